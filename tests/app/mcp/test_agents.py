"""``/mcp`` over HTTP: off by default, with the token, hosts, origins, rates and sizes of REST; and pages."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from functools import cache
from typing import Any

import httpx2
import numpy as np
import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from mcp import Client
from mcp.client.streamable_http import streamable_http_client

import kin
from app.classroom.tokens import show_code
from app.live import Listener
from app.mcp import page as page_module
from app.mcp.page import FIELDS, Pages, inside
from app.service.main import create_app
from app.shared.settings import Settings
from app.shared.store import Store

TOKEN = "correct horse battery"
STORE = Store()
URL = "http://localhost/mcp"
ACCEPT = {"accept": "application/json, text/event-stream", "content-type": "application/json"}
PING = {"jsonrpc": "2.0", "id": 1, "method": "ping"}
Act = Callable[[Client], Awaitable[Any]]


@cache
def service(**settings: Any) -> FastAPI:
    """Shared by tests: its document takes half a second to be made."""
    return create_app(Settings(mcp=True, compute=0, **settings), STORE)


def run(app: FastAPI, act: Act, mode: str = "auto", **headers: str) -> Any:
    """What `act` returns of a client of the service."""

    async def acting() -> Any:
        transport = httpx2.ASGITransport(app)
        async with (
            app.state.agents.running(),
            httpx2.AsyncClient(transport=transport, headers=headers) as http,
            Client(streamable_http_client(URL, http_client=http), mode=mode) as client,
        ):
            return await act(client)

    return asyncio.run(acting())


def post(app: FastAPI, content: Any = PING, **headers: str) -> httpx2.Response:
    """The answer to one message, without a client of the SDK."""
    body = content if isinstance(content, bytes | str) else json.dumps(content)
    return TestClient(app, base_url="http://localhost").post("/mcp", content=body, headers=ACCEPT | headers)


def kind(answer: httpx2.Response) -> str:
    return str(answer.json()["type"]).rpartition(":")[2]


@pytest.mark.parametrize("mode", ["auto", "legacy"])
def test_a_client_gets_answers_over_http(mode):
    async def act(client: Client) -> tuple[int, str]:
        tools = (await client.list_tools()).tools
        found = await client.call_tool("fk", {"robot": "ur5", "q": [0.0] * 6})
        return len(tools), found.structured_content["pose"]["frame"]

    count, frame = run(service(), act, mode)
    assert count > 10
    assert frame == "world"


def test_a_call_lists_the_tools_once(monkeypatch):
    """For their names; the SDK has no need of their schemas."""
    listed: list[object] = []

    async def counted(make: Callable[[], Any]) -> Any:
        listed.append(make)
        return make()

    monkeypatch.setattr("app.mcp.server.run_in_threadpool", counted)

    async def act(client: Client) -> int:
        counts = []
        for _ in range(2):
            await client.call_tool("fk", {"robot": "ur5", "q": [0.0] * 6})
            counts.append(len(listed))
        return counts[1] - counts[0]

    assert run(service(), act) == 1


def test_it_is_off_by_default():
    assert Settings().mcp is False
    app = create_app(Settings(), STORE)
    assert kind(post(app)) == "not-found"


def test_the_token_is_asked_for_and_a_client_that_has_it_is_answered():
    app = service(token=TOKEN)
    assert post(app).status_code == 401
    assert post(app, authorization="Bearer wrong").status_code == 401
    header = {"authorization": f"Bearer {TOKEN}"}
    found = run(app, lambda client: client.call_tool("list_robots", {"find": "ur5e"}), **header)
    assert [arm["id"] for arm in found.structured_content["robots"]] == ["ur5e"]


def test_a_read_only_service_answers_nobody_without_the_token():
    assert kind(post(service(read_only=True))) == "read-only"


def test_other_hosts_and_pages_of_other_sites_are_refused():
    app = service(allowed_hosts=("localhost",), cors_origins=("https://good.example",))
    assert kind(post(app, host="evil.example")) == "wrong-host"
    assert kind(post(app, origin="https://evil.example")) == "other-origin"
    for origin in ("http://localhost", "https://good.example"):
        assert post(app, b"{", origin=origin).status_code == 400, "it was read"


def test_each_message_counts_in_the_rate_of_its_client():
    app = service(rate_limit=0.1)  # one at once
    assert kind(post(app, b"[]")) != "too-many-requests"
    answer = post(app)
    assert answer.status_code == 429
    assert int(answer.headers["retry-after"]) > 0


@pytest.mark.parametrize(
    ("content", "status", "problem"),
    [
        (b" " * 2000 + b"{}", 413, "body-too-large"),
        (b"[" * 900, 400, "malformed-json"),
        (b"{", 400, "malformed-json"),
    ],
)
def test_a_message_is_bounded_before_it_is_parsed(content, status, problem):
    answer = post(service(max_body=1024), content)
    assert (answer.status_code, kind(answer)) == (status, problem)


def test_a_message_with_too_many_values_is_refused(monkeypatch):
    monkeypatch.setattr("app.api.body.MOST_VALUES", 10)
    monkeypatch.setattr("app.api.body.PER_ITEM", 0)
    assert kind(post(service(), {**PING, "params": {"_meta": {"x": list(range(20))}}})) == "body-too-large"


def test_only_messages_in_json_are_taken():
    app = service()
    assert kind(post(app, **{"content-type": "text/plain"})) == "unsupported-media-type"
    answer = TestClient(app, base_url="http://localhost").get("/mcp", headers=ACCEPT)
    assert answer.status_code == 405
    assert answer.headers["allow"] == "POST"


# -- pages -----------------------------------------------------------------------------------------------------


class Page:
    """Takes what its program sends, as a page's worker does, and publishes what it shows before it says done."""

    def __init__(self, app: FastAPI) -> None:
        self.taken: dict[str, Any] = {}
        self.q = kin.get_robot("ur5").q_home
        self.door = Listener(app.state.lines, self._post)
        self.door.open(kin.get_robot("ur5"))
        assert self.door.line is not None
        self.line = self.door.line
        self.code = self.line.code

    def _post(self, key: str, value: object) -> None:
        for pending in map(self.line.take, ("live", "drawn")):
            self.taken |= pending.values
            self.q = pending.values.get("q", self.q)
            for number in pending.numbers:
                self.line.publish("q", self.q)
                self.line.write(number)


