"""What the doctor finds in a URDF (immutable)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kin.files.urdf.read import UrdfRobot

Rank = Literal["wrong", "suspicious", "left out"]
RANKS: tuple[Rank, ...] = ("wrong", "suspicious", "left out")
Symptom = Literal[
    "file", "name", "type", "limit", "degrees", "millimetres", "axis", "origin", "rounded", "mimic", "tree",
    "number", "body", "mesh", "inertia", "beside the arm", "element",
]  # fmt: skip


@dataclass(frozen=True)
class UrdfFinding:
    """Something to know about a URDF.

    Attributes:
        line: of the element, from 1; None if it concerns the whole file.
        place: the element, such as ``"joint elbow"``.
        symptom: what kind of thing it is.
        rank: ``"wrong"``: the arm, or other readers, refuse it. ``"suspicious"``: it can be read, but is probably
            not what was meant. ``"left out"``: nothing is made of it.
        text: what it is, and for what is left out, why; a sentence.
        mend: what helps, a sentence; empty if nothing has to be done.
        automatic: whether it can be mended without a decision.
        done: whether the mended text has it done.
    """

    line: int | None
    place: str
    symptom: Symptom
    rank: Rank
    text: str
    mend: str = ""
    automatic: bool = False
    done: bool = False


@dataclass(frozen=True, eq=False)
class UrdfExamination:
    """A URDF as the doctor sees it.

    Attributes:
        file: its name.
        read: what the file holds and what was read of it, a sentence each.
        findings: by rank, and then by line.
        arm: the arm between the links that were asked for; None if it is refused.
        refusal: why it is refused; empty if it is not.
        mended: the text with all automatic mends, or with those that were asked for; None if there are none.
        mended_arm: the arm of the mended text; None without one, or if it is still refused.
        moved: largest distance in metres between the tools of both arms, at random configurations; None if one of
            them is missing or they have other joints.
    """

    file: str
    read: tuple[str, ...]
    findings: tuple[UrdfFinding, ...]
    arm: UrdfRobot | None
    refusal: str
    mended: str | None = None
    mended_arm: UrdfRobot | None = None
    moved: float | None = None

    @property
    def mends(self) -> int:
        """How many findings the mended text has done."""
        return sum(each.done for each in self.findings)

    @property
    def mendable(self) -> int:
        """How many findings can be mended without a decision."""
        return sum(each.automatic for each in self.findings)

    def count(self, rank: Rank) -> int:
        """How many findings have a rank.

        Args:
            rank: ``"wrong"``, ``"suspicious"`` or ``"left out"``.

        Returns:
            Their number.

        Examples:
            >>> import kin
            >>> kin.doctor.examine_urdf(kin.robot_to_urdf("ur5")).count("wrong")
            0
        """
        return sum(each.rank == rank for each in self.findings)
