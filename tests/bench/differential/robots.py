"""The arms that are asked about, and their shares of the questions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from arms import CLASSICS, GEN3, SAWYER, XARM7, reversed_at

import kin

# More for arms whose intervals are found by a search; the general solver takes a hundred times longer than others.
_SHARES = {"panda": 3.0, "gen3": 2.0, "xarm7": 2.0, "sawyer": 0.1}


def all_robots() -> dict[str, Any]:
    """Every classic arm, one of each further family, and arms whose tables count some joints the other way."""
    built_in = {robot.id: robot for robot in CLASSICS}
    others = (GEN3, XARM7, SAWYER, reversed_at(built_in["ur5"], (1, 3)), reversed_at(built_in["panda"], (0, 3, 5)))
    few = map(kin.get_robot, ("so100", "gantry", "rpp", "rrp", "gofa"))
    return dict(built_in) | {robot.id: robot for robot in (*others, *few)}


def shares(count: int, only: Sequence[str] = ()) -> list[tuple[Any, int]]:
    """Arms with numbers of questions that add up to `count`, at least one each; `only` names some of the arms."""
    robots = all_robots()
    if unknown := set(only) - set(robots):
        raise ValueError(f"no such arm: {', '.join(sorted(unknown))}; there are {', '.join(robots)}")
    chosen = [robot for name, robot in robots.items() if not only or name in only]
    total = sum(_SHARES.get(robot.id, 1.0) for robot in chosen)
    return [(robot, max(1, round(count * _SHARES.get(robot.id, 1.0) / total))) for robot in chosen]
