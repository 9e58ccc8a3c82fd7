"""The arm that is driven round in the lesson "Postures", against determinants by NumPy alone."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS
from fake_browser import FakeBrowser
from lesson_arms import arms_of

import kin
from app.viewer.lessons.postures.lesson import Postures
from app.viewer.lessons.postures.loop import (
    LOOKS,
    MOST,
    NEAR,
    SAME,
    DrivenPath,
    Round,
    drive_html,
    driven,
    in_section,
    loop_of,
    map_html,
    tool_path,
)
from kin.angles import apart
from kin.postures import loops
from kin.units import Units

ARM = kin.get_robot("orthogonal3r")
HOME = ARM.q_home
UNITS = Units()
QUESTION = Round(ARM, UNITS)
TITLES = ("There and back", "Drive it round")


def det(q: np.ndarray) -> float:
    return float(np.linalg.det(numpy_arm.jacobian(ARM, q)[:3]))


def tool(q: np.ndarray) -> np.ndarray:
    return np.asarray(numpy_arm.pose(ARM, q)[:3, 3])


def along(*degrees: tuple[float, float, float]) -> np.ndarray:
    """Corners of a drive from home."""
    return np.array([HOME, *np.radians(degrees)])


def fine(corners: np.ndarray, count: int = 300) -> np.ndarray:
    s = np.linspace(0.0, 1.0, count)[:, None]
    return np.concatenate([a + s * (b - a) for a, b in pairwise(corners)])


def drive(corners: np.ndarray) -> DrivenPath | None:
    """As frames of the page show the motion."""
    found = None
    for q in fine(corners, 25):
        found = driven(ARM, found, q)
    return found


def press(tab: FakeBrowser, *key: object, value: object = None) -> None:
    tab.say("feature", ["guide", [*key, len(tab.log)], value])


def points() -> np.ndarray:
    found = loop_of(ARM)
    assert found is not None
    return found


def test_the_loop_comes_back_in_another_posture_and_det_keeps_its_sign() -> None:
    loop = points()
    assert np.array_equal(loop[0], HOME)
    assert np.allclose(tool(loop[-1]), tool(HOME), atol=1e-9)
    assert apart(loop[-1], HOME) > 1.0
    assert ARM.in_limits(loop).all()
    values = np.array([det(q) for q in fine(loop, 60)])
    assert (np.sign(values) == np.sign(det(HOME))).all()
    assert np.abs(values).min() > 0.05 * np.abs(values).max()


def test_two_postures_share_each_sign_and_the_way_leaves_their_region() -> None:
    def postures(q: np.ndarray) -> list[np.ndarray]:
        found = kin.solve_ik(ARM, tool(q), task="position", respect_limits=False)
        return [each.q for each in found.solutions]

    assert sorted(np.sign([det(q) for q in postures(HOME)])) == [-1.0, -1.0, 1.0, 1.0]
    counts = [len(postures(q)) for q in fine(points()[[0, -1]], 40)]
    changes = [(a, b) for a, b in pairwise(counts) if a != b]
    assert changes == [(4, 2), (2, 4)]


def test_the_singular_curve_is_that_of_the_paper() -> None:
    """tan θ3 = cos θ2 / (1 + 2 cos θ2): one factor of det J; the other, 2 + 1.5 cos θ3, is never zero."""
    for t2 in np.linspace(-3.0, 3.0, 13):
        t3 = math.atan2(math.cos(t2), 1.0 + 2.0 * math.cos(t2))
        assert det(np.array([0.4, t2, t3])) == pytest.approx(0.0, abs=1e-9)
        assert abs(det(np.array([0.4, t2, t3 + 0.5 * math.pi]))) > 1e-3


def test_one_joint_after_the_other_goes_round_too() -> None:
    end = np.degrees(points()[-1])
    found = drive(along((-51, -46, 32), (-51, end[1], 32), (end[0], end[1], 32), tuple(end)))
    assert found is not None
    assert len(found.corners) == 5, "straight motions have no corners"
    worst = min(
        np.linalg.svd(numpy_arm.jacobian(ARM, q)[:3] / 1.1, compute_uv=False)[-1] for q in fine(found.corners)
    )
    assert 0.0 < found.least <= worst + 1e-9
    verdict = QUESTION.judge(found.corners.tolist())
    assert verdict.right
    assert "another posture" in verdict.reason
    assert f"above {found.least:.2g}" in drive_html(ARM, found, UNITS)


def test_a_singularity_between_two_samples_is_met() -> None:
    """The determinant has its sign at both ends, and loses it only in between."""
    corners = along((-51, -170, 32))
    values = np.array([det(q) for q in fine(corners)])
    assert np.sign(values[0]) == np.sign(values[-1]) != np.sign(values.min() if values[0] > 0 else values.max())
    met = driven(ARM, DrivenPath(HOME[None]), corners[-1])
    assert met is not None
    assert met.least == 0.0
    assert driven(ARM, met, points()[-1]) is met, "the drive is over"
    assert driven(ARM, met, HOME + 0.1 * SAME) is not met
    assert "singularity was met" in drive_html(ARM, met, UNITS)
    verdict = QUESTION.judge([*corners.tolist(), points()[-1].tolist()])
    assert (verdict.right, verdict.credit) == (False, pytest.approx(2 / 3))
    assert verdict.reason.startswith("A singularity is on the way")


def test_a_drive_begins_at_home_and_is_kept_with_so_many_corners() -> None:
    q = HOME + 0.1
    assert driven(ARM, None, q) is None
    assert "begins at home" in drive_html(ARM, None, UNITS)
    alone = driven(ARM, None, HOME)
    assert alone is not None
    assert "begins here" in drive_html(ARM, alone, UNITS), "nothing is said to be so before there is a drive"
    found, rng = driven(ARM, None, HOME), np.random.default_rng(1)
    assert found is not None
    assert driven(ARM, found, HOME.copy()) is not None
    for _ in range(MOST - 1):
        found = driven(ARM, found, HOME + rng.uniform(0.01, 0.05, 3))
        assert found is not None
    while found is not None and len(found.corners) < MOST:
        found = driven(ARM, found, HOME + rng.uniform(0.01, 0.05, 3))
    assert found is not None
    far = found.corners[-1] - (found.corners[-1] - found.corners[-2])
    assert driven(ARM, found, far + 1e-3) is None
    assert f"at most {MOST} corners" in drive_html(ARM, None, UNITS)


def test_a_hand_that_trembles_makes_no_corners() -> None:
    found, rng = driven(ARM, None, HOME), np.random.default_rng(2)
    for _ in range(MOST + 20):
        found = driven(ARM, found, HOME + rng.uniform(-0.002, 0.002, 3))
    assert found is not None
    assert len(found.corners) == 2


def test_a_right_answer_is_back_in_another_posture() -> None:
    assert QUESTION.judge(QUESTION.right()).right
    for corners, reason in (
        ([HOME], "The posture is that of home."),
        ([HOME, np.radians((-54, -58, 141))], "The posture is that of home."),
        ([HOME, HOME + 0.1], "from where it was"),
        ([points()[-1]], "begins at home"),
    ):
        verdict = QUESTION.judge([q.tolist() for q in corners])
        assert not verdict.right
        assert reason in verdict.reason
    # From home, the two postures with the other sign of det J are behind a singularity.
    others = [each.q for each in kin.solve_ik(ARM, tool(HOME), task="position").solutions]
    behind = [q for q in others if np.sign(det(q)) != np.sign(det(HOME))]
    assert behind
    assert all("A singularity" in QUESTION.judge([HOME.tolist(), q.tolist()]).reason for q in behind)
    near = points()[-1] + (0.9 * NEAR * ARM.reach, 0.0, 0.0)
    assert QUESTION.judge([HOME.tolist(), near.tolist()]).right


def test_an_answer_is_judged_with_a_bounded_number_of_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the singular set, and beside it, where every sample of a motion of the first joint alone is the same."""
    looked, smallest = [], loops.smallest

    def counted(robot: kin.Robot, q: np.ndarray) -> np.ndarray:
        looked.append(len(q))
        return smallest(robot, q)

    monkeypatch.setattr(loops, "smallest", counted)
    t2 = 0.9
    singular = math.atan2(math.cos(t2), 1.0 + 2.0 * math.cos(t2))
    for beside in (0.0, 0.01):
        looked.clear()
        turned = [[3.0 * (-1) ** i, t2, singular + beside] for i in range(MOST - 1)]
        reason = QUESTION.judge([HOME.tolist(), *turned]).reason
        assert reason == "A singularity is on the way, or it is not verified that there is none."
        assert 0 < sum(looked) <= 2 * LOOKS
    assert loops.verified(ARM, np.array([-3.0, t2, singular + 0.01]), np.array([3.0, t2, singular + 0.01])) > 0.0


