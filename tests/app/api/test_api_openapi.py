"""REST: what /openapi.json promises is what the service does."""

import json
from dataclasses import fields

import pytest

from app.api.document import ANSWERS
from app.exports.formats import FORMATS
from app.shared.answers.fk import FkAnswer
from app.shared.answers.ik import Brief, IkAnswer, ReachableAnswer
from app.shared.answers.jacobian import JacobianAnswer
from kin.motion.program import KINDS
from kin.way import is_installed


@pytest.fixture(scope="session")
def document(app):
    return json.loads(json.dumps(app.openapi(), allow_nan=False))


def operations(document):
    for path, item in document["paths"].items():
        if path.startswith("/api/"):
            for method, operation in item.items():
                yield path, method, operation


@pytest.mark.full
def test_every_operation_has_summary_description_and_documented_refusals(document):
    seen = 0
    for path, method, operation in operations(document):
        seen += 1
        assert operation["summary"]
        assert operation["description"]
        assert "200" in operation["responses"]
        expected = {"401", "403", "429", "500"} | ({"404", "422"} if "{robot_id}" in path else set())
        expected |= {"400", "413", "415"} if method == "post" else set()
        assert expected <= set(operation["responses"])
        for status, response in operation["responses"].items():
            if status[0] in "45":
                assert list(response["content"]) == ["application/problem+json"]
                schema = response["content"]["application/problem+json"]["schema"]
                assert schema == {"$ref": "#/components/schemas/Problem"}
    assert seen >= 34


def test_operations_have_short_names_of_their_own(document):
    names = [operation["operationId"] for _, _, operation in operations(document)]
    assert len(set(names)) == len(names)
    assert {"fk", "ik", "ik_path", "plan_motion", "jacobian", "reachable", "fk_sent"} <= set(names)
    assert max(map(len, names)) <= 24


def test_any_text_may_be_the_id_of_a_robot(document):
    for path, _, operation in operations(document):
        for parameter in operation.get("parameters", []):
            if parameter["name"] == "robot_id":
                assert "enum" not in parameter["schema"], path


def test_segments_are_described_as_the_core_reads_them(document):
    schemas = document["components"]["schemas"]
    variants = schemas["ProgramBody"]["properties"]["segments"]["items"]
    assert variants["discriminator"]["propertyName"] == "kind"
    assert set(variants["discriminator"]["mapping"]) == set(KINDS)
    target = {"q", "position", "wxyz", "pose", "frame"}
    for kind, segment in KINDS.items():
        described = schemas[variants["discriminator"]["mapping"][kind].rsplit("/", 1)[1]]
        own = {each.name for each in fields(segment)}
        read = own - {"target"} | (target if "target" in own else set()) | {"kind"}
        assert set(described["properties"]) == read, kind
        assert described["additionalProperties"] is False
    request = schemas["MotionRequest"]["properties"]["program"]
    assert request["$ref"] == "#/components/schemas/ProgramBody"


def test_every_parameter_is_described_and_a_cloud_has_all_its_formats(document):
    described = 0
    for path, _, operation in operations(document):
        for parameter in operation.get("parameters", []):
            assert parameter["description"], f"{path} {parameter['name']}"
            described += 1
    assert described > 15
    cloud = document["paths"]["/api/v1/robots/{robot_id}/workspace"]["get"]
    assert set(cloud["responses"]["200"]["content"]) == {kind.media_type for kind in FORMATS.values()}
    (asked,) = [p["schema"]["enum"] for p in cloud["parameters"] if p["name"] == "format"]
    assert asked == list(FORMATS)
    assert "503" in cloud["responses"]


def test_every_field_is_described(document):
    described = 0
    for name, schema in document["components"]["schemas"].items():
        if name in ("Alive", "Readiness"):  # the service's own state, not ours
            continue
        assert schema["description"], name
        for field, details in schema["properties"].items():
            assert details.get("description"), f"{name}.{field}"
            described += 1
    assert described > 60


def test_a_quantity_says_its_unit(document):
    schemas = document["components"]["schemas"]
    for name, field in [
        *(("Pose", "position"), ("Pose", "matrix"), ("Solution", "q"), ("Solution", "position_error")),
        *(("Solution", "rotation_error"), ("IkAnswer", "distance"), ("FkRequest", "q"), ("IkRequest", "q_seed")),
        *(("Target", "position"), ("RowAnswer", "d"), ("RowAnswer", "alpha"), ("RobotAnswer", "reach")),
        *(("ExtremeAnswer", "value"), ("ArcAnswer", "start"), ("ReachableAnswer", "distance")),
    ]:
        text = schemas[name]["properties"][field]["description"]
        assert "metres" in text or "radians" in text, f"{name}.{field}"


