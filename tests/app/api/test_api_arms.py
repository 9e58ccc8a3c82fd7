"""REST: arms that are sent along with a request, what an arm is, conversion, URDF, files."""

from __future__ import annotations

import gc
import inspect
import json
import math
import tracemalloc
from functools import _lru_cache_wrapper
from pathlib import Path

import jsonschema_rs
import numpy as np
import pytest
from arms import random_arms
from hypothesis import example, given, settings
from hypothesis import strategies as st

import kin
from app.api.arms.description import _SCHEMA, DEFAULTS, EXAMPLE
from app.api.arms.frames import ConstantFrame
from app.api.workspace.capability import CapabilityQuery
from app.api.workspace.query import CloudQuery
from app.api.workspace.summary import SummaryQuery

FILES = Path(__file__).parents[2] / "data" / "urdf"
PIONEER = kin.get_robot("pioneer5")
Q = [1.2, 0.4, 0.9, 0.3, 0.6]
POSE = {"position": [0.045, 0.191, -0.211], "approach": [-0.31, -0.164, -0.936]}
TARGET = {"target": POSE}


def post(client, path, body, status=200):
    response = client.post(f"/api/v1/{path}", json=body)
    assert response.status_code == status, response.text
    kind = response.headers["content-type"]
    return response.json() if "json" in kind and "ndjson" not in kind else response.text


def test_the_example_is_the_pioneer_arm():
    robot = kin.robot_from_dict({**DEFAULTS, **EXAMPLE})
    assert (robot.rows, robot.home) == (PIONEER.rows, PIONEER.home)


@pytest.fixture(scope="module")
def schema(app):
    """The schema of a sent arm, as a validator of the OpenAPI document."""
    components = app.openapi()["components"]
    return jsonschema_rs.validator_for({"$ref": "#/components/schemas/RobotDescription", "components": components})


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda robot: robot.id)
def test_what_is_written_fits_the_schema(schema, robot):
    other = kin.dh.convert_dh(robot, "modified" if robot.convention == "standard" else "standard")
    for arm in (robot, other):
        for length in ("m", "cm", "mm"):
            for angle in ("deg", "rad"):
                schema.validate(kin.robot_to_dict(arm, length=length, angle=angle))


QUANTITIES = ["-90 deg", "1e-05 rad", "+1.5 rad", "180.°", ".5rad", "0.00012345678901234567 rad", "-2.5e3 deg"]


@pytest.mark.parametrize("text", QUANTITIES)
def test_the_schema_takes_the_angles_that_the_reader_takes(schema, text):
    described = {**EXAMPLE, "rows": [{"theta": text}], "home": {"q": [0]}}
    kin.robot_from_dict({**DEFAULTS, **described})
    schema.validate(described)


@pytest.mark.parametrize("text", ["90", "π/2", "π rad", "2*45 deg"])
def test_the_reader_also_takes_expressions_which_no_pattern_describes(text):
    described = {**EXAMPLE, "rows": [{"theta": text}], "home": {"q": [0]}}
    kin.robot_from_dict({**DEFAULTS, **described})


@pytest.mark.parametrize("text", ["1 m", "1e6 rad", "1000000 rad", "nan rad", "half a turn"])
def test_neither_takes_another_text_for_an_angle(schema, text):
    described = {**EXAMPLE, "rows": [{"theta": text}], "home": {"q": [0]}}
    with pytest.raises(kin.RobotFileError):
        kin.robot_from_dict({**DEFAULTS, **described})
    assert not schema.is_valid(described)


PATTERN = _SCHEMA["properties"]["rows"]["items"]["properties"]["theta"]["anyOf"][1]["pattern"]


@pytest.mark.full
@settings(max_examples=40)
@given(st.from_regex(PATTERN, fullmatch=True))
@example("-999999.999999999 rad")
@example("99999.999999999999999999999999 deg")
@example("9.999999999E5 rad")
def test_the_reader_takes_what_the_schema_takes(text):
    described = {**EXAMPLE, "rows": [{"theta": text}], "home": {"q": [0]}}
    assert kin.robot_from_dict({**DEFAULTS, **described}).n == 1


@pytest.mark.parametrize(("unit", "most"), [("m", 1e6), ("cm", 1e8), ("mm", 1e9)])
def test_the_bound_of_a_length_is_a_million_metres_whatever_the_unit(schema, unit, most):
    for factor, expected in ((0.999, "rows"), (1.001, "rows[0].limits[0]")):
        row = {"kind": "prismatic", "limits": [f"-{factor * most:.0f} {unit}", 0]}
        described = {**EXAMPLE, "rows": [row], "home": {"q": [-1]}}
        assert schema.is_valid(described) is (factor < 1)
        with pytest.raises(kin.RobotFileError) as refused:
            kin.robot_from_dict({**DEFAULTS, **described})
        assert refused.value.field == expected, "first the number itself, then a reach of a thousand kilometres"
    for row in ({"d": 0.99 * most}, {"d": -0.99 * most}):
        assert schema.is_valid({**EXAMPLE, "units": {"length": unit, "angle": "deg"}, "rows": [row]})
    assert not schema.is_valid({**EXAMPLE, "rows": [{"d": 1.01e9}]})


