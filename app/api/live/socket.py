"""The websocket of a page's program: from the handshake to whichever side ends first.

The address has the code of the page, its query the `name` of the program and a `session`: a word of the program's
own, with which it comes back after a lost connection, in place of the old one.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from typing import Any, Protocol

from fastapi import WebSocket
from starlette.concurrency import run_in_threadpool
from starlette.websockets import WebSocketDisconnect

from app.api.body import LARGE, versioned
from app.api.live.answers import news, welcome
from app.api.live.messages import MOST_BYTES, USUAL_RATE, Message, id_of, read
from app.api.problems import ProblemError, as_problem, internal_error, invalid
from app.api.websockets import DONE, FAILED, POLICY, accept, close
from app.classroom.tokens import read_code, show_code
from app.live import RESERVED, BusyLineError, Line, Lines, Program
from app.live.codes import LONGEST, is_code
from app.shared.answers.answer import as_json
from app.shared.clients import client_of
from app.shared.connection import DELAY
from app.shared.problems import FieldError, Problem, show

logger = logging.getLogger("kinboard.live")
router = versioned("live")

RATE, BURST = 120.0, 120.0  # messages of a program that are read a second, and at once
SAID_AGAIN = 1.0  # s between two complaints of the same kind
DEFAULT_NAME = "A program"
LONGEST_NAME, LONGEST_SESSION = 40, 64  # characters


class Tries(Protocol):
    """How often a client may try codes."""

    def trying(self, client: str) -> AbstractAsyncContextManager[None]:
        """The time of one try; raises 429."""

    def wrong(self, client: str) -> None:
        """The code was wrong; raises 429 if there were too many."""


@router.websocket("/live/{code}")
async def live(visitor: WebSocket, code: str) -> None:
    """A program and the page with this code."""
    state = visitor.app.state
    if not await accept(visitor, logger):
        return
    try:
        line = await _find(state.lines, state.tries, client_of(visitor.scope), code)
        conversation = Conversation(visitor, line)
    except ProblemError as error:
        await _refuse(visitor, error.problem)
        return
    try:
        await conversation.hold()
    except WebSocketDisconnect:
        pass
    except Exception:
        logger.exception("the connection of a program failed")
        await close(visitor, FAILED, "Internal error.")


async def _find(lines: Lines, tries: Tries, client: str, code: str) -> Line:
    """The line with a code; raises `ProblemError`: 404, or 429 after many wrong codes."""
    async with tries.trying(client):
        code = read_code(code[:LONGEST])
        line = lines.find(code)
        if line is not None:
            return line
        if code not in RESERVED:  # its page is not open yet
            tries.wrong(client)
    expected = "the code of an open page" if is_code(code) else "8 letters and digits, such as K7QF-2M4A"
    error = FieldError(field="code", value=show(show_code(code)), expected=expected)
    hint = "Press Connect a program in the tab Program of the page; the code is there."
    detail = f"No page has the code {show_code(code)}."
    raise ProblemError(404, "not-found", detail, hint, [error])


class Conversation:
    """One connection of a program; raises `ProblemError` if another program is connected."""

    def __init__(self, visitor: WebSocket, line: Line) -> None:
        self._visitor, self._line = visitor, line
        self._loop = asyncio.get_running_loop()
        self._woken = asyncio.Event()
        self._interval = 1.0 / USUAL_RATE
        self._known: dict[str, int] = {}
        self._times: deque[float] = deque()  # of the messages of the last second
        self._left, self._since = BURST, self._loop.time()
        self._waiting: str | None = None  # the newest message of one that sends too many
        self._later: asyncio.TimerHandle | None = None
        self._reading = asyncio.Lock()
        self._tasks: set[asyncio.Task[None]] = set()
        self._complained: dict[str, float] = {}
        self._own: deque[dict[str, Any]] = deque(maxlen=64)  # messages of ours that wait to be sent
        query = visitor.query_params
        name = " ".join(query.get("name", "").split())[:LONGEST_NAME]
        session = query.get("session", "")[:LONGEST_SESSION] or str(id(self))
        delay: Callable[[], float | None] = visitor.scope.get("state", {}).get(DELAY, lambda: None)
        self._program = Program(
            "".join(c for c in name if c.isprintable()) or DEFAULT_NAME, session, self._wake, delay, self._rate
        )
        try:
            line.connect(self._program)
        except BusyLineError as error:
            field = FieldError(field="code", value=show(show_code(line.code)), expected="a page without a program")
            detail = f"Another program is connected to this page: {error.name}."
            hint = "End it, or withdraw the code in the page and connect with the new one."
            raise ProblemError(409, "not-allowed", detail, hint, [field]) from None

    async def hold(self) -> None:
        """Talk until one side ends."""
        tasks = asyncio.create_task(self._listen()), asyncio.create_task(self._tell())
        try:
            ended, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (*tasks, *self._tasks):
                task.cancel()
            if self._later is not None:
                self._later.cancel()
            self._line.disconnect(self._program)
            await asyncio.gather(*tasks, *self._tasks, return_exceptions=True)
        ended.pop().result()

    def _wake(self) -> None:
        """Look for news; called by any thread."""
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._woken.set)

    def _rate(self) -> int:
        """How many messages came within the last second; called by any thread."""
        since = self._loop.time() - 1.0
        return sum(time > since for time in list(self._times))

    # What the program sends

    async def _listen(self) -> None:
        while True:
            event = await self._visitor.receive()
            if event["type"] == "websocket.disconnect":
                return
            if not isinstance(text := event.get("text"), str):
                error = FieldError(field="message", value="a binary message", expected="JSON in a text message")
                self._say(problem=invalid(error).problem)
                continue
            if self._admits():
                await self._read(text)
            else:
                self._postpone(text)

    def _admits(self) -> bool:
        """Count a message; whether it is read at once."""
        now = self._loop.time()
        self._times.append(now)
        while self._times[0] < now - 1.0:
            self._times.popleft()
        self._left = min(BURST, self._left + RATE * (now - self._since))
        self._since = now
        if self._waiting is not None or self._left < 1.0:
            return False
        self._left -= 1.0
        return True

    def _postpone(self, text: str) -> None:
        """Keep the newest message of a program that sends too many, until one may be read."""
        if self._waiting is None:
            wait = max(0.0, (1.0 - self._left) / RATE)
            self._later = self._loop.call_later(wait, self._read_late)
        self._waiting = text
        error = FieldError(
            field="message", value=f"{len(self._times)} in a second", expected=f"at most {RATE:g} a second"
        )
        detail = f"More than {RATE:g} messages came within a second; of those beyond, only the newest is read."
        self._complain(ProblemError(429, "too-many-requests", detail, "Send more slowly.", [error]).problem)

    def _read_late(self) -> None:
        text, self._waiting = self._waiting, None
        self._left -= 1.0
        if text is not None:
            task = self._loop.create_task(self._read(text))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _read(self, text: str) -> None:
        """Pass a message on to the page, or say what is wrong with it."""
        async with self._reading:  # so that a long one is not overtaken by the next
            try:
                message = await self._message(text)
            except Exception as error:
                known = error if isinstance(error, ProblemError) else as_problem(error)
                if known is None:
                    logger.exception("a message of a program failed")
                self._say(id_of(text), (known or internal_error()).problem)
            else:
                self._line.note("sent", text)
                if message.subscription is not None:
                    self._program.wants = frozenset(message.subscription.values)
                    self._interval = 1.0 / message.subscription.rate
                    self._known = {name: n for name, n in self._known.items() if name == "robot"}
                    self._woken.set()
                if message.values:
                    self._line.send(message.values, message.id)
                elif message.id is not None:
                    self._say(message.id)

    async def _message(self, text: str) -> Message:
        state, robot = self._visitor.app.state, self._line.robot
        if len(text) < LARGE or len(text) > MOST_BYTES:  # that is refused at once
            return read(text, robot, state.store)
        return await run_in_threadpool(read, text, robot, state.store)

    # What the program hears

    def _say(self, number: int | None = None, problem: Problem | None = None) -> None:
        self._own.append(_letter(number, problem))
        self._woken.set()

    def _complain(self, problem: Problem) -> None:
        """Say something that would otherwise be said many times a second."""
        now = self._loop.time()
        if now - self._complained.get(problem.type, -SAID_AGAIN) >= SAID_AGAIN:
            self._complained[problem.type] = now
            self._say(problem=problem)

    async def _tell(self) -> None:
        """Send what is news until the page or another connection ends this one."""
        number, robot = self._line.news({})["robot"]
        self._known["robot"] = number
        await self._send(welcome(show_code(self._line.code), robot, RATE))
        next_news = 0.0
        while True:
            await self._woken.wait()
            self._woken.clear()
            if self._line.ended or self._line.program is not self._program:
                reason = self._line.ended or "The program has connected again."
                await self._send({"type": "end", "reason": reason})
                await close(self._visitor, DONE, reason)
                return
            now = self._loop.time()
            replies = self._line.replies()
            for pressed in (reply.pressed for reply in replies if reply.pressed):
                await self._send({"type": "pressed", "button": pressed})  # before news: it may stop who follows
            if now < next_news and not replies:
                self._loop.call_later(next_news - now, self._woken.set)
            elif values := self._line.news(self._known):  # before `done`: what was done has been heard then
                next_news = now + self._interval
                self._known.update({name: number for name, (number, _) in values.items()})
                await self._send(news({name: value for name, (_, value) in values.items()}))
            self._own += [_letter(reply.number, reply.problem) for reply in replies if not reply.pressed]
            while self._own:
                await self._send(self._own.popleft())

    async def _send(self, message: dict[str, Any]) -> None:
        text = as_json(message)
        self._line.note("heard", text)
        await self._visitor.send_text(text.decode())


def _letter(number: int | None, problem: Problem | None) -> dict[str, Any]:
    given = {} if number is None else {"id": number}
    if problem is None:
        return {"type": "done", **given}
    return {"type": "problem", **given, "problem": problem.model_dump()}


async def _refuse(visitor: WebSocket, problem: Problem) -> None:
    """Send the problem document, then close with its detail."""
    with contextlib.suppress(WebSocketDisconnect):
        await visitor.send_text(as_json(_letter(None, problem)).decode())
    await close(visitor, POLICY, problem.detail)