@pytest.fixture
def app() -> FastAPI:
    return service()


@pytest.mark.parametrize("mode", ["auto", "legacy"])
def test_an_agent_drives_the_page_whose_code_it_has_under_its_name(app, mode):
    page = Page(app)

    async def act(client: Client) -> list[Any]:
        shown = await client.call_tool("drive_page", {"code": page.code})
        names.append(page.line.program.name)
        moved = await client.call_tool("drive_page", {"code": page.code, "q": [0.1] * 6})
        names.append(page.line.program.name)
        return [shown, moved]

    names: list[str] = []
    shown, moved = run(app, act, mode)
    assert shown.structured_content["robot"]["id"] == "ur5"
    assert len(shown.structured_content["q"]) == 6
    assert moved.structured_content["q"] == [0.1] * 6
    assert page.taken["q"].tolist() == [0.1] * 6
    assert names == (["mcp"] * 2 if mode == "auto" else ["An agent"] * 2)


def test_the_code_alone_answers_with_what_the_page_shows_now(app):
    page = Page(app)
    for k in range(2):  # the second agent hears nothing of the time of the first
        page.q = np.full(6, 0.1 * k)
        found = run(app, lambda client: client.call_tool("drive_page", {"code": page.code, "draw": None}))
        assert found.structured_content["q"] == page.q.tolist()


def test_after_a_refusal_the_values_are_heard_still(app):
    page = Page(app)

    async def act(client: Client) -> list[Any]:
        return [await client.call_tool("drive_page", {"code": page.code, "q": q}) for q in ([9.0] * 6, [0.1] * 6)]

    refused, moved = run(app, act)
    assert refused.is_error
    assert moved.structured_content["q"] == [0.1] * 6


def test_calls_at_a_time_and_other_spellings_of_the_code_are_one_connection(app):
    page = Page(app)
    dials: list[str] = []
    dial = inside(app)

    async def slowly(request: Any, code: str, name: str) -> Any:
        dials.append(code)
        await asyncio.sleep(0)
        return await dial(request, code, name)

    async def act() -> list[dict[str, Any]]:
        pages = Pages(slowly)
        spellings = page.code, show_code(page.code).lower(), f" {page.code} "
        try:
            return await asyncio.gather(*(pages.drive(None, "agent", {"code": code}) for code in spellings))
        finally:
            pages.close()

    assert [shown["robot"]["id"] for shown in asyncio.run(act())] == ["ur5"] * 3
    assert len(dials) == 1


def test_it_leaves_when_it_says_nothing(app, monkeypatch):
    page = Page(app)
    monkeypatch.setattr(page_module, "IDLE", 0.0)

    async def act(client: Client) -> bool:
        await client.call_tool("drive_page", {"code": page.code})
        for _ in range(200):
            if page.line.program is None:
                return True
            await asyncio.sleep(0.01)
        return False

    assert run(app, act)


def test_it_leaves_with_the_service(app):
    page = Page(app)
    run(app, lambda client: client.call_tool("drive_page", {"code": page.code}))
    assert page.line.program is None


def test_stop_in_the_page_ends_it_and_the_code_counts_no_more(app):
    page = Page(app)

    async def act(client: Client) -> list[Any]:
        await client.call_tool("drive_page", {"code": page.code})
        page.door.close()
        return [await client.call_tool("drive_page", {"code": page.code}) for _ in range(2)]

    for found in run(app, act):
        assert found.is_error
        assert "withdrawn" in found.content[0].text or "No page has the code" in found.content[0].text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"code": "AAAA-AAAA"}, "No page has the code AAAA-AAAA"),
        ({}, "the code of a page, such as"),
        ({"code": 7}, "the code of a page, such as"),
        ({"code": "", "q": [9.0] * 6}, "the limits of the joint"),
        ({"code": "", "drives": "a machine"}, f"one of {', '.join(FIELDS)}"),
    ],
)
def test_what_a_page_does_not_take_is_an_error_in_words(app, arguments, words):
    page = Page(app)
    given = arguments | ({"code": page.code} if arguments.get("code") == "" else {})
    found = run(app, lambda client: client.call_tool("drive_page", given))
    assert found.is_error
    assert words in found.content[0].text
    assert page.taken.get("q") is None


def test_codes_cannot_be_guessed_faster_than_by_other_programs(app):
    """They are counted together with those of kin.connect."""
    tried: list[str] = []
    app.state.tries.wrong = lambda client: tried.append(client)  # type: ignore[method-assign]
    run(app, lambda client: client.call_tool("drive_page", {"code": "AAAA-AAAA"}))
    assert tried == ["127.0.0.1"]
