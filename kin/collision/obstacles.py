"""Obstacles: boxes, spheres, cylinders and tables around an arm.

A kind of obstacle is a row of `KINDS`. What checks, draws, asks for or stores obstacles reads it there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from kin.collision.solids import BOX, COLUMNS, CYLINDER, SPHERE
from kin.errors import InputError
from kin.frames import pose_from_xyz_rpy
from kin.transforms import Array

Shape = Literal["box", "sphere", "cylinder", "table"]
SHAPES: tuple[Shape, ...] = get_args(Shape)
MOST_OBSTACLES = 32
SMALLEST, LARGEST = 1e-4, 100.0  # m, of a size
FARTHEST = 1e4  # m, of a place
LONGEST_NAME = 60
Triple = tuple[float, float, float]
_NAMES = {"size": ("length", "width", "height"), "radius": ("radius",), "height": ("height",)}


@dataclass(frozen=True)
class Kind:
    """A kind of obstacle: all that tells it from others.

    Attributes:
        solid: the body that kernels and drawings have of it: `SPHERE`, `CYLINDER` or `BOX`.
        fields: those of an `Obstacle` that hold its sizes.
        letter: for it in links.
        new: sizes of one that is put into a page, in reaches of the arm; a table is as high as there is room.
        about: what has to be known of it, for documents; "" if its name says all.
        topped: whether its place is the middle of its top, not its centre, and others can stand on it.
    """

    solid: int
    fields: tuple[str, ...]
    letter: str
    new: tuple[float, ...]
    about: str = ""
    topped: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its sizes, in the order of `Obstacle.sizes`."""
        return tuple(name for key in self.fields for name in _NAMES[key])

    def with_sizes(self, values: Sequence[float]) -> dict[str, Any]:
        """The fields of an obstacle with these sizes (m), which `names` names."""
        return {"size": tuple(values)} if "size" in self.fields else dict(zip(self.fields, values, strict=True))


KINDS: dict[Shape, Kind] = {
    "box": Kind(BOX, ("size",), "b", (0.14, 0.14, 0.14)),
    "sphere": Kind(SPHERE, ("radius",), "s", (0.08,)),
    "cylinder": Kind(CYLINDER, ("radius", "height"), "c", (0.06, 0.24), "its axis is z"),
    "table": Kind(
        *(BOX, ("size",), "t", (0.45, 0.7)),
        about="a box whose place is the middle of its top; everything under the top counts as solid",
        topped=True,
    ),
}


