"""Exercises in a visitor's page: opened, answered, kept in the page's state, and what of them is sent."""

from __future__ import annotations

import html
import json
from collections.abc import Iterator

import numpy as np
import pytest
from fake_browser import FakeBrowser
from hypothesis import given
from hypothesis import strategies as st
from live_server import serve_viewer

import kin
from app.exercises import Exercise, Exercises, Variant, Verdict
from app.exports.snippets import SNIPPETS
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.activity.practice import Practice, Record
from app.viewer.server import ViewerServer
from app.viewer.session.state import PageState, decode, encode
from app.viewer.worksheet.feature import FILES
from kin import InputError
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

ALL = Exercises()
UNITS = Units()
SEED = 77
RIGHT, WRONG = Verdict(True, "Yes."), Verdict(False, "Half of it.", 0.5)


def exercise(exercise_id: str) -> Exercise:
    found = ALL.get(exercise_id)
    assert found is not None
    return found


# Without a page


def test_marks_attempts_and_time_are_kept() -> None:
    practice, one = Practice(ALL), exercise("two-elbows")
    assert practice.state() == {}
    practice.open("two-elbows")
    practice.take(one, WRONG, 4.4)
    practice.take(one, Verdict(False, "Nothing."), 2.0)
    assert practice.record(one) == Record("wrong", attempts=2, seconds=6, credit=50)
    practice.take(one, RIGHT, 1.0)
    practice.take(one, WRONG, 9.0)
    assert practice.record(one) == Record("right", attempts=3, seconds=7, credit=100), "what is settled stays"
    other = Practice(ALL)
    other.restore(json.loads(json.dumps(practice.state())))
    assert other.state() == practice.state()
    assert (other.at, other.seed) == (one, practice.seed)


def test_other_numbers_are_other_numbers() -> None:
    practice, one = Practice(ALL), exercise("two-elbows")
    drawn = set()
    for _ in range(6):
        drawn.add(tuple(quantity.value for quantity in practice.variant(one).values.values()))
        practice.again(one)
    assert len(drawn) > 3


def test_the_list_is_walked_through_to_its_end() -> None:
    practice, at = Practice(ALL), ALL.all[0]
    seen = [at]
    while (following := practice.after(seen[-1])) is not None:
        seen.append(following)
    assert tuple(seen) == ALL.all
    with pytest.raises(InputError, match="exercise"):
        practice.open("no-such")


LEAVES = st.none() | st.booleans() | st.integers() | st.text(max_size=3)
NESTED = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from(["two-elbows", "x"]), inner),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from(["seed", "at", "done"]), NESTED))
def test_a_foreign_state_is_never_an_error(state: dict[str, object]) -> None:
    practice = Practice(ALL)
    practice.restore(state)
    for record in practice.records.values():
        assert record.mark in ("open", "wrong", "right", "shown")
    practice.variant(exercise("two-elbows"))


# In a page


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(Store(), Settings(), Clouds())) as port:
        yield port


def press(tab: FakeBrowser, key: list[object], value: object = None) -> None:
    tab.say("feature", ["exercises", key, value])


def variant_of(one: Exercise, times: int = 0) -> Variant:
    practice = Practice(ALL)
    practice.seed = SEED
    practice.record(one).variant = times
    return practice.variant(one)


def begun() -> str:
    """A page's storage in which the exercises are open, for a student with our seed."""
    text = encode(PageState(lesson="exercises", features={"exercises": {"seed": SEED, "at": "", "done": {}}}))
    return json.dumps({"address": "http://127.0.0.1/", "state": text})


def shown(tab: FakeBrowser) -> str:
    return html.unescape(tab.html)


