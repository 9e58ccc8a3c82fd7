"""The joint axes as labelled lines, with the common normals between neighbours and their feet."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from app.exercises.rows import Line
from app.viewer.declared.scene import Node
from app.viewer.lessons.dh.normals import Normal, axis_lines, common_normal
from app.viewer.lessons.dh.steps import low
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import AMBER, PURPLE
from app.viewer.scene.camera import Sphere
from app.viewer.scene.meshes import body
from kin import Robot
from kin.axes import NEARLY, size
from kin.transforms import Array

# In units of the arm's thickness.
OVER, STAGGER = 10.5, 1.5  # how far an axis is drawn beyond its feet; neighbours' labels are this far apart


def axis_names(robot: Robot) -> list[str]:
    """The names of the joint axes: z₀ is the axis of joint 1 in the standard convention, z₁ in Craig's."""
    first = 0 if robot.convention == "standard" else 1
    return [f"z{low(first + joint)}" for joint in range(robot.n)]


def normals(robot: Robot, lines: Sequence[Line]) -> list[Normal]:
    """The common normal of each axis and the next; of parallel ones the normal where the one before ends."""
    near, found = 0.1 * NEARLY * size(robot), list[Normal]()
    for one, other in pairwise(lines):
        found.append(common_normal(one, other, near, through=found[-1].end if found else one.point))
    return found


def spans(robot: Robot, lines: Sequence[Line], thickness: float) -> list[tuple[Array, Array]]:
    """Both ends ``(3,)`` of each axis as it is drawn: beyond the feet of its normals."""
    feet = normals(robot, lines)
    ends = []
    for k, line in enumerate(lines):
        on_it = [feet[k - 1].end] if k else []
        on_it += [feet[k].start] if k < len(feet) else []
        places = [float((foot - line.point) @ line.z) for foot in on_it] or [0.0]
        over = (OVER + STAGGER * (k % 3)) * thickness
        ends.append((line.point + (min(places) - over) * line.z, line.point + (max(places) + over) * line.z))
    return ends


def room(robot: Robot) -> list[Sphere]:
    """What a view has to show besides the arm: the ends of the axes at home, where their names are."""
    lines = axis_lines(robot, robot.q_home)
    thickness = body(robot).size
    return [(end, 4.0 * thickness) for pair in spans(robot, lines, thickness) for end in pair]


def joint_axes(
    figure: FigureNodes, robot: Robot, q: Array, names: Sequence[str], only: Sequence[int] | None = None
) -> list[Node]:
    """The axes of all joints at a configuration ``(n,)``, with these names, and their normals.

    Args:
        only: indices of the normals to draw; by default all.
    """
    lines, nodes = axis_lines(robot, q), list[Node]()
    feet, texts = normals(robot, lines), list(names)
    for k, normal in enumerate(feet):
        if normal.relation == "one":  # one label for both, at the longer line
            texts[k + 1], texts[k] = f"{texts[k]}, {texts[k + 1]}" if texts[k] else texts[k + 1], ""
    for k, ((start, end), text) in enumerate(zip(spans(robot, lines, figure.size), texts, strict=True)):
        nodes += figure.line(f"axis-{k}", start, end, text, PURPLE, 0.15)
    for k, normal in enumerate(feet):
        if normal.relation not in ("one", "meet") and (only is None or k in only):
            nodes += figure.line(f"normal-{k}", normal.start, normal.end, "", AMBER, 0.3)
            for i, foot in enumerate((normal.start, normal.end)):
                nodes += figure.point(f"foot-{k}-{i}", foot, radius=0.42)
    return nodes
