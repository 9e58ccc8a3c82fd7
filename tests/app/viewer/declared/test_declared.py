"""Laws of declared settings, and what the reconcilers of panel and scene send."""

from __future__ import annotations

import ast
import inspect
import json
import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import pytest
from arms import CLASSICS
from bare_page import STORE, BarePage, bare_page, controls_of, nodes_of

from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import (
    Choice,
    Index,
    Kept,
    Number,
    Part,
    Settings,
    Spec,
    Text,
    Vector,
    choice,
    flag,
    joint,
    number,
    part,
    slider,
    vector,
)
from app.viewer.declared.panel import Button, Buttons, Control, Folder, Html, Native, Node, Progress
from app.viewer.declared.scene import Lazy, SceneView, arrows, axes, bars, frame, label
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.session.choices import PageChoices
from app.viewer.tabs.robot.calibrate.feature import CalibrateSettings
from app.viewer.tabs.workspace.capability.settings import MapSettings
from app.viewer.tabs.workspace.settings import WorkspaceSettings
from kin import InputError
from kin.units import DEFAULT_UNITS, Units

DECLARED = tuple(lesson for lesson in LESSONS if issubclass(lesson, DeclaredFeature))
CLASSES = (
    *(lesson.settings_of for lesson in DECLARED),
    MapSettings,
    WorkspaceSettings,
    PageChoices,
    CalibrateSettings,
)
UNITS = (DEFAULT_UNITS, Units(False, "cm"), Units(True, "m"))
JUNK = (
    None,
    True,
    math.nan,
    math.inf,
    -math.inf,
    "junk",
    -1e99,
    [],
    {},
    [1, 2],
    [math.nan] * 3,
    {"on": 5},
    10**400,
)


def leaves(settings_of: type[Settings], prefix: str = "") -> Iterator[tuple[str, Spec]]:
    """The paths of all fields with a value of their own, and what they declare."""
    for name, spec in settings_of.specs():
        if isinstance(spec, Part):
            yield from leaves(spec.of, f"{prefix}{name}.")
        elif isinstance(spec, Vector):
            yield from ((f"{prefix}{name}.{k}", settings_of.spec(f"{name}.{k}")) for k in range(len(spec.labels)))
        else:
            yield prefix + name, spec


# Laws of settings


@pytest.mark.parametrize("settings_of", CLASSES, ids=lambda each: each.__name__)
def test_links_give_back_the_settings_and_ignore_what_they_do_not_know(settings_of: type[Settings]) -> None:
    for robot in CLASSICS:
        fresh = settings_of.fresh(robot)
        state = json.loads(json.dumps(fresh.state(), allow_nan=False))
        assert fresh.restored(state, robot) == fresh
        assert fresh.restored({**state, "unknown": 5}, robot) == fresh
        for junk in JUNK:
            assert fresh.restored(junk, robot) == fresh or junk == {"on": 5}
            for name, spec in settings_of.specs():
                found = fresh.restored({name: junk}, robot)
                if spec.link and not isinstance(spec, Part | Kept) and found != fresh:
                    assert spec.unpack(name, junk, robot) == found.value_at(name)
                assert json.loads(json.dumps(found.state(), allow_nan=False)) == found.state()


@pytest.mark.parametrize("settings_of", CLASSES, ids=lambda each: each.__name__)
def test_controls_read_what_they_show_and_refuse_the_rest(settings_of: type[Settings]) -> None:
    for robot in CLASSICS:
        fresh = settings_of.fresh(robot)
        for path, spec in leaves(settings_of):
            for units in UNITS:
                if not spec.kind:
                    continue
                values = list(spec.offered(robot).values()) if isinstance(spec, Choice) else [fresh.value_at(path)]
                for value in values:
                    read = spec.read(path, spec.shown(value, robot, units), robot, units)
                    assert read == (pytest.approx(value, abs=1e-3) if isinstance(spec, Number) else value)
                for junk in (["junk"], None, math.nan, {}):
                    with pytest.raises(InputError, match=path.rpartition(".")[2]):
                        spec.read(path.rpartition(".")[2], junk, robot, units)


