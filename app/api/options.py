"""Options of ``ik``, ``ik/path`` and ``reachable``: task, joint constraints, branch."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from app.api import schemas
from app.api.schemas import Number, numbers
from app.api.targets import Target
from app.shared.settings import Settings
from kin import IKOptions, JointConstraints, Task
from kin.transforms import Array


def single_or_list(value: object) -> str:
    """Tag of a value that may be one item or a list of items."""
    return "many" if isinstance(value, list) else "one"


Mask = Annotated[list[Annotated[bool, Field(strict=True)]], numbers(6)]
Pair = Annotated[list[Number], numbers(2)]
BranchName = Annotated[str, Field(max_length=200)]
BranchNames = Annotated[
    Annotated[BranchName, Tag("one")]
    | Annotated[list[BranchName], Field(min_length=1, max_length=16), Tag("many")],
    Discriminator(single_or_list),
]


class OptionsBody(schemas.Body):
    """Task, joint constraints, branch."""

    task: Task | None = Field(
        None,
        description="pose: the whole pose. approach: the point and the direction of the tool's z axis. "
        "position: the point alone. By default what each target's form implies: "
        "`approach` given → approach, `position` alone → position, else pose.",
    )
    mask: Mask | None = Field(
        None,
        description="Instead of a task: which of the six coordinates x, y, z, rx, ry, rz of the error must "
        "be zero; the last three are the rotation vector from the target to the tool.",
    )
    mask_frame: Literal["tool", "base"] = Field(
        "tool",
        description="Frame of the mask's coordinates: the target's own (tool) or the base frame.",
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
    branch: BranchNames | None = Field(
        None,
        description="Only these branches: a name as in `branches` of the robot, parts of one such as "
        "`shoulder front`, `seed` for the branch of the seed, or a list of these.",
    )

    def options(self, task: Task) -> IKOptions:
        """These fields as options of the core, for a task that the targets may imply."""
        return IKOptions(
            task=task,
            mask=self.mask,
            mask_frame=self.mask_frame,
            constraints=JointConstraints(self.limits, self.locked),
            branch=self.branch,
        )

    def resolve_all(
        self, target: Target | list[Target], settings: Settings
    ) -> tuple[list[tuple[Task, Array]], bool]:
        """`resolve` of one target or of each in a list, and whether it was one.

        All are read before anything is computed: a mistake in the last one costs nothing. Raises 413 for too many.
        """
        if isinstance(target, Target):
            return [self.resolve(target, "target")], True
        schemas.check_batch("target", len(target), settings)
        return [self.resolve(each, f"target[{i}]") for i, each in enumerate(target)], False

    def resolve(self, target: Target, field: str) -> tuple[Task, Array]:
        """The task, and the target's pose ``(4, 4)``; raises `ProblemError` naming `field`.

        With a mask without rotations, a target may be a point alone.
        """
        if self.mask is None:
            return target.resolve(self.task, field)
        _, T = target.resolve("pose" if any(self.mask[3:]) else "position", field)
        return self.task or "pose", T
