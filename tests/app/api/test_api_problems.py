"""REST: every refusal is one problem document that names the field, the value and what is valid."""

import asyncio
import json
from contextlib import suppress

import pytest
from fastapi.testclient import TestClient

from app.api import body as body_module
from app.service.main import create_app
from app.shared.problems import KINDS, Problem
from app.shared.settings import Settings

ARM = "/api/v1/robots/pioneer5"
Q = [0.5, 0.5, 0.5, 0.5, 0.5]
EYE = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]


def problem(response, status, kind):
    """The problem document of a refusal, whose form is checked here once for all tests."""
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    document = response.json()
    assert Problem.model_validate(document, strict=True, extra="forbid").model_dump() == document
    assert document["type"] == f"urn:kinboard:problem:{kind}"
    assert document["title"] == KINDS[kind]
    assert document["status"] == status
    assert document["detail"]
    assert document["hint"]
    assert len(response.content) < 5000
    return document


def send(client, what, text, content_type="application/json"):
    return client.post(f"{ARM}/{what}", content=text, headers={"content-type": content_type})


# -- large bodies -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "status", "kind"),
    [
        (json.dumps({"q": [Q] * 1000, "qq": 1}), 422, "invalid-input"),
        (json.dumps({"q": [[*Q[:4], "x"]] + [Q] * 1000}), 422, "invalid-input"),
        (json.dumps({"q": [Q] * 1000})[:-1], 400, "malformed-json"),
        (json.dumps([Q] * 1000), 422, "invalid-input"),
    ],
)
def test_a_large_body_is_refused_as_a_small_one_is(client, monkeypatch, text, status, kind):
    assert len(text) > body_module.LARGE
    large = problem(send(client, "fk", text), status, kind)
    monkeypatch.setattr(body_module, "LARGE", 1 << 30)
    assert problem(send(client, "fk", text), status, kind) == large


@pytest.mark.parametrize(("count", "by_the_loop"), [(1, True), (1000, False)])
def test_a_large_body_is_read_by_a_thread(client, monkeypatch, count, by_the_loop):
    readers = []
    parse = body_module.from_json

    def parsed(data):
        with suppress(RuntimeError):
            readers.append(asyncio.get_running_loop())
        return parse(data)

    monkeypatch.setattr(body_module, "from_json", parsed)
    assert client.post(f"{ARM}/fk", json={"q": [Q] * count}).status_code == 200
    assert bool(readers) == by_the_loop


# -- addresses -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["get", "post"])
def test_an_unknown_robot_lists_the_known_ones(client, method):
    what = "" if method == "get" else "/fk"
    document = problem(client.request(method, f"/api/v1/robots/puma{what}", json={"q": Q}), 404, "unknown-robot")
    assert '"puma"' in document["detail"]
    for known in ("pioneer5", "redundant7", "redundant7-craig"):
        assert known in document["hint"]
    assert document["errors"][0]["field"] == "robot_id"


@pytest.mark.parametrize("path", ["/nowhere", "/api/v1/nowhere", f"{ARM}/fk/more", "/api/v1/robots/%00%ff"])
def test_an_unknown_address(client, path):
    kind = "unknown-robot" if path.startswith("/api/v1/robots/%") else "not-found"
    problem(client.get(path), 404, kind)


def test_a_wrong_method_says_which_is_right(client):
    response = client.get(f"{ARM}/fk")
    document = problem(response, 405, "method-not-allowed")
    assert response.headers["allow"] == "POST"
    assert "POST" in document["hint"]
    both = client.request("DELETE", f"{ARM}/equations")  # two routes of one address
    assert both.headers["allow"] == "GET, POST"
    folder = client.request("DELETE", "/static/landing.js")
    problem(folder, 405, "method-not-allowed")
    assert folder.headers["allow"] == "GET, HEAD"


def test_a_huge_robot_id_is_shortened(client):
    assert len(problem(client.get("/api/v1/robots/" + "x" * 5000), 404, "unknown-robot")["detail"]) < 200


# -- bodies ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    ['{"q": [1, 2,', "{'q': 1}", '{"q": 01}', b"\xff\xfe", '{"q": 1} x', '"\\ud800"', '{"q": ' + "9" * 9000 + "}"],
)
def test_malformed_json_says_where(client, text):
    assert "line 1 column" in problem(send(client, "fk", text), 400, "malformed-json")["detail"]


