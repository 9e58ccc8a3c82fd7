"""Controls for the posture: the branch, and the redundancy parameters.

The track below a parameter's slider shows the values that the joint limits allow, for the present branch and tool
pose. The ranges are exact: the core computes them in closed form.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import viser

from app.viewer.panel import Post, assign, listen, update_html
from app.viewer.panel.entry import read_value
from app.viewer.panel.fence import Fence, SliderCrossings
from app.viewer.panel.fields import field, fields_html, limit_marks
from app.viewer.panel.part import Block, add_html
from app.viewer.views.templates import render
from kin import InputError, Robot, branch_names
from kin.ik import Redundancy, branch_meanings
from kin.units import DEFAULT_UNITS, Unit, Units

CLOSEST = "Closest"
KEEP = "Keep current"
BRANCH_HINT = (
    "The posture in which the arm reaches the target. Closest: the one with the least joint motion. "
    "Keep current: the posture never changes while dragging. Or a particular one: {parts}. {meanings}"
)
SLIDER_HINT = (
    "Moves the arm while the tool stays where it is. The green bar shows the values that the joint limits allow."
)


_SIGNS = {"positive": "+", "negative": "\N{MINUS SIGN}"}


def short(name: str) -> str:
    """A branch's name without the words that all branches share: ``front · up · no-flip``, ``elbow +``."""
    words = (part.partition(" ") for part in name.split(" · "))
    # A posture that the numeric solver found has a name of one word.
    return " · ".join(f"{noun} {_SIGNS[word]}" if word in _SIGNS else word or noun for noun, _, word in words)


def parts(robot: Robot) -> str:
    """The words that all branches share: ``shoulder · elbow · wrist``."""
    names = branch_names(robot)
    return " · ".join(part.split(" ", 1)[0] for part in names[0].split(" · ")) if names else ""


def meanings(robot: Robot) -> str:
    """What one word of each pair means, as sentences: the other word is its opposite."""
    said = list(branch_meanings(robot).items())[::2]
    return " ".join(f"{short(part).capitalize()}: {meaning}." for part, meaning in said)


class BranchChoice:
    """The posture dropdown of one robot, and the line with the name of the arm's present branch."""

    def __init__(self, gui: viser.GuiApi, robot: Robot, post: Post) -> None:
        self._names = {short(name): name for name in branch_names(robot)}
        options = (CLOSEST, KEEP, *self._names) if self._names else (CLOSEST,)
        self._choice = gui.add_dropdown(
            "Posture",
            options,
            initial_value=CLOSEST,
            hint=BRANCH_HINT.format(parts=parts(robot), meanings=meanings(robot)),
        )
        listen(self._choice, post, ("branch", robot.id))
        self._now = ""
        self._line = add_html(gui)

    def read(self, value: object) -> str | None:
        """A choice as `kin.solve_ik` takes it; raises `InputError` for an unknown one."""
        if value == CLOSEST:
            return None
        if value == KEEP and self._names:
            return "seed"
        if value not in self._names:
            raise InputError("posture", value, "one of " + ", ".join((CLOSEST, KEEP, *self._names)))
        return self._names[str(value)]

    def choose(self, branch: str | None) -> None:
        """Select a choice, given as `kin.solve_ik` takes it."""
        assign(self._choice, CLOSEST if branch is None else KEEP if branch == "seed" else short(branch))

    def show(self, branch: str) -> None:
        """Show the name of the arm's present branch."""
        if branch != self._now and self._names:
            self._now = branch
            self._line.content = render("panel/branch", name=branch, text=short(branch))

    def withhold(self, on: bool) -> None:
        """Show neither the names nor the present branch."""
        for part in (self._choice, self._line):
            if part.visible == on:
                part.visible = not on

    def remove(self) -> None:
        """Remove it from the panel."""
        self._choice.remove()
        self._line.remove()


