"""The tools of agents, called by the client of the SDK: answers, schemas, refusals and limits of REST."""

from __future__ import annotations

import asyncio
import io
import json
import threading
from base64 import b64decode
from collections.abc import Mapping
from typing import Any

import pytest
from mcp import Client, MCPError
from PIL import Image
from starlette.responses import Response
from websockets.asyncio.server import serve

from app.api.arms.description import EXAMPLE as TABLE
from app.mcp import server as server_module
from app.mcp.inside import ask
from app.mcp.page import FIELDS, Pages, at, inside
from app.mcp.server import DRIVE, agent_server
from app.mcp.tools import EXAMPLE, TOOLS, Tool, tools_of
from app.service.main import create_app
from app.shared.settings import Settings, docs_folder
from app.shared.store import Store

URDF = (docs_folder().parent / "tests/data/urdf/ur5.urdf").read_text(encoding="utf-8")
REACHED = {"position": [0.4, 0.1, 0.3], "wxyz": [0.0, 1.0, 0.0, 0.0]}
FAR = {"position": [2.0, 0.0, 0.3], "wxyz": [0.0, 1.0, 0.0, 0.0]}
FOR = {"list_robots": {}, "describe_robot": {"robot": "ur5"}, "workspace": {"robot": "scara", "volume": False}}


@pytest.fixture
def agent(app):
    """Calls a function with a client, and returns what it returns."""

    def run(act):
        async def acting():
            async with Client(agent_server(app, app, Pages(inside(app)))) as client:
                try:
                    return await act(client)
                except MCPError as error:  # of which the client's task groups would make a group
                    return error

        return asyncio.run(acting())

    return run


@pytest.fixture(scope="session")
def tools(app) -> Mapping[str, Tool]:
    return tools_of(app.openapi())


def call(agent, name: str, **arguments: Any):
    return agent(lambda client: client.call_tool(name, arguments))


def test_the_tools_are_operations_and_short_enough_to_be_read(agent, tools):
    listed = agent(lambda client: client.list_tools()).tools
    assert [tool.name for tool in listed] == [*TOOLS, DRIVE]
    for tool in listed:
        assert tool.description
        schema = tool.input_schema
        assert schema["type"] == "object"
        assert set(schema["required"]) <= set(schema["properties"])
        assert "/components/" not in json.dumps(schema)
        assert all(each.get("description") or "$ref" in each for each in schema["properties"].values()), tool.name
    inputs = sum(len(json.dumps(tool.input_schema)) + len(tool.description) for tool in listed)
    assert inputs < 70_000, "some 17 000 tokens"


@pytest.mark.parametrize("name", [name for name in TOOLS if name not in ("code", "picture")])
def test_a_tool_answers_what_rest_answers_and_as_its_schema_says(agent, tools, client, name):
    """The client of the SDK checks the answer against the schema."""
    tool = tools[name]
    given = FOR.get(name) or (tool.takes.get("examples") or [{}])[0]
    found = call(agent, name, **given)
    assert not found.is_error, found.content
    method, path, query, body = tool.request(given)
    expected = client.request(method, path, params=query, json=body).json()
    assert found.structured_content == expected
    assert json.loads(found.content[0].text) == expected


def test_a_target_out_of_reach_is_an_answer_with_its_cause_numbers_and_sentence(agent):
    found = call(agent, "ik", robot="ur5", target=FAR)
    assert not found.is_error
    answer = found.structured_content
    assert (answer["status"], answer["cause"]) == ("unreachable", "too far")
    assert answer["details"]["distance"] > 1.0
    assert answer["reason"].startswith("Out of reach")
    assert answer["nearest_orientation"] is None


def test_an_arm_may_be_sent_along(agent):
    found = call(
        agent, "ik", robot=TABLE, target={"position": [0.045, 0.191, -0.211]}, task="position", fields="status"
    )
    assert found.structured_content == {"status": "solved"}
    assert call(agent, "code", robot=TABLE, format="dh").content[0].text.startswith("id = ")


@pytest.mark.parametrize("arm", ["ur5", TABLE])
def test_null_is_what_is_not_given(agent, tools, arm):
    target = {"position": [0.045, 0.191, -0.211]}
    found = call(agent, "ik", robot=arm, target=target, task="position", fields=None)
    assert not found.is_error, found.content
    assert tools["list_robots"].request({"brief": None}) == tools["list_robots"].request({})