def test_a_joint_says_how_fast_and_how_strong_it_is(client):
    rows = [{"a": 300, "velocity": 90, "effort": 40}, {"kind": "prismatic", "velocity": 250}, {"a": 100}]
    arm = {**EXAMPLE, "rows": rows, "home": {"q": [0, 1, 0]}}
    first, second, third = post(client, "robots/inspect", {"robot": arm})["robot"]["joints"]
    assert (first["velocity"], first["effort"]) == (pytest.approx(math.pi / 2), 40.0)
    assert (second["velocity"], second["effort"]) == (0.25, None)
    assert (third["velocity"], third["effort"]) == (None, None)


def test_numbers_that_are_text_in_a_query_may_be_lists_for_an_arm_sent_along(client):
    texts = {"limit": ["1:0:1.5"], "lock": ["2:0.5"], "plane": "0:0:0.1:0:0:1"}
    lists = {"limit": [[1, 0, 1.5]], "lock": [[2, 0.5]], "plane": [0, 0, 0.1, 0, 0, 1]}
    rest = {"volume": False, "robot": EXAMPLE}
    assert post(client, "workspace/summary", rest | lists) == post(client, "workspace/summary", rest | texts)
    region = {"n": 20, "format": "csv", "robot": EXAMPLE}
    cloud = post(client, "workspace", {**region, "limit": lists["limit"], "lock": ["2:0.5"]})
    assert cloud == post(client, "workspace", {**region, "limit": texts["limit"], "lock": lists["lock"]})


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        ({"limit": [[9, 0, 1]]}, "limit[0]"),
        ({"limit": [[1, 0]]}, "limit[0]"),
        ({"lock": [[1.5, 0]]}, "lock[0]"),
        ({"lock": [[True, 0]]}, "lock[0]"),
        ({"lock": [1, 0.5]}, "lock[0]"),
        ({"plane": [0, 0, 1]}, "plane"),
        ({"plane": [0, 0, 0, 0, 0, 0]}, "plane"),
        ({"plane": [0, 0, 0, 0, 0, None]}, "plane"),
    ],
)
def test_a_wrong_list_is_refused_by_its_field(client, wrong, field):
    problem = post(client, "workspace/summary", {"volume": False, "robot": EXAMPLE, **wrong}, 422)
    assert problem["errors"][0]["field"] == field


OPERATIONS = {
    "fk": {"q": Q, "frames": True},
    "jacobian": {"q": [Q, Q]},
    "singularity": {"q": [1.0, 1.0, 0.0, 0.5, 0.6]},
    "ik": TARGET,
    "ik/path": {"targets": [{"position": [-0.03, 0.157, z]} for z in (-0.194, -0.2)]},
    "reachable": {"target": [POSE, {"position": [2, 0, 0]}]},
    "workspace": {"n": 50, "format": "csv", "q": True, "lock": ["1:0.5"]},
    "workspace/summary": {"volume": False},
    "capability": {"resolution": 5, "directions": "12"},
    "robots/inspect": {},
    "robots/convert": {},
    "robots/export": {"format": "urdf"},
}


@pytest.mark.parametrize("path", OPERATIONS)
def test_an_arm_sent_along_is_answered_as_one_of_the_service(client, path):
    body = OPERATIONS[path]
    sent = {"robot": {**EXAMPLE, "id": "pioneer5", "name": PIONEER.name, "source": PIONEER.source}}
    sent["robot"]["description"] = PIONEER.description
    name = path.removeprefix("robots/")
    if path in ("fk", "jacobian", "singularity", "ik", "ik/path", "reachable"):
        expected = client.post(f"/api/v1/robots/pioneer5/{name}", json=body)
    else:
        expected = client.get(f"/api/v1/robots/pioneer5/{name}", params=body)
    assert expected.status_code == 200, expected.text
    answer = client.post(f"/api/v1/{path}", json={**body, **sent})
    assert answer.status_code == 200, answer.text
    assert answer.content == expected.content
    assert answer.headers["content-type"] == expected.headers["content-type"]


def test_equations_of_an_arm_sent_along(client):
    robot = {**EXAMPLE, "rows": EXAMPLE["rows"][:2], "home": {"q": [90, 30]}}
    found = post(client, "equations/formulas", {"robot": robot})
    assert found["source"] == "derived"
    values = post(client, "equations", {"robot": robot, "q": [0.5, 0.7]})["values"]
    assert max(abs(value["difference"]) for value in values) < 1e-12


