"""A way around obstacles: waypoints of the joints between two configurations, on which the arm touches nothing.

1. The straight line of the joints is tried first.
2. :mod:`kin.way.search` grows two trees of free motions, one from each end, until they meet (RRT-Connect of OMPL).
3. :mod:`kin.way.shortening` leaves out waypoints and takes shortcuts.
4. :mod:`kin.way.programs` makes a program of it, with zones, and checks its motion.

Every motion is judged by the swept test of :mod:`kin.collision.sweep`, which proves that nothing touches between
two configurations either. The search is random: that it finds nothing in its time does not mean that there is no
way.

J. Kuffner, S. LaValle, RRT-Connect: an efficient approach to single-query path planning, ICRA 2000.
I. Şucan, M. Moll, L. Kavraki, The Open Motion Planning Library, RAM 2012.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from kin.collision import Obstacle
from kin.collision.contacts import surroundings
from kin.errors import InputError, finite_number
from kin.ik import solve_ik
from kin.ik.problem import never_cancel
from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import Array, as_transform
from kin.way.free import Space
from kin.way.programs import way_program
from kin.way.results import Way, WayCause
from kin.way.search import alone, connect, is_installed
from kin.way.shortening import shortened

__all__ = ["LONGEST", "MOST_SEED", "Way", "find_way", "is_installed", "way_program"]

LONGEST, MOST_SEED = 600.0, 2**32 - 1  # seconds
_SHARE = 0.2  # of the time limit, at least, that may be used to shorten the way


def find_way(
    robot: Robot | str,
    q_start: ArrayLike,
    goal: ArrayLike,
    *,
    obstacles: Sequence[Obstacle] = (),
    avoid_self_collision: bool = False,
    seed: int = 0,
    time_limit: float = 5.0,
    progress: Callable[[float], None] | None = None,
    cancel: Callable[[], None] = never_cancel,
) -> Way:
    """Waypoints of the joints from a configuration to a configuration or a pose, with nothing touched between.

    Args:
        robot: the arm, or the id of a built-in one.
        q_start: ``(n,)`` where the arm is.
        goal: ``(n,)`` joint values, or a pose ``(4, 4)`` in the world frame, of which any posture may be the end.
        obstacles, avoid_self_collision: what must not be touched.
        seed: the same seed gives the same way, if it is found before the time is over.
        time_limit: seconds, above 0 and at most 600, for the search; shortening may take a fifth of it more. A
            search that waits for another one of the same process does not count that.
        progress: called now and then with the part of the time that has passed, 0 to 1.
        cancel: called now and then; cancels the search by raising.

    Raises:
        InputError: malformed arguments, or a search is needed and the package ``ompl`` is not installed
            (``pip install 'kinboard[ways]'``). A start that touches something, a goal inside an obstacle and a
            search without success are answers.
    """
    robot = robot_of(robot)
    start, seconds = _checked(robot, q_start, seed, time_limit)
    space = Space.of(robot, surroundings(robot, tuple(obstacles), avoid_self_collision), cancel)
    goals, refused = _goals(robot, start, goal, space)
    refused = space.refusal(start, "start") or refused
    if refused is not None:
        return Way(robot, None, refused, seed, seconds, 0.0)

    began = time.monotonic()

    def passed() -> float:
        part = (time.monotonic() - began) / seconds
        if progress is not None:
            progress(min(part, 1.0))
        cancel()
        return part

    straight = next((q for q in goals if space.is_free(start, q)), None)
    found = None if straight is None else np.array([start, straight])
    if found is None:
        with alone(cancel):
            began = time.monotonic()  # now it searches
            found = connect(space, start, goals, seed, passed)
    searched = time.monotonic() - began
    if found is None:
        return Way(robot, None, WayCause("time"), seed, seconds, searched)
    last = time.monotonic() + max(seconds - searched, _SHARE * seconds)
    q = shortened(space, found, seed, lambda: time.monotonic() > last)
    q.flags.writeable = False
    return Way(robot, q, None, seed, seconds, time.monotonic() - began)


def _checked(robot: Robot, q_start: ArrayLike, seed: int, time_limit: float) -> tuple[Array, float]:
    """The start ``(n,)`` and the seconds; raises `InputError`."""
    start = robot.check_q(q_start, "q_start")
    if start.ndim != 1:
        raise InputError("q_start", f"shape {start.shape}", f"one configuration of {robot.n} values")
    seconds = finite_number("time_limit", time_limit, f"seconds, above 0 and at most {LONGEST:g}")
    if not 0.0 < seconds <= LONGEST:
        raise InputError("time_limit", time_limit, f"seconds, above 0 and at most {LONGEST:g}")
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= MOST_SEED:
        raise InputError("seed", seed, f"a whole number from 0 to {MOST_SEED}")
    return start, seconds


def _goals(robot: Robot, start: Array, goal: ArrayLike, space: Space) -> tuple[list[Array], WayCause | None]:
    """The configurations in which the way may end, the nearest first; or why there is none."""
    values = np.asarray(goal)
    if values.ndim == 1:
        q = robot.check_q(goal, "goal")
        return [q], space.refusal(q, "goal")
    T = as_transform(goal, "goal")
    options = space.options
    result = solve_ik(robot, T, options=options, q_seed=start)
    ends = [each.q for each in result.solutions if space.refusal(each.q, "goal") is None]
    return ends, None if ends else WayCause("goal unreachable", words=result.reason)