def test_a_student_solves_exercises_and_the_page_keeps_it(server: int) -> None:
    one = exercise("planar-tool-point")
    variant = variant_of(one)
    right = one.kind.answer(variant)
    assert isinstance(right, list)
    with FakeBrowser(server, memory=begun()) as tab:
        tab.settle()
        tab.wait(lambda: f"0 of {len(ALL.all)} solved" in shown(tab))
        press(tab, ["open", one.id, 1])
        tab.wait(lambda: variant.text(one.text, UNITS) in shown(tab))
        assert not [text for text in right if text[:5] in shown(tab)]
        tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(one.robot, one.robot.q_home), atol=1e-6))
        press(tab, ["fields", 2], [["x", "1"]])
        tab.wait(lambda: "“x” is not a number" in shown(tab))
        press(tab, ["fields", 3], [[right[0], "99999"]])
        tab.wait(lambda: "Partly right" in shown(tab) and "(50 % of it)" in shown(tab))
        press(tab, ["hint", 4])
        tab.wait(lambda: "Hint 1." in shown(tab) and one.hints[0] in shown(tab))
        press(tab, ["fields", 5], [right])
        tab.wait(lambda: "✓ Right" in shown(tab) and "2 attempts" in shown(tab))
        tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(one.robot, variant.q), atol=1e-6))
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "1. A column" in tab.html)
        tab.wait(lambda: any(decode(text, [one.robot]).lesson == "velocity" for text in tab.kept[-1:]))
        kept = tab.kept[-1]
    memory = json.dumps({"address": "http://127.0.0.1/", "state": kept})
    with FakeBrowser(server, memory=memory) as tab:
        tab.wait(lambda: "1. A column" in tab.html)
        tab.set("Lesson", "Exercises")
        tab.wait(lambda: variant.text(one.text, UNITS) in shown(tab) and "2 attempts" in shown(tab))
        press(tab, ["list", 6])
        tab.wait(lambda: f"1 of {len(ALL.all)} solved" in shown(tab))


def test_the_arm_of_a_mistaken_answer_is_drawn_until_the_next_answer(server: int) -> None:
    one = exercise("planar-tool-point")
    variant = variant_of(one)
    mistaken = variant.with_number("t2", -variant.values["t2"].value)
    tool = kin.fk(mistaken.robot, mistaken.q)[:3, 3]

    def drawn(tab: FakeBrowser) -> list[str]:
        return [name for name, node in tab.nodes.items() if node["props"].get("text") == "the arm of your answer"]

    with FakeBrowser(server, memory=begun()) as tab:
        tab.settle()
        press(tab, ["open", one.id, 1])
        tab.wait(lambda: variant.text(one.text, UNITS) in shown(tab))
        assert not drawn(tab)
        press(tab, ["fields", 2], [[f"{1000 * x:.1f}" for x in tool[:2]]])
        tab.wait(lambda: f"with the other sign of {variant.values['t2'].text(UNITS)}." in shown(tab))
        tab.wait(lambda: [np.allclose(tab.local(name)[:3, 3], tool, atol=1e-6) for name in drawn(tab)] == [True])
        press(tab, ["fields", 3], [["1", "1"]])
        tab.wait(lambda: not drawn(tab))
        press(tab, ["fields", 4], [[f"{1000 * x:.1f}" for x in tool[:2]]])
        tab.wait(lambda: bool(drawn(tab)))
        press(tab, ["fields", 5], [["1", "x"]])
        tab.wait(lambda: not drawn(tab))
        press(tab, ["fields", 6], [[f"{1000 * x:.1f}" for x in tool[:2]]])
        tab.wait(lambda: bool(drawn(tab)))
        tab.choose(kin.get_robot("ur5e").name)
        tab.wait(lambda: not drawn(tab))


def test_the_arm_is_the_answer_where_a_posture_is_asked(server: int) -> None:
    one = exercise("reach-elbow")
    variant = variant_of(one)
    q = one.kind.answer(variant)
    assert isinstance(q, list)
    with FakeBrowser(server, memory=begun()) as tab:
        tab.settle()
        press(tab, ["open", one.id, 1])
        tab.wait(lambda: "Answer with the arm’s posture" in shown(tab) and tab.sliders.count("1 shoulder") == 2)
        press(tab, ["posture", 2])
        tab.wait(lambda: "from the target" in shown(tab))
        press(tab, ["reveal", 3])
        tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(one.robot, np.array(q)), atol=1e-6))
        tab.wait(lambda: "The answer:" in shown(tab) and tab.sliders.count("1 shoulder") == 1)
        press(tab, ["again", 4])
        tab.wait(lambda: "Answer with the arm’s posture" in shown(tab) and "The answer:" not in shown(tab))
        tab.wait(lambda: tab.script["undo"] == "New numbers")


