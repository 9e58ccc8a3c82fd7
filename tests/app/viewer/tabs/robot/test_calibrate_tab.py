"""*Calibrate by touching* of the tab *Robot*: postures, what is typed and read in them, the arm found, links."""

from __future__ import annotations

import html
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bare_page import BarePage, bare_page

import kin
from app.shared.summaries import Summaries
from app.viewer.own_arm import OwnArm
from app.viewer.session.worker.inbox import Inbox
from app.viewer.tabs.robot.calibrate.feature import Calibrate
from app.viewer.tabs.robot.calibrate.run import (
    MORE,
    MOST,
    Run,
    Touched,
    doubt,
    from_json,
    planned,
    read_joints,
    to_json,
)
from kin import InputError
from kin.calibration.chain import Chain
from kin.calibration.fit import Touches
from kin.ik.problem import never_cancel
from kin.units import Units
from tests.kin.calibration.simulated import FINE, probed, random_errors, touch, true_sockets

UR5E = probed("ur5e")
BAR = Touched("bar", "A4", 0.15, 1, False)
COUNT = 10


@pytest.fixture(scope="module")
def run() -> Run:
    return planned(UR5E, BAR, COUNT, None, never_cancel)


@pytest.fixture(scope="module")
def read(run: Run) -> list[tuple[float, ...]]:
    """What the joints of a simulated arm read in the postures of the run."""
    rng = np.random.default_rng(5)
    chain = Chain(UR5E)
    errors = random_errors(chain, rng)
    spots = true_sockets(BAR.fixture, run.places, rng)
    asked = Touches(run.q, np.array(run.sockets))
    found = touch(chain, errors, FINE, asked, BAR.fixture, spots, rng)
    assert len(found) == COUNT
    return [tuple(q) for q in found.q.tolist()]


def typed(q: tuple[float, ...]) -> str:
    return " ".join(f"{value:.6f}" for value in np.degrees(q))


# A run as data


def test_a_run_comes_back_from_its_link(run: Run, read: list[tuple[float, ...]]) -> None:
    made = run.with_read(read[0]).to(3).with_read(read[3])
    entry = json.loads(json.dumps(to_json(made)))
    back = from_json(entry, UR5E)
    assert back is not None
    assert to_json(back) == entry
    assert back.what == BAR
    assert [each.at for each in back.touches] == [0, 3]
    assert np.abs(np.subtract(back.touches[1].q, read[3])).max() < 1e-7
    assert from_json(None, UR5E) is None


@pytest.mark.parametrize(
    "change",
    [
        {"q": [[0.0] * 6] * (MOST + 1)},
        {"q": [[0.0] * 5] * COUNT},
        {"q": []},
        {"read": [None]},
        {"read": [["x"] * 6] + [None] * (COUNT - 1)},
        {"sockets": [2] * COUNT},
        {"sockets": [0.5] * COUNT},
        {"places": []},
        {"places": [[0.0] * 12] * 2},
        {"places": [[1e9] * 12]},
        {"at": COUNT},
        {"at": -1},
        {"expected": [1.0]},
        {"course": [[1.0, 2.0]]},
        {"what": ["bar", "A4", 5.0, 1, False]},
        {"what": ["net", "A4", 0.1, 1, False]},
        {"what": ["pin", "A4", 0.1, 999, False]},
        {"what": None},
    ],
    ids=str,
)
def test_what_is_no_run_is_refused(run: Run, change: dict[str, object]) -> None:
    with pytest.raises(InputError):
        from_json({**json.loads(json.dumps(to_json(run))), **change}, UR5E)


def test_further_postures_come_behind_those_that_were_touched(run: Run, read: list[tuple[float, ...]]) -> None:
    made = run
    for i in range(8):
        made = made.to(i).with_read(read[i])
    more = planned(UR5E, BAR, 2, made, never_cancel)
    assert len(more.q) == len(more.read) == len(more.sockets) == COUNT + 2
    assert more.at == COUNT
    assert more.touches == made.touches
    assert more.expected[1] < run.expected[0]


