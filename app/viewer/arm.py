"""The arm of a page at one moment: everything that its numbers, pictures and answers follow from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from typing import Final

from kin import IKOptions, JointConstraints, Obstacle, Robot, fk, link_frames
from kin.collision import Contact
from kin.collision.contacts import surroundings
from kin.ik import Task
from kin.transforms import Array

# Arms with fewer than six joints cannot match every pose. They then match point and approach direction exactly,
# and the status line reports the roll error: that is worth seeing, and the choice of another task is one click
# away.
DEFAULT_TASK: Final[Task] = "pose"


@lru_cache(maxsize=256)
def _options(
    task: Task,
    locked: tuple[float | None, ...] | None,
    branch: str | None,
    avoid: bool,
    obstacles: tuple[Obstacle, ...],
) -> IKOptions:
    """Options that are checked and hashed once for all targets of a drag."""
    constraints = JointConstraints(locked=locked)
    return IKOptions(
        task=task, constraints=constraints, branch=branch, avoid_self_collision=avoid, obstacles=obstacles
    )


# What is computed, from which fields.
_COMPUTED = {
    "T_tool": frozenset({"q"}),
    "T_goal": frozenset({"goal"}),
    "goal_points": frozenset({"goal"}),
    "aim": frozenset({"goal", "target"}),
    "options": frozenset({"goal", "task", "branch", "locks", "obstacles", "avoid"}),
    "contacts_at": frozenset({"obstacles", "avoid"}),
}


@dataclass(frozen=True, eq=False)
class Arm:
    """A robot, where it is and is heading, and how its targets are solved. It does not change when the page does.

    Attributes:
        robot: the selected robot.
        q: the configuration ``(n,)`` shown in the scene.
        goal: the configuration ``(n,)`` the arm is moving to, or has reached.
        target: the target pose ``(4, 4)``; None while the target follows the tool.
        task: how much of the target pose the arm must match.
        branch: the requested branch, as `kin.IKOptions` takes it.
        locks: whether each joint ``(n,)`` is locked.
        obstacles: those that the visitor has placed.
        avoid: whether targets are solved so that the arm touches neither itself nor an obstacle.
    """

    robot: Robot
    q: Array
    goal: Array
    target: Array | None = None
    task: Task = DEFAULT_TASK
    branch: str | None = None
    locks: tuple[bool, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    avoid: bool = False

    @cached_property
    def T_tool(self) -> Array:
        """The pose ``(4, 4)`` of the tool in the scene."""
        return fk(self.robot, self.q)

    @cached_property
    def T_goal(self) -> Array:
        """The pose ``(4, 4)`` that the tool is moving to, or has reached."""
        return fk(self.robot, self.goal)

    @cached_property
    def goal_points(self) -> Array:
        """Origins ``(n, 3)`` of the frames of the links at `goal`."""
        points: Array = link_frames(self.robot, self.goal)[:, :3, 3]
        return points

    @property
    def aim(self) -> Array:
        """The pose ``(4, 4)`` that is wanted: the target, or where the tool is going if the target follows it."""
        return self.T_goal if self.target is None else self.target

    @cached_property
    def options(self) -> IKOptions:
        """The options that targets are solved with: task, requested branch, and locked joints."""
        locked = None
        if any(self.locks):
            locked = tuple(x if lock else None for x, lock in zip(self.goal.tolist(), self.locks, strict=True))
        return _options(self.task, locked, self.branch, self.avoid, self.obstacles if self.avoid else ())

    @property
    def contacts_at(self) -> Callable[[Array], tuple[Contact, ...]]:
        """What the arm touches at a configuration ``(n,)``, the deepest first.

        Links that are only assumed are compared with each other on request: they may be far from those drawn.
        """
        links = self.avoid or bool(self.robot.capsules)
        return surroundings(self.robot, self.obstacles, links).touches if links or self.obstacles else _nothing

    def changes(self, before: Arm | None) -> frozenset[str]:
        """The names of what may have another value: fields of other objects, and what is computed from them."""
        if before is None or before.robot is not self.robot:
            return _ALL
        own = {name for name in _FIELDS if getattr(self, name) is not getattr(before, name)}
        return frozenset(own | {name for name, of in _COMPUTED.items() if not of.isdisjoint(own)} | {"at"})

    def at(self, q: Array) -> Arm:
        """The same arm at another configuration ``(n,)``."""
        return replace(self, q=q)


_FIELDS = tuple(field.name for field in fields(Arm))
_ALL = frozenset({*_FIELDS, *_COMPUTED, "at", "changes"})


def _nothing(q: Array) -> tuple[Contact, ...]:
    return ()
