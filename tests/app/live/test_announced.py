"""What a program announces in a page: its state, its words and its buttons, and what it hears of a press."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fake_browser import FakeBrowser
from live_code import code_of, fail_network
from live_server import wait_for

import kin
from app.live.announced import Announcement, Button
from app.live.client import RefusedError
from app.live.line import Line, Program
from app.shared.security import Rights

WEIGH = {"name": "weigh", "label": "Weigh"}
ENABLE = {"name": "enable", "label": "Enable", "confirm": "The arm will follow at up to 20 deg/s."}
STOP = {"name": "stop", "label": "Stop", "stops": True}


class Listener:
    """A program that is connected, and the presses that it has heard."""

    def __init__(self, arm: Any) -> None:
        self.arm = arm
        self.pressed: list[str] = []
        threading.Thread(target=self._listen, args=(arm.events(),), daemon=True).start()

    def _listen(self, events: Iterator[Any]) -> None:
        for event in events:
            if event.kind == "pressed":
                self.pressed.append(event.value)


@pytest.fixture
def program(viewer, page) -> Iterator[Listener]:
    with kin.connect(f"http://127.0.0.1:{viewer}", code_of(page), name="scale.py") as arm:
        yield Listener(arm)


def announce(page: FakeBrowser, program: Listener, *given: Any, **named: Any) -> int:
    """Announce something, and return the number by which presses name it."""
    program.arm.announce(*given, **named)
    page.wait(lambda: "data-announced=" in page.html)
    page.settle()
    found = re.search(r'data-argument="(\d+)"', page.html)
    return 0 if found is None else int(found[1])


def press(page: FakeBrowser, event: str, name: str, number: int) -> None:
    """Press a button, as static/lesson.js does."""
    page.say("feature", ["connect", [event, name, len(page.log)], number])
    page.settle()


def test_the_card_shows_state_words_and_buttons_and_the_program_hears_a_press(page, program):
    number = announce(page, program, "Nothing lies on <it>.", [WEIGH, ENABLE, STOP], state="stopped")
    assert 'data-announced="stopped"' in page.html
    assert "Stopped" in page.html
    assert "Nothing lies on &lt;it&gt;." in page.html
    assert 'data-confirm="The arm will follow at up to 20 deg/s."' in page.html
    assert "Disconnect" in page.html, "Stop is what the program has called so"
    press(page, "press", "weigh", number)
    press(page, "confirm", "enable", number)
    press(page, "halt", "stop", number)
    wait_for(lambda: program.pressed == ["weigh", "enable", "stop"])
    program.arm.announce(None)
    page.wait(lambda: "data-announced=" not in page.html)
    assert "scale.py is connected." in page.html


def test_a_press_without_its_question_or_of_something_else_is_not_passed_on(page, program):
    number = announce(page, program, "Ready.", [WEIGH, ENABLE, STOP])
    for event, name in (
        ("press", "enable"),
        ("halt", "enable"),
        ("confirm", "weigh"),
        ("halt", "weigh"),
        ("press", "x"),
    ):
        press(page, event, name, number)
    press(page, "press", "weigh", number)
    wait_for(lambda: program.pressed == ["weigh"])


def test_a_press_counts_for_what_was_shown_but_stop_counts_always(page, program):
    before = announce(page, program, "Ready.", [WEIGH, STOP])
    program.arm.announce("Ready again.", [WEIGH, STOP])
    page.wait(lambda: "Ready again." in page.html)
    press(page, "press", "weigh", before)
    assert "has changed what it offers" in page.html
    press(page, "halt", "stop", before)
    wait_for(lambda: program.pressed == ["stop"])


def test_what_stops_a_driven_arm_is_in_the_frame_of_the_page(page, program):
    announce(page, program, "It follows.", [WEIGH, STOP], state="enabled")
    assert page.shown["stop"] == ["", ""]
    program.arm.drives = "SO-101"
    page.wait(lambda: page.shown["stop"] == ["stop", "Stop"])
    program.arm.announce("It rests.", [WEIGH])
    page.wait(lambda: page.shown["stop"] == ["", ""])


def test_what_was_announced_comes_back_with_the_connection_and_leaves_with_the_program(page, program):
    number = announce(page, program, "It rests: joint 2 is held.", [WEIGH], state="stopped")
    fail_network(program.arm)
    page.wait(lambda: f'data-argument="{number}"' not in page.html and 'data-announced="stopped"' in page.html)
    program.arm.close()
    page.wait(lambda: "data-announced=" not in page.html)
    page.wait(lambda: "scale.py has left" in page.html)
    assert "It rests: joint 2 is held." in page.html, "why, is still to be read"


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"words": ""}, "announce.words"),
        ({"words": "\u200b"}, "announce.words"),
        ({"words": "x" * 301}, "announce.words"),
        ({"words": "x", "state": "happy"}, "announce.state"),
        ({"words": "x", "color": "red"}, "announce.color"),
        ({"words": "x", "buttons": [WEIGH] * 2}, "announce.buttons[1].name"),
        ({"words": "x", "buttons": [{**WEIGH, "name": f"b{i}"} for i in range(5)]}, "announce.buttons"),
        ({"words": "x", "buttons": [{**WEIGH, "name": "No <b>"}]}, "announce.buttons[0].name"),
        ({"words": "x", "buttons": [{**WEIGH, "label": "x" * 25}]}, "announce.buttons[0].label"),
        ({"words": "x", "buttons": [{**STOP, "confirm": "Sure?"}]}, "announce.buttons[0].confirm"),
    ],
)
def test_what_cannot_be_announced_is_refused_with_its_field(page, program, given, field):
    with pytest.raises(RefusedError) as refused:
        program.arm._ask(announce=given)
    assert [error["field"] for error in refused.value.problem["errors"]] == [field]
    assert "data-announced=" not in page.html


def test_a_press_does_not_outlive_the_connection_that_it_was_made_for():
    line = Line("CODE", kin.get_robot("ur5"), lambda *_: None)
    said = Announcement("Ready.", "ready", (Button("go", "Go"), Button("stop", "Stop", stops=True)))
    first, again = Program("arm.py", "1", lambda: None), Program("arm.py", "1", lambda: None)
    line.connect(first)
    line.send({"announce": said})
    assert line.press("go", said)
    assert not line.press("go"), "only what stops something goes without the announcement"
    line.connect(again)
    assert line.replies() == []
    assert line.press("stop")
    assert [reply.pressed for reply in line.replies()] == ["stop"]
    line.disconnect(again)
    assert not line.press("stop")


def test_a_page_that_may_only_look_presses_nothing():
    assert not Rights.LOOK.allow_message("feature")
    assert Rights.FULL.allow_message("feature")


def test_the_example_of_the_documents_runs(page, program):
    document = (Path(__file__).parents[3] / "docs/connect.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```py\n(events = page\.events.*?)```", document, re.DOTALL)
    done = threading.Thread(target=exec, args=(compile(example, "example", "exec"), {"page": program.arm}))
    done.start()
    page.wait(lambda: "The scale is empty." in page.html)
    (number,) = set(re.findall(r'data-argument="(\d+)"', page.html))
    press(page, "confirm", "drop", int(number))
    page.wait(lambda: "Busy with drop." in page.html)
    done.join(10.0)
    assert not done.is_alive()