NO_DRIVES = [None, [], [[1.0, 2.0]], [["1", 2, 3]], [[math.nan, 0, 0]], [[0.0] * 3] * (MOST + 1), [[1.7e308] * 3]]


@pytest.mark.parametrize("answer", NO_DRIVES)
def test_what_is_no_drive_is_refused(answer: object) -> None:
    assert not QUESTION.is_answer(answer)
    with pytest.raises(kin.InputError):
        QUESTION.read(answer)


def test_the_line_on_the_map_is_the_way_of_the_tool() -> None:
    found = kin.posture_map(ARM, respect_limits=False, resolution=8)
    places = tool_path(ARM, points()[[0, -1]])
    path = in_section(found, places)
    expected = np.column_stack([np.hypot(places[:, 0], places[:, 1]), places[:, 2]])
    assert np.allclose(np.abs(path), np.abs(expected), atol=1e-9)
    assert np.allclose(path[0], path[-1], atol=1e-9), "the loop is closed"
    shown = map_html(found, DrivenPath(points()[[0, -1]]), UNITS)
    assert shown.count("<circle") == map_html(found, None, UNITS).count("<circle") + 1


def test_the_steps_are_about_the_arm_that_shows_it() -> None:
    assert all(loop_of(robot) is None for robot in (*CLASSICS, kin.get_robot("rrp")))
    for robot in arms_of("postures"):
        steps = [step for step in Postures.asked(robot, UNITS).steps if step.title in TITLES]
        assert [step.about for step in steps] == [ARM, ARM]
        assert all(step.question is not None for step in steps)


@pytest.mark.full
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_the_arm_is_driven_round_in_the_page(port: int) -> None:
    steps = Postures.asked(arms_of("postures")[0], UNITS).steps
    at = next(i for i, step in enumerate(steps) if step.title == "Drive it round")
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(ARM.name)
        tab.set("Lesson", "Postures")
        tab.wait(lambda: 'data-guide="steps"' in tab.html)
        press(tab, "go", value=at)
        tab.wait(lambda: "The drive begins here" in tab.html and "Postures of Orthogonal 3R:" in tab.html)
        for point in "234":
            tab.set("Way point", point)
            tab.settle(0.1)
        tab.wait(lambda: "The arm is in another posture than at home." in tab.html)
        press(tab, "posture", str(at + 1))
        tab.wait(lambda: f'data-question="{at + 1}" data-closed="1"' in tab.html)
        press(tab, "go", value=at - 1)
        tab.wait(lambda: "Postures of Orthogonal 3R" not in tab.html)
