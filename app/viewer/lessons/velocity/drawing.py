"""The lesson's drawings at the tool: ellipsoid, arrows of a column and of a force, lost directions."""

from __future__ import annotations

import math
from collections.abc import Collection
from functools import lru_cache

import numpy as np

from app.viewer.declared.scene import Color, Lazy, Node, arrows, ends, frame, handle, label, lines, mesh
from app.viewer.lessons.velocity.ellipsoids import Ellipsoid
from app.viewer.lessons.velocity.facts import VelocityFacts, scale_of
from app.viewer.lessons.velocity.views import COLORS, COLUMN, LOST, SAMPLE, SLOW, label_texts
from app.viewer.scene.arm.arm_scene import GIZMO
from app.viewer.scene.meshes import body
from app.viewer.scene.shapes import Solid, cone, merged, placed, tube
from kin import Robot
from kin.transforms import Array, frame_from_approach, wxyz_from_rotation

AXIS_LINE = (90, 90, 90)
# All lengths are relative to the radius of the sphere around the arm.
FLAT, LONGEST = 0.004, 0.62
# What is lost is drawn outside of the gizmo, whose arrows are `GIZMO` long: from `CLEAR` on.
CLEAR = 1.12 * GIZMO
RING, LOST_RING, LOST_ARROW = 0.13, 0.075, CLEAR + 0.2
MOST_LOST = 3
FORCE = 0.35  # of the arrow of 10 N
HANDLE = 0.11  # of the arrows that are dragged
CROSS = np.stack([-np.eye(3), np.eye(3)], axis=1).astype(np.float32)
CHOICES = np.array([(1.0, b, c) for b in (1.0, -1.0) for c in (1.0, -1.0)])


def scene(now: VelocityFacts, read: VelocityFacts, eye: Array, withheld: Collection[str] = ()) -> list[Node]:
    """All drawings but those `withheld`, whose numbers and lost directions are those of the panel.

    They are drawn as seen from `eye` ``(3,)``.
    """
    r, kind, chosen = body(now.robot).radius, now.settings.ellipsoid, now.settings.joint
    parts: list[Node | Lazy] = [] if "singularities" in withheld else [Lazy("lost", _lost, (read,))]
    if kind is not None and "ellipsoid" not in withheld:
        parts.append(_ellipsoid(now, read, kind, eye, r))
    if chosen is not None and "jacobian" not in withheld:
        parts += _column(now, chosen, r)
    if now.settings.statics.on and "torques" not in withheld:
        end = force_scale(now.robot) * np.array(now.settings.statics.force)
        parts.append(
            arrows("force", np.array([[np.zeros(3), end]]), COLORS["force"], (0.013 * r, 0.034 * r, 0.08 * r))
        )
        parts.append(handle("tip", end, HANDLE * r, ("on_tip",)))
    return [frame("tool", *parts, position=now.T[:3, 3])]


def force_scale(robot: Robot) -> float:
    """Metres in the scene for a newton."""
    return FORCE * body(robot).radius / 10.0


def truncated(facts: VelocityFacts) -> bool:
    """Whether the ellipsoid is too long to be drawn."""
    return bool((_lengths(facts) > LONGEST * body(facts.robot).radius).any())


def _lengths(facts: VelocityFacts) -> Array:
    return facts.semi * (SAMPLE / scale_of(facts.robot, facts.settings.ellipsoid or "velocity"))


def _ellipsoid(now: VelocityFacts, read: VelocityFacts, kind: Ellipsoid, eye: Array, r: float) -> Node:
    """A unit sphere with a rotation and three scales: flat ones are thin discs."""
    a, b, c = np.clip(_lengths(now), FLAT * r, LONGEST * r).tolist()
    return frame(
        "body",
        mesh("ellipsoid", _sphere(), COLORS[kind], (a, b, c), opacity=0.32, receive_shadow=False),
        lines("axes", CROSS, AXIS_LINE, 2.0, (a, b, c)),
        Lazy("values", _values, (read, eye)),
        wxyz=wxyz_from_rotation(now.axes.R),
    )


def _values(facts: VelocityFacts, eye: Array) -> list[Node]:
    """The values at the ends of the axes, outside of the gizmo."""
    r = body(facts.robot).radius
    tips = np.maximum(np.clip(_lengths(facts), FLAT * r, LONGEST * r) + 0.05 * r, CLEAR * r)
    ends = np.diag(tips * sides(facts.axes.R * tips, eye - facts.T[:3, 3]))
    texts = label_texts(facts.semi)
    return [label(f"value-{k + 1}", text, end, 0.8) for k, (text, end) in enumerate(zip(texts, ends, strict=True))]