@pytest.mark.parametrize("opening", ["[", '{"q":', '{"q":[0,'])
def test_bottomless_json(client, opening):
    assert "recursion" in problem(send(client, "fk", opening * 40_000), 400, "malformed-json")["detail"]


def test_deep_but_legal_json_is_refused_by_its_shape(client):
    document = problem(send(client, "fk", '{"q":' + "[" * 100 + "1" + "]" * 100 + "}"), 422, "invalid-input")
    assert document["errors"][0]["field"] == "q[0][0]"


@pytest.mark.parametrize("content_type", ["text/plain", "application/x-www-form-urlencoded", "nonsense", ""])
def test_another_content_type_is_refused_with_the_right_one(client, content_type):
    document = problem(send(client, "fk", json.dumps({"q": Q}), content_type), 415, "unsupported-media-type")
    assert "application/json" in document["hint"]


@pytest.mark.parametrize(
    "content_type", ["application/json; charset=utf-8", "APPLICATION/JSON", "application/x+json"]
)
def test_json_by_another_name_is_json(client, content_type):
    assert send(client, "fk", json.dumps({"q": Q}), content_type).status_code == 200


@pytest.mark.parametrize("text", ["", "null", "[]", "3", '"q"'])
def test_a_body_that_is_no_object(client, text):
    assert problem(send(client, "fk", text), 422, "invalid-input")["errors"][0]["field"] == "body"


def test_a_body_announced_too_large_is_refused_unread(client):
    # The announcement alone decides: what arrives is small.
    response = client.post(
        f"{ARM}/fk", content="{}", headers={"content-length": "1000001", "content-type": "application/json"}
    )
    document = problem(response, 413, "body-too-large")
    assert "1000000 bytes" in document["detail"]
    assert response.headers["connection"] == "close"


def refused_after(app, chunk):
    """The bytes that are taken of an endless body of equal chunks until it is refused as too large; the detail."""
    taken = 0
    sent = []

    async def receive():
        nonlocal taken
        taken += len(chunk)
        assert taken < 10_000_000, "still reading"
        return {"type": "http.request", "body": chunk, "more_body": True}

    async def send(message):
        sent.append(message)

    headers = [
        (b"content-type", b"application/json"),
        (b"transfer-encoding", b"chunked"),
        (b"host", b"testserver"),
    ]
    scope = {"type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": "POST", "scheme": "http"}
    scope |= {"path": f"{ARM}/fk", "raw_path": f"{ARM}/fk".encode(), "query_string": b"", "root_path": ""}
    asyncio.run(app(scope | {"headers": headers}, receive, send))
    assert sent[0]["status"] == 413
    assert (b"connection", b"close") in sent[0]["headers"]
    document = json.loads(sent[1]["body"])
    assert document["type"] == "urn:kinboard:problem:body-too-large"
    return taken, document["detail"]


def test_a_body_that_never_ends_is_not_read_to_its_end(app):
    """In chunks and with no length announced: after a megabyte nothing more is taken in."""
    taken, detail = refused_after(app, b" " * 100_000)
    assert taken == 1_100_000
    assert "1000000 bytes" in detail


@pytest.mark.parametrize(
    "item", ["1,", "[],", "{},", "[0.1,0.2,0.3,0.4,0.5],", '{"position":[1,2,3]},', '"k":1,', "["]
)
def test_a_body_with_too_many_values_is_refused_while_it_arrives_and_never_parsed(monkeypatch, item):
    """What parses it holds the interpreter in one step, so its values bound how long visitors wait."""
    monkeypatch.setattr(body_module, "from_json", lambda _: pytest.fail("parsed"))
    chunk = item.encode() * 3000
    marks = sum(chunk.count(mark) for mark in body_module.MARKS)
    taken, detail = refused_after(create_app(Settings()), chunk)
    assert (taken / len(chunk) - 1) * marks <= body_module.MOST_VALUES < taken / len(chunk) * marks
    assert f"{body_module.MOST_VALUES} values" in detail


@pytest.mark.parametrize(
    ("marks", "allowed"), [(body_module.MOST_VALUES, True), (body_module.MOST_VALUES + 1, False)]
)
def test_the_number_of_values_is_exact_and_grows_with_the_batch(marks, allowed):
    text = '{"q":[' + "1," * (marks - 3) + "1]}"
    client = TestClient(create_app(Settings()))
    if not allowed:
        problem(send(client, "fk", text), 413, "body-too-large")
        client = TestClient(create_app(Settings(max_batch=10_001)))
    problem(send(client, "fk", text), 422, "invalid-input")