@pytest.mark.parametrize(
    ("change", "field", "valid"),
    [
        ({"rows": [{"alpha": "half a turn"}]}, "robot.rows[0].alpha", "finite number"),
        ({"rows": [{}, {"kind": "helical"}]}, "robot.rows[1].kind", "prismatic"),
        ({"rows": [{}] * 200}, "robot.rows", "1 to 32"),
        ({"rows": [{"a": 1e9}]}, "robot.rows[0].a", "million"),
        ({"rows": []}, "robot.rows", "1 to 32"),
        ({"rows": [{"kind": "fixed"}]}, "robot.rows", "revolute or prismatic"),
        ({"units": {"length": "mile", "angle": "deg"}}, "robot.units.length", "mm"),
        ({"convention": "craig"}, "robot.convention", "modified"),
        ({"colour": "red"}, "robot.colour", "convention"),
        ({"home": {"q": [500, 0, 0, 0, 0]}}, "robot.home.q[0]", "inside the limits"),
        ({"base": {"matrix": [[1]]}}, "robot.base.matrix", "four rows"),
        ({"mounting": "sky"}, "robot.mounting", '"ceiling"'),
        ({"floor": "deep"}, "robot.floor", "a finite number"),
        ({"floor": [0]}, "robot.floor", "a finite number"),
        ({"motors": [{"joint": "hip", "id": 1}]}, "robot.motors[0].joint", "rotating base"),
        ({"motors": [{"id": 1}]}, "robot.motors[0].name", "a name"),
        ({"motors": [{"joint": "shoulder", "id": 1, "sign": 2}]}, "robot.motors[0].sign", "1 or -1"),
    ],
)
def test_an_error_in_a_sent_arm_names_the_field(client, change, field, valid):
    problem = post(client, "fk", {"robot": {**EXAMPLE, **change}, "q": Q}, 422)
    (error,) = problem["errors"]
    assert error["field"] == field
    assert valid in error["expected"]


@pytest.mark.parametrize("robot", [None, 5, "ur5", [EXAMPLE]])
def test_a_sent_arm_is_an_object(client, robot):
    problem = post(client, "ik", {**TARGET, "robot": robot}, 422)
    assert problem["errors"][0]["field"] == "robot"
    assert post(client, "ik", TARGET, 422)["errors"][0]["field"] == "robot"


def test_mounting_and_floor_of_an_arm(client):
    answer = client.get("/api/v1/robots/gen3").json()
    assert (answer["mounting"], answer["floor"]) == ("floor", 0.0)
    answer = client.get("/api/v1/robots/ur5").json()
    assert (answer["mounting"], answer["floor"]) == (None, None)
    sent = {**EXAMPLE, "mounting": "wall", "floor": -750}
    assert post(client, "fk", {"robot": sent, "q": Q}) == post(client, "fk", {"robot": EXAMPLE, "q": Q})
    found = post(client, "robots/import", {"urdf": kin.robot_to_urdf("ur5")})
    assert (found["description"]["mounting"], found["description"]["floor"]) == ("floor", 0)
    assert (found["robot"]["mounting"], found["robot"]["floor"]) == ("floor", 0.0)


def test_motors_of_an_arm(client):
    pan, *_, gripper = client.get("/api/v1/robots/so101").json()["motors"]
    assert (pan["joint"], pan["id"], pan["unit"], pan["range"]) == ("shoulder pan", 1, "deg", None)
    assert (gripper["joint"], gripper["name"]) == ("", "gripper")
    assert client.get("/api/v1/robots/ur5").json()["motors"] == []
    motor = {
        "joint": EXAMPLE["rows"][0]["name"],
        "id": 1,
        "sign": -1,
        "offset": 12,
        "unit": "range_0_100",
        "range": [7, 9],
    }
    sent = {**EXAMPLE, "motors": [motor]}
    assert post(client, "fk", {"robot": sent, "q": Q}) == post(client, "fk", {"robot": EXAMPLE, "q": Q})


def test_nan_in_a_sent_arm_is_refused(client):
    body = json.dumps({"q": [0], "robot": {**EXAMPLE, "rows": [{"a": math.nan}]}})
    response = client.post("/api/v1/fk", content=body, headers={"content-type": "application/json"})
    assert response.status_code == 422
    assert response.json()["errors"][0]["field"] == "robot.rows[0].a"


