"""The channel of a page: what it takes, what it refuses, and what comes through a lost connection."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
from collections.abc import Callable, Coroutine
from concurrent.futures import CancelledError
from types import SimpleNamespace
from typing import Any, cast

import pytest
from viser._messages import LocalStorageGetItemResponseMessage

from app.shared.connection import ConnectionEnded
from app.shared.security import LOOKS, Rights
from app.viewer.panel.script import Reply
from app.viewer.session.channel import channel as module
from app.viewer.session.channel.channel import MAY_LOOK, REPLACED, WAITING, Channel
from app.viewer.session.events import MESSAGES
from app.viewer.viser_patches import MARK, hear_marks


class Line:
    """A page's end of a connection: what it says, and what it has been sent."""

    def __init__(self, rights: Rights = Rights.FULL) -> None:
        self.rights = rights
        self.sent: list[dict[str, Any]] = []
        self._says: asyncio.Queue[str | ConnectionEnded] = asyncio.Queue()

    def say(self, *message: object) -> None:
        self._says.put_nowait(json.dumps(message))

    def say_text(self, text: str) -> None:
        self._says.put_nowait(text)

    def cut(self) -> None:
        self._says.put_nowait(ConnectionEnded(1006))

    async def receive(self) -> str:
        found = await self._says.get()
        if isinstance(found, ConnectionEnded):
            raise found
        return found

    async def send(self, text: str) -> None:
        self.sent.append(json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON")))

    @property
    def notices(self) -> list[tuple[int, str, Any]]:
        return [tuple(each) for text in self.sent for each in text.get("notices", [])]


class Page:
    """A channel with what it has posted."""

    def __init__(self, rights: Rights = Rights.FULL) -> None:
        self.posted: list[tuple[Any, object]] = []
        self.channel = Channel(lambda key, value: self.posted.append((key, value)), rights)
        self.ends: list[asyncio.Task[ConnectionEnded]] = []

    def connect(self, rights: Rights = Rights.FULL) -> Line:
        line = Line(rights)
        loop = asyncio.get_running_loop()
        self.ends.append(loop.create_task(self.channel.serve(line, loop.call_soon_threadsafe)))
        return line

    async def end(self, which: int = -1) -> ConnectionEnded:
        return await asyncio.wait_for(self.ends[which], 5)

    async def leave(self) -> None:
        self.channel.close()
        await asyncio.wait(self.ends, timeout=5)


async def rest() -> None:
    """Let everything happen that waits for nothing."""
    for _ in range(20):
        await asyncio.sleep(0)


def run(play: Callable[[Page], Coroutine[Any, Any, None]], rights: Rights = Rights.FULL) -> Page:
    async def whole() -> Page:
        page = Page(rights)
        await play(page)
        await page.leave()
        return page

    return asyncio.run(whole())


def test_messages_are_posted_once_and_in_order_over_two_connections() -> None:
    async def play(page: Page) -> None:
        first = page.connect()
        first.say(1, "jog", ["tool", 0, 1, 10])
        first.say(2, "snap", True)
        await rest()
        assert page.channel.silence() < 5.0
        first.cut()
        assert (await page.end()).code == 1006
        second = page.connect()
        second.say(2, "snap", True)  # its confirmation was lost
        second.say(3, "snap", False)
        await rest()
        assert [text["heard"] for text in second.sent][:1] == [2], "what has arrived is said first"

    assert run(play).posted == [
        (("message", "jog", 1), ["tool", 0, 1, 10]),
        (("message", "snap", 2), True),
        (("message", "snap", 3), False),
    ]


def test_notices_come_again_until_they_are_confirmed_and_values_are_the_newest() -> None:
    async def play(page: Page) -> None:
        first = page.connect()
        await rest()
        page.channel.show("history", ["a", ""])
        page.channel.show("history", ["b", ""])
        page.channel.reply(Reply(1, "no"))
        page.channel.reply(Reply(2, ""))
        await rest()
        assert [text["set"] for text in first.sent if "set" in text] == [{"history": ["b", ""]}]
        assert first.notices == [(1, "reply", [1, "no", []]), (2, "reply", [2, "", []])]
        first.say("heard", 1)
        await rest()
        first.cut()
        await page.end()
        second = page.connect()
        await rest()
        assert second.sent[0]["set"] == {"history": ["b", ""]}
        assert second.notices == [(2, "reply", [2, "", []])]
        page.channel.show("history", ["b", ""])
        await rest()
        assert len(second.sent) == 1, "an equal value is not sent"

    run(play)


def test_the_newest_connection_of_a_page_is_served_also_where_the_old_one_ends_later() -> None:
    async def play(page: Page) -> None:
        page.connect()
        await rest()
        new = page.connect()
        assert (await page.end(0)).code == REPLACED
        await rest()
        page.channel.show("key", 1)
        new.say(1, "axes", None)
        await rest()
        assert new.sent[-1]["set"] == {"key": 1}

    assert run(play).posted == [(("message", "axes", 1), None)]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", 1007),
        ("{}", 1007),
        ("[]", 1007),
        ('[1, "snap"]', 1007),
        ('[true, "snap", 1]', 1007),
        ('[0, "snap", 1]', 1007),
        ('[1.0, "snap", 1]', 1007),
        (f'[{2**53}, "snap", 1]', 1007),
        (f'[{"9" * 5000}, "snap", 1]', 1007),
        ('[1, ["snap"], 1]', 1007),
        ('[1, "snap", NaN]', 1007),
        ('[1, "snap", Infinity]', 1007),
        ('[1, "snap", 1e999]', 1007),
        ('[1, "snap", "\\ud800"]', 1007),
        (f'[1, "snap", {"[" * 40}{"]" * 40}]', 1007),
        (f'[1, "snap", {"[" * 60_000}]', 1007),
        (f'[1, "snap", [{"0," * 20_001}0]]', 1007),
        (f'[1, "snap", "{"x" * 65_536}"]', 1007),
        ('[1, "hold", 1]', 1008),
        ('[1, "gizmo", 1]', 1008),
        ('[1, "robot", "ur5"]', 1008),
        ('[1, "undo", null, false]', 1007),
        ('[1, "undo", null, true, true]', 1007),
    ],
    ids=lambda value: f"{value!s:.30}",
)
def test_bad_input_ends_its_connection_in_words_and_reaches_neither_page_nor_log(
    text: str, code: int, caplog: pytest.LogCaptureFixture
) -> None:
    async def play(page: Page) -> None:
        line = page.connect()
        line.say_text(text)
        end = await page.end()
        assert end.code == code
        assert end.reason
        assert len(end.reason.encode()) <= 123, "a close frame takes no more"
        again = page.connect()
        again.say(1, "snap", True)
        await rest()

    assert run(play).posted == [(("message", "snap", 1), True)], "the page goes on"
    assert not caplog.records