@dataclass(frozen=True)
class Obstacle:
    """A body that the arm must not touch, at rest in the frame of the targets.

    Attributes:
        shape: ``"box"``, ``"sphere"``, ``"cylinder"`` (its axis is z) or ``"table"``: a box whose place is the
            middle of its top. Everything under the top counts as solid.
        xyz: m, the centre; of a table, the middle of its top.
        rpy: rad, roll, pitch and yaw: ``Rz(yaw) Ry(pitch) Rx(roll)``.
        size: m along x, y and z, of a box or table.
        radius: m, of a sphere or cylinder.
        height: m, of a cylinder.
        name: for people; by default its shape.

    Raises:
        InputError: naming the field.
    """

    shape: Shape
    xyz: Sequence[float] = (0.0, 0.0, 0.0)
    rpy: Sequence[float] = (0.0, 0.0, 0.0)
    size: Sequence[float] | None = None
    radius: float | None = None
    height: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        """Check the fields; lists become tuples."""
        if self.shape not in SHAPES:
            raise InputError("shape", self.shape, "one of " + ", ".join(f'"{each}"' for each in SHAPES))
        for key, most in (("xyz", FARTHEST), ("rpy", 1e6)):
            object.__setattr__(self, key, _triple(key, getattr(self, key), -most, most))
        needed = self.kind.fields
        for key in _NAMES:
            value = getattr(self, key)
            if key not in needed:
                if value is not None:
                    raise InputError(key, value, f"none: a {self.shape} has {' and '.join(needed)}")
            elif key == "size":
                object.__setattr__(self, key, _triple(key, value, SMALLEST, LARGEST))
            else:
                object.__setattr__(self, key, _number(key, value, SMALLEST, LARGEST))
        if not isinstance(self.name, str) or len(self.name) > LONGEST_NAME or not self.name.isprintable():
            raise InputError("name", self.name, f"a text of at most {LONGEST_NAME} printable characters")

    @property
    def kind(self) -> Kind:
        """What tells its shape from others."""
        return KINDS[self.shape]

    @property
    def sizes(self) -> tuple[float, ...]:
        """Its sizes (m), in the order of the names of its kind."""
        return tuple(v for key in self.kind.fields for v in np.atleast_1d(getattr(self, key)).tolist())

    @property
    def label(self) -> str:
        """Its name, or its shape."""
        return self.name or self.shape

    @cached_property
    def T(self) -> Array:
        """Pose of its centre ``(4, 4)``."""
        T = pose_from_xyz_rpy(self.xyz, self.rpy)
        if self.kind.topped:
            T[:3, 3] -= self.half[2] * T[:3, 2]
        return T

    @cached_property
    def row(self) -> Array:
        """For the kernels ``(17,)``, as in :mod:`kin.collision.solids`."""
        out = np.empty(COLUMNS)
        out[0], out[1:4] = self.kind.solid, self.half
        out[4:13], out[13:16] = self.T[:3, :3].ravel(), self.T[:3, 3]
        across = {SPHERE: self.half[:1], CYLINDER: self.half[::2], BOX: self.half}[self.kind.solid]
        out[16] = np.linalg.norm(across)
        return out

    @cached_property
    def half(self) -> Array:
        """Half of what it measures along its own x, y and z ``(3,)``, m."""
        if self.kind.solid == BOX:
            return 0.5 * np.array(self.sizes)
        radius = self.sizes[0]
        return np.array([radius, radius, radius if self.kind.solid == SPHERE else 0.5 * self.sizes[1]])

    def as_dict(self) -> dict[str, Any]:
        """Its fields as plain data, without those that do not apply; `obstacle_from_dict` reads them.

        Returns:
            Plain values, metres and radians, as JSON has them.

        Examples:
            >>> import kin
            >>> kin.Obstacle("sphere", xyz=(0.5, 0.0, 0.2), radius=0.1).as_dict()
            {'shape': 'sphere', 'xyz': [0.5, 0.0, 0.2], 'rpy': [0.0, 0.0, 0.0], 'radius': 0.1}
        """
        found: dict[str, Any] = {"shape": self.shape, "xyz": list(self.xyz), "rpy": list(self.rpy)}
        for key in self.kind.fields:
            value = getattr(self, key)
            found[key] = list(value) if key == "size" else value
        if self.name:
            found["name"] = self.name
        return found


def obstacle_from_dict(data: object) -> Obstacle:
    """An obstacle from plain data with the fields of `Obstacle`; raises `InputError` naming the field.

    Args:
        data: the fields, plain values.

    Returns:
        The obstacle.

    Raises:
        InputError: naming the field, the value and what would be valid.

    Examples:
        >>> import kin
        >>> kin.collision.obstacle_from_dict({"shape": "sphere", "xyz": [0.5, 0.0, 0.2], "radius": 0.1}).shape
        'sphere'
    """
    known = [each.name for each in fields(Obstacle)]
    if not isinstance(data, Mapping):
        raise InputError("obstacle", data, "a table with the fields " + ", ".join(known))
    for key in data:
        if key not in known:
            raise InputError(str(key), data[key], "only the fields " + ", ".join(known))
    if "shape" not in data:
        raise InputError("shape", None, "one of " + ", ".join(f'"{each}"' for each in SHAPES))
    return Obstacle(**data)


def checked_obstacles(obstacles: object) -> tuple[Obstacle, ...]:
    """A sequence of obstacles, or of their fields as plain data; an `InputError` names ``obstacles[i]``."""
    if not isinstance(obstacles, Sequence) or isinstance(obstacles, str | bytes):
        raise InputError("obstacles", obstacles, "a list of obstacles")
    if len(obstacles) > MOST_OBSTACLES:
        raise InputError("obstacles", f"{len(obstacles)} obstacles", f"at most {MOST_OBSTACLES}")
    found = []
    for i, each in enumerate(obstacles):
        try:
            found.append(each if isinstance(each, Obstacle) else obstacle_from_dict(each))
        except InputError as error:
            where = f"obstacles[{i}]" if error.field == "obstacle" else f"obstacles[{i}].{error.field}"
            raise error.renamed(where) from None
    return tuple(found)


def _triple(field: str, value: object, least: float, most: float) -> Triple:
    expected = f"three numbers from {least:g} to {most:g}"
    items = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(items, Sequence) or isinstance(items, str) or len(items) != 3:
        raise InputError(field, value, expected)
    x, y, z = (_number(f"{field}[{i}]", each, least, most) for i, each in enumerate(items))
    return x, y, z


def _number(field: str, value: object, least: float, most: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value <= most:
        raise InputError(field, value, f"a number from {least:g} to {most:g}")
    return float(value)
