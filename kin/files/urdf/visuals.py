"""What the links of a URDF look like: boxes, cylinders, spheres, and references to mesh files."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from kin.errors import RobotFileError
from kin.files.urdf.fingers import FingerMotion, fingers_of
from kin.files.urdf.poses import poses_of
from kin.files.urdf.tree import UrdfElement, UrdfTree, read_tree
from kin.transforms import Array

MAX_VISUALS = 300
LONGEST_PATH = 300  # characters

Rgb = tuple[float, float, float]


class Box(NamedTuple):
    """Sides along x, y and z in metres."""

    size: tuple[float, float, float]


class Cylinder(NamedTuple):
    """About z, its middle at the origin, in metres."""

    radius: float
    length: float


class Sphere(NamedTuple):
    """About the origin, in metres."""

    radius: float


class MeshFile(NamedTuple):
    """A mesh in a file, as the URDF names it."""

    path: str
    scale: tuple[float, float, float]


Shape = Box | Cylinder | Sphere | MeshFile


@dataclass(frozen=True, eq=False)
class Visual:
    """One visible body of a link.

    Attributes:
        link: name of the link.
        carrier: how many joints of the chain move it: 0, and it stands still.
        T_root_visual: its pose ``(4, 4)`` in the root link with all joints of the chain at zero.
        color: red, green and blue from 0 to 1; None if the URDF names none.
        finger: how joints beside the chain move it, None if none does.
    """

    link: str
    carrier: int
    T_root_visual: Array
    shape: Shape
    color: Rgb | None
    finger: FingerMotion | None = None


def read_visuals(text: str, tip: str | None = None, file: str = "URDF") -> tuple[Visual, ...]:
    """The visible bodies of all links that belong to the arm up to the link `tip`, in the order of the file.

    Links beside the chain, such as fingers, move with the link that carries them; their own joints are at zero,
    or at the limit closest to it. Where they have a range, `finger` says how they move it.

    Raises:
        RobotFileError: the file is invalid; the message names the link.
    """
    tree = read_tree(text, file)
    chain = tree.chain(None, tip)
    carriers, poses = poses_of(tree, chain)
    fingers = fingers_of(tree, chain, carriers, poses)
    colors = _colors(tree)
    found: list[Visual] = []
    for element in tree.root.findall("link"):
        link = element.get("name", "").strip()
        if link not in poses:
            continue
        for visual in element.findall("visual"):
            seen = _visual(UrdfElement(file, visual, f"of link {link}"), link, carriers[link], poses[link], colors)
            found += [replace(each, finger=fingers.get(link)) for each in seen]
            if len(found) > MAX_VISUALS:
                raise RobotFileError(
                    file, "visual", f"more than {MAX_VISUALS}", f"at most {MAX_VISUALS} in all links"
                )
    return tuple(found)


def _visual(
    fields: UrdfElement, link: str, carrier: int, T_root_link: Array, colors: dict[str, Rgb | None]
) -> list[Visual]:
    geometry = fields.element.find("geometry")
    if geometry is None:
        raise fields.refuse("geometry", "nothing", "<geometry> with a box, cylinder, sphere or mesh")
    shape = shape_of(UrdfElement(fields.file, geometry, fields.name))
    if shape is None:
        return []
    T = T_root_link @ np.array(fields.pose())
    material = fields.element.find("material")
    color = None if material is None else (_color(material, fields.file) or colors.get(material.get("name", "")))
    return [Visual(link, carrier, T, shape, color)]


def shape_of(fields: UrdfElement) -> Shape | None:
    """The shape of a `<geometry>`; None for a capsule or another shape that URDF does not define."""
    children = {child.tag for child in fields.element}
    if "mesh" in children:
        return _mesh(fields)
    if "box" in children:
        x, y, z = fields.triple("box", "size", "")
        _positive(fields, "box size", min(x, y, z))
        return Box((x, y, z))
    if "cylinder" in children:
        return Cylinder(_length(fields, "cylinder", "radius"), _length(fields, "cylinder", "length"))
    return Sphere(_length(fields, "sphere", "radius")) if "sphere" in children else None


def _mesh(fields: UrdfElement) -> MeshFile:
    mesh = fields.element.find("mesh")
    path = "" if mesh is None else mesh.get("filename", "").strip()
    if not path or len(path) > LONGEST_PATH:
        raise fields.refuse("mesh filename", path, f"the path of a mesh, at most {LONGEST_PATH} characters")
    x, y, z = fields.triple("mesh", "scale", "1 1 1")
    if 0.0 in (x, y, z):
        raise fields.refuse("mesh scale", f"{x:g} {y:g} {z:g}", "three numbers that are not zero")
    return MeshFile(path, (x, y, z))


def _length(fields: UrdfElement, tag: str, key: str) -> float:
    child = fields.element.find(tag)
    value = fields.number(tag, key, "" if child is None else child.get(key, ""))
    return _positive(fields, f"{tag} {key}", value)


def _positive(fields: UrdfElement, field: str, value: float) -> float:
    if not value > 0.0:
        raise fields.refuse(field, f"{value:g}", "a length above zero, in metres")
    return value


def _colors(tree: UrdfTree) -> dict[str, Rgb | None]:
    """The colours by the name of their material, wherever in the file it is defined."""
    found: dict[str, Rgb | None] = {}
    for material in tree.root.iter("material"):
        if (color := _color(material, tree.file)) is not None:
            found[material.get("name", "")] = color
    return found


def _color(material: Element, file: str) -> Rgb | None:
    color = material.find("color")
    if color is None:
        return None
    fields = UrdfElement(file, material, material.get("name", ""))
    parts = color.get("rgba", "").split()
    values = [fields.number("color", f"rgba[{i}]", part) for i, part in enumerate(parts)]
    if len(values) not in (3, 4):
        raise fields.refuse("color rgba", " ".join(parts), "four numbers from 0 to 1")
    red, green, blue = (min(max(value, 0.0), 1.0) for value in values[:3])
    return red, green, blue
