"""The (r, z) section with a sign: r is negative behind joint 1's axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import kin
from kin.workspace.sections.cut import faced

SLANTED = ((0.8, 0.0, 0.6, 0.2), (0.0, 1.0, 0.0, 0.3), (-0.6, 0.0, 0.8, 0.9), (0.0, 0.0, 0.0, 1.0))
PIONEER = kin.get_robot("pioneer5")


def signed_points(robot, section, q):
    """(r, z) of tool points ``(k, 2)``, r negative where the tool is more than 90° from where joint 1 faces."""
    p = kin.fk_positions(robot, q) - section.origin
    z = p @ section.v
    across = p - z[:, None] * section.v
    left = np.cross(section.v, section.u)
    ahead = np.cos(q[:, :1]) * section.u + np.sin(q[:, :1]) * left
    return np.stack([np.linalg.norm(across, axis=1) * np.sign((across * ahead).sum(axis=1)), z], axis=1)


def inside(section, points):
    """Which points ``(k, 2)`` are inside the boundary, by counting crossings."""
    x, y = points.T
    crossings = np.zeros(len(points), dtype=int)
    for curve in section.curves:
        for (x1, y1), (x2, y2) in zip(curve, np.roll(curve, -1, axis=0), strict=True):
            spans = (y1 <= y) != (y2 <= y)
            crossings += spans & (x < x1 + (y - y1) / np.where(y2 == y1, 1.0, y2 - y1) * (x2 - x1))
    return crossings % 2 == 1


@pytest.mark.parametrize(
    "robot", [PIONEER, kin.get_robot("ur5"), replace(PIONEER, base=SLANTED)], ids=["pioneer5", "ur5", "slanted"]
)
def test_all_tool_points_are_inside_and_on_both_sides(robot):
    section = kin.workspace.workspace_section(robot, resolution=40, signed=True)
    assert section.signed
    points = signed_points(robot, section, robot.random_q(np.random.default_rng(2), 4000))
    assert (points[:, 0] < 0.0).any()
    assert inside(section, points).mean() > 0.998
    # Its size is what the points span: nothing is mirrored from the other side.
    curves = np.concatenate(section.curves)
    assert curves[:, 0].min() < points[:, 0].min() + 0.05
    assert curves[:, 0].max() > points[:, 0].max() - 0.01
    for arc in section.arcs:
        assert np.abs(curves[:, None] - arc.points[None]).max(axis=2).min(axis=0).max() < 3.0 * section.step


def test_the_pioneer_reaches_less_far_behind_its_axis():
    section = kin.workspace.workspace_section(PIONEER, resolution=40, signed=True)
    s = np.concatenate(section.curves)[:, 0]
    assert s.min() == pytest.approx(-0.326, abs=0.005)
    assert s.max() == pytest.approx(0.487, abs=0.002)
    assert np.allclose(section.u, [1.0, 0.0, 0.0])
    plain = kin.workspace.workspace_section(PIONEER, resolution=40)
    assert not plain.signed
    assert np.concatenate(plain.curves)[:, 0].min() >= -1e-12


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda robot: robot.id)
def test_joint_1_faces_to_the_side_of_the_bases_x_axis(robot):
    ahead = faced(robot, np.array([0.0, 0.0, 1.0]))
    assert np.allclose(ahead, [1.0, 0.0, 0.0], atol=1e-12)
