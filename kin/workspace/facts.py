"""Sizes of the workspace: bounding box, reach and holes, exact to rounding; volume and surface, estimated."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kin.angles import TURN
from kin.ik.options import JointConstraints, Limits, Locks
from kin.ik.problem import never_cancel
from kin.named import robot_of
from kin.robot import Robot
from kin.workspace.region import Region, checked_integer
from kin.workspace.results import WorkspaceFacts
from kin.workspace.search.extremes import along, base_axis, from_axis, from_point
from kin.workspace.volume import from_probes, from_section


def workspace_facts(
    robot: Robot | str,
    *,
    limits: Limits | None = None,
    locked: Locks | None = None,
    constraints: JointConstraints | None = None,
    effort: int = 4,
    volume: bool = True,
    cancel: Callable[[], None] = never_cancel,
) -> WorkspaceFacts:
    """Bounding box, reach, holes, volume and surface of the points the tool reaches.

    Args:
        robot: the arm, or the id of a built-in one.
        limits, locked: as in `kin.JointConstraints`.
        constraints: both as one value, instead of `limits` and `locked`.
        effort: 2 to 64: points tried per cube, or the resolution of the section in steps of 24 squares. The error
            of the volume falls with its square root, or with its square where joint 1 turns all the way.
        volume: whether to estimate volume and surface, which takes some seconds; the rest takes a tenth of one.
        cancel: called now and then; raises to cancel the computation.

    Returns:
        The figures, each with its estimated error.

    Raises:
        InputError: naming the wrong argument, or a joint that slides without limits.

    Examples:
        >>> import kin
        >>> round(kin.workspace.workspace_facts("planar2r", volume=False).reach.largest.value, 3)
        1.6
    """
    robot, constraints = robot_of(robot), JointConstraints.of(limits, locked, constraints)
    region = Region.finite(robot, constraints)
    tries = checked_integer("effort", effort, 2, 64, "a whole number from 2 to 64")
    point, axis, shoulder = base_axis(region)
    x, y, z = (along(region, direction) for direction in np.eye(3))
    estimate = from_section if _turns(region) else from_probes
    size = estimate(region, tries, cancel) if volume else (None, None)
    return WorkspaceFacts(
        x=x,
        y=y,
        z=z,
        axis_point=point,
        axis=axis,
        shoulder=shoulder,
        radius=from_axis(region, point, axis),
        reach=from_point(region, shoulder),
        volume=size[0],
        surface=size[1],
    )


def _turns(region: Region) -> bool:
    """Whether joint 1 turns all the way."""
    low, high = region.bounds[0]
    return region.robot.turns_as_one and high - low >= TURN - 1e-9
