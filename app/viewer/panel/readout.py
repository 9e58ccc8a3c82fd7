"""The tool's pose in numbers, with fixed decimals in tabular figures: digits change but never move."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Sequence
from functools import lru_cache
from itertools import chain

import viser
from markupsafe import Markup

from app.viewer.frames import TITLES, Frames
from app.viewer.panel import update_html
from app.viewer.panel.part import add_html
from app.viewer.views.templates import render
from kin.frames import WORLD
from kin.poses import DEFAULT, Notation, Rotations
from kin.transforms import Array
from kin.units import Unit, Units, fixed

_NUMBER = Markup("<number>")  # for the place of a number: what is escaped has no "<"


def html(
    T_frame_tool: Array,
    units: Units,
    T_frame_target: Array | None = None,
    frame: str = WORLD,
    withheld: Collection[str] = (),
    rotations: Rotations = DEFAULT,
    typed: bool = True,
) -> str:
    """Position, angles such as roll, pitch, yaw, and quaternion of a pose ``(4, 4)`` as a small table.

    Args:
        T_frame_target: a target that the tool has missed, from which the form for a typed target starts.
        frame: name of the frame in which both are.
        withheld: rows that an open question asks for: position, angles, quaternion.
        rotations: how rotations are written.
        typed: whether a click opens the form for a typed target.
    """
    lengths, angles = units.lengths, units.angles
    titles = (
        ("position", "x y z", f"Tool point in the frame {frame}", lengths.name),
        ("angles", rotations.notation.names, rotations.notation.definition, angles.name),
        ("quaternion", rotations.quaternion.names, rotations.quaternion.definition, ""),
    )
    tool = _parts(T_frame_tool, units, rotations)
    if T_frame_target is None:
        texts = _between(titles, tuple(map(len, tool)), frozenset(withheld), typed)
        shown = [numbers for title, numbers in zip(titles, tool, strict=True) if title[0] not in withheld]
        return "".join(chain.from_iterable(zip(texts, [*chain(*shown), ""], strict=True)))
    target = _parts(T_frame_target, units, rotations)
    rows = [(*title, numbers, wanted) for title, numbers, wanted in zip(titles, tool, target, strict=True)]
    return render("panel/readout", rows=rows, withheld=withheld, typed=typed)


@lru_cache(maxsize=64)
def _between(
    titles: Sequence[tuple[str, ...]], counts: tuple[int, ...], withheld: frozenset[str], typed: bool
) -> tuple[str, ...]:
    """The texts before, between and after the numbers of the table, which is written many times a second."""
    rows = [(*title, [_NUMBER] * count, ()) for title, count in zip(titles, counts, strict=True)]
    return tuple(render("panel/readout", rows=rows, withheld=withheld, typed=typed).split(_NUMBER))


def _parts(T: Array, units: Units, rotations: Rotations) -> tuple[list[str], list[str], list[str]]:
    """Position and both notations of the rotation of a pose as texts."""
    lengths = units.lengths
    return (
        _numbers((lengths.scale * T[:3, 3]).tolist(), lengths.decimals(1)),
        _turned(T[:3, :3], rotations.notation, units.angles),
        _turned(T[:3, :3], rotations.quaternion, units.angles),
    )


def _turned(R: Array, notation: Notation, angles: Unit) -> list[str]:
    pairs = zip(notation.values(R), notation.turns, strict=True)
    return [
        fixed(angles.scale * _half_turn_positive(value), angles.decimals(1)) if turn else fixed(value, 3)
        for value, turn in pairs
    ]


def _half_turn_positive(angle: float) -> float:
    """The angle, but +180° for −180° to the tenth that is shown: the same sign in all units, and no flicker."""
    return abs(angle) if round(math.degrees(angle), 1) == -180.0 else angle


def _numbers(values: Sequence[float], decimals: int) -> list[str]:
    return [fixed(value, decimals) for value in values]


class PoseReadout:
    """Shows the tool's pose in a frame, and the form for a typed target, which ``static/input.js`` opens.

    Args:
        typed: whether the visitor may type a target.
    """

    def __init__(self, gui: viser.GuiApi, T_world_tool: Array, units: Units, typed: bool) -> None:
        self._typed = typed
        self._choice = add_html(gui)
        self._html = add_html(gui, html(T_world_tool, units, typed=typed))
        self._form = add_html(gui)
        self.use_rotations(DEFAULT)

    def use_rotations(self, rotations: Rotations) -> None:
        """Write rotations in these notations from the next pose on, and ask for them in the form."""
        self._rotations = rotations
        turned, quaternion = rotations.notation, rotations.quaternion
        none = {
            "pose": f"0 0 0\n{turned.none}",
            "position": "0 0 0",
            "angles": turned.none,
            "quaternion": quaternion.none,
        }
        both = len(turned.turns) != len(quaternion.turns)
        form = render("panel/typed_target", turned=turned, quaternion=quaternion, both=both, none=json.dumps(none))
        update_html(self._form, form)

    def show_frames(self, frames: Frames) -> None:
        """Offer the frames of the page."""
        offered = [(name, TITLES.get(name, name)) for name in frames.names]
        update_html(self._choice, render("panel/frame", frames=offered, shown=frames.shown))

    def show(
        self,
        T: Array,
        units: Units,
        target: Array | None = None,
        frame: str = WORLD,
        withheld: Collection[str] = (),
    ) -> None:
        """Replace the numbers; see `html`."""
        update_html(self._html, html(T, units, target, frame, withheld, self._rotations, self._typed))