def test_base_and_tool_frames(client):
    tool, base = {"xyz": [0.0, 0.0, 0.1]}, {"xyz": [1.0, 2.0, 3.0], "rpy": [0.0, 0.0, math.pi / 2]}
    plain = np.array(post(client, "robots/pioneer5/fk", {"q": Q})["pose"]["matrix"])
    framed = post(client, "robots/pioneer5/fk", {"q": Q, "tool": tool, "base": base})["pose"]
    T_base = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    T_tool = np.eye(4)
    T_tool[2, 3] = 0.1
    assert np.array(framed["matrix"]) == pytest.approx(T_base @ plain @ T_tool)
    matrices = {"tool": {"matrix": T_tool.tolist()}, "base": {"matrix": T_base.tolist()}}
    assert np.array(post(client, "robots/pioneer5/fk", {"q": Q, **matrices})["pose"]["matrix"]) == pytest.approx(
        np.array(framed["matrix"])
    )
    target = {"matrix": framed["matrix"]}
    for path, arm in (("robots/pioneer5/ik", {}), ("ik", {"robot": EXAMPLE})):
        found = post(
            client, path, {"target": target, "task": "approach", "tool": tool, "base": base, "q_seed": Q} | arm
        )
        assert found["status"] == "solved"
        assert found["solutions"][0]["q"] == pytest.approx(Q, abs=1e-6)
    # The frames are added to those of the arm.
    own = {
        **EXAMPLE,
        "tool": {"xyz": [20, 0, 50], "rpy": [0, 90, 0]},
        "base": {"xyz": [0, 0, 300], "rpy": [90, 0, 0]},
    }
    plain = np.array(post(client, "fk", {"q": Q, "robot": own})["pose"]["matrix"])
    framed = post(client, "fk", {"q": Q, "robot": own, "tool": tool, "base": base})["pose"]
    assert np.array(framed["matrix"]) == pytest.approx(T_base @ plain @ T_tool)
    wrong = {"matrix": np.diag([2.0, 1, 1, 1]).tolist()}
    problem = post(client, "robots/pioneer5/fk", {"q": Q, "tool": wrong}, 422)
    assert problem["errors"][0]["field"] == "tool.matrix rotation"
    both = {"matrix": np.eye(4).tolist(), "xyz": [0.0, 0.0, 0.0]}
    assert "one of the two" in post(client, "robots/pioneer5/ik", {**TARGET, "base": both}, 422)["detail"]


def test_jacobians_and_motions_with_base_and_tool_are_in_the_world_frame(client):
    asked = {
        "tool": {"xyz": [0.02, 0.05, 0.11], "rpy": [0.3, 0.2, -0.4]},
        "base": {"xyz": [1, 2, 3], "rpy": [0.4, 0, 1]},
    }
    base, tool = (kin.pose_from_xyz_rpy(asked[name]["xyz"], asked[name]["rpy"]) for name in ("base", "tool"))

    def world(q):
        return base @ kin.fk("ur5", q) @ tool

    ends = [world(np.add(SIX, step * axis)) for axis in np.eye(6) for step in (-1e-6, 1e-6)]
    linear = [(after - before)[:3, 3] / 2e-6 for before, after in zip(ends[::2], ends[1::2], strict=True)]
    J = np.array(post(client, "robots/ur5/jacobian", {"q": SIX, **asked})["jacobian"])
    assert np.allclose(J[:3].T, linear, atol=1e-8)
    in_tool = np.array(post(client, "robots/ur5/jacobian", {"q": SIX, "frame": "tool", **asked})["jacobian"])
    assert np.allclose(in_tool[:3], world(SIX)[:3, :3].T @ J[:3], atol=1e-9)
    program = {"segments": [{"kind": "ptp", "q": np.add(SIX, 0.2).tolist()}]}
    samples = post(client, "robots/ur5/motion", {"program": program, "q_start": SIX, "rate": 20, **asked})[
        "samples"
    ]
    for q, position, wxyz in zip(samples["q"], samples["position"], samples["wxyz"], strict=True):
        assert np.allclose(kin.pose_from_position_wxyz(position, wxyz), world(q), atol=1e-9)


def test_what_an_arm_is(client):
    for robot in kin.files.classic_robots().values():
        found = client.get(f"/api/v1/robots/{robot.id}/inspect").json()
        assert found["motions"] + found["redundancy"] == robot.n
        assert not found["singular_at_home"]
    straight = {**EXAMPLE, "rows": [{"a": 300}, {"a": 200}, {"a": 100}], "home": {"q": [0, 0, 0]}}
    found = post(client, "robots/inspect", {"robot": straight})
    assert (found["motions"], found["redundancy"]) == (3, 0)
    assert found["parallel"] == [[0, 1, 2]]
    assert found["singular_at_home"]
    assert found["home_margin"] < 1e-6


def test_conversion_with_proof(client):
    found = client.get("/api/v1/robots/panda/convert").json()
    assert found["robot"]["convention"] == "standard"
    assert found["difference"] <= 1e-12
    assert kin.robot_from_dict(found["description"]) == kin.dh.convert_dh(kin.get_robot("panda"), "standard")
    again = post(client, "robots/convert", {"robot": found["description"], "convention": "modified"})
    assert again["robot"]["rows"][3] == pytest.approx(client.get("/api/v1/robots/panda").json()["rows"][3])
    same = post(client, "robots/convert", {"robot": found["description"], "convention": "standard"})
    assert same["description"] == found["description"]