@pytest.mark.parametrize("door", ["page", "connection"])
def test_who_may_only_look_is_answered_and_changes_nothing(door: str) -> None:
    looking = Rights.LOOK

    async def play(page: Page) -> None:
        line = page.connect(looking if door == "connection" else Rights.FULL)
        for number, name in enumerate(acts, 1):
            line.say(number, name, "hello")
        await rest()
        replies = [value for _, _, value in line.notices]
        assert replies == [[number, MAY_LOOK, []] for number in range(1, len(acts) + 1)]
        for number, name in enumerate(looks, len(acts) + 1):
            line.say(number, name, "value")
        await rest()

    looks, acts = ([name for name in MESSAGES if (name in LOOKS) == look] for look in (True, False))
    posted = run(play, looking if door == "page" else Rights.FULL).posted
    passed = [(("message", name, number), "value") for number, name in enumerate(looks, len(acts) + 1)]
    assert posted == passed, "what only changes how the page shows things"


def test_what_a_page_remembers_comes_first_and_counts_once_whatever_its_rights() -> None:
    async def play(page: Page) -> None:
        line = page.connect(Rights.LOOK)
        line.say(1, "hello", {"state": "abc"})
        line.say(2, "hello", {"state": "other"})
        await rest()
        assert page.channel.hello(0.0) == {"state": "abc"}

    assert run(play, Rights.LOOK).posted == []


