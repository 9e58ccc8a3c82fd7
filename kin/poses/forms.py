"""The forms in which a pose stands in a text: those of textbooks, and those of makers' pendants and programs.

A form is a row of `FORMS`: the names of its numbers, the units of numbers without one, the notation of its
rotation, and how it is printed. `kin.poses.reading` reads them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError, one_of
from kin.poses import rotations
from kin.poses.rotations import Notation
from kin.transforms import Array, as_transform
from kin.units import PLAIN, Unit, Units

SI: Final = Units(degrees=False, length="m")
PENDANT: Final = Units(degrees=True, length="mm")


@dataclass(frozen=True)
class PoseForm:
    """One way to write a pose.

    Attributes:
        key: its name in calls, options and requests, and in front of a text.
        title: who uses it, or what it is called.
        names: of the numbers of the rotation, as labels; lower case. The position is x y z.
        rotation: what they mean.
        units: of numbers without a unit; None: those of the reader.
        written: how it is printed, with a place for each number.
        pattern: what stands around the numbers, besides brackets; its group is the list of numbers. "": nothing.
        besides: labels that may stand beside, and say nothing about the pose, such as the posture of the arm.
        spare: how many numbers may follow the pose in a list: flags of the posture.
        maker: whose arms show it, as robot files name the maker; "" for none.
        source: where it is defined.
    """

    key: str
    title: str
    names: tuple[str, ...]
    rotation: Notation
    units: Units | None
    written: str
    pattern: str = ""
    besides: frozenset[str] = frozenset()
    spare: int = 0
    maker: str = ""
    source: str = ""
    labels: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        """Join the labels."""
        object.__setattr__(self, "labels", frozenset(("x", "y", "z", *self.names)))

    @property
    def where(self) -> str:
        """What stands around them, and the units, for a message."""
        units = "" if self.units is None else f" in {self.units.lengths.name} and {self.units.angles.name}"
        return units if any(self.rotation.turns) else units.partition(" and ")[0]

    @property
    def shown(self) -> str:
        """The names of its numbers, for a message or a table: ``X Y Z A B C``."""
        return " ".join(("x", "y", "z", *self.rotation.names.split()))

    def units_of(self, units: Units) -> list[Unit]:
        """The unit of each number, for a reader with these units."""
        units = self.units or units
        return [units.lengths] * 3 + [units.angles if turn else PLAIN for turn in self.rotation.turns]

    def pose(self, values: Sequence[float]) -> Array:
        """The pose ``(4, 4)`` of its numbers in metres and radians; raises `kin.typed.EntryError`."""
        T = np.eye(4)
        T[:3, 3] = values[:3]
        T[:3, :3] = self.rotation.matrix(values[3:])
        return T

    def numbers(self, T: Array) -> tuple[float, ...]:
        """The numbers of a pose ``(4, 4)`` in metres and radians, in the order of the form."""
        return (*T[:3, 3].tolist(), *self.rotation.values(T[:3, :3]))

    def text(self, T: Array, units: Units = SI) -> str:
        """A pose ``(4, 4)`` in this form: to a micrometre and 0.0001°, without trailing zeros."""
        pairs = zip(self.numbers(T), self.units_of(units), strict=True)
        return self.written.format(*(_number(value, unit) for value, unit in pairs))


def _number(value: float, unit: Unit) -> str:
    decimals = 6 if unit is PLAIN else unit.decimals(3 if unit.is_length else 4)
    text = f"{round(value * unit.scale, decimals) + 0.0:.{decimals}f}"
    return text.rstrip("0").rstrip(".")


class _Matrix(PoseForm):
    """The twelve numbers of a matrix ``(3, 4)``, row by row."""

    def units_of(self, units: Units) -> list[Unit]:
        """The unit of each number."""
        return [PLAIN, PLAIN, PLAIN, units.lengths] * 3

    def numbers(self, T: Array) -> tuple[float, ...]:
        """The numbers of a pose ``(4, 4)``."""
        return tuple(T[:3].ravel().tolist())


def _plain(key: str, title: str, names: str, rotation: Notation) -> PoseForm:
    """A form of textbooks, in the units of the reader."""
    labels = tuple(names.split())
    return PoseForm(key, title, labels, rotation, None, " ".join(["{}"] * (3 + len(labels))))


_RC = "https://doc.rc-visard.com/latest/en/pose_format_"
_MECH = "https://docs.mech-mind.net/en/suite-software-manual/2.0.0/appendix/euler-angles-definition-and-convention.html"
_FUNCTION = r"\s*\((.*)\)"
_GROUP = r"\[[^\[\],]*(?:,[^\[\],]*){%s}\]\s*"
# Position, quaternion, configuration and external axes; a matrix has other counts.
_ROBTARGET = rf"\[\s*({_GROUP % 2},\s*{_GROUP % 3}),\s*{_GROUP % 3},\s*{_GROUP % 5}\]"
_ROWS = (
    _plain("wxyz", "quaternion w x y z", "qw qx qy qz", rotations.WXYZ),
    _plain("xyzw", "quaternion x y z w", "qx qy qz qw", rotations.XYZW),
    _plain("rpy", "roll pitch yaw", "roll pitch yaw", rotations.RPY),
    _plain("rotvec", "rotation vector", "rvx rvy rvz", rotations.VECTOR),
    _plain("zyz", "Euler Z-Y-Z", "alpha beta gamma", rotations.ZYZ),
    _plain("axis", "axis and angle", "kx ky kz theta", rotations.AXIS),
    _Matrix("matrix", "matrix", (), rotations.RPY, None, "{} {} {} {}\n{} {} {} {}\n{} {} {} {}"),
    PoseForm(
        "kuka",
        "KUKA",
        ("a", "b", "c"),
        rotations.KUKA,
        PENDANT,
        "{{X {}, Y {}, Z {}, A {}, B {}, C {}}}",
        besides=frozenset(("s", "t", "e1", "e2", "e3", "e4", "e5", "e6")),
        maker="KUKA",
        source=_RC + "kuka.html",
    ),
    PoseForm(
        "fanuc",
        "FANUC",
        ("w", "p", "r"),
        rotations.FANUC,
        PENDANT,
        "X {} Y {} Z {} W {} P {} R {}",
        besides=frozenset(("uf", "ut")),
        maker="FANUC",
        source=_RC + "fanuc.html",
    ),
    PoseForm(
        "abb",
        "ABB",
        ("q1", "q2", "q3", "q4"),
        rotations.ABB,
        PENDANT,
        "[[{}, {}, {}], [{}, {}, {}, {}]]",
        pattern=_ROBTARGET,
        maker="ABB",
        source="RAPID Instructions, Functions and Data types: robtarget and orient",
    ),
    PoseForm(
        "ur",
        "UR (script)",
        (),
        rotations.VECTOR,
        SI,
        "p[{}, {}, {}, {}, {}, {}]",
        pattern=r"p\s*\[([^\[\]]*)\]",
        maker="Universal Robots",
        source="URScript manual: pose",
    ),
    PoseForm(
        "polyscope",
        "UR (pendant)",
        ("rx", "ry", "rz"),
        rotations.VECTOR,
        Units(degrees=False, length="mm"),
        "X {} mm Y {} mm Z {} mm RX {} RY {} RZ {} rad",
        maker="Universal Robots",
        source="https://forum.universal-robots.com/t/pose-rotation-order/223",
    ),
    PoseForm(
        "staubli",
        "Stäubli",
        ("rx", "ry", "rz"),
        rotations.STAUBLI,
        PENDANT,
        "{{{}, {}, {}, {}, {}, {}}}",
        pattern=r"\{\s*(\{[^{}]*\})\s*,\s*\{[a-z,\s]*\}\s*\}",
        maker="Stäubli",
        source=_MECH,
    ),
    PoseForm(
        "yaskawa",
        "Yaskawa",
        ("rx", "ry", "rz"),
        rotations.FIXED,
        PENDANT,
        "X {} Y {} Z {} Rx {} Ry {} Rz {}",
        maker="Yaskawa",
        source=_RC + "yaskawa.html",
    ),
    PoseForm(
        "doosan",
        "Doosan",
        ("a", "b", "c"),
        rotations.DOOSAN,
        PENDANT,
        "posx({}, {}, {}, {}, {}, {})",
        pattern="posx" + _FUNCTION,
        maker="Doosan",
        source="https://manual.doosanrobotics.com/en/programming/3.3.0/Publish/fkin-pos-ref",
    ),
    PoseForm(
        "kawasaki",
        "Kawasaki",
        ("o", "a", "t"),
        rotations.KAWASAKI,
        PENDANT,
        "TRANS({}, {}, {}, {}, {}, {})",
        pattern="trans" + _FUNCTION,
        maker="Kawasaki",
        source=_RC + "kawasaki.html",
    ),
    PoseForm(
        "denso",
        "Denso",
        ("rx", "ry", "rz"),
        rotations.FIXED,
        PENDANT,
        "P({}, {}, {}, {}, {}, {})",
        pattern="p" + _FUNCTION,
        besides=frozenset(("fig",)),
        spare=1,
        maker="Denso",
        source="https://rc8.tech-guild.com/001939.html",
    ),
    PoseForm(
        "mitsubishi",
        "Mitsubishi",
        ("a", "b", "c"),
        rotations.MITSUBISHI,
        PENDANT,
        "({}, {}, {}, {}, {}, {})",
        pattern=r"(\((?:[^(),]*,){5,7}[^(),]*\))\s*\(\s*\d+\s*,\s*\d+\s*\)",
        besides=frozenset(("l1", "l2", "fl1", "fl2")),
        spare=2,
        maker="Mitsubishi",
        source=_RC + "mitsubishi.html",
    ),
)
FORMS: Final = {form.key: form for form in _ROWS}
LABELS: Final = frozenset().union(*(form.labels | form.besides for form in _ROWS))


def form_named(name: object, field: str = "form") -> PoseForm:
    """The form of a key, in small or capital letters; raises `InputError` naming the field."""
    found = FORMS.get(name.strip().lower()) if isinstance(name, str) else None
    if found is None:
        raise InputError(field, name, one_of(*FORMS))
    return found


def pose_to_text(T: ArrayLike, form: str = "rpy") -> str:
    """A pose as it is written by people, or by a maker's pendant or program; `pose_from_text` reads it again.

    Args:
        T: pose ``(4, 4)`` in metres.
        form: "wxyz", "xyzw", "rpy", "rotvec", "zyz", "axis" in metres and radians, and
            "kuka", "fanuc", "abb", "ur" (script), "polyscope" (UR's pendant), "staubli", "yaskawa", "doosan",
            "kawasaki", "denso", "mitsubishi" in the units of the maker.

    Returns:
        The text: lengths to a micrometre, angles to 0.0001°, quaternions to six decimals.

    Raises:
        InputError: T is no rigid transform, or there is no such form.

    Examples:
        >>> import kin
        >>> kin.pose_to_text(kin.pose_from_xyz_rpy([0.6, 0.1, 0.3], [0.0, 1.5707963267948966, 0.0]), "kuka")
        '{X 600, Y 100, Z 300, A 0, B 90, C 0}'
    """
    return form_named(form).text(as_transform(T, "T"))