# A feature of tests


@dataclass(frozen=True)
class Force(Settings):
    on: bool = flag("On", undo="Force")
    parts: tuple[float, float] = vector(("Fx, N", "Fy, N"), (1.0, 2.0), Number(limits=(-5.0, 5.0), digits=2))


@dataclass(frozen=True)
class Knobs(Settings):
    frame: str | None = choice("Frame", {"Base": "base", "None": None}, "base", none="none", old={"world": "base"})
    step: float = number("Step", 0.005, (1e-4, 0.1), "length", hint="How far")
    count: int = slider("Count", lambda robot: robot.n, (0, 9), whole=True)
    joint: int | None = joint()
    runs: bool = flag("Run", link=False, renew=True)
    force: Force = part(Force)


@dataclass(frozen=True, eq=False)
class Sums(Facts[Knobs]):
    @cached_property
    def total(self) -> float:
        return float(np.abs(self.q).sum()) + self.settings.step


class Toy(DeclaredFeature[Knobs, Sums]):
    key, title, settings_of, facts_of = "toy", "Toy", Knobs, Sums
    undo = {"on_add": "Add"}  # noqa: RUF012
    rendered = 0

    def started(self) -> None:
        self.said: list[object] = []
        self.frames = 0

    def panel(self) -> Sequence[Node]:
        s = self.settings
        more = [Html(str, ("more",), key="more")] if s.runs else []
        return [
            *more,
            Control("frame"),
            Folder("Amounts", [Control("step"), Control("count", of=self.stage.arm.now.robot.id)]),
            Html(self.render, (round(self.read.total, 6), self.stage.display.units)),
            Control("force.parts.1", label="Sideways, N", visible=s.force.on),
            Button("Add", self.event(self.on_add, 1), hold=10.0),
            Buttons("Go", {"a": self.event(self.on_go, "a"), "b": self.event(self.on_go, "b")}, offered=("a",)),
            Progress(50.0),
        ]

    def scene(self) -> Sequence[SceneNode | Lazy]:
        f, s = self.facts, self.settings
        parts = [arrows("arrow", np.array([[np.zeros(3), f.T[:3, 2]]]), (200, 0, 0), (0.01, 0.02, 0.05))]
        if s.force.on:
            parts.append(label("name", f"{s.step}", np.zeros(3)))
        return [frame("tool", *parts, position=f.T[:3, 3]), axes("base", np.eye(4), 0.1, 0.01), self.lazy()]

    def lazy(self) -> Lazy:
        return Lazy("lazy", self.far, (self.settings.step,))

    def far(self, step: float) -> list[SceneNode]:
        self.frames += 1
        return [label("far", f"{step}", np.ones(3))] if step > 0.01 else []

    def render(self, total: float, units: Units) -> str:
        self.rendered += 1
        return f"Σ {total} {units.length}"

    def changed(self, path: str) -> None:
        self.said.append(path)

    def on_add(self, amount: int) -> None:
        self.change(count=self.settings.count + amount)

    def on_go(self, where: str) -> None:
        self.said.append(where)


@pytest.fixture
def page() -> Iterator[BarePage]:
    with bare_page(STORE.get("ur5")) as found:
        yield found


def handles(page: BarePage) -> dict[str, Any]:
    return dict(controls_of(page.client.gui))


def test_the_panel_shows_what_is_declared_and_controls_survive(page: BarePage) -> None:
    toy = page.open(Toy)
    first = handles(page)
    assert [item.get("label", item["kind"]) for item in page.panel()] == [
        "Frame",
        "Amounts",
        "GuiHtmlHandle",
        "Add",
        "Go",
        "GuiProgressBarHandle",
    ]
    assert page.panel()[4]["options"] == ["a"]
    page.set("Step, mm", 12.5)
    page.rest()
    assert toy.settings.step == 0.0125
    assert toy.said == ["step"]
    toy.change(runs=True, force=replace(toy.settings.force, on=True))
    toy.refresh()
    assert page.panel()[0]["content"] == "more"
    assert [item.get("label") for item in page.panel()][4] == "Sideways, N"
    after = handles(page)
    assert {name: after[name] for name in first} == first, "nothing that stays was made anew"
    page.set("Step, mm", 0.01)
    with pytest.raises(InputError, match=r"step: got 0\.01, expected a number from 0\.1 to 100"):
        page.rest()
    assert toy.settings.step == 0.0125
    toy.remove()
    assert page.panel() == []
    assert page.scene() == []