def test_a_page_that_leaves_or_says_nothing_is_not_awaited_for_ever() -> None:
    channel = Channel(lambda *_: None)
    with pytest.raises(TimeoutError):
        channel.hello(0.0)
    channel.close()
    with pytest.raises(CancelledError):
        channel.hello(5.0)


def test_a_value_that_no_page_could_read_is_the_error_of_who_shows_it() -> None:
    channel = Channel(lambda *_: None)
    with pytest.raises(ValueError, match="JSON"):
        channel.show("key", math.nan)
    with pytest.raises(ValueError, match="JSON"):
        channel.notify("reply", [math.inf])


def test_a_page_that_confirms_nothing_fills_no_memory() -> None:
    async def play(page: Page) -> None:
        for k in range(2 * module.KEPT):
            page.channel.reply(Reply(k, ""))
        line = page.connect()
        await rest()
        assert [number for number, *_ in line.notices] == list(range(module.KEPT + 1, 2 * module.KEPT + 1))

    run(play)


def test_a_beat_comes_by_itself_and_when_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(page: Page) -> None:
        line = page.connect()
        await rest()
        assert len(line.sent) == 1
        line.say("ask")
        await rest()
        assert line.sent[1] == {"heard": 0}
        monkeypatch.setattr(module, "BEAT", 0.0)
        line.say("ask")
        await rest()
        await asyncio.sleep(0.001)
        await rest()
        assert len(line.sent) > 4

    run(play)


def test_a_closed_session_ends_its_connections() -> None:
    async def play(page: Page) -> None:
        page.connect()
        await rest()
        page.channel.close()
        assert (await page.end()).code == 1001
        page.connect()
        assert (await page.end()).code == 1001

    run(play)


def test_values_of_one_step_come_together_with_the_message_that_they_follow() -> None:
    async def play(page: Page) -> None:
        line = page.connect()
        await rest()
        with page.channel.step(3):
            page.channel.show("a", 1)
            await rest()
            page.channel.show("b", 2)
            page.channel.reply(Reply(3, ""))
            await rest()
            assert len(line.sent) == 1
        await rest()
        assert line.sent[1:] == [
            {"heard": 0, "done": 3, "set": {"a": 1, "b": 2}, "notices": [[1, "reply", [3, "", []]]]}
        ]
        with page.channel.step(0):
            await rest()
        with page.channel.step(4):
            pass
        await rest()
        assert line.sent[2:] == [{"heard": 0, "done": 4}]

    run(play)


def test_what_a_step_holds_back_is_looked_at_under_the_lock() -> None:
    class Guarded(Channel):
        def __getattribute__(self, name: str) -> Any:
            if name in ("_held", "_due"):
                assert object.__getattribute__(self, "_lock").locked(), name
            return super().__getattribute__(name)

    async def play(page: Page) -> None:
        page.channel = Guarded(lambda *_: None)
        line = page.connect()
        await rest()
        for held in (contextlib.nullcontext(), page.channel.step(1)):
            with held:
                page.channel.show("a", 1)
                page.channel.forget("a")
                page.channel.notify("b", 2)
        await rest()
        assert [value for *_, value in line.notices] == [2, 2]

    run(play)