def test_a_batch_too_large_names_the_limit(client):
    for what, body in {
        "fk": {"q": [Q] * 2001},
        "jacobian": {"q": [Q] * 2001},
        "ik": {"target": [{"position": [0, 0, 0]}] * 2001},
    }.items():
        document = problem(client.post(f"{ARM}/{what}", json=body), 413, "batch-too-large")
        assert "2000" in document["detail"]
        assert document["errors"][0]["field"] in ("q", "target")
    assert client.post(f"{ARM}/fk", json={"q": [Q] * 2000}).status_code == 200


# -- values ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("q", "field", "value", "expected"),
    [
        ("[0, 0, NaN, 0, 0]", "q[2]", "NaN", "finite"),
        ("[0, 0, 0, Infinity, 0]", "q[3]", "Infinity", "finite"),
        ("[[0, 0, 0, 0, 0], [0, -Infinity, 0, 0, 0]]", "q[1][1]", "-Infinity", "finite"),
        ("[0, 0, 0, 0, 1e400]", "q[4]", "Infinity", "finite"),
        ("[1e308, 0, 0, 0, 0]", "q[0]", "1e+308", "1000000"),
        ("[-1e308, 0, 0, 0, 0]", "q[0]", "-1e+308", "-1000000"),
        ("[1" + "0" * 400 + ", 0, 0, 0, 0]", "q[0]", "1000", "number"),
        ('[0, "ninety", 0, 0, 0]', "q[1]", '"ninety"', "a valid number"),
        ("[0, true, 0, 0, 0]", "q[1]", "true", "a valid number"),
        ("[0, null, 0, 0, 0]", "q[1]", "null", "a valid number"),
        ("[0, {}, 0, 0, 0]", "q[1]", "nothing in it", "a valid number"),
        ("[0, 0, 0]", "q", "3 values", "5 values in radians"),
        ("[[0, 0, 0, 0, 0], [0, 0, 0, 0]]", "q[1]", "4 values", "5 values in radians"),
        ("[[0, 0, 0, 0, 0], 3]", "q[1]", "3", "a list"),
        ("[3, [0, 0, 0, 0, 0]]", "q[1]", "[0, 0, 0, 0, 0]", "a valid number"),
        ("[]", "q", "[]", "at least 1 item"),
        ("[[]]", "q[0]", "[]", "at least 1 item"),
        ('"zero"', "q", '"zero"', "a list"),
        ('"' + "x" * 9000 + '"', "q", "…", "a list"),
        ("null", "q", "null", "a list"),
    ],
)
@pytest.mark.parametrize("what", ["fk", "jacobian"])
def test_a_wrong_configuration(client, what, q, field, value, expected):
    document = problem(send(client, what, '{"q": ' + q + "}"), 422, "invalid-input")
    error = document["errors"][0]
    assert error["field"] == field
    assert value in error["value"]
    assert expected in error["expected"]
    assert error["field"] in document["detail"]