def test_motions_are_put_in_order_and_frames_placed(server: int) -> None:
    order, frame = exercise("dh-order"), exercise("two-turns")
    picks = order.kind.answer(variant_of(order))
    assert isinstance(picks, list)
    with FakeBrowser(server, memory=begun()) as tab:
        tab.settle()
        press(tab, ["open", order.id, 1])
        tab.wait(lambda: "Press them in their order" in shown(tab))
        for serial, pick in enumerate([picks[2], picks[0], picks[2], *picks], 2):
            press(tab, ["pick", serial], pick)  # two, taken back, then all in order
        press(tab, ["answer", 20])
        tab.wait(lambda: "✓ Right" in shown(tab))
        press(tab, ["open", frame.id, 21])
        tab.wait(lambda: "Drag the ghost" in shown(tab))
        (ghost,) = [name for name in tab.nodes if name.endswith("/ghost")]
        at = {"name": ghost, "owner": tab.nodes[ghost]["owner"]}
        tab.send("TransformControlsDragStartMessage", **at)
        tab.send("TransformControlsUpdateMessage", **at, position=[0.1, 0.2, 0.3], wxyz=[1.0, 0.0, 0.0, 0.0])
        tab.send("TransformControlsDragEndMessage", **at)
        tab.wait(lambda: 'value="100 200 300 0 0 0"' in shown(tab))
        press(tab, ["fields", 22], [["0 0"]])
        tab.wait(lambda: "needs another count of numbers" in shown(tab))
        press(tab, ["fields", 23], [["0 0 0 0 0 0"]])
        tab.wait(lambda: "has not moved from where it began" in shown(tab))
        T = np.array(frame.kind.answer(variant_of(frame)))
        press(tab, ["fields", 24], [[" ".join(repr(float(x)) for x in [*(1000 * T[:3]), *T[3:]])]])
        tab.wait(lambda: "✓ Right" in shown(tab))


@pytest.mark.parametrize("one", [each for each in ALL.all if each.kind.withholds], ids=lambda one: one.id)
def test_no_tab_shows_the_table_that_an_exercise_asks_for(server: int, one: Exercise) -> None:
    with FakeBrowser(server, memory=begun()) as tab:
        tab.settle()
        assert 'data-arm="table"' in tab.html
        press(tab, ["open", one.id, 1])
        tab.wait(lambda: 'data-arm="withheld"' in tab.html)
        assert "asks for this table" in shown(tab)
        assert 'data-arm="table"' not in tab.html
        assert 'data-arm="convert"' not in tab.html
        assert 'data-arm="compare"' not in tab.html
        tab.say("feature", ["robot", ["download"], "toml"])
        tab.wait(lambda: "would contain the table" in shown(tab))
        for serial, form in enumerate(FILES, 1):
            tab.say("feature", ["sheet", [form, serial], None])
        tab.wait(lambda: "The worksheet would contain the table" in shown(tab))
        tab.say("feature", ["sheet", ["web", 8], None])
        tab.wait(lambda: "The page would contain what the open question asks for" in shown(tab))
        tab.say("feature", ["sheet", ["page", 9], None])
        tab.wait(lambda: 'data-sheet="9"' in tab.html)
        assert not any("FileTransfer" in message["type"] for message in tab.log)
        assert "asks for the table of this arm, which the worksheet contains" in shown(tab)
        assert 'aria-label="DH table"' not in tab.html
        for language in SNIPPETS:
            tab.set("Copy as", language)
        tab.wait(lambda: 'data-code="withheld"' in tab.html)
        press(tab, ["list", 2])
        tab.say("feature", ["sheet", ["page", 10], None])
        tab.wait(lambda: 'data-sheet="10"' in tab.html and 'aria-label="DH table"' in tab.html)
        tab.wait(lambda: 'data-code="withheld"' not in tab.html)
        tab.wait(lambda: 'data-arm="table"' in tab.html)
        press(tab, ["open", one.id, 3])
        tab.wait(lambda: 'data-arm="withheld"' in tab.html)
        tab.set("Lesson", "None")
        tab.wait(lambda: 'data-arm="table"' in tab.html)
        tab.set("Lesson", "Exercises")
        tab.wait(lambda: 'data-arm="withheld"' in tab.html)
        press(tab, ["reveal", 4])
        tab.wait(lambda: 'data-arm="table"' in tab.html and 'data-arm="convert"' in tab.html)


def test_messages_that_no_control_sends_are_refused(server: int) -> None:
    with FakeBrowser(server, memory=begun()) as tab:
        tab.settle()
        press(tab, ["open", "no-such", 1])
        tab.wait(lambda: "the id of an exercise" in shown(tab))
        press(tab, ["open", "dh-order", 2])
        tab.wait(lambda: "Press them in their order" in shown(tab))
        press(tab, ["pick", 3], 99)
        tab.wait(lambda: "the index of a motion" in shown(tab))
        press(tab, ["fields", 4], [[1, 2]])
        tab.wait(lambda: "rows of texts" in shown(tab))
