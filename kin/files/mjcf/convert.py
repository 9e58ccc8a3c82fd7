"""The kinematics of an MJCF file as the elements of a URDF, which are then read as any URDF is.

A body may have several joints, each about an axis through a point of the body, and a joint may have a reference
value at which the model stands as it is written. Each becomes a URDF joint and fixed ones around it, so the joint
values stay those of MuJoCo. Defaults and their classes, angles in degrees (MuJoCo's own default), the five ways of
writing an orientation, frames and sites are understood. Files that it includes are not: MuJoCo can save one file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from kin.axes import frame_of, inverse
from kin.errors import RobotFileError
from kin.files.mjcf.fields import ignored_of
from kin.files.names import unused
from kin.files.numbers import LARGEST, number_of
from kin.files.write import rpy_of
from kin.frames import pose_from_xyz_rpy
from kin.transforms import Array, pose_from_position_wxyz

MOUNTING, FLOOR = "kinboard_mounting", "kinboard_floor"  # names of custom data: text, and metres
POLYNOMIAL = "polycoef"  # attribute of `<mimic>` that keeps a relation of two joints which is not linear
MOST_SHAPES = 240  # shapes that are drawn
WRITTEN = "mjcf-type"  # attribute of a converted joint: its type in the MJCF file
_KINDS = {"hinge": "revolute", "slide": "prismatic", "ball": "floating", "free": "floating"}
_SHAPES = ("sphere", "capsule", "box", "cylinder")
_X, _Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])


class Converted(NamedTuple):
    """The `<robot>` of a URDF, and what of the file is not read though it may change the arm.

    Attributes:
        robot: the root of a URDF.
        ignored: sentences, each with the name of the link of `robot` that it concerns; "" for the whole file.
    """

    robot: Element
    ignored: Sequence[tuple[str, str]]


def as_urdf(root: Element, file: str) -> Converted:
    """The `<robot>` of a URDF with the bodies, joints and shapes of a `<mujoco>`.

    Raises:
        RobotFileError: naming the element and what would be valid.
    """
    converter = _Converter(root, file)
    return Converted(converter.robot, converter.ignored)


class _Converter:
    def __init__(self, root: Element, file: str) -> None:
        self._file = file
        self.ignored: list[tuple[str, str]] = []
        for element in root.iter():
            if element.tag in ("include", "attach", "replicate", "composite", "flexcomp"):
                words = "one file without it: MuJoCo writes one with mj_saveLastXML"
                raise self._refuse(f"<{element.tag}>", element.get("file", "") or element.tag, words)
        compilers = root.findall("compiler")
        for compiler in compilers:
            self._note("", "The file", compiler)
        settings = {key: value for compiler in compilers for key, value in compiler.attrib.items()}
        if settings.get("coordinate", "local") != "local":
            raise self._refuse("compiler coordinate", settings["coordinate"], "local coordinates")
        self._angle = 1.0 if settings.get("angle", "degree") == "radian" else math.pi / 180.0
        self._order = settings.get("eulerseq", "xyz")
        if len(self._order) != 3 or set(self._order.lower()) - set("xyz"):
            raise self._refuse("compiler eulerseq", self._order, "three of x, y, z, X, Y and Z")
        self._auto = settings.get("autolimits", "true") == "true"
        self._references: dict[str, float] = {}  # by joint, its value in the first configuration
        self._defaults: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        for each in root.findall("default"):
            self._read_defaults(each, {}, "main")
        self.robot = Element("robot", name=root.get("model", "MuJoCo model"))
        self._links: set[str] = set()
        self._joints: set[str] = set()
        self._shapes = 0
        self._link("world")
        for world in root.findall("worldbody"):
            self._body(world, "world", np.eye(4), "main")
        self._follow(root)
        found = {each.get("name"): each.get("data", "") for custom in root.findall("custom") for each in custom}
        stated = {"mounting": found.get(MOUNTING), "floor": found.get(FLOOR)}
        if any(value is not None for value in stated.values()):
            SubElement(self.robot, "kinboard", {key: value for key, value in stated.items() if value is not None})

    def _note(self, link: str, what: str, element: Element) -> None:
        """Keep what is not read of an element on the way to a link."""
        self.ignored += [(link, f"{what}: {words}.") for words in ignored_of(element)]

    def _refuse(self, field: str, value: object, expected: str) -> RobotFileError:
        return RobotFileError(self._file, field, value, expected)

    # Defaults

    def _read_defaults(self, element: Element, above: dict[str, dict[str, str]], name: str) -> None:
        name = element.get("class", name)
        own = {tag: dict(values) for tag, values in above.items()}
        for child in element:
            if child.tag != "default":
                own[child.tag] = {**own.get(child.tag, {}), **child.attrib}
        self._defaults[name] = own
        for child in element.findall("default"):
            self._read_defaults(child, own, name)

    def _values(self, element: Element, inherited: str) -> dict[str, str]:
        """The attributes of an element with those of its class."""
        chosen = element.get("class", inherited)
        if chosen not in self._defaults:
            raise self._refuse(
                f"{element.tag} {element.get('name', '')}: class", chosen, "the class of a <default>"
            )
        return {**self._defaults[chosen].get(element.tag, {}), **element.attrib}

    # Numbers and frames

    def _numbers(self, values: dict[str, str], key: str, where: str, count: int, default: str) -> list[float]:
        parts = values.get(key, default).split()
        found = [number_of(part) for part in parts]
        if len(found) != count or not all(map(math.isfinite, found)):
            raise self._refuse(
                f"{where}: {key}", values.get(key, ""), f"{count} finite numbers with blanks between"
            )
        return found

    def _pose(self, values: dict[str, str], where: str) -> Array:
        """The frame of an element ``(4, 4)`` in its parent's."""
        p = self._numbers(values, "pos", where, 3, "0 0 0")
        T = np.eye(4)
        if "quat" in values:
            wxyz = self._numbers(values, "quat", where, 4, "")
            if not any(wxyz):
                raise self._refuse(f"{where}: quat", values["quat"], "a quaternion that is not zero")
            T = pose_from_position_wxyz([0.0, 0.0, 0.0], wxyz)
        elif "axisangle" in values:
            *axis, angle = self._numbers(values, "axisangle", where, 4, "")
            T = _turn(self._unit(axis, f"{where}: axisangle"), angle * self._angle)
        elif "euler" in values:
            for letter, angle in zip(self._order, self._numbers(values, "euler", where, 3, ""), strict=True):
                turn = _turn(np.eye(3)["xyz".index(letter.lower())], angle * self._angle)
                T = T @ turn if letter.islower() else turn @ T
        elif "xyaxes" in values:
            both = self._numbers(values, "xyaxes", where, 6, "")
            x = self._unit(both[:3], f"{where}: xyaxes")
            y = self._unit(np.array(both[3:]) - (np.array(both[3:]) @ x) * x, f"{where}: xyaxes")
            T = frame_of(x, np.cross(x, y), np.zeros(3))
        elif "zaxis" in values:
            T = _turned_to(self._unit(self._numbers(values, "zaxis", where, 3, ""), f"{where}: zaxis"))
        T = T.copy()
        T[:3, 3] = p
        return T

    def _site(self, values: dict[str, str], where: str) -> Array:
        """The frame of a site: one from a point to another is in the middle, its z axis towards the first."""
        if "fromto" not in values or values.get("type", "sphere") == "sphere":
            return self._pose(values, where)
        ends = np.array(self._numbers(values, "fromto", where, 6, "")).reshape(2, 3)
        T = _turned_to(self._unit(ends[0] - ends[1], f"{where}: fromto")).copy()
        T[:3, 3] = ends.mean(axis=0)
        return T

    def _unit(self, values: Sequence[float] | Array, field: str) -> Array:
        vector = np.array(values)
        length = float(np.linalg.norm(vector))
        if length < 1e-9:
            raise self._refuse(field, values, "a direction that is not zero")
        return np.asarray(vector / length)

    # Bodies

    def _link(self, name: str) -> str:
        found = unused(name[:180], self._links)
        self._links.add(found)
        SubElement(self.robot, "link", name=found)
        return found

    def _fixed(self, parent: str, child: str, T: Array) -> None:
        self._add_joint(f"{child} frame", "fixed", parent, child, T)

    def _add_joint(self, name: str, kind: str, parent: str, child: str, T: Array) -> Element:
        name = unused(name[:180], self._joints)
        self._joints.add(name)
        joint = SubElement(self.robot, "joint", name=name, type=kind)
        SubElement(joint, "parent", link=parent)
        SubElement(joint, "child", link=child)
        SubElement(joint, "origin", xyz=_spelled(T[:3, 3]), rpy=_spelled(rpy_of(T)))
        return joint

    def _body(self, element: Element, link: str, T: Array, inherited: str) -> None:
        """Add the contents of a body, or of a frame in it. `T` is its frame in that of the link."""
        inherited = element.get("childclass", inherited)
        for child in element:
            if child.tag == "body":
                self._child(child, link, T, child.get("childclass", inherited))
            elif child.tag == "frame":
                where = f"frame in {link}"
                self._body(child, link, T @ self._pose(dict(child.attrib), where), inherited)
            elif child.tag == "site" and child.get("name"):
                values = self._values(child, inherited)
                name = self._link(child.get("name", ""))
                self._fixed(link, name, T @ self._site(values, f"site {name}"))
            elif child.tag == "geom":
                self._geom(self._values(child, inherited), link, T)

    def _child(self, body: Element, parent: str, T: Array, inherited: str) -> None:
        name = body.get("name", "") or f"body {len(self._links)}"
        T = T @ self._pose(dict(body.attrib), f"body {name}")
        joints = [child for child in body if child.tag in ("joint", "freejoint")]
        link = parent
        for k, joint in enumerate(joints):
            last = k == len(joints) - 1
            own = joint.get("name", "") or (f"{name} joint" if len(joints) == 1 else f"{name} joint {k + 1}")
            link, T = self._moving(
                joint, own, link, T, inherited, f"{name} {k + 1}" if not last else f"{own} of {name}"
            )
        here = self._link(name)
        self._note(here, f"Body {name}", body)
        self._fixed(link, here, T)
        self._body(body, here, np.eye(4), inherited)

    def _moving(
        self, element: Element, name: str, parent: str, T: Array, inherited: str, child: str
    ) -> tuple[str, Array]:
        """Add a joint; returns the link behind it, and the frame of the body in that link."""
        values = {"type": "free"} if element.tag == "freejoint" else self._values(element, inherited)
        kind = values.get("type", "hinge")
        where = f"joint {name}"
        if kind not in _KINDS:
            raise self._refuse(f"{where}: type", kind, "one of " + ", ".join(_KINDS))
        at = np.eye(4)
        at[:3, 3] = self._numbers(values, "pos", where, 3, "0 0 0")
        axis = self._unit(self._numbers(values, "axis", where, 3, "0 0 1"), f"{where}: axis")
        unit = self._angle if kind == "hinge" else 1.0
        reference = self._numbers(values, "ref", where, 1, "0")[0] * unit
        self._references[name] = reference
        limits = self._limits(values, where, unit)
        urdf = "continuous" if kind == "hinge" and limits is None else _KINDS[kind]
        link = self._link(child)
        self._note(link, f"Joint {name}", element)
        joint = self._add_joint(name, urdf, parent, link, T @ at)
        joint.set(WRITTEN, kind)
        SubElement(joint, "axis", xyz=_spelled(axis))
        force = [number_of(part) for part in values.get("actuatorfrcrange", "").split()]
        limited = values.get("actuatorfrclimited", "auto") != "false" and len(force) == 2
        effort = max(map(abs, force)) if limited and all(map(math.isfinite, force)) else 0.0
        limit = SubElement(joint, "limit", effort=repr(effort), velocity="0")
        if limits is not None:
            limit.set("lower", repr(limits[0]))
            limit.set("upper", repr(limits[1]))
        back = inverse(at)
        if reference and kind == "hinge":
            back = _turn(axis, -reference) @ back
        elif reference:
            back = back.copy()
            back[:3, 3] -= reference * axis
        return link, back

    def _limits(self, values: dict[str, str], where: str, unit: float) -> tuple[float, float] | None:
        limited = values.get("limited", "auto")
        if limited == "false":
            return None
        low, high = (number_of(part) for part in self._pair(values, where))
        if limited == "auto" and not (self._auto and "range" in values and low < high):
            return None  # MuJoCo's "0 0" resets the range of a class
        if not low < high:
            raise self._refuse(f"{where}: range", values.get("range", "none"), "two numbers, range[0] < range[1]")
        low, high = low * unit, high * unit
        if not (max(abs(low), abs(high)) < LARGEST or (low <= -LARGEST and high >= LARGEST)):
            raise self._refuse(f"{where}: range", values["range"], "numbers smaller than a million rad or m")
        return low, high

    def _pair(self, values: dict[str, str], where: str) -> list[str]:
        """The texts of a range, which may be infinite."""
        parts = values.get("range", "0 0").split()
        if len(parts) != 2 or any(math.isnan(number_of(part)) for part in parts):
            raise self._refuse(f"{where}: range", values.get("range", ""), "2 numbers with blanks between")
        return parts

    # Shapes and followers

    def _geom(self, values: dict[str, str], link: str, T_link: Array) -> None:
        kind = values.get("type", "mesh" if "mesh" in values else "sphere")
        if kind not in _SHAPES or self._shapes >= MOST_SHAPES:
            return
        where = f"geom {values.get('name', '')} of {link}"
        size = [number_of(part) for part in values.get("size", "").split()]
        T, half = self._pose(values, where), None
        if "fromto" in values:
            ends = self._numbers(values, "fromto", where, 6, "")
            start, end = np.array(ends[:3]), np.array(ends[3:])
            half = 0.5 * float(np.linalg.norm(end - start))
            if half > 0.0:
                T = _turned_to((end - start) / (2.0 * half))
            T = T.copy()
            T[:3, 3] = 0.5 * (start + end)
        needed = {"sphere": 1, "box": 3}.get(kind, 1 if half is not None else 2)
        if len(size) < needed or not all(math.isfinite(x) and x > 0.0 for x in size[:needed]):
            return  # a shape that nobody can read is no reason to refuse the arm
        collides = values.get("contype", "1") != "0" or values.get("conaffinity", "1") != "0"
        T = T_link @ T
        half = half if half is not None else (size[1] if needed == 2 else 0.0)
        owner = next(each for each in self.robot if each.tag == "link" and each.get("name") == link)
        for tag in ("visual", "collision") if collides else ("visual",):
            for shape, attributes, along in _pieces(kind, size, half, tag):
                body = SubElement(owner, tag)
                place = T.copy()
                place[:3, 3] += along * T[:3, 2]
                SubElement(body, "origin", xyz=_spelled(place[:3, 3]), rpy=_spelled(rpy_of(place)))
                SubElement(SubElement(body, "geometry"), shape, attributes)
                self._shapes += 1

    def _follow(self, root: Element) -> None:
        """Joints that an equality ties to another one, as `<mimic>`; one that is not linear is refused later."""
        joints = {joint.get("name"): joint for joint in self.robot.findall("joint")}
        for equality in root.findall("equality"):
            for each in equality.findall("joint"):
                follower, leader = joints.get(each.get("joint1")), each.get("joint2")
                if follower is None or each.get("active", "true") != "true":
                    continue
                mimic = SubElement(follower, "mimic", joint=leader or "")
                curve = each.get("polycoef", "0 1")
                terms = [number_of(part) for part in curve.split()]
                if len(terms) < 2 or any(terms[2:]) or not all(map(math.isfinite, terms)):
                    mimic.set(POLYNOMIAL, curve)
                    continue
                # How far the follower is from its first value, by how far the leader is.
                own, others = (self._references.get(str(name), 0.0) for name in (follower.get("name"), leader))
                mimic.set("multiplier", repr(terms[1]))
                mimic.set("offset", repr(own + terms[0] - terms[1] * others))