@pytest.mark.parametrize(
    ("what", "body", "field", "expected"),
    [
        ("fk", {}, "q", "a value"),
        (
            "fk",
            {"q": Q, "pose": True},
            "pose",
            "only the fields base, tool, workpieces, q, pendant, frames, frame, form",
        ),
        ("fk", {"q": Q, "frames": "yes"}, "frames", "a valid boolean"),
        ("jacobian", {"q": Q, "frame": "world"}, "frame", "'base' or 'tool'"),
        ("ik", {}, "target", "a value"),
        ("ik", {"target": 5}, "target", "a JSON object"),
        ("ik", {"target": []}, "target", "at least 1 item"),
        ("ik", {"target": [{"position": [0, 0, 0]}, 7]}, "target[1]", "a JSON object"),
        ("ik", {"target": {}}, "target", "`position` and `wxyz` (or `xyzw`, `rpy`, `rotvec`), or `matrix`, or"),
        ("ik", {"target": {"wxyz": [1, 0, 0, 0]}}, "target", "`position` and `wxyz`"),
        ("ik", {"target": {"position": [0, 0, 0]}, "task": "pose"}, "target", "`position` and `wxyz`"),
        ("ik", {"target": {"position": [0, 0, 0]}, "task": "approach"}, "target", "`approach`"),
        ("ik", {"target": {"position": [0, 0]}}, "target.position", "at least 3 items"),
        ("ik", {"target": {"position": [0, 0, 0, 0]}}, "target.position", "at most 3 items"),
        ("ik", {"target": {"position": [0, 0, 1e308]}}, "target.position[2]", "1000000"),
        ("ik", {"target": {"position": [0, 0, 0], "euler": [0, 0, 0]}}, "target.euler", "only the fields frame, "),
        ("ik", {"target": {"position": [0, 0, 0], "wxyz": [0, 0, 0, 0]}}, "target.wxyz", "this one is zero"),
        ("ik", {"target": [{"position": [0, 0, 0], "approach": [0, 0, 0]}]}, "target[0].approach", "not zero"),
        ("ik", {"target": {"matrix": EYE[:2]}}, "target.matrix", "at least 3 items"),
        ("ik", {"target": {"matrix": [[2.0, 0, 0, 0], *EYE[1:]]}}, "target.matrix rotation", "orthonormal"),
        ("ik", {"target": {"matrix": [[-1.0, 0, 0, 0], *EYE[1:]]}}, "target.matrix rotation", "right-handed"),
        ("ik", {"target": {"matrix": [*EYE[:3], [0, 0, 1, 1]]}}, "target.matrix[3]", "0, 0, 0, 1"),
        (
            "ik",
            {"target": {"matrix": EYE, "position": [1, 0, 0]}},
            "target.position",
            "the position the matrix has",
        ),
        ("ik", {"target": {"matrix": EYE, "wxyz": [0, 1, 0, 0]}}, "target.wxyz", "the rotation the matrix has"),
        ("ik", {"target": {"matrix": EYE, "approach": [0, 0, 1]}}, "target.approach", "one of the two"),
        ("ik", {"target": {"position": [0, 0, 0]}, "task": "roll"}, "task", "'pose', 'approach' or 'position'"),
        ("ik", {"target": {"position": [0, 0, 0]}, "max_solutions": 0}, "max_solutions", "1"),
        ("ik", {"target": {"position": [0, 0, 0]}, "max_solutions": 1.5}, "max_solutions", "integer"),
        ("ik", {"target": {"position": [0, 0, 0]}, "respect_limits": 1}, "respect_limits", "boolean"),
        ("ik", {"target": {"position": [0, 0, 0]}, "redundancy": "psi"}, "redundancy", "a valid number"),
        ("ik", {"target": {"position": [0, 0, 0]}, "q_seed": [0, 0]}, "q_seed", "5 values"),
        ("ik", {"target": [{"position": [0, 0, 0]}] * 2, "q_seed": [Q] * 3}, "q_seed", "a list of 2"),
        ("ik", {"target": [{"position": [0, 0, 0]}] * 2, "q_seed": [Q, Q[:2]]}, "q_seed[1]", "5 values"),
    ],
)
def test_a_wrong_field_is_named_with_what_is_valid(client, what, body, field, expected):
    document = problem(client.post(f"{ARM}/{what}", json=body), 422, "invalid-input")
    error = document["errors"][0]
    assert error["field"] == field
    assert expected in error["expected"]
    assert error["value"] in document["detail"]


def test_a_wrong_length_names_the_joints(client):
    document = problem(client.post(f"{ARM}/fk", json={"q": [1, 2]}), 422, "invalid-input")
    assert "rotating base, rotating elbow, pivoting elbow, rotating wrist, pivoting wrist" in document["hint"]


def test_several_mistakes_are_all_listed(client):
    document = problem(client.post(f"{ARM}/ik", json={"task": 1, "max_solutions": -1}), 422, "invalid-input")
    assert {error["field"] for error in document["errors"]} == {"target", "task", "max_solutions"}
    assert "and 2 more" in document["detail"]


# -- our own mistakes ------------------------------------------------------------------------------------------


def test_an_unforeseen_error_tells_nothing_of_our_insides(monkeypatch, caplog):
    monkeypatch.setattr("app.api.fk.fk_answers", lambda *_: {}["secret detail"])
    response = TestClient(create_app(Settings())).post(f"{ARM}/fk", json={"q": Q})
    problem(response, 500, "internal-error")
    assert "secret" not in response.text
    assert "KeyError: 'secret detail'" in caplog.text  # the log has the cause, and says of which request
    assert response.headers["x-request-id"] in caplog.text
    assert "default-src 'self'" in response.headers["content-security-policy"]
    assert response.headers["x-content-type-options"] == "nosniff"


def test_a_body_may_begin_with_a_byte_order_mark():
    """PowerShell and some editors write one; RFC 8259, section 8.1 lets a reader skip it."""
    assert body_module.parsed(b'\xef\xbb\xbf{"q": [1.5]}') == {"q": [1.5]}