def test_a_key_that_is_forgotten_has_no_value_in_the_page_and_is_not_sent_again() -> None:
    async def play(page: Page) -> None:
        line = page.connect()
        page.channel.show("a", 1)
        await rest()
        page.channel.forget("a")
        page.channel.forget("none such")
        await rest()
        assert [text.get("set") for text in line.sent] == [{"a": 1}, {"a": None}]
        again = page.connect()
        await rest()
        assert "set" not in again.sent[0]

    run(play)


# Marks in viser's connection


def numbers(page: Page) -> list[int]:
    return [key[2] for key, _ in page.posted]


def test_a_message_with_a_mark_and_all_after_it_wait_for_the_mark() -> None:
    async def play(page: Page) -> None:
        line = page.connect()
        line.say(1, "jog", None)
        line.say(2, "undo", None, True)
        line.say(3, "jog", None)
        line.say(4, "released", None, True)
        await rest()
        assert numbers(page) == [1]
        await page.channel.mark(2)
        assert numbers(page) == [1, 2, 3]
        for number in (4, 4, 1):
            await page.channel.mark(number)
        assert numbers(page) == [1, 2, 3, 4]

    run(play)


def test_a_message_that_comes_after_its_mark_over_another_connection_counts_once() -> None:
    async def play(page: Page) -> None:
        line = page.connect()
        line.say(1, "undo", None, True)
        await rest()
        line.cut()
        await page.end()
        await page.channel.mark(2)
        again = page.connect()
        for _ in range(2):
            again.say(1, "undo", None, True)
            again.say(2, "redo", None, True)
        await rest()
        assert numbers(page) == [1, 2]

    run(play)


def test_what_follows_a_mark_waits_for_its_message_as_long_as_there_is_a_connection() -> None:
    async def play(page: Page) -> None:
        line = page.connect()
        await rest()
        heard, lost = (asyncio.ensure_future(page.channel.mark(number)) for number in (2, 3))
        line.say(1, "jog", None)
        await rest()
        assert not heard.done()
        line.say(2, "undo", None, True)
        await rest()
        assert heard.done()
        assert not lost.done()
        line.cut()
        await rest()
        assert lost.done()

    run(play)


def test_where_marks_cannot_be_heard_none_is_awaited() -> None:
    async def play(page: Page) -> None:
        page.channel = Channel(lambda key, value: page.posted.append((key, value)), marks=False)
        page.connect().say(1, "undo", None, True)
        await rest()
        assert numbers(page) == [1]

    run(play)


def test_a_page_that_never_sends_a_mark_fills_no_memory() -> None:
    async def play(page: Page) -> None:
        line = page.connect()
        for number in range(1, WAITING + 2):
            line.say(number, "undo", None, True)
        end = await page.end()
        assert (end.code, numbers(page)) == (1008, [])
        await page.channel.mark(WAITING)
        assert numbers(page) == list(range(1, WAITING + 1))

    run(play)


@pytest.mark.parametrize(
    "answer",
    [
        {"request_uuid": "other", "value": "1"},
        {"value": None},
        {"value": "-1"},
        {"value": "1.0"},
        {"value": "9" * 17},
        {"value": "\N{SUPERSCRIPT ONE}"},
        {"value": "1", "error": "no"},
    ],
)
def test_of_the_answers_about_storage_only_marks_are_heard(answer: dict[str, Any]) -> None:
    heard: list[int] = []
    handlers: list[Callable[[int, Any], Coroutine[Any, Any, None]]] = []

    async def act(number: int) -> None:
        heard.append(number)

    line = SimpleNamespace(register_handler=lambda kind, act: handlers.append(act))
    hear_marks(cast(Any, SimpleNamespace(_websock_connection=line)), act)
    (hear,) = handlers
    fields = {"value": "7", "error": None, "request_uuid": MARK} | answer
    asyncio.run(hear(0, LocalStorageGetItemResponseMessage(**fields)))
    assert heard == ([1] if answer.get("error") else [])
    asyncio.run(hear(0, LocalStorageGetItemResponseMessage("7", None, MARK)))
    assert heard[-1] == 7
