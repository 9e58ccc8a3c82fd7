"""What can be wrong with the bodies of a link: shapes, mesh files, mass and inertia."""

from __future__ import annotations

import math
from typing import Protocol
from xml.etree.ElementTree import Element

import numpy as np

from kin.doctor.joints import check_origin
from kin.doctor.notes import FindingLog, cut, spelled
from kin.files.numbers import number_of
from kin.transforms import Array
from kin.units import general

SHAPES = {
    "box": ("size", 3),
    "sphere": ("radius", 1),
    "cylinder": ("radius length", 1),
    "capsule": ("radius length", 1),
}
INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
HEAVIEST = 2000.0  # kg of one link
_FARTHEST, _SMALLEST = 10.0, 5e-4  # of a mesh, relative to the reach of the arm
_ROUNDING = 2e-3  # of moments of inertia, relative to their sum
Matrix3 = Array


class MeshFiles(Protocol):
    """The files that came with a URDF."""

    def extent(self, path: str) -> Array | None:
        """The sides ``(3,)`` of a mesh as it is in its file, None if it has units of its own.

        Raises:
            LookupError: with the reason why there is none.
        """

    def elsewhere(self, path: str) -> str | None:
        """The path, as the URDF would name it, of a file of the same name somewhere else; None without one."""


def check_link(notes: FindingLog, link: Element, place: str, reach: float, files: MeshFiles | None) -> None:
    """Look at the bodies of one link of an arm with this reach, in metres."""
    inertial = link.find("inertial")
    if inertial is not None:
        _check_inertial(notes, inertial, place, reach)
    for tag in ("visual", "collision"):
        for body in link.findall(tag):
            where = f"{place}: {tag}"
            origin = body.find("origin")
            if origin is not None:
                check_origin(notes, origin, f"{where} origin")
            geometry = body.find("geometry")
            if geometry is None or not len(geometry):
                words = "It has no shape."
                edit = notes.source.without(body)
                notes.add(body, where, "body", "wrong", words, f"Leave out the <{tag}>.", edit)
                continue
            for shape in geometry:
                if shape.tag == "mesh":
                    _check_mesh(notes, shape, where, reach, files)
                else:
                    _check_shape(notes, shape, where, tag == "collision")


def _check_shape(notes: FindingLog, shape: Element, place: str, collides: bool) -> None:
    if shape.tag not in SHAPES or (shape.tag == "capsule" and not collides):
        words = f"URDF has no shape <{cut(shape.tag)}>: it is not drawn."
        notes.add(shape, place, "body", "left out", words)
        return
    keys, count = SHAPES[shape.tag]
    for key in keys.split():
        if key not in shape.attrib:
            notes.add(shape, place, "body", "wrong", f"Its {shape.tag} has no {key}.", "State it in metres.")
            continue
        values = notes.numbers(shape, place, key, count)
        if values is None or all(value > 0.0 for value in values):
            continue
        words = f"The {key} of its {shape.tag} is {' '.join(general(value) for value in values)}."
        if any(value < 0.0 for value in values) and all(values):
            sizes = [abs(value) for value in values]
            edit = notes.source.with_attribute(shape, key, spelled(*sizes))
            mend = f"Write {' '.join(general(value) for value in sizes)}."
            notes.add(shape, place, "body", "wrong", words, mend, edit)
        else:
            notes.add(shape, place, "body", "wrong", words, "State a length above zero, in metres.")


def _check_mesh(notes: FindingLog, mesh: Element, place: str, reach: float, files: MeshFiles | None) -> None:
    source, path = notes.source, mesh.get("filename", "").strip()
    scale = notes.numbers(mesh, place, "scale", 3) if "scale" in mesh.attrib else [1.0, 1.0, 1.0]
    if not path:
        notes.add(mesh, place, "mesh", "wrong", "Its mesh has no filename.", "Name the file.")
        return
    if scale is not None and 0.0 in scale:
        notes.add(
            mesh, place, "mesh", "wrong", "The scale of its mesh has a zero.", "Write 1 1 1, or the right one."
        )
        return
    if files is None:
        return
    name = cut(path.rpartition("/")[2])
    try:
        extent = files.extent(path)
    except LookupError as error:
        other = files.elsewhere(path)
        words = f"The mesh “{cut(path)}” cannot be used: {error.args[0]}."
        if other is not None:
            edit = source.with_attribute(mesh, "filename", other)
            notes.add(mesh, place, "mesh", "wrong", words, f"Write “{cut(other)}”: there it is.", edit)
        else:
            notes.add(mesh, place, "mesh", "wrong", words, "Send it along, or correct the path.")
        return
    if extent is None or scale is None:
        return
    largest = float(np.max(np.abs(extent * np.array(scale)), initial=0.0))
    size, near = general(largest, 3), max(reach, 0.01)
    if largest > _FARTHEST * near and largest / 1000.0 <= _FARTHEST * near:
        factor, unit = 1e-3, "millimetres"
    elif 0.0 < largest < _SMALLEST * near and largest * 1000.0 <= _FARTHEST * near:
        factor, unit = 1e3, "metres that are scaled as if they were millimetres"
    else:
        return
    mended = [value * factor for value in scale]
    edit = source.with_attribute(mesh, "scale", spelled(*mended))
    words = f"{name} is {size} m large, and the arm reaches {general(reach, 3)} m: it is in {unit}."
    mend = f'Write scale="{" ".join(general(value) for value in mended)}".'
    notes.add(mesh, place, "millimetres", "suspicious", words, mend, edit)


