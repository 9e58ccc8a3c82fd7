"""An agent in a page: it says what the page is to show, and hears what is shown then.

The connection is the one of other programs (:mod:`app.api.live`), opened with the code of the page and under the
agent's name, which the page shows beside *Stop*. It stays open between the calls of the tool. An agent that says
nothing for `IDLE` seconds leaves the page.
"""

from __future__ import annotations

import asyncio
import json
import secrets
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Final, Protocol
from urllib.parse import quote

from pydantic_core import from_json
from starlette.requests import Request
from starlette.types import ASGIApp, Message
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException

from app.api.live.messages import LiveMessage
from app.api.problems import ProblemError, invalid
from app.classroom.tokens import read_code
from app.live.client.connection import where
from app.mcp.inside import scope_of
from app.mcp.tools import Schema, closed
from app.shared.problems import FieldError, Problem, show
from kin import KinematicsError

IDLE: Final = 120.0  # s
ANSWER: Final = 20.0  # s for an answer of the page
SHOWN: Final = ("q", "gripper", "target", "result", "contacts", "program")
# Of a message: what an agent that moves no machine has to say.
FIELDS: Final = ("robot", "q", "gripper", "target", "obstacles", "program", "play", "draw", "clear")
DESCRIPTION: Final = (
    "Says what an open page of the dashboard is to show, and answers with what it shows then: robot, joint values "
    "q, gripper, target, the result of inverse kinematics, contacts, program. The person who has the page open "
    "presses Connect a program in its tab Program, and tells you the code. The page shows your name and a Stop. "
    "Without other arguments than the code, nothing is changed."
)
# Parts of a message that another tool describes.
KNOWN: Final = {
    "ProgramBody": {"type": "object", "description": "A program as `plan` takes it."},
    "ObstacleBody": {"type": "object", "description": "An obstacle as `ik` takes it."},
}
ENDED: Final = "Ask the person for the code that the page shows now."
NOT_LET_IN: Final = "Set KINBOARD_TOKEN to its access token, if it has one; else its log says why."
NOT_THERE: Final = "Start the service, or name its address: kinboard mcp --url URL."


class Socket(Protocol):
    """A websocket to a page."""

    async def send(self, message: str) -> None:
        """Send a text."""

    async def recv(self) -> str | bytes:
        """The next text; raises `OSError` or `ConnectionClosed`."""

    async def close(self) -> None:
        """End it."""


Dial = Callable[[Request | None, str, str], Awaitable[Socket]]  # with the code, and the name of the agent


class Inside:
    """A websocket to a route of this process."""

    def __init__(self, service: ASGIApp, request: Request | None, code: str, name: str) -> None:
        path = f"/api/v1/live/{quote(code, safe='')}"
        scope = scope_of(request, "websocket", path, {"name": name, "session": secrets.token_urlsafe(12)})
        self._heard: asyncio.Queue[Message] = asyncio.Queue()
        self._said: asyncio.Queue[Message] = asyncio.Queue(maxsize=64)
        self._heard.put_nowait({"type": "websocket.connect"})
        route = service({**scope, "subprotocols": []}, self._heard.get, self._said.put)
        self._task = asyncio.ensure_future(route)

    async def send(self, message: str) -> None:
        self._heard.put_nowait({"type": "websocket.receive", "text": message})

    async def recv(self) -> str:
        while True:
            event = await self._said.get()
            if event["type"] == "websocket.send":
                return str(event["text"])
            if event["type"] == "websocket.close":
                raise ConnectionResetError(event.get("reason") or "the page has ended the connection")

    async def close(self) -> None:
        self._heard.put_nowait({"type": "websocket.disconnect", "code": 1000})
        await asyncio.wait((self._task,), timeout=1.0)
        self._task.cancel()


def inside(service: ASGIApp) -> Dial:
    """Dials pages of this service."""

    async def dial(request: Request | None, code: str, name: str) -> Socket:
        return Inside(service, request, code, name)

    return dial


def at(url: str, token: str | None) -> Dial:
    """Dials pages of the service with this address."""

    async def dial(_: Request | None, code: str, name: str) -> Socket:
        try:
            address, options = where(url, code, name, token)
            return await connect(address, **options)
        except InvalidStatus as error:
            detail = f"The service at {url} refused the connection with {error.response.status_code}."
            raise ProblemError(403, "not-allowed", detail, NOT_LET_IN) from None
        except (OSError, WebSocketException, KinematicsError) as error:
            detail = f"No connection to {url}: {error}."
            raise ProblemError(404, "not-running", detail, NOT_THERE) from None

    return dial