def _pieces(
    kind: str, size: Sequence[float], half: float, tag: str
) -> Iterator[tuple[str, dict[str, str], float]]:
    """A shape as URDF has it, and how far it is along z: a capsule is drawn as a cylinder and two balls."""
    radius = repr(size[0])
    if kind == "box":
        yield "box", {"size": _spelled([2.0 * x for x in size[:3]])}, 0.0
    elif kind == "sphere" or (kind == "capsule" and half <= 0.0):
        yield "sphere", {"radius": radius}, 0.0
    elif kind == "cylinder":
        yield "cylinder", {"radius": radius, "length": repr(2.0 * half)}, 0.0
    elif tag == "collision":
        yield "capsule", {"radius": radius, "length": repr(2.0 * half)}, 0.0
    else:
        yield "cylinder", {"radius": radius, "length": repr(2.0 * half)}, 0.0
        yield "sphere", {"radius": radius}, half
        yield "sphere", {"radius": radius}, -half


def _turn(axis: Array, angle: float) -> Array:
    """A rotation ``(4, 4)`` by Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    T = np.eye(4)
    T[:3, :3] += math.sin(angle) * K + 2.0 * math.sin(0.5 * angle) ** 2 * (K @ K)
    return T


def _turned_to(z: Array) -> Array:
    """The smallest rotation ``(4, 4)`` that takes z to a direction."""
    axis = np.array([-z[1], z[0], 0.0])
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(4) if z[2] > 0.0 else pose_from_xyz_rpy([0.0, 0.0, 0.0], [math.pi, 0.0, 0.0])
    return _turn(axis / sine, math.atan2(sine, float(z[2])))


def _spelled(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)
