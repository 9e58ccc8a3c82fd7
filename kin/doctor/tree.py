"""Faults in how links and joints hang together, and parts of a file that nobody reads."""

from __future__ import annotations

from difflib import get_close_matches
from xml.etree.ElementTree import Element
from xml.sax.saxutils import quoteattr

from kin.doctor.notes import FindingLog, cut
from kin.files.names import unused
from kin.files.urdf.fields import ELEMENTS, ignored_of
from kin.files.urdf.tree import Unread, UrdfTree

LISTED = 6  # names in a sentence
# Why an element is left out, by the tag of its parent and its own.
_UNREAD = {
    ("robot", "transmission"): "actuators, which kinematics does not need",
    ("robot", "gazebo"): "for the simulator Gazebo",
    ("robot", "sensor"): "sensors, which kinematics does not need",
    ("robot", "ros2_control"): "for the controllers of ROS 2",
    ("robot", "verbose"): "nothing but words",
    ("link", "inertial"): "masses and inertia, which kinematics does not need; they are checked below",
    ("link", "contact"): "friction, which kinematics does not need",
    ("link", "verbose"): "nothing but words",
    ("link", "self_collision_checking"): "an old way of bodies for collisions",
    ("link", "sensor"): "sensors, which kinematics does not need",
    ("joint", "dynamics"): "friction and damping, which kinematics does not need",
    ("joint", "safety_controller"): "limits of a controller; those in <limit> count",
    ("joint", "calibration"): "where a joint finds its reference",
    ("joint", "hardwareInterface"): "for the controllers of ROS",
}
_READ = {
    "robot": {"link", "joint", "material", "kinboard"},
    **{tag: {name for name, use in ELEMENTS[tag].items() if use == "read"} for tag in ("link", "joint")},
}


def check_tree(notes: FindingLog, tree: UrdfTree) -> None:
    """Look at names, parents and children."""
    for each in tree.unread:
        _check_unread(notes, tree, each)
    lost = [link for link in tree.links if link not in tree.depths]
    if lost:
        element = next(e for e in tree.root.findall("link") if e.get("name", "").strip() == lost[0])
        words = f"{_listed(lost)} hang on a cycle of joints, and on no root."
        notes.add(element, "robot", "tree", "wrong", words, "Give each link one parent, and the first link none.")
    roots = [link for link in tree.links if link not in tree.parents]
    if len(roots) > 1:
        element = next(e for e in tree.root.findall("link") if e.get("name", "").strip() == roots[1])
        words = f"{len(roots)} links have no parent: {_listed(roots)}. ROS readers take files with one root only."
        notes.add(element, "robot", "tree", "suspicious", words, "Connect them with fixed joints.")


def _check_unread(notes: FindingLog, tree: UrdfTree, each: Unread) -> None:
    element, source, error = each.element, notes.source, each.error
    name = element.get("name", "").strip()
    place = f"{element.tag} {name}" if name else element.tag
    words = f"{error.field} is {error.value}, expected {error.expected}."
    if not name:
        notes.add(element, place, "name", "wrong", words, f"Give the {element.tag} a name of its own.")
        return
    if not each.connects:
        if error.field == "joint":
            other = unused(name, {joint.name for joint in tree.joints}).replace(" ", "_")
            edit = source.with_attribute(element, "name", other)
            words = f"There are two joints “{cut(name)}”."
            notes.add(element, place, "name", "wrong", words, f"Call the second one {cut(other)}.", edit)
        elif element.tag == "link":
            words = f"There are two links “{cut(name)}”; the first one counts."
            if len(element):
                notes.add(element, place, "name", "wrong", words, "Rename one of them, or make them one.")
            else:
                notes.add(
                    element, place, "name", "wrong", words, "Leave out the empty one.", source.without(element)
                )
        else:
            words = f"The link “{cut(each.child)}” is {error.value}."
            mend = (
                "Leave out one of the joints; a closed loop needs a reader of its own kind, such as SDF or MJCF."
            )
            notes.add(element, place, "tree", "wrong", words.replace("'", ""), mend)
        return
    for tag, end in (("parent", each.parent), ("child", each.child)):
        if end in tree.known:
            continue
        child = element.find(tag)
        if child is None:
            words = f"It has no {tag}, so it is left out."
            notes.add(element, place, "tree", "wrong", words, f'Write <{tag} link="…"/>.')
        elif near := get_close_matches(end, _free(tree, tag), 1, 0.7):
            words = f"Its {tag} is “{cut(end)}”, which does not exist, so it is left out."
            edit = source.with_attribute(child, "link", near[0])
            notes.add(child, place, "tree", "wrong", words, f'Write link="{cut(near[0])}".', edit)
        else:
            words = f"Its {tag} is “{cut(end)}”, which does not exist, so it is left out."
            edits = (
                (source.with_child(tree.root, f"<link name={quoteattr(end)}/>"),) if end and tag == "child" else ()
            )
            mend = f'Add <link name="{cut(end)}"/>.' if edits else "Name a link of this file."
            notes.add(child, place, "tree", "wrong", words, mend, *edits)


def _free(tree: UrdfTree, tag: str) -> list[str]:
    """Links that a joint may have been meant to name: a child hangs on nothing yet."""
    return [link for link in tree.links if tag == "parent" or link not in tree.parents]


def check_elements(notes: FindingLog, root: Element) -> None:
    """List the elements of which nothing is made, each tag once."""
    found: dict[tuple[str, str], list[Element]] = {}
    for parent in [root, *root.findall("link"), *root.findall("joint")]:
        for child in parent:
            named = parent.tag == "joint" and child.tag not in ELEMENTS["joint"]  # as a finding of the joint
            if child.tag not in _READ[parent.tag] and not named:
                found.setdefault((parent.tag, child.tag), []).append(child)
    for (above, tag), several in found.items():
        many = f"<{cut(tag)}>"
        if len(several) > 1:
            many = f"{len(several)} {many}" if above == "robot" else f"{len(several)} elements {many} of {above}s"
        why = _UNREAD.get((above, tag), "URDF does not define it")
        notes.add(several[0], above, "element", "left out", f"{many}: {why}.")


def check_root(notes: FindingLog, root: Element) -> None:
    """Look at the attributes of the whole file."""
    for each in ignored_of(root):
        words = each.words[0].upper() + each.words[1:]
        notes.add(root, "robot", "element", "suspicious", f"{words}.", "Correct it, or leave it out.")


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return ", ".join(cut(name) for name in names[:LISTED]) + more