def test_import_of_urdf(client):
    text = (FILES / "panda.urdf").read_text(encoding="utf-8")
    found = post(client, "robots/import", {"urdf": text, "tip": "panda_link8"})
    assert found["report"]["difference"] <= 1e-12
    assert found["report"]["tips"][0]["joints"] == 7
    assert found["robot"]["n"] == 7
    assert kin.load_robot(found["toml"]) == kin.robot_from_dict(found["description"])
    answer = post(client, "ik", {"robot": found["description"], "target": {"position": [0.4, 0.1, 0.5]}})
    assert answer["status"] == "solved"
    problem = post(client, "robots/import", {"urdf": text}, 422)
    assert problem["errors"][0]["field"] == "urdf.tip"
    assert "panda_leftfinger (8 joints)" in problem["detail"]
    for urdf, field in (
        ("/etc/passwd", "urdf"),
        ("../../etc/passwd", "urdf"),
        ("<robot", "urdf"),
        ('<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot/>', "urdf.DOCTYPE"),
    ):
        problem = post(client, "robots/import", {"urdf": urdf}, 422)
        assert problem["errors"][0]["field"] == field
        assert "root:" not in str(problem)


def test_the_doctor_for_urdf(client):
    text = (FILES / "panda.urdf").read_text(encoding="utf-8")
    found = post(client, "robots/doctor", {"urdf": text, "tip": "panda_link8"})
    assert (found["refusal"], found["mended"], found["text"]) == ("", None, "Nothing is wrong or suspicious.")
    sick = text.replace('<axis xyz="0 0 1" />', '<axis xyz="0 0 2" />', 1)
    found = post(client, "robots/doctor", {"urdf": sick, "tip": "panda_link8"})
    first = found["findings"][0]
    assert (first["symptom"], first["line"]) == ("axis", sick[: sick.index("0 0 2")].count("\n") + 1)
    assert first["automatic"]
    assert post(client, "robots/import", {"urdf": found["mended"], "tip": "panda_link8"})["robot"]["n"] == 7
    assert found["moved"] == 0.0
    broken = post(client, "robots/doctor", {"urdf": "<robot>\n<link></robot>"})
    assert (broken["findings"][0]["line"], broken["findings"][0]["rank"]) == (2, "wrong")
    hostile = post(client, "robots/doctor", {"urdf": '<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot/>'})
    assert "DOCTYPE" in hostile["refusal"]
    assert post(client, "robots/doctor", {"urdf": 7}, 422)["errors"][0]["field"] == "urdf"


@pytest.mark.full
def test_export(client):
    panda = kin.get_robot("panda")
    for name, convention in (("toml", "modified"), ("mdh", "modified"), ("dh", "standard")):
        response = client.get(f"/api/v1/robots/panda/export?format={name}")
        assert response.headers["content-type"].startswith("application/toml")
        assert response.headers["content-disposition"].endswith('.toml"')
        assert kin.load_robot(response.text) == kin.dh.convert_dh(panda, convention)
    response = client.get("/api/v1/robots/panda/export?format=mjcf")
    assert response.headers["content-disposition"] == 'attachment; filename="panda.xml"'
    again = post(client, "robots/import", {"urdf": response.text})
    assert again["robot"]["source"].startswith("MJCF, from body world")
    assert kin.fk(kin.load_robot(again["toml"]), panda.home) == pytest.approx(kin.fk(panda, panda.home), abs=1e-12)
    response = client.get("/api/v1/robots/panda/export?format=urdf")
    assert response.headers["content-type"].startswith("application/xml")
    assert kin.load_robot(response.text).n == 7
    response = client.get("/api/v1/robots/panda/export?format=js")
    assert response.headers["content-disposition"] == 'attachment; filename="panda.js"'
    assert response.text == kin.generate("panda", "js")
    response = client.get("/api/v1/robots/tx2-60/export?format=c-test")
    assert response.headers["content-disposition"] == 'attachment; filename="tx2_60_test.c"'
    assert '#include "tx2_60.c"' in response.text
    assert client.get("/api/v1/robots/panda/export?format=dxf").status_code == 422


# -- many arms -------------------------------------------------------------------------------------------------


def arms(count):
    """Descriptions of different arms, without a home."""
    for robot in random_arms(count):
        data = kin.robot_to_dict(robot, angle="rad")
        yield {key: data[key] for key in ("convention", "units", "rows")}


def ask(client, robot):
    """What a visitor with an arm of their own asks."""
    home = post(client, "robots/inspect", {"robot": robot})["robot"]["home"]
    pose = post(client, "fk", {"robot": robot, "q": home})["pose"]
    post(client, "jacobian", {"robot": robot, "q": home})
    answer = post(client, "ik", {"robot": robot, "target": {"matrix": pose["matrix"]}, "q_seed": home})
    assert answer["status"] in ("solved", "approximate")
    post(client, "workspace", {"robot": robot, "n": 10})


def objects(kind):
    """All objects of a kind, also of modules imported while tests were collected (`tests/conftest.py`)."""
    gc.unfreeze()
    return [each for each in gc.get_objects() if issubclass(type(each), kind)]  # not proxies, which may be dead