def test_a_value_is_not_sent_back_to_the_control_that_sent_it(page: BarePage) -> None:
    toy = page.open(Toy)
    page.watch()
    page.set("Count", 3)
    page.rest()
    assert toy.settings.count == 3
    assert page.sent == []
    toy.change(count=4)
    toy.refresh()
    assert page.control("Count").value == 4


def test_a_value_that_was_overwritten_before_it_arrived_is_shown_again(page: BarePage) -> None:
    toy = page.open(Toy)
    page.answer()
    page.set("Count", 3)  # waits
    toy.change(count=5)  # as a motion does, with each of its frames
    toy.refresh()
    assert page.control("Count").value == 5
    page.rest()
    assert toy.settings.count == 3
    page.answer()
    assert page.control("Count").value == 3

    page.watch()
    page.set("Count", 4)
    page.rest()
    page.answer()
    assert page.sent == [], "nothing was under way"
    toy.change(count=5)
    toy.refresh()  # this message is under way while the visitor sets a value
    page.watch()
    page.set("Count", 4)
    page.rest()
    assert page.sent == [], "the visitor may still move it"
    page.answer()
    assert page.control("Count").value == 4
    assert page.sent == ["GuiUpdateMessage"], "the browser may have shown 5"
    page.answer()
    assert page.sent == ["GuiUpdateMessage"]


def test_what_a_released_slider_shows_is_sent_once_more(page: BarePage) -> None:
    toy = page.open(Toy)
    page.answer()
    page.set("Count", 3)
    page.rest()
    toy.change(count=5)  # the page shows it in no slider that is held
    toy.refresh()
    page.answer()
    page.watch()
    page.fence.released()
    page.answer()
    assert page.sent == ["GuiUpdateMessage"]
    assert page.control("Count").value == 5
    page.fence.released()
    page.answer()
    assert page.sent == ["GuiUpdateMessage"]


def test_events_of_controls_that_are_gone_are_void(page: BarePage) -> None:
    toy = page.open(Toy)
    page.set("Step, mm", 50.0)
    page.units = Units(True, "cm")
    toy.on_style()
    page.rest()
    assert toy.settings.step == 0.005
    assert "Step, cm" in handles(page)
    page.set("Count", 2)
    page.change(STORE.get("scara"))
    assert toy.settings.count == 4, "the slider of the last robot"


def test_a_click_on_what_was_just_offered_counts(page: BarePage) -> None:
    toy = page.open(Toy)
    page.press("Go", "b")
    page.rest()
    assert toy.said == ["b"]
    page.press("Add")
    page.press("Add")
    assert toy.step_name(page.events[0][0][2]) == "Add"
    page.rest()
    assert toy.settings.count == 8


class Choosing(DeclaredFeature[Knobs, Sums]):
    key, title, settings_of, facts_of = "choosing", "Choosing", Knobs, Sums

    def panel(self) -> Sequence[Node]:
        go = {"a": self.event(self.on_go), "b": self.event(self.on_go)}
        offered = ("a",) if self.settings.runs else ()
        return [
            Control("runs"),
            Buttons("Go", go, offered=offered),
            Buttons("Home", {"c": self.event(self.on_go)}),
        ]

    def on_go(self) -> None:
        self.change(count=self.settings.count + 1)