class Visit:
    """The connection of an agent with a page."""

    def __init__(self, socket: Socket, left: Callable[[], object]) -> None:
        self._socket, self._left = socket, left
        self._shown: dict[str, Any] = {}
        self._answers: dict[int, asyncio.Future[None]] = {}
        self._count = 0
        self._timer: asyncio.TimerHandle | None = None
        self._closing: asyncio.Task[None] | None = None
        self._reader = asyncio.ensure_future(self._read())

    async def ask(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Have the page show something, and return what it shows then. Raises `ProblemError`."""
        loop = asyncio.get_running_loop()
        if self._timer is not None:
            self._timer.cancel()
        self._timer = loop.call_later(IDLE, self.leave)
        self._count += 1
        number = self._count
        given = {name: value for name, value in fields.items() if value is not None}
        answer = self._answers[number] = loop.create_future()
        try:
            if number == 1:  # apart: a message that is refused subscribes to nothing
                await self._socket.send(json.dumps({"subscribe": {"values": SHOWN, "rate": 10}}))
            # With a value, if only an empty drawing: else it is done before the page has said what it shows.
            await self._socket.send(json.dumps({"draw": {}, **given, "id": number}))
            await asyncio.wait_for(answer, ANSWER)
        except TimeoutError:
            raise _ended(f"the page has not answered within {ANSWER:g} s") from None
        except (OSError, ConnectionClosed) as error:
            raise _ended(str(error)) from None
        finally:
            del self._answers[number]
        return dict(self._shown)

    async def _read(self) -> None:
        try:
            while True:
                self._take(from_json(await self._socket.recv()))
        except (OSError, ConnectionClosed) as error:
            self._fail(_ended(str(error)))
        finally:
            self.leave()

    def _take(self, message: dict[str, Any]) -> None:
        answer = self._answers.get(message.get("id", 0))
        match message["type"]:
            case "welcome" | "news":
                self._shown |= {name: value for name, value in message.items() if name in ("robot", *SHOWN)}
                if (robot := message.get("robot")) is not None:
                    self._shown["robot"] = {name: robot[name] for name in ("id", "name", "joints")}
            case "done" if answer is not None and not answer.done():
                answer.set_result(None)
            case "problem" if answer is not None or "id" not in message:
                self._fail(_refused(message["problem"]), answer)
            case "end":
                self._fail(_ended(message["reason"]))

    def _fail(self, error: ProblemError, only: asyncio.Future[None] | None = None) -> None:
        for answer in (only,) if only is not None else self._answers.values():
            if not answer.done():
                answer.set_exception(error)

    def leave(self) -> None:
        """Leave the page."""
        if self._closing is None:
            self._left()
            if self._timer is not None:
                self._timer.cancel()
            self._closing = asyncio.ensure_future(self._close())

    async def _close(self) -> None:
        await self._socket.close()
        self._reader.cancel()


def _ended(why: str) -> ProblemError:
    return ProblemError(409, "not-running", f"The connection to the page has ended: {why.rstrip('.')}.", ENDED)


def _refused(given: Mapping[str, Any]) -> ProblemError:
    document = Problem(**given)
    kind = document.type.rpartition(":")[2]
    return ProblemError(document.status, kind, document.detail, document.hint, document.errors)


class Pages:
    """The pages that agents are in, by code and name of the agent."""

    def __init__(self, dial: Dial) -> None:
        self._dial = dial
        self._dialling = asyncio.Lock()  # or a second call would be refused as another program
        self._visits: dict[tuple[str, str], Visit] = {}

    async def drive(self, request: Request | None, name: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """What a page shows after it has taken `arguments`, its code among them; raises `ProblemError`."""
        fields = dict(arguments)
        code = fields.pop("code", None)
        if not isinstance(code, str):
            raise invalid(
                FieldError(field="code", value=show(code), expected="the code of a page, such as K7QF-2M4A")
            )
        for given in fields.keys() - set(FIELDS):
            raise invalid(
                FieldError(field=given, value=show(fields[given]), expected=f"one of {', '.join(FIELDS)}")
            )
        key = read_code(code), name
        async with self._dialling:
            if (visit := self._visits.get(key)) is None:
                socket = await self._dial(request, code, name)
                visit = self._visits[key] = Visit(socket, lambda: self._visits.pop(key, None))
        return await visit.ask(fields)

    def close(self) -> None:
        """Leave all pages."""
        for visit in list(self._visits.values()):
            visit.leave()


def takes() -> Schema:
    """JSON schema of the arguments."""
    whole = LiveMessage.model_json_schema(ref_template="#/components/schemas/{model}")
    fields = {name: whole["properties"][name] for name in FIELDS}
    code = {"type": "string", "description": "The code of the page, such as K7QF-2M4A."}
    schema = {
        "type": "object",
        "properties": {"code": code, **fields},
        "required": ["code"],
        "additionalProperties": False,
    }
    return closed(schema, whole["$defs"], elsewhere=KNOWN)