@pytest.mark.parametrize(
    ("name", "arguments", "field", "words"),
    [
        ("fk", {"robot": "ur5", "q": [0.0]}, "q", "expected 6 values in radians"),
        ("fk", {"robot": "ur5", "q": [0.0] * 6, "units": "deg"}, "units", "only the fields"),
        ("fk", {"robot": "ur6", "q": [0.0]}, "robot_id", "one of pioneer5"),
        ("fk", {"robot": "ur5/inspect", "q": [0.0]}, "robot_id", "one of pioneer5"),
        ("fk", {"q": [0.0]}, "robot", "the id of an arm, or the fields of a robot file"),
        ("fk", {"robot": "", "q": [0.0]}, "robot", "the id of an arm, or the fields of a robot file"),
        ("fk", {"robot": {"rows": []}, "q": [0.0]}, "robot", ""),
        ("describe_robot", {"robot": TABLE}, "robot", "the id of an arm"),
        ("code", {"robot": "ur5", "format": "pdf"}, "format", "'toml'"),
        ("ik", {"robot": "ur5", "target": FAR, "fields": "speed"}, "fields", "names separated by commas"),
    ],
)
def test_what_is_not_valid_is_an_error_that_names_the_field_and_what_would_be(
    agent, name, arguments, field, words
):
    found = call(agent, name, **arguments)
    assert found.is_error
    problem = found.structured_content
    assert problem["errors"][0]["field"].startswith(field)
    assert words in problem["errors"][0]["expected"] or words in problem["detail"]
    assert found.content[0].text == f"{problem['detail']} {problem['hint']}"


def test_the_limits_of_rest_hold(agent, app, monkeypatch):
    most = app.state.settings.max_batch
    found = call(agent, "ik", robot="ur5", target=[{"position": [0.1, 0.2, 0.3]}] * (most + 1), fields="status")
    assert found.structured_content["type"] == "urn:kinboard:problem:batch-too-large"
    found = call(agent, "examine_urdf", urdf="x" * app.state.settings.max_body)
    assert found.structured_content["status"] == 413
    monkeypatch.setattr(server_module, "MOST", 1000)
    found = call(agent, "describe_robot", robot="ur5")
    assert found.is_error
    assert found.structured_content["type"] == "urn:kinboard:problem:answer-too-large"
    assert "fewer" in found.content[0].text


def test_an_unknown_tool_is_an_error_of_the_protocol(agent):
    assert str(call(agent, "fly")).startswith('There is no tool "fly". Tools: list_robots, ')


def test_a_failure_of_ours_says_no_more_than_rest_does(agent, app, monkeypatch, caplog):
    def fail(*_: object) -> None:
        raise RuntimeError("secret")

    monkeypatch.setattr("app.api.fk._answers", fail)
    monkeypatch.setattr(app.state.compute, "pool", None)
    found = call(agent, "fk", robot="ur5", q=[0.0] * 6)
    assert found.structured_content["type"] == "urn:kinboard:problem:internal-error"
    assert "secret" not in found.content[0].text
    assert "secret" in caplog.text


def test_pictures_of_postures_and_motions_differ_and_have_the_size_that_was_asked_for(agent):
    images = []
    for q in ([0.5, -1.2, 1.4, -1.7, -1.5, 0.0], [[0.5, -1.2, 1.4, -1.7, -1.5, 0.1 * k] for k in range(3)]):
        content = call(agent, "picture", robot="ur5", q=q, size=96).content[0]
        assert content.mime_type == "image/png"
        images.append(Image.open(io.BytesIO(b64decode(content.data))).convert("RGB"))
    assert {image.size for image in images} == {(96, 96)}
    assert images[0].tobytes() != images[1].tobytes()
    assert len(images[0].getcolors(96 * 96) or ()) > 50


def test_a_wrist_without_lengths_is_a_picture_too(agent):
    rows = [{"name": f"axis {k}", "alpha": (90, -90, 0)[k], "limits": [-90, 90]} for k in range(3)]
    wrist = {**TABLE, "rows": rows, "home": {"q": [10, 20, 30]}}
    (content,) = call(agent, "picture", robot=wrist, size=64).content
    assert Image.open(io.BytesIO(b64decode(content.data))).size == (64, 64)


