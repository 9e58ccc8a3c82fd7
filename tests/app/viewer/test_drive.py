"""Motions along waypoints, frame by frame."""

from __future__ import annotations

import numpy as np

from app.viewer.drive import FASTEST, FRAME, Drive


def test_frames_pass_whole_waypoints_at_most_as_fast_as_joints_may() -> None:
    q = np.linspace(0.0, 1.0, 101)[:, None] * np.array([1.0, -0.5])
    assert Drive(q).after(0.1).passed == 5
    assert Drive(q, 98).after(1.0).arrived
    assert Drive(q, 10).after(0.0).passed == 11, "at least one"


def test_a_straight_drive_goes_through_all_corners_in_small_steps() -> None:
    corners = np.array([[0.0, 0.0], [0.5, -1.0], [0.5, -1.0], [0.1, 0.2]])
    drive = Drive.straight(corners)
    assert np.abs(np.diff(drive.q, axis=0)).max() < FASTEST * FRAME
    assert np.array_equal(drive.here, corners[0])
    assert all((np.abs(drive.q - corner).max(axis=1) < 1e-12).any() for corner in corners)
    frames = 0
    while not drive.arrived:
        drive, frames = drive.after(FRAME), frames + 1
    assert np.array_equal(drive.here, corners[-1])
    assert frames >= 2.2 / (FASTEST * FRAME)