def test_a_group_of_buttons_of_which_none_is_offered_is_not_there(page: BarePage) -> None:
    page.open(Choosing)
    assert list(handles(page)) == ["Run", "Home"]
    home = page.control("Home")
    for runs in (True, False):
        page.set("Run", runs)
        page.rest()
        assert ("Go" in handles(page)) == runs
        assert page.control("Home") is home
    page.set("Run", True)
    page.rest()
    assert page.control("Go").options == ("a",)
    page.press("Go", "a")
    page.rest()
    assert page.feature is not None
    assert page.feature.settings.count == 7


class Whole(DeclaredFeature[Knobs, Sums]):
    """Has a part between two texts."""

    key, title, settings_of, facts_of = "whole", "Whole", Knobs, Sums

    @cached_property
    def part(self) -> Toy:
        return self.adopt(Toy(self.stage, self))

    def at(self, order: float) -> Any:
        self.part.place.order = order
        return self.part.place

    def panel(self) -> Sequence[Node]:
        return [Html(str, ("above",)), Native(self.at), Html(str, ("below",))]


def test_a_part_stands_where_it_is_declared_and_does_what_its_whole_does(page: BarePage) -> None:
    whole = page.open(Whole)
    shown = [item.get("label", item.get("content")) for item in page.panel()]
    assert (shown[0], shown[1], shown[-1]) == ("above", "Frame", "below")
    page.set("Step, mm", 12.5)
    page.rest()
    assert whole.part.settings.step == 0.0125, "its events come by the whole"
    assert (whole.settings.step, whole.state()["toy"]["step"]) == (0.005, 0.0125)
    whole.restore({"toy": {"step": 0.02}})
    assert (whole.settings.step, whole.part.settings.step) == (0.005, 0.02)
    page.use(STORE.get("scara"))
    whole.on_robot()
    page.rest()
    assert whole.part.settings.count == 4
    whole.part.schedule(3.0)
    whole.due = 5.0
    assert whole.due == pytest.approx(3.0, abs=0.5), "the whole wakes for its part"
    whole.remove()
    assert page.panel() == []
    assert page.scene() == []


def test_undo_names_and_links(page: BarePage) -> None:
    toy = page.open(Toy)
    assert toy.step_name(("at", "force.on", 3)) == "Force"
    assert toy.step_name(("at", "step", 3)) == "Toy"
    assert toy.state() == {
        "frame": "base",
        "step": 0.005,
        "count": 6,
        "joint": 0,
        "force": {"on": False, "parts": [1.0, 2.0]},
    }
    toy.restore({"frame": "world", "joint": 3, "force": {"on": True, "parts": [9.0, 1.0]}, "step": "far"})
    assert toy.state() == {**toy.state(), "frame": "base", "joint": 3, "force": {"on": True, "parts": [1.0, 2.0]}}
    page.change(STORE.get("scara"))
    assert (toy.settings.joint, toy.settings.count, toy.settings.force.on) == (None, 4, True)


def test_the_scene_is_changed_and_hidden_not_made_again(page: BarePage) -> None:
    toy = page.open(Toy)
    assert [node[0] for node in page.scene()] == ["ArrowHandle", "FrameHandle"] or len(page.scene()) == 2
    toy.change(step=0.05, force=replace(toy.settings.force, on=True))
    toy.refresh()
    assert sorted(node[2]["text"] for node in page.scene() if "text" in node[2]) == ["0.05", "0.05"]
    names = set(nodes_of(page.client.scene))
    for on in (False, True, False):
        toy.change(step=0.05 if on else 0.005, force=replace(toy.settings.force, on=on))
        toy.refresh()
        assert len(page.scene()) == (4 if on else 2)
        assert set(nodes_of(page.client.scene)) == names
    page.change(STORE.get("scara"))
    assert not names & set(nodes_of(page.client.scene)) - {"/WorldAxes"}, "names are never used again"


