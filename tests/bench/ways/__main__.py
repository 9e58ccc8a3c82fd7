"""``python tests/bench/ways``: ways around obstacles in ten scenes, beside OMPL alone with its own checks.

*OMPL alone* is RRT-Connect with the distances of our bodies at single configurations, OMPL's discrete check of
motions at its usual resolution, and OMPL's own simplification. What it finds is then looked at by the swept test.
Each search is one scene, arm and seed. The times include shortening, for which `kin.way` uses the time that is
left.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "bench")]

from ways.scenes import SCENES, Scene, ends  # noqa: E402

import kin  # noqa: E402
from kin.collision.contacts import surroundings  # noqa: E402
from kin.differential.metric import weights  # noqa: E402
from kin.way import find_way  # noqa: E402
from kin.way.free import Space  # noqa: E402
from kin.way.results import path_length  # noqa: E402
from kin.way.search import STEP, alone  # noqa: E402

ARMS = ("ur5", "panda", "iiwa14")


class Found(NamedTuple):
    """What a search has found: seconds, length (nan: nothing was found), and whether the way is free all along."""

    seconds: float
    length: float
    free: bool


def main() -> int:
    """Print the tables; 1 if a way of ours touches something."""
    parser = argparse.ArgumentParser(prog="python tests/bench/ways", description=__doc__)
    parser.add_argument("--seeds", type=int, default=1, help="searches of each scene and arm (1)")
    parser.add_argument("--time-limit", type=float, default=5.0, help="seconds of a search (5)")
    parser.add_argument("--only", nargs="+", default=list(ARMS), metavar="ARM", help="these arms only")
    arguments = parser.parse_args()
    print(f"{'arm':9}{'search':12}{'solved':>10}{'s, median':>11}{'s, most':>9}{'length':>8}{'touch':>7}")
    bad = 0
    for name in arguments.only:
        robot = kin.get_robot(name)
        rows: dict[str, list[Found]] = {"kinboard": [], "OMPL alone": []}
        for scene, start, goal in posed(robot):
            for seed in range(arguments.seeds):
                rows["kinboard"].append(ours(robot, scene, start, goal, seed, arguments.time_limit))
                rows["OMPL alone"].append(ompl_alone(robot, scene, start, goal, seed, arguments.time_limit))
        for search, found in rows.items():
            print(f"{name:9}{search:12}{line(found)}")
        bad += sum(not each.free for each in rows["kinboard"])
    return int(bad > 0)


def posed(robot: kin.Robot) -> Iterator[tuple[Scene, np.ndarray, np.ndarray]]:
    """The scenes with free ends and no free straight motion between them."""
    for scene in SCENES:
        found = ends(robot, scene)
        if found is None:
            print(f"{robot.id:9}{scene.name}: no free start or goal", file=sys.stderr)
        else:
            yield scene, *found


def line(found: list[Found]) -> str:
    """One row of the table."""
    solved = [each for each in found if np.isfinite(each.length)]
    seconds = [each.seconds for each in solved] or [np.nan]
    length = statistics.mean(each.length for each in solved) if solved else np.nan
    touching = sum(not each.free for each in solved)
    share = f"{len(solved)} of {len(found)}"
    return f"{share:>10}{statistics.median(seconds):11.2f}{max(seconds):9.2f}{length:8.1f}{touching:7}"


def space_of(robot: kin.Robot, scene: Scene) -> Space:
    """The free space of a scene."""
    return Space.of(robot, surroundings(robot, scene.obstacles, True), lambda: None)


def is_free(space: Space, q: np.ndarray) -> bool:
    """Whether the swept test finds nothing on a polyline ``(k, n)``."""
    return all(space.is_free(a, b) for a, b in pairwise(q))


def ours(robot: kin.Robot, scene: Scene, start: np.ndarray, goal: np.ndarray, seed: int, seconds: float) -> Found:
    """`kin.way.find_way`."""
    way = find_way(
        robot, start, goal, obstacles=scene.obstacles, avoid_self_collision=True, seed=seed, time_limit=seconds
    )
    return Found(
        way.seconds, way.length if way.found else np.nan, way.q is None or is_free(space_of(robot, scene), way.q)
    )


def ompl_alone(
    robot: kin.Robot, scene: Scene, start: np.ndarray, goal: np.ndarray, seed: int, seconds: float
) -> Found:
    """RRT-Connect and the simplifier of OMPL, with its discrete check of motions."""
    from ompl import base, geometric, util

    space, weight = space_of(robot, scene), weights(robot)

    def read(state) -> np.ndarray:
        return np.array([state[i] for i in range(robot.n)]) / weight

    with alone(lambda: None):
        util.noOutputHandler()
        util.RNG.setSeed(seed + 1)
        states = base.RealVectorStateSpace(robot.n)
        bounds = base.RealVectorBounds(robot.n)
        for i, (low, high) in enumerate(zip(space.lower * weight, space.upper * weight, strict=True)):
            bounds.setLow(i, float(low))
            bounds.setHigh(i, float(high))
        states.setBounds(bounds)
        setup = geometric.SimpleSetup(states)
        setup.setStateValidityChecker(lambda state: space.is_free_at(read(state)))
        ends = []
        for q in (start, goal):
            state = states.allocState()
            for i, value in enumerate((q * weight).tolist()):
                state[i] = value
            ends.append(state)
        setup.setStartAndGoalStates(*ends)
        planner = geometric.RRTConnect(setup.getSpaceInformation())
        planner.setRange(STEP)
        setup.setPlanner(planner)
        began = time.monotonic()
        setup.solve(seconds)
        if not setup.haveExactSolutionPath():
            return Found(time.monotonic() - began, np.nan, True)
        setup.simplifySolution()
        took = time.monotonic() - began
        path = setup.getSolutionPath()
        q = np.array([read(path.getState(i)) for i in range(path.getStateCount())])
    return Found(took, path_length(robot, q), is_free(space, q))


if __name__ == "__main__":
    sys.exit(main())
