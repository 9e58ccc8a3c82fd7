"""Options of the display: units, frames, labels, axes, page colours, camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import viser

from app.viewer.labels import TEXT_SIZES
from app.viewer.panel import Post, assign, listen, listen_click
from app.viewer.panel.rotations import ANGLES, QUATERNIONS, Rotations
from app.viewer.views.templates import render
from kin import InputError, Robot
from kin.units import LENGTHS, Length, Units

BRAND = (0, 114, 178)
BRAND_ON_DARK = (86, 180, 233)
SCHEMES: dict[str, bool | None] = {"Like the system": None, "Light": False, "Dark": True}
Side = Literal["Front", "Side", "Top", "Corner"]
SIDES: tuple[Side, ...] = get_args(Side)
SYSTEM_IS_DARK = "The system is dark"  # static/page.js looks for this label

Look = Literal["body", "skeleton", "both"]
LOOKS: tuple[Look, ...] = get_args(Look)
LOOK_NAMES: dict[Look, str] = {"body": "Body", "skeleton": "Skeleton", "both": "Both"}
LOOK_HINT = (
    "Body: as the real arm looks. Skeleton: its joints and links, in the colours of the sliders. "
    "Both: the skeleton in a translucent body. Arms without a drawn body are always a skeleton."
)
AVOID_HINT = (
    "Targets are reached only in postures in which the arm touches neither itself nor an obstacle, and programs "
    "that touch something are refused. What touches is red in any case."
)
AXES = ("Tool axes", "Base axes")
AXES_HINT = (
    "The directions of the coloured arrows and rings, and of the keys that move the target: those of the tool, or "
    "those of the base. The key G switches. Hold Shift while dragging to move in steps."
)


@dataclass
class ViewState:
    """The visitor's choices; they are kept when another robot is selected.

    Attributes:
        dark: whether the page is dark; None: as the visitor's system is.
        base_axes: whether the gizmo is aligned with the base instead of the tool.
        look: how an arm is drawn of which there is a body.
        detailed: whether the body is that of an installed package, for arms of which there is one.
        avoid: whether the arm is moved to targets without touching itself or an obstacle.
        angles, quaternions: how rotations are written and typed: keys of `ANGLES` and `QUATERNIONS`.
    """

    frames: bool = False
    labels: bool = True
    axes: bool = True
    dark: bool | None = None
    base_axes: bool = False
    look: Look = "body"
    detailed: bool = False
    avoid: bool = False
    angles: str = "rpy"
    quaternions: str = "wxyz"

    @property
    def rotations(self) -> Rotations:
        """The notations of rotations."""
        return Rotations(self.angles, self.quaternions)


class UnitChoice:
    """Posts ``"radians"`` and ``"lengths"``."""

    def __init__(self, gui: viser.GuiApi, units: Units, post: Post) -> None:
        hint = "Angles in radians instead of degrees"
        self._radians = gui.add_checkbox("Radians", not units.degrees, hint=hint)
        listen(self._radians, post, "radians")
        self._length: Length = units.length
        self._lengths = gui.add_dropdown(
            "Lengths", LENGTHS, initial_value=units.length, hint="Unit of all lengths"
        )
        listen(self._lengths, post, "lengths")

    def show(self, units: Units) -> None:
        """Show these units."""
        self._length = units.length
        assign(self._radians, not units.degrees)
        assign(self._lengths, units.length)

    def with_length(self, units: Units, value: object) -> Units:
        """The units with the chosen unit of length; raises `InputError` for an unknown one."""
        if value not in LENGTHS:
            assign(self._lengths, self._length)
            raise InputError("lengths", value, "one of " + ", ".join(LENGTHS))
        self._length = value
        return replace(units, length=self._length)


class RotationChoice:
    """Posts ``("rotations", "angles")`` and ``("rotations", "quaternions")``."""

    def __init__(self, gui: viser.GuiApi, rotations: Rotations, post: Post) -> None:
        hint = "How rotations are written in the read-out, and typed in a target"
        self._tables = {"angles": ANGLES, "quaternions": QUATERNIONS}
        self._menus: dict[str, viser.GuiDropdownHandle[str]] = {}
        for name, label in (("angles", "Rotations"), ("quaternions", "Quaternions")):
            titles = tuple(each.title for each in self._tables[name].values())
            chosen = self._tables[name][getattr(rotations, name)].title
            self._menus[name] = gui.add_dropdown(label, titles, initial_value=chosen, hint=hint)
            listen(self._menus[name], post, ("rotations", name))

    def show(self, rotations: Rotations) -> None:
        """Show these notations."""
        for name, menu in self._menus.items():
            assign(menu, self._tables[name][getattr(rotations, name)].title)

    def read(self, name: str, value: object, before: Rotations) -> str:
        """A choice as a field of `ViewState`; an unknown one raises `InputError`, and `before` is shown again."""
        table = self._tables[name]
        found = next((key for key, notation in table.items() if notation.title == value), None)
        if found is None:
            self.show(before)
            raise InputError(name, value, "one of " + ", ".join(each.title for each in table.values()))
        return found


class ViewOptions:
    """The options of the scene; a choice of detailed bodies only if some robots have one.

    Posts ``"look"``, ``("view", name)`` (check boxes), ``"axes"``, ``"camera"``, ``"fit-arm"`` and
    ``("look-from", side)``.
    """

    def __init__(self, gui: viser.GuiApi, state: ViewState, detailed: Sequence[Robot], post: Post) -> None:
        self._gui = gui
        names = tuple(LOOK_NAMES.values())
        self._look = gui.add_dropdown("Show arm as", names, initial_value=LOOK_NAMES[state.look], hint=LOOK_HINT)
        listen(self._look, post, "look")
        self._boxes: dict[str, viser.GuiCheckboxHandle] = {}
        if detailed:
            self.add_box("detailed", "Real shape", _about_detailed(detailed), state, post)
        for name, text, hint in (
            ("frames", "Link frames", "The frame of every DH row: x red, y green, z blue"),
            ("labels", "Frame labels", "The name of each frame, at the tip of its z axis"),
            (
                "axes",
                "Joint axes",
                "The axis of each joint of a skeleton; its arrow shows the positive turn",
            ),
        ):
            self.add_box(name, text, hint, state, post)
        initial = AXES[state.base_axes]
        self._axes = gui.add_dropdown("Arrows along", AXES, initial_value=initial, hint=AXES_HINT)
        listen(self._axes, post, "axes")
        gui.add_html(render("panel/text_size", names=tuple(TEXT_SIZES)))
        group = gui.add_button_group("Camera", ("Fit all", "Reset view"))
        listen_click(group, post, {"Fit all": "fit-arm", "Reset view": "camera"})
        sides = gui.add_button_group("View from", SIDES)
        listen_click(sides, post, {side: ("look-from", side) for side in SIDES})

    def add_box(self, name: str, text: str, hint: str, state: ViewState, post: Post) -> None:
        """Add a check box for a choice of this name to the container that is open."""
        self._boxes[name] = self._gui.add_checkbox(text, getattr(state, name), hint=hint)
        listen(self._boxes[name], post, ("view", name))

    def show(self, state: ViewState) -> None:
        """Show these choices."""
        for name, box in self._boxes.items():
            assign(box, getattr(state, name))
        assign(self._axes, AXES[state.base_axes])
        assign(self._look, LOOK_NAMES[state.look])

    def read_look(self, value: object, before: Look) -> Look:
        """A choice as `ViewState.look`; an unknown one raises `InputError`, and `before` is shown again."""
        found = next((look for look in LOOKS if LOOK_NAMES[look] == value), None)
        if found is None:
            assign(self._look, LOOK_NAMES[before])
            raise InputError("show arm as", value, "one of " + ", ".join(LOOK_NAMES.values()))
        return found


def _about_detailed(robots: Sequence[Robot]) -> str:
    names = ", ".join(robot.name for robot in robots)
    return f"The body in every detail, from its maker's drawings, instead of our simplified one: {names}."


class ColourChoice:
    """The colours of the page. Posts ``"colours"``, and ``"system-dark"`` when the visitor's system changes.

    The check box is hidden: ``static/page.js`` keeps it as the system is.
    """

    def __init__(self, gui: viser.GuiApi, system_dark: bool, post: Post) -> None:
        self._gui, self._post = gui, post
        listen(gui.add_checkbox(SYSTEM_IS_DARK, system_dark), post, "system-dark")
        self._choice: viser.GuiDropdownHandle[str]

    def build(self, dark: bool | None) -> None:
        """Add the choice to the container that is open."""
        hint = "Light or dark, or as the system is set"
        self._choice = self._gui.add_dropdown(
            "Page colours", tuple(SCHEMES), initial_value=_scheme(dark), hint=hint
        )
        listen(self._choice, self._post, "colours")

    def show(self, dark: bool | None) -> None:
        """Show this choice."""
        assign(self._choice, _scheme(dark))

    def read(self, value: object, before: bool | None) -> bool | None:
        """A choice as `ViewState.dark`; an unknown one raises `InputError`, and `before` is shown again."""
        if value not in SCHEMES:
            assign(self._choice, _scheme(before))
            raise InputError("page colours", value, "one of " + ", ".join(SCHEMES))
        return SCHEMES[str(value)]


def _scheme(dark: bool | None) -> str:
    return next(name for name, value in SCHEMES.items() if value is dark)


def configure_theme(gui: viser.GuiApi, dark: bool) -> None:
    """Set the page's colours, and hide viser's share button: it would open a public tunnel to the service."""
    gui.configure_theme(
        dark_mode=dark,
        brand_color=BRAND_ON_DARK if dark else BRAND,
        show_logo=False,
        show_share_button=False,
    )
