"""Targets of programs as they stand on a pendant."""

from __future__ import annotations

import numpy as np
import pytest

import kin

KUKA = "X 400 Y 100 Z 300 A 10 B 120 C 30"


def target(
    pose: object, units: dict[str, str] | None = None, robot: str | None = None, **more: object
) -> kin.motion.PoseTarget:
    """The target of a program of one segment."""
    data = {"units": units or {}, "segments": [{"kind": "ptp", "pose": pose, **more}]}
    frames = {"table": kin.pose_from_xyz_rpy([1.0, 0.0, 0.0], [0.0, 0.0, np.pi / 2])}
    segment = kin.motion.program_from_dict(data, robot, frames).segments[0]
    assert isinstance(segment, kin.motion.Ptp)
    assert isinstance(segment.target, kin.motion.PoseTarget)
    return segment.target


def test_a_pose_may_be_a_text() -> None:
    T = kin.pose_from_text(KUKA, "kuka")
    assert np.allclose(target(f"kuka {KUKA}").pose(np.eye(4)), T)
    assert np.allclose(target(KUKA, robot="kr6").pose(np.eye(4)), T), "by the maker of the arm"
    in_table = target(f"kuka {KUKA}", frame="table").pose(np.eye(4))
    assert np.allclose(in_table, kin.pose_from_xyz_rpy([1.0, 0.0, 0.0], [0.0, 0.0, np.pi / 2]) @ T)
    typed = target("400 100 300 0 90 0", {"length": "mm", "angle": "deg"}).pose(np.eye(4))
    assert np.allclose(typed, kin.pose_from_text("0.4 0.1 0.3 0 pi/2 0"))
    assert target("0.4 0.1 0.3").wxyz is None


@pytest.mark.parametrize(
    ("pose", "said"),
    [
        (KUKA, r"segments\[0\]\.pose: .*begin with kuka or doosan or mitsubishi"),
        ("0.4 0.1 0.3 along 0 0 -1", r"segments\[0\]\.pose: .*a whole pose, or a point"),
        ("nowhere", r"segments\[0\]\.pose: .*is not a number"),
    ],
)
def test_a_text_that_is_no_pose_names_its_field(pose: str, said: str) -> None:
    with pytest.raises(kin.InputError, match=said):
        target(pose)


def test_a_quaternion_far_from_unit_length_is_no_target() -> None:
    with pytest.raises(kin.InputError, match=r"wxyz: .*this one has the length 0\.24"):
        kin.motion.PoseTarget((0.4, 0.1, 0.3), (0.0, 0.24, 0.0, 0.0))
    assert kin.motion.PoseTarget((0.4, 0.1, 0.3), (0.0, 1.01, 0.0, 0.0)).wxyz == (0.0, 1.0, 0.0, 0.0)