def test_a_single_answer_and_a_list_are_both_in_the_schema(document):
    kinds = {"fk": FkAnswer, "ik": IkAnswer, "jacobian": JacobianAnswer, "reachable": ReachableAnswer}
    for what, kind in kinds.items():
        responses = document["paths"][f"/api/v1/robots/{{robot_id}}/{what}"]["post"]["responses"]
        options = responses["200"]["content"]["application/json"]["schema"]["anyOf"]
        one, many, *brief = (
            document["components"]["schemas"][option["$ref"].rsplit("/", 1)[1]] for option in options
        )
        assert set(one["properties"]) == set(kind.__annotations__)
        assert many["properties"]["results"]["items"] == options[0]
        if what in ("ik", "reachable"):
            several, single = brief
            assert set(single["properties"]) == set(Brief.__annotations__)
            assert several["properties"]["results"]["items"] == options[3]


# Requests with short answers; all others are the first example of their operation, for this arm.
SHORT = {
    "list_robots": ("get", "/robots", None),
    "describe_robot": ("get", "/robots/planar2r", None),
    "inspect_robot": ("get", "/robots/planar2r/inspect", None),
    "convert_robot": ("get", "/robots/planar2r/convert", None),
    "equations": ("get", "/robots/planar2r/equations", None),
    "summary": ("get", "/robots/planar2r/workspace/summary?volume=false", None),
    "posture_map": ("post", "/robots/planar2r/postures", {"resolution": 8}),
    "cuspidal": ("get", "/robots/gofa/cuspidal", None),
    "leave_singularity": ("post", "/robots/planar2r/singularity", {"q": [0.3, 0.0]}),
    "capability": ("get", "/robots/planar2r/capability?resolution=4&directions=12", None),
    "plan_motion": (
        "post",
        "/robots/pioneer5/motion",
        {"rate": 2.0, "program": {"segments": [{"kind": "ptp", "q": [1.0, 0.7, 0.9, 0.3, 0.6]}]}},
    ),
}
# Found by chance, or only there for who has a code.
WITHOUT_EXAMPLE = {"way", "check_result"}


def rounded(value):
    """An answer with numbers of five digits."""
    if isinstance(value, float):
        return float(f"{value:.5g}") if abs(value) > 1e-9 else 0.0
    if isinstance(value, dict):
        return {name: rounded(each) for name, each in value.items()}
    return list(map(rounded, value)) if isinstance(value, list) else value


def alike(one, other):
    """Whether answers are the same but for the last digits of numbers."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(alike(value, other[name]) for name, value in one.items())
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(alike, one, other))
    if isinstance(one, float) or isinstance(other, float):
        return other == pytest.approx(one, rel=1e-3, abs=1e-6)
    return one == other


def checked(response):
    assert response.status_code == 200, response.text
    return response.json()


def answered(client, path, operation):
    """The answer to `SHORT` or to the first example of an operation."""
    method, address, body = SHORT.get(operation["operationId"], ("post", path.removeprefix("/api/v1"), None))
    if method == "get":
        answer = checked(client.get(f"/api/v1{address}"))
        return {"robots": answer["robots"][:1]} if "robots" in answer else answer
    if body is None:
        (body, *_) = operation["requestBody"]["content"]["application/json"]["examples"].values()
        body = body["value"]
    return checked(client.post(f"/api/v1{address.replace('{robot_id}', 'pioneer5')}", json=body))


def test_answers_have_examples_that_are_answered(client, document, request):
    found = {}
    for path, _, operation in operations(document):
        name, answer = operation["operationId"], operation["responses"]["200"]["content"].get("application/json")
        if answer is None or name in WITHOUT_EXAMPLE or name.removesuffix("_sent") in WITHOUT_EXAMPLE:
            continue
        if name.removesuffix("_sent") == "way" and not is_installed():
            continue
        if not name.endswith("_sent"):
            found[name] = rounded(answered(client, path, operation))
        if not request.config.getoption("--snapshot-update"):
            assert alike(answer["example"], found[name.removesuffix("_sent")]), name
    assert len(found) >= 16
    if request.config.getoption("--snapshot-update"):
        ANSWERS.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


@pytest.mark.full
def test_every_example_request_works(client, document):
    tried = 0
    for path, _, operation in operations(document):
        examples = (
            operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("examples", {})
        )
        for name, example in examples.items():
            response = client.post(path.replace("{robot_id}", "pioneer5"), json=example["value"])
            assert response.status_code == 200, f"{path} {name}: {response.text}"
            tried += 1
            if response.headers["content-type"] != "application/json":  # a cloud, a robot file
                assert response.content
                continue
            answer = response.json()
            for one in answer.get("results", [answer]):
                if "status" in one:
                    expected = {"unreachable": "unreachable", "pose": "approximate"}.get(name, "solved")
                    assert one["status"] == expected, one["reason"]
    assert tried >= 30