def test_no_cache_without_bound_keeps_arms(client):
    """Of all caches of functions; those of results have a capacity (`ComputationCache`)."""
    ask(client, next(arms(1)))
    ours = [each for each in objects(_lru_cache_wrapper) if each.__module__.split(".")[0] in ("kin", "app")]
    assert len(ours) > 15
    for each in ours:
        if each.cache_parameters()["maxsize"] is None:
            given = {str(p.annotation) for p in inspect.signature(each).parameters.values()}
            assert given <= {"int", "str", "Path", "bool", "type[Answer]", "type[Settings]", "FunctionType"}, (
                each.__qualname__
            )


@pytest.mark.slow
def test_arms_sent_along_do_not_fill_memory(client):
    """Further arms take the places of those that the caches hold."""
    many, sizes = list(arms(1250)), []
    tracemalloc.start()
    for k, robot in enumerate(many):
        ask(client, robot)
        if k in (1050, 1249):
            gc.collect()
            sizes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert sizes[1] < sizes[0] + 5e6


# Targets in named frames

UR5 = kin.get_robot("ur5")
SIX = [0.3, -1.2, 1.4, 0.2, 0.7, 0.1]
TABLE = {"xyz": [0.3, 0.2, 0.1], "rpy": [0.1, -0.2, 0.3]}
STAND = {"xyz": [0.0, 0.5, 0.2], "rpy": [0.0, 0.0, 1.0]}
T_TABLE = kin.pose_from_xyz_rpy(TABLE["xyz"], TABLE["rpy"])
OPTIONS = [{}, {"base": STAND}, {"base": STAND, "tool": {"xyz": [0, 0, 0.1]}}]


@pytest.mark.parametrize("options", OPTIONS, ids=["as it is", "base", "base and tool"])
@pytest.mark.parametrize("frame", ["world", "base", "table"])
def test_a_pose_answered_in_a_frame_is_a_target_in_it(client, frame, options):
    asked = {"workpieces": {"table": TABLE}, **options}
    pose = post(client, "robots/ur5/fk", {"q": SIX, "frame": frame, "frames": True, **asked})
    assert {each["frame"] for each in (pose["pose"], *(row["pose"] for row in pose["frames"]))} == {frame}
    answer = post(client, "robots/ur5/ik", {"target": pose["pose"], "q_seed": SIX, **asked})
    assert answer["status"] == "solved"
    assert answer["solutions"][0]["q"] == pytest.approx(SIX, abs=1e-9)
    judged = post(client, "robots/ur5/reachable", {"target": [pose["pose"]], **asked})
    assert judged["results"][0]["reachable"]
    path = {"targets": [pose["pose"], {**pose["pose"]}], "q_start": SIX, **asked}
    assert post(client, "robots/ur5/ik/path", path)["q"][0] == pytest.approx(SIX, abs=1e-9)


def test_a_frame_moves_the_numbers_of_a_pose(client):
    arm = UR5.with_base(kin.pose_from_xyz_rpy(STAND["xyz"], STAND["rpy"]))
    asked = {"q": SIX, "base": STAND, "workpieces": {"table": TABLE}}
    for frame in ("world", "base", "table"):
        expected = np.linalg.solve(kin.frame_pose(arm, frame, {"table": T_TABLE}), kin.fk(arm, np.array(SIX)))
        answer = post(client, "robots/ur5/fk", {**asked, "frame": frame})
        assert np.allclose(answer["pose"]["matrix"], expected, atol=1e-12)


def test_targets_in_the_frame_of_the_tool_are_steps_from_the_present_configuration(client):
    ahead = {"position": [0, 0, 0.03], "wxyz": [1, 0, 0, 0], "frame": "tool"}
    expected = kin.fk(UR5, np.array(SIX)) @ kin.pose_from_xyz_rpy([0, 0, 0.03])
    answer = post(client, "robots/ur5/ik", {"target": ahead, "q_seed": SIX})
    assert np.allclose(kin.fk(UR5, answer["solutions"][0]["q"]), expected, atol=1e-9)
    other = [0.1, *SIX[1:]]
    several = post(client, "robots/ur5/ik", {"target": [ahead, ahead], "q_seed": [SIX, other]})["results"]
    ends = [kin.fk(UR5, each["solutions"][0]["q"]) for each in several]
    starts = [kin.fk(UR5, np.array(q)) for q in (SIX, other)]
    assert np.allclose(np.linalg.solve(starts, ends), kin.pose_from_xyz_rpy([0, 0, 0.03]), atol=1e-9)
    path = post(client, "robots/ur5/ik/path", {"targets": [ahead], "q_start": SIX})
    assert np.allclose(kin.fk(UR5, path["q"][0]), expected, atol=1e-9)


@pytest.mark.parametrize("name", [" ", "world", "base", "tool", "x" * 41])
def test_names_of_workpieces_are_their_own(client, name):
    body = {"target": {"position": [0.3, 0, 0.3]}, "workpieces": {name: TABLE}}
    assert post(client, "robots/ur5/ik", body, 422)["errors"][0]["field"].startswith("workpieces")


