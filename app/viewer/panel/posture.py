"""Which posture takes a pose: the branch, and the value of what the task leaves free.

The strip under a free value's slider shows the values the joint limits allow, for the branch the arm is on and the
tool as it is now. It is exact: it comes from the core's arcs, not from trying.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import viser

from app.viewer.panel import Post, assign, listen
from kin import InputError, Redundancy, Robot, branch_names
from kin.units import DEFAULT_UNITS, Unit, Units

NEAREST = "Nearest"
STAY = "Stay on this one"
BRANCH_HINT = (
    "Which of the arm's postures may take the pose. Nearest: whichever needs the least motion. "
    "Stay on this one: never change it while dragging. Or one of them by name: {parts}."
)
FEASIBLE = "#009e73"
# The slider's own track begins and ends here: its label and its number field have fixed widths.
UNDER_TRACK = "margin:0 3.25em 0 6em"


def short(name: str) -> str:
    """A branch's name without the words that every branch shares: ``front · up · no-flip``."""
    return " · ".join(part.split(" ", 1)[-1] for part in name.split(" · "))


def parts(robot: Robot) -> str:
    """What the parts of the short names are about: ``shoulder · elbow · wrist``."""
    names = branch_names(robot)
    return " · ".join(part.split(" ", 1)[0] for part in names[0].split(" · ")) if names else ""


class BranchChoice:
    """The branch dropdown of one robot, and the line that names the branch the arm is on."""

    def __init__(self, gui: viser.GuiApi, robot: Robot, post: Post) -> None:
        self._names = {short(name): name for name in branch_names(robot)}
        options = (NEAREST, STAY, *self._names) if self._names else (NEAREST,)
        self._choice = gui.add_dropdown(
            "Branch", options, initial_value=NEAREST, hint=BRANCH_HINT.format(parts=parts(robot))
        )
        listen(self._choice, post, ("branch", robot.id))
        self._now = ""
        self._line = gui.add_html("")

    def read(self, value: object) -> str | None:
        """A choice as `kin.solve_ik` takes it; raises `InputError` for one that is not on the list."""
        if value == NEAREST:
            return None
        if value == STAY and self._names:
            return "seed"
        if value not in self._names:
            raise InputError("branch", value, "one of " + ", ".join((NEAREST, STAY, *self._names)))
        return self._names[str(value)]

    def choose(self, branch: str | None) -> None:
        """Select a choice, told as `kin.solve_ik` takes it."""
        assign(self._choice, NEAREST if branch is None else STAY if branch == "seed" else short(branch))

    def show(self, branch: str) -> None:
        """Name the branch the arm is on."""
        if branch != self._now and self._names:
            self._now = branch
            self._line.content = (
                '<div style="margin:-.2em 1em .4em;font-size:.78em;opacity:.8" data-branch="'
                f'{escape(branch, quote=True)}">now: {escape(branch)}</div>'
            )

    def remove(self) -> None:
        """Take it out of the panel."""
        self._choice.remove()
        self._line.remove()


class FreeSliders:
    """A slider with its feasible strip for each free value; made anew when other values are free.

    Posts ``("free", robot id, name, units)`` with the slider's value in screen units.
    """

    def __init__(self, gui: viser.GuiApi, folder: viser.GuiFolderHandle, post: Post) -> None:
        self._gui = gui
        self._folder = folder
        self._post = post
        self._key: tuple[object, ...] = ()
        self._sliders: dict[str, viser.GuiSliderHandle[float]] = {}
        self._strips: dict[str, viser.GuiHtmlHandle] = {}
        self._unit = DEFAULT_UNITS.angles

    def show(self, free: Sequence[Redundancy], robot: Robot, units: Units, held: str | None = None) -> None:
        """Show these values and ranges; the slider in the visitor's hand (`held`) keeps its value."""
        key = (robot.id, units, *(item.name for item in free))
        if key != self._key:
            self.remove()
            self._key = key
            self._make(free, robot, units)
        for item in free:
            slider = self._sliders[item.name]
            value = self._unit.shown(item.value)
            if item.name != held:
                assign(slider, min(max(value, slider.min), slider.max))
            strip = strip_html(item, float(slider.min), float(slider.max), self._unit)
            if self._strips[item.name].content != strip:
                self._strips[item.name].content = strip

    def read(self, name: str, value: object) -> float:
        """A slider's value in radians; raises `InputError` for anything but a finite number."""
        if name not in self._sliders:
            raise InputError("free parameter", name, "one of " + ", ".join(self._sliders))
        if not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(name, value, "a finite number")
        return self._unit.read(float(value))

    def remove(self) -> None:
        """Take the sliders out of the panel."""
        for slider in self._sliders.values():
            slider.remove()
        for strip in self._strips.values():
            strip.remove()
        self._sliders, self._strips, self._key = {}, {}, ()

    def _make(self, free: Sequence[Redundancy], robot: Robot, units: Units) -> None:
        self._unit = unit = units.angles
        with self._folder:
            for item in free:
                low, high = -math.pi, math.pi
                if item.name.startswith("theta"):
                    joint = robot.joints[int(item.name.removeprefix("theta")) - 1]
                    low, high = joint.limits or (low, high)
                least, most = unit.shown(low), unit.shown(high)
                slider = self._gui.add_slider(
                    item.label[0].upper() + item.label[1:] if item.label[0].isascii() else item.label,
                    min=least,
                    max=most,
                    step=unit.step(1),
                    initial_value=min(max(unit.shown(item.value), least), most),
                    hint="Moves the arm while the target stays met. The strip shows the values the limits allow.",
                )
                listen(slider, self._post, ("free", robot.id, item.name, units))
                self._sliders[item.name] = slider
                self._strips[item.name] = self._gui.add_html("")


def strip_html(item: Redundancy, low: float, high: float, unit: Unit, under: str = UNDER_TRACK) -> str:
    """The feasible ranges as bars on a line from `low` to `high` (screen units), and in words.

    `under`: margins that put the line under a slider's track.
    """
    span = high - low

    def percent(value: float) -> float:
        return 100.0 * min(max((value * unit.scale - low) / span, 0.0), 1.0)

    bars = "".join(
        f'<span style="position:absolute;top:0;bottom:0;left:{percent(a):.2f}%;'
        f'width:max(2px,{percent(b) - percent(a):.2f}%);background:{FEASIBLE};border-radius:2px"></span>'
        for a, b in item.intervals
    )
    mark = (
        f'<span style="position:absolute;top:-3px;bottom:-3px;left:calc({percent(item.value):.2f}% - 1px);'
        'width:2px;background:currentColor"></span>'
    )
    ranges = ", ".join(f"{unit.number(a)} … {unit.text(b)}" for a, b in item.intervals[:4])
    words = f"feasible: {ranges}" if ranges else "no value is feasible"
    return (
        f'<div data-free="{escape(item.name)}" style="margin:-.2em 1em .4em">'
        f'<div style="position:relative;height:6px;{under};border-radius:3px;'
        f'background:rgba(128,128,128,.28)" aria-hidden="true">{bars}{mark}</div>'
        '<div style="font-size:.74em;line-height:1.6;opacity:.8;font-variant-numeric:tabular-nums">'
        f"{escape(words)}</div></div>"
    )
