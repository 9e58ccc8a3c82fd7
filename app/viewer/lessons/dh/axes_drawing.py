"""The joint axes as labelled lines, with the common normals between neighbours and their feet."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from app.exercises.rows import Line
from app.viewer.lessons.dh.normals import Normal, axis_lines, common_normal
from app.viewer.lessons.dh.steps import low
from app.viewer.lessons.figure_shapes import AMBER, PURPLE
from app.viewer.lessons.figures import Figure
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


class AxesDrawing:
    """The axes of all joints and their normals, as parts of a figure."""

    def __init__(self, figure: Figure, robot: Robot) -> None:
        self._robot = robot
        self._size = figure.size
        self._axes = [figure.line(color=PURPLE, width=0.15) for _ in range(robot.n)]
        self._normals = [figure.line(color=AMBER, width=0.3) for _ in range(robot.n - 1)]
        self._feet = [[figure.point(color=AMBER, radius=0.42) for _ in range(2)] for _ in range(robot.n - 1)]

    def show(self, q: Array, names: Sequence[str], only: Sequence[int] | None = None) -> None:
        """Draw them at a configuration ``(n,)``, the axes with these names.

        Args:
            only: indices of the normals to draw; by default all.
        """
        lines = axis_lines(self._robot, q)
        feet = normals(self._robot, lines)
        texts = list(names)
        for k, normal in enumerate(feet):
            if normal.relation == "one":  # one label for both, at the longer line
                texts[k + 1], texts[k] = f"{texts[k]}, {texts[k + 1]}" if texts[k] else texts[k + 1], ""
        for part, (start, end), text in zip(self._axes, spans(self._robot, lines, self._size), texts, strict=True):
            part.show(start, end, text)
        for k, (part, ends, normal) in enumerate(zip(self._normals, self._feet, feet, strict=True)):
            if normal.relation in ("one", "meet") or (only is not None and k not in only):
                for each in (part, *ends):
                    each.hide()
                continue
            part.show(normal.start, normal.end)
            for each, foot in zip(ends, (normal.start, normal.end), strict=True):
                each.show(foot)

    def hide(self) -> None:
        """Hide all of it."""
        for part in (*self._axes, *self._normals, *(foot for pair in self._feet for foot in pair)):
            part.hide()