CRUDE = T_TABLE.round(1).tolist()
TWISTED = {"a": {"xyz": [0, 0, 0], "matrix": np.eye(4).tolist()}}


@pytest.mark.parametrize(
    ("operation", "body", "field", "valid"),
    [
        ("ik", {"target": {**POSE, "frame": "desk"}}, "target.frame", "world, base, tool, table"),
        ("ik", {"target": [POSE, {**POSE, "frame": ""}]}, "target[1].frame", ""),
        ("ik", {"target": {**POSE, "frame": "tool"}}, "target.frame", "q_seed"),
        ("reachable", {"target": {**POSE, "frame": "tool"}}, "target.frame", "one of world, base, table"),
        ("ik/path", {"targets": [POSE, {**POSE, "frame": "tool"}]}, "targets[1].frame", "q_start"),
        ("fk", {"q": SIX, "frame": "tool"}, "frame", "one of world, base, table"),
        ("fk", {"q": SIX, "frame": "desk"}, "frame", "one of world, base, table"),
        ("fk", {"q": SIX, "workpieces": TWISTED}, "workpieces.a.matrix", "one of the two"),
        ("ik", {"target": POSE, "workpieces": {"a": {"matrix": CRUDE}}}, "workpieces.a.matrix", "orthonormal"),
        ("ik", {"target": POSE, "base": {"matrix": CRUDE}}, "base.matrix", "orthonormal"),
        ("fk", {"q": SIX, "frame": "a", "workpieces": TWISTED}, "workpieces.a.matrix", "one of the two"),
        ("ik", {"target": POSE, "workpieces": {str(k): {} for k in range(33)}}, "workpieces", "32"),
    ],
)
def test_a_frame_that_is_none_is_refused_by_name(client, operation, body, field, valid):
    problem = post(client, f"robots/ur5/{operation}", {"workpieces": {"table": TABLE}, **body}, 422)
    assert problem["errors"][0]["field"].startswith(field)
    assert valid in problem["errors"][0]["expected"]
    others = {"ik": "q_start", "ik/path": "q_seed"}
    assert others.get(operation, "q_") not in problem["errors"][0]["expected"], "only fields it has"


def test_workpieces_are_for_operations_with_targets_or_poses(client):
    body = {"q": SIX, "workpieces": {"table": TABLE}}
    assert post(client, "robots/ur5/jacobian", body, 422)["errors"][0]["field"] == "workpieces"


def test_frames_are_read_once_for_all_targets(client, monkeypatch):
    read = []
    resolve = ConstantFrame.resolve
    monkeypatch.setattr(ConstantFrame, "resolve", lambda self, field: read.append(field) or resolve(self, field))
    target = {"position": [0.1, 0.1, 0.1], "frame": "table"}
    body = {"target": [target] * 20, "workpieces": {"table": TABLE, "desk": STAND}, "base": STAND}
    post(client, "robots/ur5/reachable", body)
    assert read == ["base", "workpieces.table", "workpieces.desk"]


DOWN = PIONEER.q_home + 0.1


@pytest.mark.parametrize("digits", [6, 4, 3])
@pytest.mark.parametrize("field", ["workpieces", "base", "tool"])
def test_rounded_frames_are_read_as_rounded_targets_are(client, field, digits):
    """The target is exact in the exact frame; in the rounded one, five joints meet it as its digits say."""
    T = T_TABLE.round(digits)
    frame = {"matrix": T.tolist()}
    tool = kin.fk(PIONEER, DOWN)
    exact, asked = {
        "workpieces": (np.linalg.solve(T_TABLE, tool), {"workpieces": {"table": frame}}),
        "base": (T_TABLE @ tool, {"base": frame}),
        "tool": (tool @ T_TABLE, {"tool": frame}),
    }[field]
    name = "table" if field == "workpieces" else "world"
    asked |= {"task": "pose"}
    target = {"matrix": exact.tolist(), "frame": name}
    answer = post(client, "robots/pioneer5/ik", {"target": target, "q_seed": DOWN.tolist(), **asked})
    assert answer["status"] == "solved", answer["reason"]
    assert 10.0**-digits <= answer["tolerances"]["target_error"] < 30.0 * 10.0**-digits
    assert "The target is rounded" in answer["reason"]
    assert post(client, "robots/pioneer5/reachable", {"target": [target], **asked})["results"][0]["reachable"]
    path = post(client, "robots/pioneer5/ik/path", {"targets": [target], "q_start": DOWN.tolist(), **asked})
    assert path["tolerances"] == answer["tolerances"]
    del asked["task"]
    pose = post(client, "robots/pioneer5/fk", {"q": DOWN.tolist(), **asked, "frame": name})["pose"]
    assert np.allclose(pose["matrix"], exact, atol=3.0 * 10.0**-digits)