# What is typed


def test_joint_values_are_read_in_the_units_of_the_page() -> None:
    values = (0.5, -1.25, 1.5, 0.0, 0.1, -2.0)
    for units in (Units(), Units(degrees=False)):
        shown = " ".join(f"{units.angles.scale * value:.9f}" for value in values)
        for text in (shown, shown.replace(" ", ", "), f"[{shown}]", shown.replace("-", "−")):
            assert read_joints(text, UR5E, BAR, units) == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 2 3", "joint values: got '1 2 3', expected 6 numbers with spaces between: base, shoulder"),
        ("1 2 3 4 5 x", "expected 6 numbers"),
        ("", "expected 6 numbers"),
        ("1 2 3 4 5 1e999", "expected 6 numbers|wrist 3: got"),
        ("0 0 0 900 0 0", "wrist 1: got '900.0°', expected -?[−0-9.]+° to [0-9.]+°$"),
    ],
)
def test_other_texts_are_refused_with_the_joint_the_value_and_what_is_valid(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_joints(text, UR5E, BAR, Units())


def test_degrees_are_suspected_where_radians_are_typed() -> None:
    with pytest.raises(InputError, match=r"wrist 1: got '90.0+ rad', expected .* rad; are these degrees"):
        read_joints("0 0 0 90 0 0", UR5E, BAR, Units(degrees=False))


def test_a_touch_far_from_its_posture_is_questioned() -> None:
    asked = np.array([0.5, -1.25, 1.5, 0.9, 0.6, -2.0])
    names = [joint.name for joint in UR5E.joints]
    near = asked + 0.1
    assert doubt(UR5E, asked, tuple(near)) == ""
    assert doubt(UR5E, asked, tuple(np.add(near, [0, 0, 2 * np.pi, 0, 0, 0]))) == ""
    backwards = tuple(near * [1, 1, -1, 1, 1, 1])
    said = doubt(UR5E, asked, backwards)
    assert said.lower() == f"{names[2]} is far from the posture that was asked. does it count backwards?"
    exchanged = tuple(near[[0, 2, 1, 3, 4, 5]])
    assert doubt(UR5E, asked, exchanged).endswith("Are the two exchanged?")
    assert doubt(UR5E, asked, tuple(np.radians(near))).endswith("Are these radians?")
    assert doubt(UR5E, asked, tuple(np.add(near, [0, 1, 0, 0, 0, 0]))).endswith("that was asked.")


# In a page


class Page:
    """A page with the feature, a connected arm, and what was made the arm of the page."""

    def __init__(self, page: BarePage) -> None:
        self.page: Any = page
        self.saved: dict[str, bytes] = {}
        self.line = SimpleNamespace(measured=None)
        page.door, page.summaries = SimpleNamespace(line=self.line), Summaries(threads=1)  # type: ignore[attr-defined]
        page.edit_arm = self._edit  # type: ignore[attr-defined]
        page.client.send_file_download = lambda name, data, **_: self.saved.update({name: data})
        self.feature: Any = None
        page.feature = self.feature = Calibrate(page)  # type: ignore[arg-type]

    def _edit(self, own: OwnArm) -> None:
        self.page.own = own
        self.page.use(own.robot)
        self.feature.on_robot()

    def until(self, done: Callable[[], object], most: float = 30.0) -> None:
        """Handle what was posted, and tick, until something is so."""
        end = time.monotonic() + most
        while not done():
            inbox = Inbox()
            while self.page.events:
                inbox.post(*self.page.events.pop(0))
            for key, value in inbox.take() or []:
                self.feature.handle(key[2], value)
            self.feature.tick(time.perf_counter())
            assert time.monotonic() < end, "it does not come to that"
            time.sleep(0.001)

    def set(self, label: str, value: object) -> None:
        """Set a control, or press a button of a group, and handle what it posts."""
        self.page.set(label, value)
        self.until(lambda: not self.page.events)

    @property
    def html(self) -> str:
        return html.unescape(str(self.page.panel()))

    @property
    def run(self) -> Run:
        found = self.feature.settings.run
        assert found is not None
        return found

    @property
    def found(self) -> Any:
        return self.feature.facts.found


@pytest.fixture
def page() -> Iterator[Page]:
    with bare_page(UR5E) as bare:
        yield Page(bare)


def begun(page: Page, run: Run) -> None:
    """Postures as the fixture of the module has them: it takes a second to choose them."""
    page.feature.change(run=run)
    page.feature.refresh()


def test_postures_are_proposed_and_the_sheet_is_saved(page: Page) -> None:
    page.set("Postures", "Save sheet")
    assert page.saved["touch-sheet-A3.svg"].startswith(b"<svg")
    page.set("Touch", "two sockets of a bar")
    assert page.feature.settings.length == 0.15
    with pytest.raises(InputError, match="count: got 6, expected a whole number from 7 to 60"):
        page.set("Touches", 6)
    page.set("Touches", 7)
    page.set("Postures", "Propose")
    page.until(lambda: page.feature.settings.run)
    assert len(page.run.q) == 7
    assert (page.run.what.kind, page.run.what.length, page.run.what.places) == ("bar", 0.15, 1)
    assert "Posture 1 of 7: socket" in page.html
    assert "7 more touches until there is a result" in page.html
    drawn = [kind for kind, _, _ in page.page.scene()]
    assert "BatchedMeshHandle" in drawn
    assert "LabelHandle" in drawn
    page.set("Result", "Stop")
    assert page.page.scene() == []


def test_typed_touches_give_the_arm_that_becomes_the_one_of_the_page(
    page: Page, run: Run, read: list[tuple[float, ...]]
) -> None:
    begun(page, run)
    for i, q in enumerate(read):
        page.set("Joint values", "1 2")
        for button in ("Take", "Next") if i < COUNT - 1 else ("Take",):
            with pytest.raises(InputError, match="joint values: got '1 2'"):
                page.set("Touch", button)
            assert page.run.at == i
            assert page.run.read[i] is None
            assert page.feature.settings.joints == "1 2", "what was typed is still there"
        page.set("Joint values", typed(q))
        if i % 2 or i == COUNT - 1:
            page.set("Touch", "Take")
        if i < COUNT - 1:
            page.set("Touch", "Next")
        assert page.run.read[i] == pytest.approx(q, abs=1e-7)
    page.until(lambda: page.found is not None and len(page.found.touches) == COUNT)
    page.until(lambda: page.run.course and page.run.course[-1][0] == COUNT)
    expected = page.found.calibration.expected
    assert expected.after < 0.2 * expected.before
    assert page.run.course[-1][1:] == (expected.after, expected.bound)
    assert "Different arms" in page.html, "compared with the nominal table"
    assert "The tip is expected to be off by" in page.html
    page.set("Result", "Save report")
    assert b"Calibration of" in page.saved["calibration.html"]
    state = page.feature.state()
    page.set("Result", "Use this arm")
    made = page.page.own.robot
    assert made.nominal is not None
    assert np.abs(kin.fk_positions(made, read[0]) - kin.fk_positions(UR5E, read[0])).max() > 1e-3
    assert page.feature.settings.run is None
    page.page.use(UR5E)
    page.feature.on_robot()
    page.feature.restore(state)
    assert [each.at for each in page.run.touches] == list(range(COUNT)), "undo brings the touches back"


def test_joint_values_are_taken_on_a_press_and_not_while_they_are_typed(page: Page, run: Run) -> None:
    begun(page, run)
    text = "11.5 -78.25 110 -40.5 17.5 -0.5"
    for end in range(1, len(text) + 1):
        page.set("Joint values", text[:end])
        assert page.run.read[0] is None
        assert page.page.control("Joint values").value == text[:end], "the field is not written into"
    page.set("Touch", "Take")
    assert [np.degrees(each.q).tolist() for each in page.run.touches] == [
        pytest.approx([11.5, -78.25, 110.0, -40.5, 17.5, -0.5])
    ]
    assert page.page.control("Joint values").value == text
    taken = page.run
    page.set("Touch", "Next")
    page.set("Touch", "Back")
    assert page.run.read == taken.read, "nothing typed, nothing taken"


@pytest.mark.parametrize(
    "acts",
    [("text", "Next"), ("text", "Next", "late"), ("part", "text", "Next", "late"), ("Next", "text")],
    ids=str,
)
def test_what_is_typed_is_never_a_reading_of_the_next_posture(page: Page, run: Run, acts: tuple[str, ...]) -> None:
    """What was typed before the press is taken and nothing else, also if all of it waits in the inbox at once."""
    text = "11.5 -78.25 110 -40.5 17.5 -0.5"
    texts = {"part": text[:-1], "text": text, "late": text + "5"}
    begun(page, run)
    for act in acts:
        page.page.set(*(("Joint values", texts[act]) if act in texts else ("Touch", act)))
    page.until(lambda: not page.page.events)
    assert page.run.at == 1
    assert page.feature.settings.joints == ""
    page.set("Touch", "Next")
    expected = [pytest.approx(np.radians([float(word) for word in text.split()]))] if acts[-1] != "text" else []
    assert [each.q for each in page.run.touches] == expected
    assert [each.at for each in page.run.touches] == [0] * len(expected)


def test_a_value_far_from_its_posture_is_questioned_by_next_too(page: Page, run: Run) -> None:
    begun(page, run)
    for i, (turn, title) in enumerate(((1.0, "Posture 1 is in doubt"), (0.1, ""))):
        q = tuple(run.q[i] + turn * np.eye(6)[1])
        page.set("Joint values", typed(q))
        page.page.notices.clear()
        page.set("Touch", "Next")
        assert page.run.at == i + 1
        said = [(one.title, one.detail) for one in page.page.notices]
        assert said == ([(title, doubt(UR5E, run.q[i], q))] if title else [])


def test_a_reload_loses_nothing(page: Page, run: Run, read: list[tuple[float, ...]]) -> None:
    assert page.feature.state() == {}
    begun(page, run.with_read(read[0]).to(1))
    page.set("Joint values", "1 2 3")
    state = json.loads(json.dumps(page.feature.state()))
    with bare_page(UR5E) as bare:
        other = Page(bare)
        other.feature.restore(state)
        assert other.run.read[0] == pytest.approx(read[0], abs=1e-7)
        assert other.page.control("Joint values").value == "1 2 3"
        other.feature.restore({})
        assert other.feature.settings.run is None
        assert other.feature.state() == {}


def test_the_connected_arm_is_compared_and_read(page: Page, run: Run) -> None:
    begun(page, run)
    assert "connected" not in page.html
    page.line.measured = run.q[0] + 0.1
    page.until(lambda: "from there" in page.html)
    gap = kin.fk_positions(UR5E, run.q[0] + 0.1) - kin.fk_positions(UR5E, run.q[0])
    away = Units().distance(float(np.linalg.norm(gap)))
    assert f"The connected arm’s tip is {away} from there." in page.html
    page.set("Touch", "Read")
    assert page.run.read[0] == pytest.approx(run.q[0] + 0.1, abs=1e-5)
    page.set("Touch", "Leave out")
    assert page.run.read[0] is None
    page.line.measured = np.degrees(run.q[0])
    page.until(lambda: page.feature.settings.measured[1] == pytest.approx(np.degrees(run.q[0, 1])))
    with pytest.raises(InputError, match=r"expected .*°; are these degrees"):
        page.set("Touch", "Read")
    assert page.run.read[0] is None
    page.line.measured = [0.0]  # of another arm
    page.until(lambda: page.feature.settings.measured is None)


def test_a_wrong_touch_is_named(page: Page, run: Run, read: list[tuple[float, ...]]) -> None:
    wrong = tuple(np.add(read[4], [0, 0.05, 0, 0, 0, 0]))
    made = run
    for i, q in enumerate(read):
        made = made.to(i).with_read(wrong if i == 4 else q)
    begun(page, made)
    page.until(lambda: page.found is not None)
    page.feature.refresh()
    assert "Touch 5 does not fit the others" in page.html
    assert "✕ left out" in page.html


def test_what_is_being_typed_stays_when_further_postures_come(page: Page, run: Run) -> None:
    begun(page, run.to(3))
    page.set("Joint values", "11.5 -78")
    page.set("Result", f"{MORE} more")
    page.until(lambda: len(page.run.q) == COUNT + MORE)
    assert page.run.at == 3
    assert page.page.control("Joint values").value == "11.5 -78"
    assert page.feature.settings.wanted == 0


def test_an_arm_with_the_same_geometry_keeps_the_touches_and_what_is_typed(
    page: Page, run: Run, read: list[tuple[float, ...]]
) -> None:
    begun(page, run.with_read(read[0]).to(1))
    page.set("Joint values", "11.5 -78")
    rows = [replace(row, name=f"my {row.name}", velocity=1.0) for row in UR5E.rows]
    rows[0] = replace(rows[0], limits=(-3.0, 3.0))
    same = replace(UR5E, name="My arm", rows=tuple(rows), motors=(), pendant=(), ros_joints=())
    page.page.use(same)
    page.feature.on_robot()
    assert page.run.robot is same
    assert page.run.read[0] == read[0]
    assert page.page.control("Joint values").value == "11.5 -78"
    rows[1] = replace(rows[1], a=rows[1].a - 0.001)
    page.page.use(replace(same, rows=tuple(rows)))
    page.feature.on_robot()
    assert page.feature.settings.run is None
    assert page.feature.settings.joints == ""


def test_only_what_all_of_the_touches_have_shown_can_be_used(
    page: Page, run: Run, read: list[tuple[float, ...]]
) -> None:
    made = run
    for i, q in enumerate(read):
        made = made.to(i).with_read(q)
    begun(page, made)
    page.until(lambda: page.feature.facts.ready)
    page.feature.refresh()
    assert "Use this arm" in page.page.control("Result").options
    page.set("Touch", "Leave out")
    assert page.feature.facts.ready is None, "the next fit has not ended"
    assert page.page.control("Result").options == (f"{MORE} more", "Stop")
    page.feature.on_use()
    page.feature.on_report()
    assert page.page.own is None
    assert page.saved == {}
    page.until(lambda: page.feature.facts.ready)
    page.feature.refresh()
    page.set("Result", "Save report")
    assert list(page.saved) == ["calibration.html"]


def test_postures_that_cannot_be_touched_are_said(page: Page) -> None:
    page.set("Touch", "two sockets of a bar")
    page.set("Distance of the sockets, mm", 2000.0)
    page.set("Postures", "Propose")
    page.until(lambda: page.page.notices)
    assert page.page.notices[-1].title == "No postures were found"
    assert "socket" in page.page.notices[-1].detail
    assert page.feature.settings.wanted == 0


def test_touches_in_one_posture_are_refused_in_words(page: Page, run: Run, read: list[tuple[float, ...]]) -> None:
    made = run
    for i in range(COUNT):
        made = made.to(i).with_read(read[0])
    begun(page, made)
    page.until(lambda: page.feature.facts.work("fit").error)
    page.feature.refresh()
    said = "touches: got 'all in one posture', expected postures that differ by 5° in some joint or more"
    assert said in page.html
    assert page.run.touches == made.touches, "nothing is lost"


def test_other_units_write_what_was_read_anew(page: Page, run: Run, read: list[tuple[float, ...]]) -> None:
    begun(page, run)
    page.set("Joint values", typed(read[0]))
    page.set("Touch", "Take")
    page.page.units = Units(degrees=False)
    page.feature.on_style()
    shown = [float(word) for word in page.page.control("Joint values").value.split()]
    assert shown == pytest.approx(read[0], abs=1e-6)
