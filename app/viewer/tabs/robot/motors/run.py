"""One run of *Match motors*: poses shown one after another, the readings in each, and the conclusion."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

import kin
from app.viewer.scene.clearance import clearance
from kin import InputError, Obstacle, Robot
from kin.files.numbers import LARGEST, number_of
from kin.motors import MotorMatch
from kin.motors.joints import counted, moving_motors, of_moving
from kin.transforms import Array

COUNT = 3  # poses
_LEAST_ROOM = 0.001  # m to the next body
_LONGEST = 2000  # characters of readings


@dataclass(frozen=True, eq=False)
class Run:
    """See the module.

    Attributes:
        robot: the arm, with the motors that are to be matched.
        poses: ``(3, n)``.
        at: index of the pose on show.
        readings: of each pose, None until they are known.
        match: what they say, once they are solved.
    """

    robot: Robot
    poses: Array
    at: int = 0
    readings: tuple[tuple[float, ...] | None, ...] = (None,) * COUNT
    match: MotorMatch | None = None

    @property
    def is_last(self) -> bool:
        """Whether the last pose is on show."""
        return self.at == COUNT - 1

    @property
    def points(self) -> Array:
        """Points ``(k, 3)`` of the arm in all poses, for the picture."""
        frames = kin.link_frames(self.robot, self.poses)
        tools = kin.fk(self.robot, self.poses)
        return np.vstack([frames[..., :3, 3].reshape(-1, 3), tools[:, :3, 3]])

    def of(self, robot: Robot) -> bool:
        """Whether it is about this arm, motors aside."""
        return (self.robot.rows, self.robot.base, self.robot.tool) == (robot.rows, robot.base, robot.tool)

    def read(self, values: tuple[float, ...]) -> Run:
        """The same with these readings in the pose on show."""
        kept = [*self.readings]
        kept[self.at] = values
        return replace(self, readings=tuple(kept), match=None)

    def to(self, at: int) -> Run:
        """The same at another pose."""
        return replace(self, at=min(max(at, 0), COUNT - 1), match=None)

    def solved(self) -> Run:
        """The same with what the readings of the poses say; raises `InputError`: fewer than two poses are read."""
        known = [i for i, values in enumerate(self.readings) if values is not None]
        found = kin.motors.match_motors(self.robot, self.poses[known], [self.readings[i] for i in known])  # type: ignore[arg-type]
        return replace(self, match=found)


def begun(robot: Robot, obstacles: Sequence[Obstacle]) -> Run:
    """A run at its first pose; raises `InputError` if the arm has no motors, or no such poses."""
    moving_motors(robot)
    return Run(robot, kin.motors.motor_poses(robot, COUNT, free(robot, obstacles)))


def free(robot: Robot, obstacles: Sequence[Obstacle]) -> Callable[[Array], bool]:
    """Whether a configuration touches nothing: no link, no obstacle, neither what holds the arm nor the floor.

    Where an arm is drawn into its mount or the floor at home already, these do not count.
    """
    drawn = clearance(robot)
    stands_clear = drawn.at(robot.q_home) is None

    def is_free(q: Array) -> bool:
        if stands_clear and drawn.at(q) is not None:
            return False
        return float(kin.clearance(robot, q, obstacles)) > _LEAST_ROOM

    return is_free


def readings_of(text: str, robot: Robot) -> tuple[float, ...]:
    """Readings of the motors that move a joint, as they are typed or pasted, or of all; raises `InputError`."""
    moving_motors(robot)
    words = re.split(r"[\s,;]+", text.replace("−", "-").strip().strip("[]()").strip()) if text.strip() else []
    values = [number_of(word) for word in words] if len(text) <= _LONGEST else []
    refusal = InputError("readings", text, f"numbers with spaces between: {counted(robot.motors)}")
    if not all(abs(value) < LARGEST for value in values):
        raise refusal
    try:
        return tuple(of_moving(robot.motors, values).tolist())
    except InputError:
        raise refusal from None
