"""The table of events: every event that anything posts has a row, and every row is used."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.live import EVENTS
from app.shared.security import HELLO
from app.viewer.session.events import (
    FENCE,
    LONG_PAUSE,
    MESSAGES,
    RULES,
    SHORT_PAUSE,
    Rule,
    belongs_before,
    name_of,
    pause_within,
)

ROOT = Path(__file__).parents[4]
VIEWER = ROOT / "app" / "viewer"
# Here `post` is the page's. Elsewhere it is a feature's, and only `stage.post` is the page's.
OF_THE_PAGE = ("panel", "scene", "session", "shown.py")
BY_A_FEATURE = re.compile(r"stage\.post$")
IN_A_PAGE = re.compile(r"(^|\.)(_?post|listen|listen_click)$")


def first(node: ast.expr) -> Iterator[str]:
    """The names with which the keys of an argument begin."""
    match node:
        case ast.Constant(str(name)):
            yield name
        case ast.Tuple([ast.Constant(str(name)), *_]):
            yield name
        case ast.Dict(values=values):
            for value in values:
                yield from first(value)
        case ast.DictComp(value=value) | ast.Starred(value=value):
            yield from first(value)
        case ast.IfExp(body=body, orelse=other):
            yield from first(body)
            yield from first(other)


def posted(source: str, inside: bool) -> Iterator[str]:
    """The names of the events that a module posts; `inside`: whether its `post` is the page's."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Call(func=func, args=args) if (IN_A_PAGE if inside else BY_A_FEATURE).search(
                ast.unparse(func)
            ):
                place = 2 if ast.unparse(func).startswith("listen") else 0
                for key in args[place : place + 1]:
                    yield from first(key)
            case ast.Call(func=ast.Name("Buttons"), args=[_, events, *_]) if inside:
                yield from first(events)
            case ast.Assign([ast.Name("key")], value) if inside:
                yield from first(value)


SENDS = (
    r'\bsend\("([\w-]+)"',
    r'\bsend\([^"\n]*\? "([\w-]+)" :',
    r'\bsend\([^"\n]*\? "[\w-]+" : "([\w-]+)"',
    r'\bsend, \w+, "([\w-]+)"',  # after a time
    r'detail: \["([\w-]+)"',
    r'data-send="([\w-]+)"',
)


def sent() -> set[str]:
    """The names of the messages that the page's own scripts send."""
    paths = (*(ROOT / "static").glob("*.js"), ROOT / "static/viewer.html", *(VIEWER / "views").rglob("*.html"))
    texts = [path.read_text(encoding="utf-8") for path in paths if path.name != "landing.js"]  # not in the viewer
    return {name for text in texts for pattern in SENDS for name in re.findall(pattern, text) if name}


def events() -> set[str]:
    """The names of all events, without what only wraps a message."""
    found = {FENCE, *EVENTS} | sent() - {HELLO}  # which the channel keeps to itself
    for path in VIEWER.rglob("*.py"):
        inside = path.relative_to(VIEWER).parts[0] in OF_THE_PAGE
        found |= set(posted(path.read_text(encoding="utf-8"), inside))
    return found - {"message"}


@pytest.mark.full
def test_every_event_that_is_posted_has_a_rule_and_every_rule_an_event() -> None:
    assert events() == set(RULES)


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ('listen(self._menu, post, "robot")', {"robot"}),
        ('listen(slider, post, ("joint", i))', {"joint"}),
        (
            'listen_click(group, post, {"Home": "home", **{side: ("look-from", side) for side in SIDES}})',
            {"home", "look-from"},
        ),
        ('key = "grab" if start else "gizmo"', {"grab", "gizmo"}),
        ('self._page.post("new", 3)', {"new"}),
        ('Buttons("Camera", {"Fit arm": ("fit-arm",), "Reset view": ("camera",)})', {"fit-arm", "camera"}),
    ],
)
def test_the_search_for_events_finds_all_ways_to_post(source: str, names: set[str]) -> None:
    assert set(posted(source, inside=True)) == names


def test_the_script_sends_what_the_table_lists_as_messages() -> None:
    assert sent() == {HELLO, *MESSAGES}


@pytest.mark.parametrize(("name", "rule"), RULES.items())
def test_a_rule_does_not_contradict_itself(name: str, rule: Rule) -> None:
    assert not rule.label or rule.step  # undo would never show it
    assert not rule.gradual or rule.step
    assert not rule.answered or rule.message
    assert rule.label or not rule.step or name in ("joint", "feature")  # these say what undo calls them


def test_the_name_of_a_message_is_that_of_its_event() -> None:
    assert [name_of(key) for key in ("home", ("joint", "ur5", 0), ("message", "nudge", 7))] == [
        "home",
        "joint",
        "nudge",
    ]


@pytest.mark.parametrize(
    ("gesture", "value", "pause"),
    [
        (("gizmo",), None, math.inf),
        (("joint", "ur5", 0, 0), 3.0, LONG_PAUSE),
        (("home",), None, 0.0),
        (("feature", "workspace", "size"), 3, SHORT_PAUSE),
        (("feature", "workspace", "on"), True, 0.0),
        (("feature", "robot", ("cell", 2, "a")), "1", LONG_PAUSE),
        (("feature", "robot", ("cell", 2, "kind")), "prismatic", 0.0),
        (("feature", "obstacles", ("drag", ("on_drag",), 1)), None, math.inf),
    ],
)
def test_how_long_a_step_may_pause(gesture: tuple[object, ...], value: object, pause: float) -> None:
    assert pause_within(gesture, value) == pause


@pytest.mark.parametrize(
    ("gesture", "expected"),
    [
        (("feature", "robot", ("meshes", 3)), True),
        (("feature", "learn", ("done", ())), True),
        (("feature", "workspace", ("capability", ("do", ("on_start",), 1, 0))), False),
        (("feature", "workspace", "done"), False),
        (("feature", "robot", ("cell", 2, "a")), False),
        (("joint", "ur5", ("done", ())), False),
    ],
)
def test_the_end_of_work_completes_what_the_visitor_did(gesture: tuple[object, ...], expected: bool) -> None:
    assert belongs_before(gesture) is expected
