"""The visitor's choices for the whole page: units, looks, and how much of a target the arm must match."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.viewer.arm import DEFAULT_TASK
from app.viewer.declared.fields import Settings, choice, flag, part
from app.viewer.scene.arm.looks import AxesShown, Look
from kin.ik import Task
from kin.poses import ANGLES, QUATERNIONS, Rotations
from kin.units import DEFAULT_UNITS, LENGTHS, Length, Units

SCHEMES: Final[dict[str, bool | None]] = {"Like the system": None, "Light": False, "Dark": True}
JOINT_AXES: Final[dict[str, AxesShown]] = {"On skeletons": True, "On every arm": "every", "Never": False}
LOOKS: Final[dict[str, Look]] = {"Body": "body", "Skeleton": "skeleton", "Both": "both"}
AXES: Final = {"Tool axes": False, "Base axes": True}
TASKS: Final[dict[str, Task]] = {"Full pose": "pose", "Point + approach": "approach", "Point only": "position"}
TASK_HINT = (
    "Full pose: the position and orientation of the tool. "
    "Point + approach: the tool point and the direction of the tool's z axis; any roll. "
    "Point only: the tool point; any orientation."
)
LOOK_HINT = (
    "Body: as the real arm looks. Skeleton: its joints and links, in the colours of the sliders. "
    "Both: the skeleton in a translucent body. Arms without a drawn body are always a skeleton."
)
AVOID_HINT = (
    "Targets are reached only in postures in which the arm touches neither itself nor an obstacle, and programs "
    "that touch something are refused. What touches is red in any case."
)
AXES_HINT = (
    "The directions of the coloured arrows and rings, and of the keys that move the target: those of the tool, or "
    "those of the base. The key G switches. Hold Shift while dragging to move in steps."
)
NOTATION_HINT = "How rotations are written in the read-out, and typed in a target"
LANGUAGE_HINT = "The words of the lessons, as far as this service has them in another language"
NOTATION_UNDO = "How rotations are written"


@dataclass(frozen=True)
class ViewState(Settings):
    """How the page looks, under ``"view"`` in links; the choices are kept when another robot is selected.

    Attributes:
        dark: whether the page is dark; None: as the visitor's system is.
        base_axes: whether the gizmo is aligned with the base instead of the tool.
        look: how an arm is drawn of which there is a body.
        detailed: whether the body is that of an installed package, if there is one for the arm.
        avoid: whether the arm is moved to targets without touching itself or an obstacle.
        angles, quaternions: how rotations are written and typed: keys of `ANGLES` and `QUATERNIONS`.
        language: of lessons; "", or one that the service does not have: as it is set.
    """

    frames: bool = flag("Link frames", hint="The frame of every DH row: x red, y green, z blue")
    labels: bool = flag("Frame labels", True, hint="The name of each frame, at the tip of its z axis")
    axes: AxesShown = choice(
        "Joint axes",
        JOINT_AXES,
        True,
        hint="The axis of each joint, through the body of an arm that has one; its arrow shows the positive turn",
    )
    dark: bool | None = choice(
        "Page colours",
        SCHEMES,
        None,
        hint="Light or dark, or as the system is set",
        undo="Page colours",
        names="page colours",
    )
    base_axes: bool = choice(
        "Arrows along", AXES, False, hint=AXES_HINT, undo="Arrows along", names="arrows along"
    )
    look: Look = choice("Show arm as", LOOKS, "body", hint=LOOK_HINT, undo="Show arm as", names="show arm as")
    detailed: bool = flag("Real shape")
    avoid: bool = flag("Avoid collisions", hint=AVOID_HINT)
    angles: str = choice(
        "Rotations", {one.title: key for key, one in ANGLES.items()}, "rpy", hint=NOTATION_HINT, undo=NOTATION_UNDO
    )
    quaternions: str = choice(
        "Quaternions",
        {one.title: key for key, one in QUATERNIONS.items()},
        "wxyz",
        hint=NOTATION_HINT,
        undo=NOTATION_UNDO,
    )

    language: str = choice(
        "Language",
        {"As the service is set": ""},
        "",
        hint=LANGUAGE_HINT,
        undo="Language",
        anything=True,
    )

    def is_dark(self, system: bool) -> bool:
        """Whether the page is dark on a system that is, or is not."""
        return system if self.dark is None else self.dark

    @property
    def rotations(self) -> Rotations:
        """The notations of rotations."""
        return Rotations(self.angles, self.quaternions)


@dataclass(frozen=True)
class PageChoices(Settings):
    """All choices as their controls show them. Units and task have entries of their own in links."""

    radians: bool = flag("Radians", hint="Angles in radians instead of degrees", undo="Unit of angles", link=False)
    lengths: Length = choice(
        "Lengths",
        {unit: unit for unit in LENGTHS},
        DEFAULT_UNITS.length,
        hint="Unit of all lengths",
        undo="Unit of lengths",
        link=False,
    )
    task: Task = choice("Target must match", TASKS, DEFAULT_TASK, hint=TASK_HINT, link=False)
    view: ViewState = part(ViewState)

    @property
    def units(self) -> Units:
        """The units of angles and lengths."""
        return Units(not self.radians, self.lengths)
