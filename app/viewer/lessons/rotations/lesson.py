"""The lesson "Rotations and frames": one rotation in all its forms, and a chain of frames that students build.

Frames are drawn beside the arm. The rotation is set by three angles in one of 24 conventions, typed as a
quaternion or a matrix, or taken from the tool.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from itertools import count

import numpy as np
import viser

from app.exercises.typed import EntryError
from app.viewer.feature import Stage
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.rotations import views
from app.viewer.lessons.rotations.conventions import CONVENTIONS, PAGE, Angles, Convention
from app.viewer.lessons.rotations.drawing import Drawing
from app.viewer.lessons.rotations.frames import FARTHEST, MOST, Motion, as_json, from_json, places, swapped
from app.viewer.lessons.rotations.questions import outline
from app.viewer.lessons.rotations.typed import LONGEST, read_rotation
from app.viewer.panel import assign, listen, listen_click, update_html
from app.viewer.panel.fields import limit_marks
from app.viewer.panel.status import Notice
from kin import InputError
from kin.transforms import Array

SHOWN = ("One rotation", "Chain of frames")
TITLES = {convention.title: convention for convention in CONVENTIONS}
MOTIONS = {
    f"{verb} {axis}": (turns, k)
    for turns, verb in ((True, "Turn about"), (False, "Shift along"))
    for k, axis in enumerate("xyz")
}
WHOSE = ("own axes", "fixed axes")
ACTS = ("Set", "From tool", "To target")
CHAIN_ACTS = ("Add", "Remove", "Swap", "Clear")
SHOWN_HINT = "What is drawn beside the arm"
CONVENTION_HINT = "Three axes in the order of the turns, about fixed or about moving axes"
TURN = 2.0 * math.pi + 1e-3  # the largest angle of a motion
ANGLE_HINT = "Drag, or type a value"
TYPED_HINT = "3 angles in the order of the turns, a quaternion w x y z, or the 9 numbers of a matrix, row by row"
ACT_HINT = "Set: take the typed numbers. From tool: the orientation of the tool. To target: turn the target so."
MOTION_HINT = "The next motion of the chain"
WHOSE_HINT = "Axes of the frame itself, or of the fixed frame {0}"
TURN_HINT, SHIFT_HINT = "Angle of the next turn", "Length of the next shift"
CHAIN_HINT = "Add: append the motion. Remove: the last one. Swap: the last two. Clear: all."
_NUMBERS = count(1)


class RotationsLesson(Lesson):
    """See the module."""

    key = "rotations"
    title = "Rotations and frames"
    about = "A rotation in all its forms, gimbal lock, and a chain of frames that you build."
    outline = staticmethod(outline)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._convention, self._angles = PAGE, (math.radians(20.0), math.radians(35.0), math.radians(50.0))
        self._chained = False
        self._chain: tuple[Motion, ...] = ()
        self._motion, self._own = "Turn about z", True
        self._turn, self._shift = math.radians(90.0), 0.2
        self._typed, self._error = "", ""
        self._sliders: list[viser.GuiSliderHandle[float]] = []
        self._drawing: Drawing
        gui, post = stage.client.gui, self.post
        self._shown = gui.add_dropdown("Show", SHOWN, hint=SHOWN_HINT)
        listen(self._shown, post, "shown")
        with gui.add_folder("One rotation") as self._rotation_folder:
            self._conventions = gui.add_dropdown(
                "Angles", tuple(TITLES), initial_value=PAGE.title, hint=CONVENTION_HINT, order=1
            )
            listen(self._conventions, post, "convention")
            self._about = gui.add_html("", order=2)
            self._lock = gui.add_html("", order=6)
            self._forms = gui.add_html("", order=7)
            text = gui.add_text("Rotation", "", hint=TYPED_HINT, order=8)
            listen(text, post, "typed")
            acts = gui.add_button_group("Use", ACTS, hint=ACT_HINT, order=9)
            listen_click(acts, post, {name: ("act", name) for name in ACTS})
            self._wrong = gui.add_html("", order=10)
        with gui.add_folder("Chain of frames") as self._chain_folder:
            self._motions = gui.add_dropdown(
                "Motion", tuple(MOTIONS), initial_value="Turn about z", hint=MOTION_HINT
            )
            listen(self._motions, post, "motion")
            with gui.add_folder(None) as self._amounts:
                pass
            self._whose = gui.add_dropdown("Axes", WHOSE, hint=WHOSE_HINT)
            listen(self._whose, post, "whose")
            made = gui.add_button_group("Chain", CHAIN_ACTS, hint=CHAIN_HINT)
            listen_click(made, post, {name: ("chain", name) for name in CHAIN_ACTS})
            self._product = gui.add_html("")
        self._make_fields()
        self._use_robot()

    # Controls in the present units

    def _make_fields(self) -> None:
        gui, units = self.stage.client.gui, self.stage.units
        self._units = units
        with self._amounts:
            angles, lengths = units.angles, units.lengths
            self._turn_field = gui.add_number(
                f"Angle, {angles.name}", angles.shown(self._turn), min=angles.shown(-2.0 * math.pi),
                max=angles.shown(2.0 * math.pi), step=angles.step(1), hint=TURN_HINT,
            )  # fmt: skip
            listen(self._turn_field, self.post, ("turn", units))
            self._shift_field = gui.add_number(
                f"Length, {lengths.name}", lengths.shown(self._shift), min=lengths.shown(-FARTHEST),
                max=lengths.shown(FARTHEST), step=lengths.step(1), hint=SHIFT_HINT,
            )  # fmt: skip
            listen(self._shift_field, self.post, ("shift", units))
        self._make_sliders()

    def _make_sliders(self) -> None:
        """The three angles, named after the axes of the convention."""
        for slider in self._sliders:
            slider.remove()
        gui, unit = self.stage.client.gui, self.stage.units.angles
        low, high = unit.shown(-math.pi), unit.shown(math.pi)
        self._sliders = []
        with self._rotation_folder:
            for k in range(3):
                name = views.turn_name(self._convention, k)
                value = min(max(unit.shown(self._angles[k]), low), high)
                marks = limit_marks(low, high)
                slider = gui.add_slider(
                    name, low, high, unit.step(1), value, marks=marks, hint=ANGLE_HINT, order=3 + k
                )
                listen(slider, self.post, ("angle", k, self._convention.key, self.stage.units))
                self._sliders.append(slider)

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case "shown":
                self._chained = _one_of("show", value, SHOWN) == SHOWN[1]
            case "convention":
                self._use(TITLES[_one_of("convention", value, tuple(TITLES))])
            case ("angle", int(k), str(convention), units):
                if convention == self._convention.key and units == self.stage.units:
                    angle = units.angles.read(_number("angle", value, math.inf))
                    self._angles = tuple(angle if i == k else v for i, v in enumerate(self._angles))  # type: ignore[assignment]
            case "typed":
                self._typed = str(value)[: LONGEST + 1]
                return
            case ("act", str(name)):
                self._act(name)
            case "motion":
                self._motion = _one_of("motion", value, tuple(MOTIONS))
            case "whose":
                self._own = _one_of("axes", value, WHOSE) == WHOSE[0]
            case ("turn", units):
                if units == self.stage.units:
                    self._turn = units.angles.read(_number("angle", value, TURN * units.angles.scale))
            case ("shift", units):
                if units == self.stage.units:
                    self._shift = units.lengths.read(_number("length", value, FARTHEST * units.lengths.scale))
            case ("chain", str(name)):
                self._change_chain(name)
            case _:
                raise InputError("rotations", key, "a control of this lesson")
        self._show()

    def step_name(self, key: Hashable) -> str:
        return "Chain of frames" if isinstance(key, tuple) and key[0] == "chain" else self.title

    def _act(self, name: str) -> None:
        self._error = ""
        if name == "From tool":
            self._turn_to(self.stage.now.T_goal[:3, :3])
        elif name == "To target":
            T = self.stage.now.aim.copy()
            T[:3, :3] = self._convention.rotation(self._angles)
            self.stage.set_target(T)
        else:
            try:
                self._turn_to(read_rotation(self._typed, self._convention, self.stage.units))
            except EntryError as error:
                self._error = f"{error.title}: {error.detail}"

    def _change_chain(self, name: str) -> None:
        chain = self._chain
        if name == "Add":
            if len(chain) == MOST:
                self.stage.notify(Notice("error", "The chain is full", f"It has room for {MOST} motions."))
                return
            turns, axis = MOTIONS[self._motion]
            chain = (*chain, Motion(turns, axis, self._turn if turns else self._shift, self._own))
        elif name == "Swap":
            chain = swapped(chain)
        else:
            chain = chain[:-1] if name == "Remove" else ()
        self._chain, self._chained = chain, True

    def _turn_to(self, R: Array) -> None:
        self._angles = self._convention.angles(R)
        self._write_angles()

    def _use(self, convention: Convention) -> None:
        """Show the same rotation in another convention."""
        R = self._convention.rotation(self._angles)
        self._convention, self._angles = convention, convention.angles(R)
        self._make_sliders()

    def _write_angles(self) -> None:
        unit = self.stage.units.angles
        for slider, angle in zip(self._sliders, self._angles, strict=True):
            assign(slider, min(max(unit.shown(angle), slider.min), slider.max))

    def on_robot(self) -> None:
        self._drawing.remove()
        self._use_robot()

    def on_style(self) -> None:
        if self.stage.units != self._units:
            self._turn_field.remove()
            self._shift_field.remove()
            self._make_fields()
        self._show()

    def state(self) -> dict[str, object]:
        return {
            "convention": self._convention.key,
            "angles": list(self._angles),
            "chained": self._chained,
            "chain": as_json(self._chain),
            "motion": self._motion,
            "own": self._own,
            "turn": self._turn,
            "shift": self._shift,
        }

    def restore(self, state: dict[str, object]) -> None:
        self._convention = next((c for c in CONVENTIONS if c.key == state.get("convention")), self._convention)
        self._angles = _angles(state.get("angles")) or self._angles
        chain = from_json(state.get("chain"))
        self._chain = self._chain if chain is None else chain
        self._chained = state.get("chained") is True
        motion, own = state.get("motion"), state.get("own")
        self._motion = motion if isinstance(motion, str) and motion in MOTIONS else self._motion
        self._own = own if isinstance(own, bool) else self._own
        self._turn = _kept(state.get("turn"), 2.0 * math.pi, self._turn)
        self._shift = _kept(state.get("shift"), FARTHEST, self._shift)
        units = self.stage.units
        assign(self._conventions, self._convention.title)
        assign(self._motions, self._motion)
        assign(self._whose, WHOSE[0 if self._own else 1])
        assign(self._turn_field, units.angles.shown(self._turn))
        assign(self._shift_field, units.lengths.shown(self._shift))
        self._make_sliders()
        self._show()

    def remove(self) -> None:
        self._drawing.remove()
        self.stage.fit_view([])

    # What is shown

    def _use_robot(self) -> None:
        self._drawing = Drawing(self.stage.client.scene, self.stage.now.robot, f"/rotations-{next(_NUMBERS)}")
        self.stage.fit_view([self._drawing.room])
        self._show()

    def _show(self) -> None:
        units, convention, angles = self.stage.units, self._convention, self._angles
        assign(self._shown, SHOWN[self._chained])
        self._rotation_folder.visible, self._chain_folder.visible = not self._chained, self._chained
        self._turn_field.visible = MOTIONS[self._motion][0]
        self._shift_field.visible = not self._turn_field.visible
        update_html(self._about, views.convention_html(convention))
        update_html(self._lock, views.lock_html(convention, angles, units))
        update_html(self._forms, views.rotation_html(convention, angles, units))
        update_html(self._wrong, views.error_html(self._error))
        update_html(self._product, views.chain_html(self._chain, units))
        if self._chained:
            self._drawing.show_chain(places(self._chain))
        else:
            self._drawing.show_rotation(convention, angles)


def _one_of(field: str, value: object, options: tuple[str, ...]) -> str:
    if not isinstance(value, str) or value not in options:
        raise InputError(field, value, "one of " + ", ".join(options))
    return value


def _number(field: str, value: object, most: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= most:
        raise InputError(field, value, f"a number from {-most:g} to {most:g}")
    if not math.isfinite(value):
        raise InputError(field, value, "a finite number")
    return float(value)


def _kept(value: object, most: float, otherwise: float) -> float:
    return float(value) if isinstance(value, int | float) and abs(value) <= most else otherwise


def _angles(value: object) -> Angles | None:
    """Three angles of a link."""
    if not isinstance(value, list) or len(value) != 3 or any(type(v) not in (int, float) for v in value):
        return None
    found = np.array(value, dtype=np.float64)
    return (float(found[0]), float(found[1]), float(found[2])) if bool((np.abs(found) <= 7.0).all()) else None
