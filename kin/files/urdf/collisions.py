"""The collision bodies of a URDF as capsules of the robot that was read from it.

Each URDF link gets capsules of its own, in the frame of the DH row that moves it; links behind fixed joints, and
those beside the chain, move with the link that carries them. A collision body that is stated wrongly, or whose
mesh is missing, is left out. A tube is assumed for that link of the arm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from kin.axes import inverse
from kin.collision.bodies import touches_beside_home
from kin.errors import RobotFileError
from kin.files.home import homes
from kin.files.read import MAX_CAPSULES
from kin.files.urdf.poses import poses_of
from kin.files.urdf.tree import TERMS, Format, UrdfElement, UrdfJoint, UrdfTree
from kin.files.urdf.visuals import Box, Cylinder, MeshFile, Shape, Sphere, shape_of
from kin.fitting import MOST, Segment, capsule_around, capsules_around, radius_of, tubes
from kin.fitting import bodies as solids
from kin.fk import link_frames
from kin.later import Later
from kin.robot import Capsule, Robot
from kin.transforms import Array

MAX_BODIES = 300  # collision bodies of all links
MOST_CUT = 50  # capsules up to which bodies of several links are cut into pieces
MAX_SOURCE, LISTED = 1000, 4  # characters, and links that a sentence names
FARTHEST = 10.0  # times the reach of the arm: a body beyond is not in metres
NOT_READ = "its mesh was not sent along"
Triangles = Callable[[str], Array]  # of a mesh file ``(k, 3, 3)``; raises `LookupError` with the reason


class Pill(NamedTuple):
    """A capsule about z, its middle at the origin; `length` is that of its axis, in metres."""

    radius: float
    length: float


class Piece(NamedTuple):
    """A collision body, and its pose ``(4, 4)`` in the frame of the row that moves it."""

    shape: Shape | Pill
    pose: Array


@dataclass(frozen=True, eq=False)
class LinkPieces:
    """The collision bodies of one URDF link.

    Attributes:
        name: of the URDF link.
        link: 0 for the base, k for the link that joint k moves.
        wrong: what could not be read of it.
    """

    name: str
    link: int
    pieces: tuple[Piece, ...]
    wrong: tuple[str, ...] = ()

    @property
    def meshes(self) -> bool:
        """Whether some of its bodies are in mesh files."""
        return any(isinstance(piece.shape, MeshFile) for piece in self.pieces)


class Fitted(NamedTuple):
    """The capsules of one URDF link, and what of its bodies is missing.

    Attributes:
        capsules: fitted already, or when something asks for them.
        missing: a sentence each.
        rough: one capsule for each body, which is quickly found and larger; none where `capsules` are known.
    """

    capsules: Sequence[Segment]
    missing: Sequence[str]
    rough: Sequence[Segment] = ()


Fit = Callable[[Sequence[LinkPieces], float], Sequence[Fitted]]


@dataclass(frozen=True)
class UrdfBody:
    """What stands for a link of the arm in collisions.

    Attributes:
        link: 0 for the base, k for the link that joint k moves.
        names: the URDF links whose collision bodies it has.
        missing: what could not be used of it, and why.
        assumed: whether a tube is assumed, because something is missing or nothing is stated.
        fitted: the capsules of each of these links that has some.
    """

    link: int
    names: tuple[str, ...]
    missing: tuple[str, ...]
    assumed: bool
    fitted: tuple[Sequence[Segment], ...] = ()

    @property
    def capsules(self) -> int:
        """How many stand for what the file states."""
        return sum(map(len, self.fitted))


def collisions_of(robot: Robot, tree: UrdfTree, chain: tuple[UrdfJoint, ...]) -> list[LinkPieces]:
    """The collision bodies of all URDF links that belong to an arm, in the order of the file."""
    carriers, poses = poses_of(tree, chain)
    frames = link_frames(robot, np.zeros(robot.n))
    rows = [inverse(robot.T_world_base), *(inverse(frames[row]) for row in robot.moving_rows)]
    found, count = [], 0
    for element in tree.root.findall("link"):
        name = element.get("name", "").strip()
        if name not in poses:
            continue
        pieces, wrong = [], []
        T = rows[carriers[name]] @ poses[name]
        for collision in element.findall("collision"):
            count += 1
            if count > MAX_BODIES:
                wrong.append(f"more than {MAX_BODIES} collision bodies in the file")
                break
            try:
                shape, pose = _collision(UrdfElement(tree.file, collision, f"of link {name}"))
            except RobotFileError as error:
                wrong.append(f"{error.field}: {error.value}, expected {error.expected}")
            else:
                pieces.append(Piece(shape, T @ pose))
        if pieces or wrong:
            found.append(LinkPieces(name, carriers[name], tuple(pieces), tuple(wrong)))
    return found


def _collision(fields: UrdfElement) -> tuple[Shape | Pill, Array]:
    geometry = fields.element.find("geometry")
    if geometry is None:
        raise fields.refuse("geometry", "nothing", "a box, cylinder, sphere, capsule or mesh")
    inner = UrdfElement(fields.file, geometry, fields.name)
    pill = geometry.find("capsule")
    shape: Shape | Pill | None = shape_of(inner) if pill is None else _pill(inner)
    if shape is None:
        raise fields.refuse("geometry", "another shape", "a box, cylinder, sphere, capsule or mesh")
    return shape, np.array(fields.pose())


def _pill(fields: UrdfElement) -> Pill:
    """A `<capsule>`, which some programs write though URDF does not define it: `length` is that of its axis."""
    capsule = fields.element.find("capsule")
    assert capsule is not None
    radius, length = (fields.number("capsule", key, capsule.get(key, "")) for key in ("radius", "length"))
    if not (radius > 0.0 and length >= 0.0):
        raise fields.refuse("capsule", f"radius {radius:g}, length {length:g}", "lengths above zero, in metres")
    return Pill(radius, length)


def most_of(links: int) -> int:
    """Into how many capsules the body of each link may be cut."""
    return max(1, min(MOST, MOST_CUT // max(links, 1)))


def fitted(pieces: Sequence[Piece], most: int, reach: float, triangles_of: Triangles) -> Fitted:
    """Capsules around the bodies of one URDF link, which are fitted when something asks for them.

    Args:
        most: into how many capsules it may be cut.
        reach: of the arm, in metres: what is far beyond is left out.
    """
    triangles, balls, missing, rough = [], [], [], []
    for shape, pose in pieces:
        flat, round_ = np.empty((0, 3, 3)), np.empty((0, 2, 4))
        match shape:
            case Box(size):
                flat = solids.box(*size)
            case Cylinder(radius, length):
                flat = solids.cylinder(radius, length)
            case Sphere(radius):
                round_ = solids.balls(radius)
            case Pill(radius, length):
                round_ = solids.balls(radius, length)
            case MeshFile(path, scale):
                try:
                    flat = triangles_of(path) * np.array(scale)
                except LookupError as error:
                    missing.append(f"{path.rpartition('/')[2]}: {error.args[0]}")
                    continue
        flat, round_ = solids.moved(flat, pose), solids.moved(round_, pose)
        extent = float(np.abs(flat).max(initial=0.0)) + float(np.abs(round_).sum(axis=-1).max(initial=0.0))
        if extent > FARTHEST * max(reach, 0.01):
            name = shape.path.rpartition("/")[2] if isinstance(shape, MeshFile) else type(shape).__name__.lower()
            missing.append(
                f"{name}: it is {extent:.3g} m large, more than {FARTHEST:g} times the reach of the arm"
            )
            continue
        if len(flat) or len(round_):
            triangles.append(flat)
            balls.append(round_)
            rough.append(capsule_around(flat, round_))
    if not triangles:
        return Fitted((), missing)
    flat, round_ = np.concatenate(triangles), np.concatenate(balls)
    return Fitted(Later(lambda: capsules_around(flat, round_, most)), missing, rough)


def without_meshes(links: Sequence[LinkPieces], reach: float) -> list[Fitted]:
    """The capsules of all URDF links of an arm with this reach, where meshes are not at hand."""

    def missing(path: str) -> Array:
        raise LookupError(NOT_READ)

    return [fitted(link.pieces, most_of(len(links)), reach, missing) for link in links]


def with_bodies(
    robot: Robot, links: Sequence[LinkPieces], fits: Sequence[Fitted], file_format: Format = "URDF"
) -> tuple[Robot, tuple[UrdfBody, ...]]:
    """The robot with these capsules, and what stands for each of its links.

    A tube is added where something is missing; without any capsule of the file all bodies are left to be assumed.
    """
    pieces = tubes(robot)
    bodies = []
    for k in range(len(robot.moving_rows) + 1):
        own = [(link, fit) for link, fit in zip(links, fits, strict=True) if link.link == k]
        stated = tuple(fit.capsules for _, fit in own if fit.capsules)
        missing = tuple(f"{link.name}: {words}" for link, fit in own for words in (*link.wrong, *fit.missing))
        assumed = any(each.link == k for each in pieces) and (bool(missing) or not stated)
        bodies.append(UrdfBody(k, tuple(link.name for link, _ in own), missing, assumed, stated))
    if not any(body.fitted for body in bodies):
        return robot, tuple(bodies)
    # Only where the most that there can be is too many have they to be fitted at once, and counted.
    assumed_of = {body.link for body in bodies if body.assumed}
    most = len(links) * most_of(len(links)) + sum(each.link in assumed_of for each in pieces)
    if most > MAX_CAPSULES:
        count = len(_capsules(robot, bodies))
        if count > MAX_CAPSULES:
            words = f"{count} capsules would be needed, and a robot has at most {MAX_CAPSULES}"
            return robot, tuple(UrdfBody(k, (), (words,), True) for k in range(1, len(robot.moving_rows) + 1))
    source = said(bodies, file_format)[:MAX_SOURCE]
    capsules = Later(lambda: _capsules(robot, bodies))
    return replace(robot, capsules=capsules, capsules_source=source[0].upper() + source[1:]), tuple(bodies)


def _capsules(robot: Robot, bodies: Sequence[UrdfBody]) -> list[Capsule]:
    """Those that stand for the bodies of an arm, base first: of the file, then the tubes that are assumed."""
    found: list[Capsule] = []
    pieces = tubes(robot)
    radius = radius_of(pieces)
    for body, row in zip(bodies, (-1, *robot.moving_rows), strict=True):
        found += [Capsule(body.link, row, *each) for capsules in body.fitted for each in capsules]
        if body.assumed:
            found += [Capsule(*each, radius, True) for each in pieces if each.link == body.link]
    return found


def with_free_home(robot: Robot, bodies: Sequence[UrdfBody], fits: Sequence[Fitted]) -> Robot:
    """The robot with the best home configuration in which no stated bodies touch; its own if there is none.

    Bodies whose capsules are not fitted yet are judged by rough ones, so that nothing has to be fitted.
    """
    if not robot.capsules:
        return robot
    rough = {id(fit.capsules): fit.rough for fit in fits if fit.rough}
    quick = [
        replace(body, fitted=tuple(rough.get(id(capsules), capsules) for capsules in body.fitted))
        for body in bodies
    ]
    judged = replace(robot, capsules=tuple(_capsules(robot, quick)))
    if not touches_beside_home(judged, robot.q_home[None])[0]:
        return robot
    q = homes(robot)
    free = np.flatnonzero(~touches_beside_home(judged, q))
    return replace(robot, home=tuple(q[free[0]].tolist())) if len(free) else robot


def said(bodies: Sequence[UrdfBody], file_format: Format = "URDF") -> str:
    """Which bodies are from the file and which are assumed: the rest of a sentence that begins "Collisions: "."""
    if not any(body.fitted for body in bodies):
        none = f"the {file_format} states no {TERMS[file_format].bodies}"
        why = next((words for body in bodies for words in body.missing), none)
        return f"all bodies are assumed to be tubes along the lengths of the table ({why})."
    text = f"capsules around the {TERMS[file_format].bodies} of the {file_format}"
    doubtful = [body for body in bodies if body.missing or body.assumed]
    if not doubtful:
        return f"{text}, for every link."
    named = [_doubt(body) for body in doubtful[:LISTED]]
    more = f"; and {len(doubtful) - LISTED} more links" if len(doubtful) > LISTED else ""
    return f"{text}, except: {'; '.join(named)}{more}."


def _doubt(body: UrdfBody) -> str:
    link = f"link {body.link}" if body.link else "the base"
    what = "an assumed tube" if body.assumed else "a part without a body" if body.fitted else "no body"
    if body.assumed and body.fitted:
        what = "an assumed tube besides them"
    return f"{link} has {what} ({'; '.join(body.missing[:2]) or 'the file states no body'})"