def _column(now: VelocityFacts, joint: int, r: float) -> list[Node]:
    """A straight arrow for the motion of the tool, and a round one for its turning."""
    linear, angular = now.J[:3, joint] * (SAMPLE / scale_of(now.robot, "velocity")), now.J[3:, joint]
    parts = []
    if np.linalg.norm(linear) > 0.02 * r:
        parts.append(_arrows("column", [[np.zeros(3), linear]], COLUMN, r))
    if np.linalg.norm(angular) > 1e-6:
        parts.append(mesh("turn", ring_arrow(False), COLUMN, RING * r, wxyz=wxyz_along(angular)))
    return parts


def _lost(facts: VelocityFacts) -> list[Node]:
    """Double arrows along and about the directions that are lost: red; amber if they are only slow."""
    straight: list[list[Array]] = []
    parts, r = [], body(facts.robot).radius
    color, twists = LOST if facts.state == "at" else SLOW, facts.twists[:MOST_LOST]
    turning = [(k, twist) for k, twist in enumerate(twists, 1) if np.linalg.norm(twist[3:]) > 1e-3]
    for twist in twists:
        if (size := float(np.linalg.norm(twist[:3]))) > 1e-3:
            end = twist[:3] / size * LOST_ARROW * r
            start = end * (CLEAR / LOST_ARROW)
            straight += [[start, end], [-start, -end]]
    if straight:
        parts.append(_arrows("lost", straight, color, r))
    if turning:
        places = np.array([[np.zeros(3), _ring_place(twist, r)] for _, twist in turning])
        parts.append(lines("lost-axes", places, color, 1.5))
    for k, twist in turning:
        turn, at = wxyz_along(twist[3:]), _ring_place(twist, r)
        parts.append(mesh(f"lost-turn-{k}", ring_arrow(True), color, LOST_RING * r, position=at, wxyz=turn))
    return parts


def lost_ends(facts: VelocityFacts) -> Array:
    """Where the arrows of lost directions end ``(n, 3)``."""
    found = ends(_lost(facts))
    return found + facts.T[:3, 3] if len(found) else found


def _arrows(key: str, points: list[list[Array]], color: Color, r: float) -> Node:
    return arrows(key, np.array(points), color, (0.011 * r, 0.028 * r, 0.07 * r))


def _ring_place(twist: Array, r: float) -> Array:
    """Where the arrow of a lost rotation is, on its axis ``(3,)``: at the side that is farther up.

    Beyond the arrow of the motion that is lost with it, if they are along the same line.
    """
    axis, size = twist[3:] / float(np.linalg.norm(twist[3:])), float(np.linalg.norm(twist[:3]))
    axis = axis if axis[2] >= 0.0 else -axis
    along = size > 1e-3 and abs(float(axis @ twist[:3])) > 0.8 * size
    return np.asarray(axis * ((LOST_ARROW if along else CLEAR) + 0.5 * LOST_RING) * r)


@lru_cache(maxsize=1)
def _sphere() -> Solid:
    from trimesh.creation import icosphere  # its import takes a quarter of a second

    sphere = icosphere(subdivisions=3)
    return Solid(np.asarray(sphere.vertices), np.asarray(sphere.faces))


def sides(tips: Array, towards: Array) -> Array:
    """The end of each axis to label, ±1 ``(3,)``: the choice that keeps the labels farthest apart on screen.

    Args:
        tips: the axes' ends as columns ``(3, 3)``, relative to their common centre.
        towards: vector ``(3,)`` from there to the eye.
    """
    ahead = towards / max(float(np.linalg.norm(towards)), 1e-9)
    flat = (tips - np.outer(ahead, ahead @ tips)).T
    ends = CHOICES[:, :, None] * flat
    apart = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2).min(axis=1)
    # The first of equals: the labels of a moving arm must not jump needlessly.
    best: Array = CHOICES[int(np.argmax(apart > apart.max() - 1e-3 * np.abs(tips).max()))]
    return best


def wxyz_along(direction: Array) -> tuple[float, float, float, float]:
    """The shortest rotation that takes z to a nonzero direction ``(3,)``."""
    x, y, z = (direction / np.linalg.norm(direction)).tolist()
    if z < -1.0 + 1e-12:
        return 0.0, 1.0, 0.0, 0.0
    size = math.sqrt(2.0 * (1.0 + z))
    return 0.5 * size, -y / size, x / size, 0.0


@lru_cache(maxsize=2)
def ring_arrow(double: bool) -> Solid:
    """A circular arrow about z, counter-clockwise, of radius 1; with a head at each end if `double`."""
    first, last = math.radians(35.0 if double else 0.0), math.radians(290.0)
    angles = np.linspace(first, last, 40)
    path = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    heads = [(last, 1.0)] + ([(first, -1.0)] if double else [])
    parts = [tube(path, 0.05)]
    for angle, way in heads:
        T = np.eye(4)
        T[:3, :3] = frame_from_approach((-way * math.sin(angle), way * math.cos(angle), 0.0))
        T[:3, 3] = math.cos(angle), math.sin(angle), 0.0
        parts.append(placed(cone(0.16, 0.0, 0.42), T))
    return merged(parts)