def _check_inertial(notes: FindingLog, inertial: Element, place: str, reach: float) -> None:
    source, place = notes.source, f"{place}: inertial"
    gone = source.without(inertial)
    element = inertial.find("mass")
    if element is None or "value" not in element.attrib:
        notes.add(inertial, place, "inertia", "wrong", "It states no mass.", "Leave out the <inertial>.", gone)
        return
    values = notes.numbers(element, f"{place} mass", "value")
    if values is None:
        return
    mass = values[0]
    if mass <= 0.0:
        words = f"Its mass is {general(mass)} kg, which no body has."
        mend = "State the mass; without it, leave out the <inertial>."
        notes.add(element, place, "inertia", "suspicious", words, mend, gone)
        return
    if mass > HEAVIEST:
        words = f"Its mass is {general(mass)} kg: this looks like grams."
        edit = source.with_attribute(element, "value", spelled(mass / 1000.0))
        notes.add(element, place, "inertia", "suspicious", words, f"Write {general(mass / 1000.0)}.", edit)
        mass /= 1000.0
    tensor = inertial.find("inertia")
    if tensor is None:
        notes.add(inertial, place, "inertia", "wrong", "It states no inertia.", "Leave out the <inertial>.", gone)
        return
    _check_tensor(notes, tensor, place, mass, reach)


def _check_tensor(notes: FindingLog, tensor: Element, place: str, mass: float, reach: float) -> None:
    source = notes.source
    missing = [key for key in INERTIA if key not in tensor.attrib]
    if missing:
        words = f"Its inertia has no {', '.join(missing)}."
        if {"ixx", "iyy", "izz"} & set(missing):
            notes.add(tensor, place, "inertia", "wrong", words, "State all moments, in kg·m².")
        else:
            edits = [source.with_attribute(tensor, key, "0") for key in missing]
            notes.add(tensor, place, "inertia", "wrong", words, "Write 0 for them.", *edits)
        return
    found = [number_of(tensor.get(key, "")) for key in INERTIA]
    if not all(map(math.isfinite, found)):
        for key in INERTIA:
            notes.numbers(tensor, place, key)
        return
    inertia = _matrix(found)
    moments = np.linalg.eigvalsh(inertia)
    total = float(np.trace(inertia))
    if not moments.any():
        words = f"Its inertia is zero, and its mass {general(mass)} kg: simulators refuse a moving link like that."
        notes.add(tensor, place, "inertia", "suspicious", words, "State the moments, in kg·m².")
        return
    low, middle, high = moments.tolist()
    if low < -_ROUNDING * abs(total) or high > (low + middle) * (1.0 + _ROUNDING) + _ROUNDING * abs(total):
        listed = ", ".join(general(value, 3) for value in moments)
        words = f"No body has its principal moments, {listed} kg·m²: each is at most the sum of the other two."
        if low < 0.0:
            words = f"One of its principal moments, {listed} kg·m², is negative, which no body has."
        possible = nearest_possible(inertia)
        if possible is None:
            notes.add(tensor, place, "inertia", "suspicious", words, "State the moments, in kg·m².")
            return
        pairs = zip(INERTIA, _six(possible), strict=True)
        edits = [source.with_attribute(tensor, key, spelled(value)) for key, value in pairs]
        mend = "Write the nearest moments that a body can have; better are those of its maker."
        notes.add(tensor, place, "inertia", "suspicious", words, mend, *edits)
    elif math.sqrt(high / mass) > max(reach, 1.0):
        radius = general(math.sqrt(high / mass), 3)
        words = (
            f"With {general(mass)} kg its inertia is that of a mass {radius} m away, more than the arm reaches."
        )
        mend = "State the moments in kg·m²; those of a file in g·mm² are 10⁹ times as large."
        notes.add(tensor, place, "inertia", "suspicious", words, mend)


def nearest_possible(inertia: Matrix3) -> Matrix3 | None:
    """The nearest inertia tensor ``(3, 3)`` that a body can have; None if there is none but zero.

    The second moments of mass, ``tr(I)/2 − I``, are never negative in any direction (Wensing, Kim and Slotine,
    *Linear matrix inequalities for physically consistent inertial parameter identification*, 2018). Negative ones
    become a thousandth of the largest.
    """
    second, axes = np.linalg.eigh(0.5 * np.trace(inertia) * np.eye(3) - inertia)
    if second[-1] <= 0.0:
        return None
    second = np.maximum(second, 1e-3 * second[-1])
    return np.asarray(second.sum() * np.eye(3) - (axes * second) @ axes.T)


def _matrix(six: list[float]) -> Matrix3:
    xx, xy, xz, yy, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _six(matrix: Matrix3) -> list[float]:
    return [float(matrix[i, j]) for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
