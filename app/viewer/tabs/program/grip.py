"""The gripper of the page, as a program moves it."""

from __future__ import annotations

from app.viewer.feature import Stage
from kin.motion import Motion


def show(stage: Stage, motion: Motion | None, time: float, before: float) -> float:
    """Open the gripper as far as it is at a time of a motion; until its first row begins it stays as it is.

    Args:
        before: how far it was open before that row; NaN: not known.

    Returns:
        The same for the next time.
    """
    now = stage.arm.opening
    first = next((each for each in motion.segments if each.opening is not None), None) if motion else None
    if motion is None or first is None or now is None:
        return before
    if time <= first.start < first.end:
        return now
    stage.arm.open_gripper(float(motion.opening(time, before)))
    return before
