"""What is made of each element and attribute that a URDF has on the way from the base to the tip of an arm.

The tables hold URDF 1.0 to 1.2 as urdfdom reads it. What is in neither table, a misspelt attribute say, may have
been meant to change the arm, so it is never ignored in silence: the report of the import names it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from difflib import get_close_matches
from typing import Literal, NamedTuple
from xml.etree.ElementTree import Element

Use = Literal["read", "beside"]  # whether the arm depends on it, or it has nothing to do with its geometry
VERSIONS = ("1.0", "1.1", "1.2", "1")

# Of each element the attributes, and the elements inside it.
ATTRIBUTES: dict[str, dict[str, Use]] = {
    "robot": {"name": "read", "version": "read", "xmlns": "beside"},
    "link": {"name": "read", "type": "beside"},
    "joint": {"name": "read", "type": "read"},
    "parent": {"link": "read"},
    "child": {"link": "read"},
    "origin": {"xyz": "read", "rpy": "read", "quat_xyzw": "read"},
    "axis": {"xyz": "read"},
    "limit": {
        **dict.fromkeys(("lower", "upper", "velocity", "effort"), "read"),
        **dict.fromkeys(("acceleration", "deceleration", "jerk"), "read"),
    },
    "mimic": {"joint": "read", "multiplier": "read", "offset": "read"},
    "dynamics": {"damping": "beside", "friction": "beside"},
    "calibration": {"rising": "beside", "falling": "beside", "reference_position": "beside"},
    "safety_controller": {
        **dict.fromkeys(("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"), "beside"),
    },
}
ELEMENTS: dict[str, dict[str, Use]] = {
    "link": {
        **dict.fromkeys(("visual", "collision"), "read"),
        **dict.fromkeys(("inertial", "contact", "verbose", "self_collision_checking", "sensor"), "beside"),
    },
    "joint": {
        **dict.fromkeys(("parent", "child", "origin", "axis", "limit", "mimic"), "read"),
        **dict.fromkeys(("dynamics", "safety_controller", "calibration", "hardwareInterface"), "beside"),
    },
    **{tag: {} for tag in ("parent", "child", "origin", "axis", "limit", "mimic")},
}


class Ignored(NamedTuple):
    """Something of an element that is not read, though it may change the arm."""

    element: Element
    words: str


def ignored_of(element: Element) -> Iterator[Ignored]:
    """What is not read of a `<robot>`, `<link>` or `<joint>`, and of the elements of a joint."""
    yield from _attributes(element)
    if element.tag == "robot":
        return
    known = ELEMENTS[element.tag]
    for tag, count in Counter(child.tag for child in element).items():
        if tag not in known:
            yield Ignored(element, f"<{tag}> is not read, as URDF does not define it there{_meant(tag, known)}")
        elif count > 1 and element.tag == "joint":
            yield Ignored(element, f"of {count} elements <{tag}> only the first one is read")
    if element.tag == "joint":
        for child in element:
            if known.get(child.tag) == "read":
                yield from _attributes(child)
                yield from (Ignored(child, f"<{each.tag}> in <{child.tag}> is not read") for each in child)
                if child.text and child.text.strip():
                    yield Ignored(child, f"the text in <{child.tag}> is not read: its numbers are attributes")


def _attributes(element: Element) -> Iterator[Ignored]:
    known = ATTRIBUTES[element.tag]
    for key in element.keys():  # noqa: SIM118 - an Element iterates over its children
        if key not in known and not key.startswith(("xmlns:", "xml:", "xsi:")):
            words = f"{key} of <{element.tag}> is not read, as URDF does not define it{_meant(key, known)}"
            yield Ignored(element, words)
    if element.tag == "robot" and (version := element.get("version", "1.0").strip()) not in VERSIONS:
        yield Ignored(element, f"version {version[:20]} is read as 1.2, the newest that is known")


def _meant(name: str, known: dict[str, Use]) -> str:
    near = get_close_matches(name.lower(), known, 1)
    return f"; {near[0]} may be meant" if near else ""
