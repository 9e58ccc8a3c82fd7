"""The posture controls, played by a fake browser: branches, and free values with their feasible strips."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from arms import eight_joints
from fake_browser import FakeBrowser

import kin
from app.shared.store import Store
from app.viewer.panel.joints import label
from app.viewer.panel.posture import feasible_html, meanings, on_side_of, short
from kin.units import DEGREES, fixed

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER = STORE.get("pioneer5")
SRS = STORE.get("redundant7-craig")
PRINTED = STORE.get("redundant7")


def q_of(tab: FakeBrowser, robot: kin.Robot) -> np.ndarray:
    return np.radians([tab.value(label(robot, i)) for i in range(robot.n)])


def branch_shown(tab: FakeBrowser) -> str:
    return re.findall(r'data-branch="([^"]*)"', tab.html)[-1]


@pytest.mark.full
def test_every_branch_can_be_chosen_and_the_tool_stays(port: int) -> None:
    T = kin.fk(SRS, SRS.q_home)
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        assert branch_shown(tab) == kin.branch_of(SRS, SRS.q_home)
        seen = []
        for name in kin.branch_names(SRS):
            tab.set("Posture", short(name))
            tab.settle()
            q = q_of(tab, SRS)
            assert kin.branch_of(SRS, q) == branch_shown(tab) == name
            assert np.allclose(kin.fk(SRS, q), T, atol=5e-4)
            assert np.allclose(tab.tool_pose(), T, atol=1e-6)
            assert 'data-status="reached"' in tab.html
            seen.append(q)
        gaps = [np.abs(a - b).max() for i, a in enumerate(seen) for b in seen[:i]]
        assert min(gaps) > 0.1, "eight branches are eight postures"


@pytest.mark.full
def test_a_chosen_branch_is_kept_while_dragging_and_left_by_hand(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        name = next(n for n in kin.branch_names(SRS) if "elbow negative" in n)
        tab.set("Posture", short(name))
        tab.settle()
        T = kin.fk(SRS, SRS.q_home)
        tab.grab()
        for k in range(15):
            T[:3, 3] += (-0.01, 0.01 * math.sin(k), -0.004)
            tab.drag(T)
        tab.release()
        tab.settle()
        assert branch_shown(tab) == name
        assert np.allclose(tab.tool_pose(), T, atol=1e-6)
        tab.set("Joint 4", 60)
        tab.settle()
        assert tab.value("Posture") == "Closest"


@pytest.mark.full
def test_a_posture_that_is_not_possible_here_is_explained_and_nothing_moves(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        q = q_of(tab, PIONEER)
        for task in ("Full pose", "Point + approach"):
            tab.set("Target must match", task)
            for name in kin.branch_names(PIONEER):
                if name == kin.branch_of(PIONEER, PIONEER.q_home):
                    continue
                tab.set("Posture", short(name))
                tab.wait(lambda name=name: f"Not possible here: {short(name)}" in tab.html)
                assert 'data-status="advice"' in tab.html
                assert "kb-amber" in tab.html
                flip = name == "shoulder front · elbow positive · wrist flip"
                assert ("It needs joint 4 (rotating wrist) at 210.0° (limit 85.0°)" in tab.html) is flip
                tab.settle()
                assert tab.value("Posture") == "Closest"
        assert np.array_equal(q_of(tab, PIONEER), q)


def test_a_posture_is_requested_for_a_target_that_is_not_reached_anyway(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.say("target", ["position", "3000 0 500"])
        tab.wait(lambda: 'data-status="unreachable"' in tab.html)
        name = short(kin.branch_of(PIONEER, PIONEER.q_home))
        tab.set("Posture", name)
        tab.settle()
        assert tab.value("Posture") == name
        assert 'data-status="advice"' not in tab.html


def test_a_value_outside_the_feasible_range_is_refused_by_name(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        (free,) = kin.solve_ik(SRS, kin.fk(SRS, SRS.q_home), q_seed=SRS.q_home, branch="seed").redundancy
        (low, high), *_ = np.degrees(free.intervals)
        assert high < 150.0
        q, shown = q_of(tab, SRS), tab.value("Arm angle ψ")
        number = tab.say("field", [tab.element("Arm angle ψ"), "150"])
        tab.wait(lambda: tab.script["reply"][0] == number)
        assert "Arm angle ψ was not changed. 150.0° is outside the feasible range" in tab.script["reply"][1]
        assert f"Feasible here: {fixed(low, 1)}° … {fixed(high, 1)}°" in tab.script["reply"][1]
        tab.settle()
        assert tab.value("Arm angle ψ") == shown
        assert np.array_equal(q_of(tab, SRS), q)
        # The ends as they are shown are valid, though rounded.
        tab.say("field", [tab.element("Arm angle ψ"), f"{high:.1f}"])
        tab.wait(lambda: tab.value("Arm angle ψ") == pytest.approx(high, abs=0.06))


@pytest.mark.full
@pytest.mark.parametrize("robot", [SRS, PRINTED], ids=lambda robot: robot.id)
def test_the_free_slider_moves_the_arm_and_not_the_tool(port: int, robot: kin.Robot) -> None:
    T = kin.fk(robot, robot.q_home)
    with FakeBrowser(port) as tab:
        tab.choose(robot.name)
        (name,) = tab.sliders_in("Posture and redundancy")
        (free,) = kin.solve_ik(robot, T, q_seed=robot.q_home, branch="seed").redundancy
        low, high = next((a, b) for a, b in free.intervals if a <= free.value <= b)
        before = q_of(tab, robot)
        for share in (0.6, 0.7, 0.8, 0.9):
            tab.set(name, math.degrees(low + share * (high - low)))
            tab.settle()
            assert np.allclose(tab.tool_pose(), T, atol=1e-6)
            assert 'data-status="reached"' in tab.html
        assert np.abs(q_of(tab, robot) - before).max() > 0.1
        assert np.allclose(kin.fk(robot, q_of(tab, robot)), T, atol=5e-4)


@pytest.mark.full
def test_beyond_the_feasible_range_the_arm_stops_at_its_end_and_says_which_joint(port: int) -> None:
    T = kin.fk(SRS, SRS.q_home)
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        (free,) = kin.solve_ik(SRS, T, q_seed=SRS.q_home, branch="seed").redundancy
        end = free.intervals[0][1]
        assert end < math.radians(150)
        for degrees in (30, 60, 90, 110, 140):
            tab.set("Arm angle ψ", degrees)
            tab.settle()
        assert 'data-status="limits"' in tab.html
        assert "joint" in tab.html
        assert np.allclose(tab.tool_pose(), T, atol=1e-6)
        (there,) = kin.solve_ik(SRS, T, q_seed=q_of(tab, SRS), branch="seed", max_solutions=1).redundancy
        assert there.value == pytest.approx(end, abs=1e-3)
        assert f"{math.degrees(end):.1f}°" in tab.html


def test_the_strip_draws_and_words_the_ranges() -> None:
    free = kin.ik.Redundancy("psi", "arm angle ψ", 0.0, ((-math.pi, -math.pi / 2), (0.0, math.pi / 2)))
    strip = feasible_html(free, -180, 180, DEGREES)
    assert strip.count("kb-range") == 2
    assert "left:50.00%;width:max(2px,25.00%)" in strip
    assert "feasible: −180.0 … −90.0°, 0.0 … 90.0°" in strip
    nothing = feasible_html(kin.ik.Redundancy("psi", "arm angle ψ", 0.0, ()), -180, 180, DEGREES)
    assert "no value is feasible" in nothing


def test_half_a_turn_is_shown_where_the_slider_is() -> None:
    free = kin.ik.Redundancy("psi", "arm angle ψ", -math.pi + 1e-7, ((-math.pi, math.pi),))
    assert on_side_of(180.0, free, DEGREES).value == pytest.approx(math.pi)
    assert on_side_of(-180.0, free, DEGREES).value == pytest.approx(-math.pi)
    assert "calc(100.00% - 1px)" in feasible_html(on_side_of(180.0, free, DEGREES), -180, 180, DEGREES)
    for other in (free._replace(value=-3.0), free._replace(name="theta7")):
        assert on_side_of(180.0, other, DEGREES) is other


def test_the_choice_explains_its_words() -> None:
    text = meanings(kin.get_robot("ur5"))
    assert "Elbow +: θ3 is on the positive side of where the arm is straight." in text
    assert "Left: the plane of the arm is on the left, seen from axis 1 towards the wrist centre." in text
    assert meanings(eight_joints(kin.get_robot("panda"))) == ""


def test_hostile_choices_are_refused_and_the_session_lives(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        for name, value in (("Posture", "<b>up</b>"), ("Arm angle ψ", math.nan), ("Arm angle ψ", -math.inf)):
            tab.set(name, value)
            tab.wait(lambda: 'data-status="error"' in tab.html)
            assert "<b>up" not in tab.html
            tab.set("Go to", "Home")
            tab.wait(lambda: 'data-status="hand"' in tab.html)
        tab.settle()
        assert np.allclose(tab.tool_pose(), kin.fk(SRS, SRS.q_home), atol=1e-9)


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda r: r.id)
def test_the_answer_to_a_pose_tells_what_asking_again_where_it_leads_would_tell(robot: kin.Robot) -> None:
    """So that a drag need not ask twice."""
    rng = np.random.default_rng(5)
    seed = "seed" if kin.branch_names(robot) else None
    for _ in range(10):
        q = robot.random_q(rng)
        T = kin.fk(robot, robot.clip(q + 0.05 * rng.normal(size=robot.n)))
        best = kin.solve_ik(robot, T, task="pose", q_seed=q).best
        again = kin.solve_ik(
            robot, kin.fk(robot, best.q), task="pose", q_seed=best.q, branch=seed, max_solutions=1
        ).redundancy
        assert [r.name for r in best.redundancy] == [r.name for r in again]
        for one, other in zip(best.redundancy, again, strict=True):
            assert math.remainder(one.value - other.value, math.tau) == pytest.approx(0.0, abs=1e-6)
            assert np.array(one.intervals) == pytest.approx(np.array(other.intervals), abs=1e-5)


def test_another_task_after_a_drag_leaves_free_what_it_leaves_free(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        T = kin.fk(SRS, SRS.q_home)
        T[0, 3] += 0.02
        tab.grab()
        tab.drag(T)
        tab.release()
        tab.wait(lambda: "Reached" in tab.html)
        tab.settle()
        assert 'data-redundancy="theta7"' not in tab.html
        tab.set("Target must match", "Point + approach")
        tab.wait(lambda: 'data-redundancy="theta7"' in tab.html)
