"""A loop of the tool that leaves the arm in another posture, although no singularity is on the way.

An arm that can do so is cuspidal. The part is for arms with three joints that have, at home, another posture of
the tool point to which the joints can go straight without a singularity: `verified`, the bound of `kin.cuspidal`,
proves it between the samples too. The student drives the arm there. A drive is the corners of the motion so far;
the joints go straight from one to the next, and each of these motions is verified when it is made.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from app.exercises.contract import numbers
from app.exercises.questions import Asked, Question, Verdict
from app.exports.postures import page_chart, page_plot
from app.exports.svg import Plot
from app.shared.summaries import PostureRequest
from app.viewer.declared.scene import Node, lines
from app.viewer.lessons.figure_shapes import PURPLE
from app.viewer.views.templates import render
from kin import IKOptions, InputError, JointConstraints, Robot, fk
from kin.angles import apart
from kin.differential.task import usual_rank
from kin.ik import solve
from kin.postures import PostureMap
from kin.postures.loops import verified
from kin.transforms import Array
from kin.units import Units, general, typeset

POINTS = 4  # way points, home and the other posture among them
SAME = 1e-5  # rad: configurations are the same
NEAR = 0.03  # of the reach: the tool is back, as near as sliders bring it with a mouse
OTHER = 0.2  # rad: exact postures differ by more
AHEAD = math.cos(math.radians(10.0))  # a motion that turns by less has no corner
MOST = 200  # corners
SHORT = 0.005  # rad: a last corner nearer to the one before is replaced by the next
LOOKS = 2000  # samples of one motion at most: then it is not verified
FAR = 1e3  # rad: joints of an answer turn by less
SAMPLES = 16  # places of the tool between two corners
BEGIN = f"A drive begins at home and has at most {MOST} corners. Go back to the pose of this step."
ABOUT = (
    "Section through axis 1 with the number of postures at each place. On orange curves two postures merge. The "
    "black line is where the tool has been, turned into the section; the dot is where it is."
)
WAY_HINT = "Moves the arm to a way point: 1 is home, 4 another posture with the tool where it was"


@lru_cache(maxsize=64)
def _postures(robot: Robot) -> tuple[Array, ...]:
    """All postures that have the tool point exactly where it is at home, home among them."""
    home = robot.q_home
    found = solve(robot, fk(robot, home)[:3, 3], IKOptions(task="position"), home)
    return tuple(each.q for each in found.solutions)


@lru_cache(maxsize=64)
def loop_of(robot: Robot) -> Array | None:
    """Way points ``(4, 3)`` on the straight motion of the joints from home to another posture of the tool point.

    None if there is a singularity between home and each other posture. Axis 1 is the z axis of the base, about
    which places of the tool are turned into the section that is drawn.
    """
    turns = robot.n == 3 and robot.revolute.all() and not robot.coupled
    upright = robot.convention == "standard" and robot.joint_rows[0] == 0
    if not (turns and upright) or usual_rank(robot, "position") < 3:
        return None
    home = robot.q_home
    for other in _postures(robot):
        if apart(other, home) > OTHER and verified(robot, home, other, LOOKS) > 0.0:
            points: Array = np.linspace(home, other, POINTS)
            points.flags.writeable = False
            return points
    return None


@dataclass(frozen=True, eq=False)
class DrivenPath:
    """The motion on which the arm was driven since it was at home.

    Attributes:
        corners: ``(k, n)`` of the motion, the first one home, the last one where the arm is.
        least: no singular value was smaller on the way, with lengths as shares of the arm's size. 0.0: a
            singularity was met, or it is not verified that there was none. The drive is over then.
    """

    corners: Array
    least: float = math.inf


def driven(robot: Robot, drive: DrivenPath | None, q: Array) -> DrivenPath | None:
    """A drive that goes on to q ``(n,)``; None before the arm is at home, and with too many corners."""
    if apart(q, robot.q_home) <= SAME:
        return DrivenPath(robot.q_home[None])
    if drive is None or drive.least == 0.0 or apart(q, drive.corners[-1]) <= SAME:
        return drive
    *before, last = drive.corners
    least = verified(robot, last, q, LOOKS)
    passed = len(before) > 0 and (apart(before[-1], last) < SHORT or _is_ahead(before[-1], last, q))
    if passed and least > 0.0 and verified(robot, before[-1], q, LOOKS) > 0.0:
        corners = np.array([*before, q])
    else:
        corners = np.array([*before, last, q])
    return DrivenPath(corners, min(drive.least, least)) if len(corners) <= MOST else None


def _least(robot: Robot, corners: Array) -> float:
    """A lower bound of the singular values on a motion with corners ``(k, n)``; 0.0 as of `verified`."""
    least = math.inf
    for a, b in pairwise(corners):
        least = min(least, verified(robot, a, b, LOOKS))
        if least == 0.0:
            break
    return least


def _is_ahead(a: Array, b: Array, c: Array) -> bool:
    """Whether the way from a over b to c goes on in about the same direction."""
    first, second = b - a, c - b
    return float(first @ second) >= AHEAD * float(np.linalg.norm(first) * np.linalg.norm(second))


def tool_path(robot: Robot, corners: Array) -> Array:
    """Places of the tool point ``(m, 3)`` along a motion with corners ``(k, n)``."""
    s = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    legs = corners[:-1, None] * (1.0 - s) + corners[1:, None] * s
    return fk(robot, np.concatenate([corners[:1], legs.reshape(-1, robot.n)]))[:, :3, 3]


def _said(robot: Robot, corners: Array, least: float, units: Units) -> list[tuple[bool, str]]:
    """What a motion from home has to do, whether it does, and what is said.

    The tool is back only nearly, so the posture is that of the exact one to which the arm is nearest: near a
    singularity, joints move the tool little.
    """
    end, home = corners[-1], robot.q_home
    off = float(np.linalg.norm(fk(robot, end)[:3, 3] - fk(robot, home)[:3, 3]))
    nearest = min(_postures(robot), key=lambda q: float(apart(q, end)), default=home)
    back, other = off <= NEAR * robot.reach, bool(apart(nearest, home) > OTHER)
    bound = f": the smallest singular value stays above {general(least, 2)}" if math.isfinite(least) else ""
    unclear = "A singularity is on the way, or it is not verified that there is none."
    clear = f"No singularity is on the way{bound}." if least > 0.0 else unclear
    if not back:
        return [
            (least > 0.0, clear),
            (False, f"The tool is {units.distance(off)} from where it was."),
            (False, "The posture is compared when the tool is back."),
        ]
    posture = "The arm is in another posture than at home." if other else "The posture is that of home."
    return [(least > 0.0, clear), (True, "The tool is back."), (other, posture)]


@dataclass(frozen=True, eq=False)
class Round(Question):
    """The arm is driven round. An answer is the corners of the motion ``(k, n)``."""

    robot: Robot
    units: Units
    prompt: str = (
        "Drive the arm from home so that its tool comes back to where it was, with the arm in another posture and "
        "without a singularity on the way."
    )

    def asked(self) -> Asked:
        near = self.units.distance(NEAR * self.robot.reach)
        note = f"Required: the tool point within {near} of where it is at home, and no singularity since home."
        return Asked("posture", note=note)

    def read(self, given: object) -> object:
        self._corners(given)
        return given

    def is_answer(self, answer: object) -> bool:
        try:
            self._corners(answer)
        except InputError:
            return False
        return True

    def judge(self, answer: object) -> Verdict:
        corners = self._corners(answer)
        if apart(corners[0], self.robot.q_home) > SAME:
            return Verdict(False, BEGIN)
        least = _least(self.robot, corners)
        parts = _said(self.robot, corners, least, self.units)
        return Verdict.of(parts, " ".join(words for _, words in parts))

    def right(self) -> object:
        points = loop_of(self.robot)
        assert points is not None
        return points.tolist()

    def solution(self) -> str:
        angles, points = self.units.angles, loop_of(self.robot)
        assert points is not None
        places = [f"({', '.join(map(angles.number, each))}){angles.suffix}" for each in points.tolist()]
        return f"For instance over {places[1]} and {places[2]} to {places[3]}."

    def cells(self, answer: object) -> list[list[str]]:
        return []

    def _corners(self, given: object) -> Array:
        if not isinstance(given, list) or not 0 < len(given) <= MOST:
            raise InputError("answer", given, f"1 to {MOST} configurations")
        corners = np.array([numbers(each, self.robot.n, "one configuration in radians") for each in given])
        if np.abs(corners).max() > FAR:
            raise InputError("answer", given, f"joints that turn by {FAR:g} rad at most")
        return corners


# What is shown


def request(robot: Robot) -> PostureRequest:
    """The map of the section through axis 1 and the tool at home, which all visitors share."""
    return PostureRequest(robot, JointConstraints(), False, None, None, None, None)


def drive_html(robot: Robot, drive: DrivenPath | None, units: Units) -> str:
    """What the drive has done so far."""
    if drive is None:
        return render("panel/note", text=BEGIN)
    if drive.least == 0.0:
        met = "A singularity was met, or it is not verified that there was none."
        return render("panel/note", text=f"✗ {met} {BEGIN}")
    if len(drive.corners) < 2:
        return render("panel/note", text="The drive begins here: the arm is at home.")
    said = _said(robot, drive.corners, drive.least, units)
    return render("panel/note", text=" ".join(f"{'✓' if fine else '○'} {words}" for fine, words in said))


def map_html(found: PostureMap, drive: DrivenPath | None, units: Units) -> str:
    """The section with its singular curves and the way of the tool, and its regions in words."""
    way: list[str] = []
    if drive is not None:
        way = _line(page_plot(found), in_section(found, tool_path(found.robot, drive.corners)))
    label = f"Postures of {found.robot.name}: their number at each place, in words below, and the way of the tool"
    picture = page_chart(found, units, label, way)
    return render("velocity/line", chart=picture, words=f"{ABOUT} {typeset(found.explain(units))}")


def _line(plot: Plot, path: Array) -> list[str]:
    """A line that stands out from every colour, with a dot at its end."""
    d, (x, y) = plot.path(path), plot.at(path[-1]).tolist()
    look = 'fill="none" stroke-linejoin="round"'
    return [
        f'<path {look} stroke="#fff" stroke-width="4" d="{d}"/>',
        f'<path {look} stroke="#000" stroke-width="1.6" d="{d}"/>',
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="#000" stroke="#fff" stroke-width="1.5"/>',
    ]


def in_section(found: PostureMap, points: Array) -> Array:
    """Points ``(k, 3)``, turned about axis 1 into the section of a map, in its coordinates ``(k, 2)``."""
    plane, base = found.plane, found.robot.T_world_base
    assert plane.u is not None
    assert plane.v is not None
    axis, out = base[:3, 2], points - base[:3, 3]
    home = fk(found.robot, found.robot.q_home)[:3, 3] - base[:3, 3]
    aside = home - (home @ axis) * axis
    height = out @ axis
    far = np.linalg.norm(out - height[:, None] * axis, axis=1)
    turned = far[:, None] * aside / np.linalg.norm(aside) + height[:, None] * axis
    return np.asarray(turned @ np.column_stack([plane.u, plane.v]))


def path_nodes(robot: Robot, drive: DrivenPath) -> list[Node]:
    """The way of the tool in the scene."""
    points = tool_path(robot, drive.corners)
    return [lines("drive", np.stack([points[:-1], points[1:]], axis=1), PURPLE, 3.0)]
