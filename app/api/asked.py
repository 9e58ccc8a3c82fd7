"""What can be asked of the arm besides where to go: the fields that ``ik`` and ``ik/path`` share."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from app.api import schemas
from app.api.schemas import Number, numbers
from app.api.targets import Target
from app.shared.settings import Settings
from kin import Task
from kin.transforms import Array


def one_or_many(value: object) -> str:
    """Whether one thing was sent or a list of them."""
    return "many" if isinstance(value, list) else "one"


Mask = Annotated[list[Annotated[bool, Field(strict=True)]], numbers(6)]
Pair = Annotated[list[Number], numbers(2)]
Wish = Annotated[str, Field(max_length=200)]
Wishes = Annotated[
    Annotated[Wish, Tag("one")] | Annotated[list[Wish], Field(min_length=1, max_length=16), Tag("many")],
    Discriminator(one_or_many),
]


class Asked(schemas.Body):
    """The task, and what the joints may do."""

    task: Task | None = Field(
        None,
        description="pose: the whole pose. approach: the point and the direction of the tool's z axis. "
        "position: the point alone. By default what each target's form implies: "
        "`approach` given → approach, `position` alone → position, else pose.",
    )
    mask: Mask | None = Field(
        None,
        description="Instead of a task: which of the six coordinates x, y, z, rx, ry, rz of the error must "
        "vanish; the last three are the rotation vector from the target to the tool.",
    )
    mask_frame: Literal["tool", "base"] = Field(
        "tool",
        description="Whether the mask's coordinates are told in the target's own frame or in the base frame.",
    )
    limits: list[Pair | None] | None = Field(
        None,
        description="Narrower joint limits, one [lower, upper] per joint in radians (metres), inside the robot's "
        "own; null for a joint that keeps its own.",
    )
    locked: list[Number | None] | None = Field(
        None,
        description="Joint values to keep, in radians (metres), one per joint; null for a joint that may move.",
    )
    branch: Wishes | None = Field(
        None,
        description="Only these branches: a name as in `branches` of the robot, parts of one such as `elbow up`, "
        "`seed` for the branch the seed is on, or a list of these.",
    )

    @property
    def options(self) -> dict[str, Any]:
        """These fields but for the task, as `kin.solve_ik` and `kin.solve_path` take them by name."""
        return {name: getattr(self, name) for name in ("mask", "mask_frame", "limits", "locked", "branch")}

    def resolve_all(
        self, target: Target | list[Target], settings: Settings
    ) -> tuple[list[tuple[Task, Array]], bool]:
        """What `resolve` gives for one target or for a list, and whether it was one.

        All are read before anything is answered: a mistake in the last one costs nothing. Raises 413 for too many.
        """
        if isinstance(target, Target):
            return [self.resolve(target, "target")], True
        schemas.check_batch("target", len(target), settings)
        return [self.resolve(each, f"target[{i}]") for i, each in enumerate(target)], False

    def resolve(self, target: Target, field: str) -> tuple[Task, Array]:
        """The task as the core takes it, and the target's pose ``(4, 4)``; raises `ProblemError` naming `field`.

        A mask without rotations takes a target that is a point alone.
        """
        if self.mask is None:
            return target.resolve(self.task, field)
        _, T = target.resolve("pose" if any(self.mask[3:]) else "position", field)
        return self.task or "pose", T