def test_a_drawing_of_another_kind_takes_the_place_of_one(page: BarePage) -> None:
    """A wrong answer is a bar in one step of a lesson and a frame in the next, and both are called so."""
    view = SceneView(page.client.scene, "copies", page.post)
    ends = np.array([[np.zeros(3), np.ones(3)]])
    kinds = [
        (bars("wrong", ends, (200, 0, 0), 0.01), "LineSegmentsHandle"),
        (axes("wrong", np.eye(4), 0.1, 0.01), "FrameHandle"),
        (label("wrong", "yours", np.zeros(3), anchor=None), "LabelHandle"),
        (label("wrong", "yours", np.zeros(3), anchor="bottom-center"), "LabelHandle"),
        (frame("wrong", label("words", "yours", np.zeros(3))), "FrameHandle"),
        (bars("wrong", ends, (200, 0, 0), 0.01), "LineSegmentsHandle"),
    ]
    names = set[str]()
    for node, kind in kinds:
        view.show([node])
        shown = {name: found for name, found in nodes_of(page.client.scene).items() if "/wrong" in name}
        top = {name for name in shown if name.split("/")[-1].startswith("wrong")}
        assert [type(shown[name]).__name__ for name in top] == [kind]
        assert not names & top, "names are never used again"
        assert len(shown) == 1 + len(node.children)
        names |= top
    view.show([])
    assert [found.visible for name, found in nodes_of(page.client.scene).items() if "/wrong" in name] == [False]


def test_a_frame_sends_only_what_moved_and_renders_nothing_twice(page: BarePage) -> None:
    toy = page.open(Toy)
    rng = np.random.default_rng(1)
    rendered, frames = toy.rendered, toy.frames
    page.watch()
    page.now = replace(page.now, q=page.now.robot.random_q(rng))
    toy.on_arm_changed(page.now.changes(None))
    assert sorted(page.sent) == ["SceneNodeUpdateMessage", "SetPositionMessage"]
    assert (toy.rendered, toy.frames) == (rendered, frames)
    toy.on_arm_changed(page.now.changes(None))
    assert len(page.sent) == 2, "nothing has changed"
    page.rest()
    assert toy.rendered == rendered + 1
    page.sent.clear()
    toy.refresh()
    assert page.sent == []


def test_facts_are_the_same_object_until_something_changes(page: BarePage) -> None:
    toy = page.open(Toy)
    facts = toy.facts
    toy.refresh()
    assert toy.facts is facts
    toy.change(step=0.01)
    toy.refresh()
    assert toy.facts is not facts
    other = toy.facts.at(page.now.robot.q_home + 0.1)
    assert other.total == pytest.approx(np.abs(page.now.robot.q_home + 0.1).sum() + 0.01)


def test_scripts_of_the_page_cannot_call_methods() -> None:
    """No script may send an event that `handle` takes itself, whichever these are."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(DeclaredFeature.handle)))
    cases = [case.pattern for node in ast.walk(tree) if isinstance(node, ast.Match) for case in node.cases]
    firsts = [one.patterns[0] for one in cases if isinstance(one, ast.MatchSequence)]
    kinds = {ast.literal_eval(first.value) for first in firsts if isinstance(first, ast.MatchValue)}
    assert kinds == {"at", "do", "done", "drag"}
    for kind in kinds:
        with pytest.raises(TypeError, match=f"must not contain {kind}"):
            type("Open", (Toy,), {"messages": frozenset({kind})})
    for lesson in DECLARED:
        assert not lesson.messages & kinds


def test_events_of_no_control_are_refused_with_the_key(page: BarePage) -> None:
    toy = page.open(Toy)
    with pytest.raises(InputError, match="a control of this feature"):
        toy.handle(("step", 5), 1.0)


def test_every_kind_of_field_is_tried() -> None:
    tried = {type(spec) for settings_of in (*CLASSES, Knobs) for _, spec in leaves(settings_of)}
    assert tried >= {Choice, Index, Number}
    assert {Kept, Text} <= tried or not any(lesson.key == "rotations" for lesson in DECLARED)


@pytest.mark.full
@pytest.mark.parametrize("lesson", DECLARED, ids=lambda each: each.key)
def test_panels_of_all_arms_name_fields_that_exist(lesson: type[Lesson]) -> None:
    with bare_page(CLASSICS[0]) as page:
        page.open(lesson)
        for robot in CLASSICS[1:]:
            page.change(robot)
            assert page.panel()
