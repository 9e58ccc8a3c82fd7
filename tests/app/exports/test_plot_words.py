"""Plots in words: what a screen reader says of their extremes, against the values that are plotted."""

from __future__ import annotations

import html
import math
import re

import numpy as np
import pytest

import kin
from app.exports.curves import Curve, Row, with_legend
from app.exports.svg import extremes
from app.viewer.tabs.program.plot import plot_html
from kin.motion import JointTarget, Ptp, plan_motion
from kin.units import Units

T = np.linspace(0.0, 2.0, 201)


def label(drawn: str) -> str:
    found = re.search(r'role="img" aria-label="([^"]*)"', drawn)
    assert found is not None
    return html.unescape(found[1])


def test_the_extremes_of_several_curves_have_their_names_and_places() -> None:
    curves = [("sine", T, np.sin(np.pi * T)), ("parabola", T, (T - 0.5) ** 2)]
    assert extremes("Height, m", curves, "s") == "Height, m: from −1 (sine, at 1.5 s) to 2.25 (parabola, at 2 s)"


def test_one_curve_needs_no_name_and_a_constant_no_place() -> None:
    assert extremes("Speed, m/s", [("it", T, 3.0 * T)], "s") == "Speed, m/s: from 0 (at 0 s) to 6 (at 2 s)"
    assert (
        extremes("Rank", [("a", T, np.full(201, 5.0)), ("b", T, np.full(201, 5.0))], "%") == "Rank: 5 everywhere"
    )


def test_a_chart_of_a_lesson_names_the_extremes_of_each_row_and_leaves_out_what_is_not_in_it() -> None:
    curves = (Curve("one", T, (T, None)), Curve("two", T, (-T, 1e-3 + T)))
    drawn = with_legend((Row("Angle, °"), Row("Error", log=True)), curves, "Two <curves>")
    assert label(drawn) == (
        "Two <curves>. Angle, °: from −2 (two, at 2 s) to 2 (one, at 2 s); "
        "Error: from 0.001 (at 0 s) to 2.001 (at 2 s)."
    )


@pytest.mark.parametrize("joint", [None, 0])
def test_the_plot_of_a_program_names_the_largest_velocity(joint: int | None) -> None:
    robot = kin.get_robot("scara")
    goal = robot.q_home.copy()
    goal[0] += 0.8
    motion = plan_motion(robot, [Ptp(JointTarget(tuple(goal.tolist())))], robot.q_home)
    words = label(plot_html(motion, joint, Units()))
    times = np.linspace(0.0, motion.duration, 2001)
    fastest = np.gradient(motion.sample(times).q[:, 0], times).max()  # rad/s
    scale = 100.0 / motion.limits.velocity[0] if joint is None else math.degrees(1.0)
    found = re.search(r"Velocity[^:]*: from [^;]* to ([\d.]+) \(([^;]*)", words)
    assert found is not None, words
    assert float(found[1]) == pytest.approx(fastest * scale, rel=0.02)
    assert ("joint 1" in found[2]) == (joint is None)
