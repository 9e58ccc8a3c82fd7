"""The lesson "Trajectories": its numbers and curves against the core, and what it draws."""

from __future__ import annotations

import re

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.exports.curves import WIDTH, Curve, Row, with_legend
from app.viewer import profiles
from app.viewer.lessons.guide.outline import Number
from app.viewer.lessons.trajectories import motions
from app.viewer.lessons.trajectories.lesson import TrajectoriesLesson
from app.viewer.lessons.trajectories.questions import END, LINKS, OFFSETS, SPEED, START
from kin import Robot
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

UR5, STANFORD = kin.get_robot("ur5"), kin.get_robot("stanford")


@pytest.mark.parametrize("robot", [UR5, STANFORD, kin.get_robot("pioneer5")], ids=lambda robot: robot.id)
def test_every_profile_is_as_fast_as_the_limits_allow(robot: Robot) -> None:
    _, _, way, limits = motions.example(robot)
    for name, profile in motions.family(robot).items():
        _, values = motions.sampled(profile, 1.0)
        assert values[0][[0, -1]] == pytest.approx([0.0, way])
        reached = np.abs(values[1:]).max(axis=1) / limits
        kept = reached[:2] if name in ("cubic", "trapezoidal") else reached
        assert kept.max() == pytest.approx(1.0, abs=1e-3)


def test_the_numbers_of_the_steps() -> None:
    answers = {
        key: q.answer for key, q in TrajectoriesLesson.outline(UR5, Units()).questions() if isinstance(q, Number)
    }
    cubic = motions.family(UR5)["cubic"]
    _, values = motions.sampled(cubic, 1.0)
    assert answers["2"] == pytest.approx(values[1].max() / (values[0][-1] / cubic.duration), abs=1e-3)
    x, rate = motions.turning_past(OFFSETS[0], SPEED, 0.3)
    assert answers["5"] == pytest.approx(rate.max())
    angle = np.arctan2(OFFSETS[0], -x)  # where the tool is, seen from the axis
    assert np.allclose(np.gradient(angle, x / SPEED)[1:-1], rate[1:-1], rtol=1e-3)
    assert answers["c1"] == profiles.cubic(0.0, 2.0, 2.0).sample([0.0])[2, 0]


def test_a_ptp_is_never_slower_than_a_line_and_leaves_it() -> None:
    found = motions.ways(UR5)
    assert found is not None
    assert found.ptp.duration <= found.lin.duration * (1 + 1e-9)
    ends = [each.sample([0.0, each.duration]).T for each in found]
    assert np.allclose(ends[0], ends[1], atol=1e-6)
    _, off = found.off_line()
    assert off[0] == pytest.approx(0.0, abs=1e-9)
    assert off[-1] < 1e-5
    assert off.max() > 0.01


def test_a_line_goes_through_in_the_posture_that_the_chart_of_postures_says() -> None:
    arm = kin.get_robot("planar2r")
    assert tuple(row.a for row in arm.rows) == LINKS
    share, found = motions.both_elbows(START, END, LINKS)
    points = np.array([[*(np.array(START) + s * np.subtract(END, START)), 0.0] for s in share])
    postures = kin.path.path_postures(arm, points, options=kin.IKOptions(task="position"))
    assert [postures.postures[row] for row in postures.through] == ["elbow positive"]
    for name, angles in zip(("elbow positive", "elbow negative"), found, strict=True):
        row = postures.postures.index(name)
        last = int(postures.reach[0, row])
        assert np.allclose(postures.q[: last + 1, row, 0], angles[: last + 1], atol=1e-9)
        assert (np.abs(angles) <= np.pi).all() == (last == len(share) - 1)
    step = next(each for each in TrajectoriesLesson.outline(UR5, Units()).steps if "posture a line" in each.title)
    (stop,) = re.findall(r"joint 1 is at 180° after (\d+) % of the line", step.shown)
    assert float(stop) == pytest.approx(100.0 * last / (len(share) - 1), abs=1.1)
    assert step.question is not None
    assert step.question.judge(step.question.right()).right


def test_a_load_behind_a_ramp_of_its_own_period_rests_after_the_stop() -> None:
    hertz = motions.frequency(UR5)
    blow, smooth = (motions.residual(motions.family(UR5)[name], hertz) for name in ("trapezoidal", "S-curve"))
    assert blow > 20 * smooth
    # While a constant acceleration lasts, the load swings about -a / ω².
    push = profiles.trapezoidal(0.0, 1e3, 1e6, 1.0)
    times, x = motions.swing(push, 1.0)
    first = x[(times > 0.0) & (times < 1.0)]
    assert first.min() == pytest.approx(-2.0 / (2 * np.pi) ** 2, rel=0.05)


@pytest.mark.parametrize("axis", ["s", "mm", "iterations"])
@pytest.mark.parametrize("end", [0.3, 1.0, 250.0])
def test_the_numbers_of_the_horizontal_axis_stay_inside_and_apart(end: float, axis: str) -> None:
    times = np.linspace(0.0, end, 5)
    shown = str(with_legend((Row("a"),), (Curve("b", times, (times,)),), "c", axis))
    numbers = re.findall(r'<text x="([\d.]+)" y="[\d.]+" text-anchor="middle" class="kb-axis">([^<]+)', shown)
    numbers.reverse()
    assert numbers[-1][1].endswith(f" {axis}")
    half = [3.0 * len(text) for _, text in numbers]  # of the widths, in pixels
    middle = [float(x) for x, _ in numbers]
    assert middle[-1] + half[-1] <= WIDTH
    assert all(middle[i] + half[i] < middle[i + 1] - half[i + 1] for i in range(len(numbers) - 1))


def test_names_in_a_chart_are_escaped() -> None:
    times = np.linspace(0.0, 1.0, 5)
    shown = str(with_legend((Row("<b>"),), (Curve("<i>", times, (times,)),), "<u>"))
    assert "<b>" not in shown
    assert "<i>" not in shown
    assert "<u>" not in shown


def test_both_ways_are_drawn_and_removed(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Lesson", "Trajectories")
        tab.wait(lambda: "data-guide" in tab.html)
        tab.settle()
        assert "kb-chart" not in tab.html, "a plot is shown after its prediction"
        tab.set("Both ways in the scene", True)
        tab.wait(lambda: sum(name.startswith("/trajectories-") for name in tab.nodes) == 3)
        tab.say("feature", ["guide", ["reveal", "1", 1], None])
        tab.wait(lambda: "kb-chart" in tab.html)
        tab.set("Lesson", "None")
        tab.wait(lambda: not any(name.startswith("/trajectories-") for name in tab.nodes))