def test_a_rounded_frame_counts_only_where_it_matters(client):
    """Six joints meet any pose, so rounding that a target may have counts neither there nor in other frames."""
    coarse, fine = ({"matrix": T_TABLE.round(digits).tolist()} for digits in (3, 8))
    pose = {"position": [0.1, 0.1, 0.3], "wxyz": [0, 1, 0, 0]}
    for frame, other, rounded in (("table", coarse, True), ("table", fine, False), ("world", coarse, False)):
        body = {"target": {**pose, "frame": frame}, "workpieces": {"table": other}}
        assert ("tolerances" in post(client, "robots/ur5/ik", body)) == rounded
    body = {"target": {**pose, "frame": "base"}, "base": coarse}
    assert "tolerances" not in post(client, "robots/ur5/ik", body), "the base cancels out"
    far = {"target": {"position": [1e5, 0, 0], "frame": "table"}, "workpieces": {"table": coarse}}
    assert post(client, "robots/ur5/ik", far)["tolerances"]["position"] <= 0.1


# Numbers of queries as lists

HUGE = 10**400
SPHERE = {"volume": False, "robot": EXAMPLE}


@pytest.mark.parametrize("path", ["workspace", "capability", "workspace/summary"])
def test_a_huge_integer_is_refused_everywhere(client, path):
    model = {"workspace": CloudQuery, "capability": CapabilityQuery, "workspace/summary": SummaryQuery}[path]
    lengths = {"limit": 3, "lock": 2, "plane": 6}
    assert set(model.in_json()) <= set(lengths)
    for name in model.model_fields:
        numbers = [[1, 0, 0, 0, 0, 1][: lengths.get(name, 1)] for _ in range(lengths.get(name, 1))]
        for k, row in enumerate(numbers):
            row[k] = HUGE
        values = numbers if name == "plane" else [[row] for row in numbers] if name in lengths else []
        for value in [HUGE, [HUGE], *values]:
            problem = post(client, path, {"robot": EXAMPLE, name: value}, 422)
            assert problem["errors"][0]["field"].startswith(name)
            assert len(problem["detail"]) < 500


LISTS = "JOINT:LOWER:UPPER or [joint, lower, upper]"


@pytest.mark.parametrize(
    ("body", "field", "value", "expected"),
    [
        ({"limit": [1, 0, 1]}, "limit[0]", "1", LISTS),
        ({"limit": [["1", 0, 1]]}, "limit[0]", '["1", 0, 1]', LISTS),
        ({"limit": [[1, 0]]}, "limit[0]", "[1, 0]", LISTS),
        ({"limit": [[]]}, "limit[0]", "[]", LISTS),
        ({"limit": [[True, 0, 1]]}, "limit[0]", "[true, 0, 1]", LISTS),
        ({"limit": [[1.5, 0, 1]]}, "limit[0]", "[1.5, 0, 1]", LISTS),
        ({"limit": [None]}, "limit[0]", "null", LISTS),
        ({"limit": ["1:0"]}, "limit[0]", '"1:0"', LISTS),
        ({"limit": ["1.0:0:1"]}, "limit[0]", '"1.0:0:1"', LISTS),
        ({"limit": [[9, 0, 1]]}, "limit[0]", "[9, 0, 1]", "[joint, lower, upper], a joint from 1 to 5"),
        ({"limit": ["9:0:1"]}, "limit[0]", '"9:0:1"', "JOINT:LOWER:UPPER, a joint from 1 to 5"),
        ({"limit": [[1, -50, 1]]}, "limit[0]", "[1, -50, 1]", ""),
        ({"lock": [[1, 0.5], [1, 0.5]]}, "lock[1]", "[1, 0.5]", "each joint once"),
        ({"lock": [[1]]}, "lock[0]", "[1]", "JOINT:VALUE or [joint, value]"),
        ({"plane": [0, 0, 0, 0, 0, 0]}, "plane", "[0, 0, 0, 0, 0, 0]", "[x, y, z, nx, ny, nz], a point"),
        ({"plane": [0, 0, 0, 1]}, "plane", "[0, 0, 0, 1]", "X:Y:Z:NX:NY:NZ or [x, y, z, nx, ny, nz]"),
        ({"plane": "0:0:0:0:0:0"}, "plane", '"0:0:0:0:0:0"', "X:Y:Z:NX:NY:NZ, a point"),
    ],
)
def test_errors_of_lists_say_what_was_sent_and_what_is_valid(client, body, field, value, expected):
    error = post(client, "workspace/summary", {**SPHERE, **body}, 422)["errors"][0]
    assert (error["field"], error["value"]) == (field, value)
    assert error["expected"].startswith(expected)
    assert "string" not in error["expected"]


def test_texts_and_lists_of_numbers_say_the_same(client):
    lists = {"limit": [[1, 0.25, 1.5], [2.0, 0, 1]], "lock": [[3, 1e-3]], "plane": [0, 0, 0.1, 0, 0, 1]}
    texts = {"limit": ["1:0.25:1.5", "2:0:1"], "lock": ["3:0.001"], "plane": "0:0:0.1:0:0:1"}
    assert post(client, "workspace/summary", SPHERE | lists) == post(client, "workspace/summary", SPHERE | texts)
