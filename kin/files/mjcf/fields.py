"""What is made of the attributes that an MJCF file has on the way from the base to the tip of an arm.

The tables hold the schema of MuJoCo 3. What is in neither is refused by MuJoCo as a "schema violation"; here it is
named in the report of the import, as it may come with a newer version.
"""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

_FRAME = ("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler")
READ: dict[str, tuple[str, ...]] = {
    "compiler": ("angle", "eulerseq", "coordinate", "autolimits"),
    "body": ("name", "childclass", *_FRAME),
    "frame": ("name", "childclass", *_FRAME),
    "joint": ("name", "class", "type", "pos", "axis", "limited", "range", "ref", "actuatorfrcrange",
              "actuatorfrclimited"),
    "freejoint": ("name",),
}  # fmt: skip
# Nothing of these moves a frame or bounds a joint: forces, names of files, groups for drawing, masses.
BESIDE: dict[str, tuple[str, ...]] = {
    "compiler": (
        *("boundmass", "boundinertia", "settotalmass", "balanceinertia", "strippath", "fitaabb", "meshdir"),
        *("texturedir", "assetdir", "discardvisual", "usethread", "fusestatic", "inertiafromgeom", "alignfree"),
        *("inertiagrouprange", "saveinertial", "convexhull", "exactmeshinertia"),
    ),
    "body": ("gravcomp", "user", "sleep"),
    "frame": (),
    "joint": (
        *("group", "springdamper", "solreflimit", "solimplimit", "solreffriction", "solimpfriction", "stiffness"),
        *("actuatorgravcomp", "margin", "springref", "armature", "damping", "frictionloss", "user"),
    ),
    "freejoint": ("group", "align"),
}
# What changes where a body is, and is not read: in words.
NOT_READ = {("body", "mocap"): "a body that a program moves; it stands still here"}


def ignored_of(element: Element) -> Iterator[str]:
    """What of an element is not read, though it may change the arm; in words."""
    if element.tag not in READ:
        return
    for key, value in element.attrib.items():
        if key in READ[element.tag] or key in BESIDE[element.tag]:
            continue
        if why := NOT_READ.get((element.tag, key)):
            if value == "true":
                yield f"{key} of <{element.tag}> is not read: {why}"
        else:
            yield f"{key} of <{element.tag}> is not read, as MuJoCo does not define it"