class RedundancySliders:
    """A slider with its feasible ranges for each redundancy parameter; rebuilt when the parameters change.

    Posts ``("redundancy", robot id, name, units)`` with the slider's value in screen units.
    """

    def __init__(self, gui: viser.GuiApi, folder: viser.GuiFolderHandle, post: Post, fence: Fence) -> None:
        self._gui = gui
        self._folder = folder
        self._post = post
        self._key: tuple[object, ...] = ()
        self._sliders: dict[str, viser.GuiSliderHandle[float]] = {}
        self._tracks: dict[str, Block] = {}
        self._html: Block | None = None
        self._uuids: dict[str, str] = {}
        self._crossings = SliderCrossings[str](fence, lambda name: self._sliders[name])
        self._unit = DEFAULT_UNITS.angles

    def show(
        self, parameters: Sequence[Redundancy], robot: Robot, units: Units, dragged: str | None = None
    ) -> None:
        """Show these values and ranges; the slider that the visitor drags keeps its value."""
        key = (robot.id, units, *(item.name for item in parameters))
        if key != self._key:
            self.remove()
            self._key = key
            self._make(parameters, robot, units)
            self._crossings.sent(self._sliders)
        for parameter in parameters:
            slider = self._sliders[parameter.name]
            item = on_side_of(slider.value, parameter, self._unit)
            value = min(max(self._unit.shown(item.value), slider.min), slider.max)
            self._crossings.set(item.name, value, item.name == dragged)
            track = feasible_html(item, float(slider.min), float(slider.max), self._unit)
            update_html(self._tracks[item.name], track)

    def name_of(self, uuid: object) -> str | None:
        """The parameter whose slider has this id; None if there is none."""
        return next((name for key, name in self._uuids.items() if key == uuid), None)

    def label_of(self, name: str) -> str:
        """The label of a slider."""
        return str(self._sliders[name].label)

    def read_text(self, name: str, text: str) -> float:
        """A typed value in screen units; raises `EntryError` unless the slider has it."""
        slider = self._sliders[name]
        limits = (self._unit.read(float(slider.min)), self._unit.read(float(slider.max)))
        return self._unit.scale * read_value(text, slider.label, self._unit, limits)

    def read(self, name: str, value: object) -> float:
        """A slider's value in radians; raises `InputError` for anything but a finite number."""
        if name not in self._sliders:
            raise InputError("redundancy parameter", name, "one of " + ", ".join(self._sliders))
        if not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(name, value, "a finite number")
        self._crossings.heard(name)
        return self._unit.read(float(value))

    def remove(self) -> None:
        """Remove the sliders from the panel."""
        for slider in self._sliders.values():
            slider.remove()
        for track in self._tracks.values():
            track.remove()
        if self._html is not None:
            self._html.remove()
        self._sliders, self._tracks, self._html, self._uuids, self._key = {}, {}, None, {}, ()
        self._crossings.clear()

    def _make(self, parameters: Sequence[Redundancy], robot: Robot, units: Units) -> None:
        self._unit = unit = units.angles
        with self._folder:
            for item in parameters:
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
                    marks=limit_marks(least, most),
                    initial_value=min(max(unit.shown(item.value), least), most),
                    hint=SLIDER_HINT,
                )
                listen(slider, self._post, ("redundancy", robot.id, item.name, units))
                self._sliders[item.name] = slider
                self._tracks[item.name] = add_html(self._gui)
            fields = dict(field(slider, unit) for slider in self._sliders.values())
            self._html = add_html(self._gui, fields_html(fields))
            self._uuids = dict(zip(fields, self._sliders, strict=True))


def on_side_of(shown: float, item: Redundancy, unit: Unit) -> Redundancy:
    """The parameter, with half a turn, which is both 180° and −180°, on the side of a slider at `shown`."""
    if item.name.startswith("theta") or (math.pi - abs(item.value)) * unit.scale > 0.5 * unit.step(1):
        return item
    return item._replace(value=math.copysign(item.value, shown))


def feasible_html(item: Redundancy, low: float, high: float, unit: Unit) -> str:
    """The feasible ranges as bars on a track from `low` to `high` (in the shown unit), and in words."""
    span = high - low

    def percent(value: float) -> float:
        return 100.0 * min(max((value * unit.scale - low) / span, 0.0), 1.0)

    ranges = ", ".join(f"{unit.number(a)} … {unit.text(b)}" for a, b in item.intervals[:4])
    return render(
        "panel/feasible",
        name=item.name,
        bars=[(f"{percent(a):.2f}", f"{percent(b) - percent(a):.2f}") for a, b in item.intervals],
        now=f"{percent(item.value):.2f}",
        words=f"feasible: {ranges}" if ranges else "no value is feasible",
    )
