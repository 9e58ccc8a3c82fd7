"""What the folder "Postures" shows: the map, the postures of a place in it, and the loop of a cuspidal arm."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

import kin
from app.exports.postures import PAGE_SIZE, page_chart, page_plot, pixels
from app.exports.svg import chart, cross
from app.shared.summaries import PostureRequest
from app.viewer.declared.scene import Color, Node, lines
from app.viewer.drive import Drive
from app.viewer.panel.status import Notice
from app.viewer.postures.survey import Posture, best_manipulability, limit_margin
from app.viewer.skeleton import ghost
from app.viewer.tabs.workspace.pick import MARK_COLOUR
from app.viewer.views.templates import render
from kin import IKOptions, JointConstraints, Robot
from kin.angles import wrapped
from kin.ik import solve
from kin.postures import Cuspidality, PostureMap
from kin.tolerances import TOLERANCES
from kin.transforms import Array, wxyz_from_rotation
from kin.units import Units, general, typeset

COLOR: Color = (0, 158, 115)  # of the loop
OPACITY = 0.35
SHEER = 0.55  # opacity of a section in the scene
_EVERY = 5  # waypoint of the loop is drawn
SEARCHES = 8  # for loops, once one is found


def note(text: str) -> str:
    """A sentence."""
    return render("panel/note", text=text)


def map_html(found: PostureMap, units: Units) -> str:
    """The map as a plot; ``static/lesson.js`` sends where it is clicked."""
    label = f"Postures of {found.robot.name}: their number at each place, in words below"
    return render("workspace/posture_map", chart=page_chart(found, units, label))


def mark_html(found: PostureMap, place: tuple[float, float]) -> str:
    """The place that was chosen, a layer over the map."""
    picture = chart((), cross(page_plot(found).at(place)), (), "the place chosen", PAGE_SIZE)
    return render("numeric/mark", chart=picture)


def at_shares(found: PostureMap, x: float, y: float) -> tuple[float, float]:
    """The coordinates at shares of the width and the height of the map, from the left and from below."""
    (left, right), (low, high) = found.plane.window
    return left + x * (right - left), low + y * (high - low)


def postures_at(
    found: PostureMap, request: PostureRequest, place: tuple[float, float], q: Array
) -> tuple[Posture, ...]:
    """All postures at a place of a map; of whole turns those nearest to the configuration q ``(n,)``."""
    (T,) = found.plane.poses(found.robot, np.array([place]))
    options = IKOptions(task=found.task, constraints=request.constraints, respect_limits=request.respect_limits)
    result = solve(found.robot, T[:3, 3] if found.task == "position" else T, options, q)
    if result.status != "solved":
        return ()
    named = kin.branch_names(found.robot)
    each = enumerate(result.solutions, 1)
    return tuple(_posture(found.robot, one.branch if named else str(i), one.q) for i, one in each)


def _posture(robot: Robot, name: str, q: Array) -> Posture:
    margin, joint = limit_margin(robot, q)
    measure = float(kin.manipulability(robot, q))
    share = min(1.0, measure / best_manipulability(robot))
    if robot.in_limits(q, TOLERANCES.limit):
        return Posture(name, "reachable", "reachable", q, margin, joint, measure, share)
    return Posture(name, "blocked", "", q)


def section_nodes(found: PostureMap, dark: bool) -> list[Node]:
    """A section where it lies in the scene, with its borders."""
    plane, (a, b) = found.plane, found.counts.shape
    assert plane.origin is not None
    assert plane.u is not None
    assert plane.v is not None
    (left, right), (low, high) = plane.window
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([plane.u, -plane.v, np.cross(plane.v, plane.u)])  # pictures are drawn downwards
    pose[:3, 3] = plane.origin + 0.5 * (left + right) * plane.u + 0.5 * (low + high) * plane.v
    size = {"render_width": (right - left) * a / (a - 1), "render_height": (high - low) * b / (b - 1)}
    image = {"image": pixels(found, SHEER), **size, "cast_shadow": False, "receive_shadow": False}
    nodes = [Node("image", "nodes", image, pose[:3, 3], wxyz_from_rotation(pose[:3, :3]))]
    for kind, color in (("singular", MARK_COLOUR), ("limit", (225, 225, 225) if dark else (24, 33, 43))):
        curves = [each.points for each in found.curves if each.kind == kind]
        if curves:
            pairs = np.concatenate([np.stack([xy[:-1], xy[1:]], axis=1) for xy in curves])
            nodes.append(lines(kind, plane.origin + pairs @ np.array([plane.u, plane.v]), color, 2.0))
    return nodes


def judge(robot: Robot, constraints: JointConstraints, cancel: Callable[[], None]) -> Cuspidality:
    """Whether the arm is cuspidal; of several loops the highest, as others may pass through the floor."""
    found = kin.cuspidal(robot, constraints=constraints, cancel=cancel)
    if found.loop is None:
        return found
    seeds = range(1, SEARCHES)
    others = [kin.cuspidal(robot, constraints=constraints, seed=seed, cancel=cancel) for seed in seeds]
    return max((found, *others), key=lambda each: (each.in_limits, _lowest(each)))


def _lowest(found: Cuspidality) -> float:
    """The least height of a joint on a loop; −∞ without one."""
    if found.loop is None:
        return -math.inf
    return float(kin.link_frames(found.robot, Drive.straight(found.loop).q[::_EVERY])[..., 2, 3].min())


def verdict_words(found: Cuspidality) -> str:
    """The verdict, how it is known, and whether the page can show it."""
    if found.loop is not None and not found.in_limits:
        return f"{typeset(found.reason)} The page does not drive it."
    return typeset(found.reason)


def loop_nodes(found: Cuspidality) -> list[Node]:
    """The loop of the tool as a line, and the arm as it stands at its start, pale."""
    assert found.loop is not None
    points = kin.fk(found.robot, Drive.straight(found.loop).q[::_EVERY])[:, :3, 3]
    return [
        lines("loop", np.stack([points[:-1], points[1:]], axis=1), COLOR, 3.0),
        ghost("start", found.robot, found.loop[0], COLOR, OPACITY),
    ]


def under_way(found: Cuspidality) -> Notice:
    """While the arm is driven round the loop."""
    sigma = f"The smallest singular value stays above {general(found.least, 2)}."
    return Notice("reached", "Round the loop, without a singularity", sigma)


def came_back(found: Cuspidality, units: Units) -> Notice:
    """At the end of the loop: how far the joints are from where they were."""
    assert found.loop is not None
    robot, off = found.robot, found.loop[-1] - found.loop[0]
    off = np.abs(np.where(robot.revolute, wrapped(off), off))
    i = int(off.argmax())
    far = units.motion(bool(robot.revolute[i]), float(off[i]))
    detail = f"Joint {i + 1} is {far} from where it was, and no singularity was met. The pale arm is the start."
    return Notice("reached", "The tool is back in another posture", detail)