def test_resources_are_the_arms_and_the_pages_of_the_documentation(agent):
    async def read(client: Client) -> tuple[list[str], dict[str, str]]:
        uris = [each.uri for each in (await client.list_resources()).resources]
        wanted = ["kinboard://arms", "kinboard://arms/ur5", "kinboard://docs/robot-files"]
        return uris, {uri: (await client.read_resource(uri)).contents[0].text for uri in wanted}

    uris, texts = agent(read)
    assert uris[0] == "kinboard://arms"
    assert {"kinboard://docs/agents", "kinboard://docs/robot-files", "kinboard://docs/SKILL"} <= set(uris)
    arms = json.loads(texts["kinboard://arms"])["robots"]
    assert {"id": "ur5", "name": "UR5", "maker": "Universal Robots", "n": 6, "solver": "parallel6"} in arms
    assert len(json.loads(texts["kinboard://arms/ur5"])["rows"]) == 6
    assert texts["kinboard://docs/robot-files"].startswith("# Robot files")


@pytest.mark.parametrize(
    "uri",
    [
        *("kinboard://arms/", "kinboard://arms/ur6", "kinboard://docs/none", "kinboard://docs/../README"),
        *("file:///etc/passwd", "x"),
    ],
)
def test_there_are_no_other_resources(agent, uri):
    found = agent(lambda client: client.read_resource(uri))
    assert isinstance(found, MCPError)
    assert str(found).startswith("There is no")


def test_a_call_that_is_taken_back_ends_its_computation():
    """As a client that leaves does: what computes hears of it, and keeps its place until it has ended."""
    heard: list[str] = []

    async def service(scope, receive, send):
        await receive()
        heard.append((await receive())["type"])

    async def cancelled() -> None:
        call = asyncio.ensure_future(ask(service, None, "GET", "/", {}, None))
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        call.cancel()
        with pytest.raises(asyncio.CancelledError):
            await call
        for _ in range(5):
            await asyncio.sleep(0)

    asyncio.run(cancelled())
    assert heard == ["http.disconnect"]


def test_an_empty_answer_of_rest_is_an_error_of_the_tool():
    """As REST gives it, for the log, to an agent that has left."""

    async def service(scope, receive, send):
        await Response(status_code=499)(scope, receive, send)

    reply = asyncio.run(ask(service, None, "GET", "/", {}, None))
    assert server_module.result(reply).is_error


def test_settings_of_a_service_refuse_nothing_to_an_agent_on_this_machine():
    settings = Settings(allowed_hosts=("kinboard.example",), rate_limit=0.1, compute=0).on_this_machine()
    app = create_app(settings, Store())

    async def acting():
        async with Client(agent_server(app, app, Pages(inside(app)))) as client:
            return [await client.call_tool("fk", {"robot": "ur5", "q": [0.0] * 6}) for _ in range(3)]

    assert [found.structured_content["pose"]["frame"] for found in asyncio.run(acting())] == ["world"] * 3


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("ftp://127.0.0.1", "address: got 'ftp://127.0.0.1', expected the service's, such as http://localhost"),
        ("http://127.0.0.1:{}", "refused the connection with 403. Set KINBOARD_TOKEN to its access token"),
        ("http://127.0.0.1:1", "Start the service, or name its address"),
    ],
)
def test_why_a_page_cannot_be_reached_is_said(app, url, words):
    def refuse(connection, _):
        return connection.respond(403, "")

    async def acting():
        async with serve(pytest.fail, "127.0.0.1", 0, process_request=refuse) as server:
            (socket,) = server.sockets
            pages = Pages(at(url.format(socket.getsockname()[1]), None))
            async with Client(agent_server(app, app, pages)) as client:
                return await client.call_tool(DRIVE, {"code": "K7QF-2M4A"})

    found = asyncio.run(acting())
    assert found.is_error
    assert words in found.content[0].text


def test_the_document_is_made_by_a_thread(agent, app, monkeypatch):
    """It takes half a second, for which the event loop would answer nobody."""
    made: list[bool] = []
    document = app.openapi()
    loop = threading.get_ident()
    monkeypatch.setattr(app, "openapi", lambda: made.append(threading.get_ident() != loop) or document)
    agent(lambda client: client.read_resource("kinboard://arms"))
    assert made == [True]


def test_the_schema_of_a_page_has_no_fields_of_real_machines():
    assert not {"measured", "readings", "drives"} & set(FIELDS)
    assert EXAMPLE == "pioneer5"
