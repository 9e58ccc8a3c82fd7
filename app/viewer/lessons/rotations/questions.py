"""The facts that the texts of the lesson "Rotations and frames" use (``lesson.toml``): numbers of a tool pose."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from app.exercises.variant import Quantity
from app.viewer.lessons.guide.content import LessonFacts
from app.viewer.lessons.guide.leads import direction, place, up_or_down
from app.viewer.lessons.guide.outline import Configuration, Cosine, Lead, Pose
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.rotations.conventions import PAGE, Convention, axis_angle
from app.viewer.lessons.rotations.drawing import LENGTH, anchor
from app.viewer.lessons.rotations.frames import Motion, as_json, places
from app.viewer.scene.camera import DIRECTION
from app.viewer.scene.chain import rotation
from app.viewer.scene.meshes import body
from kin import Robot, fk
from kin.axes import inverse
from kin.transforms import Array
from kin.units import Units, fixed

_SAMPLES, LEVEL = 64, 0.1  # configurations; the vertical part of a direction that is nearly level
SEEN = 0.5  # share of its length that an axis has in the default view at least
ZYZ = Convention("zyz", False)
TWO_TURNS = Motion(True, 2, math.pi / 2, True), Motion(True, 0, math.pi / 2, True)
# The 1st and the 3rd axis coincide.
LOCKED = {"chained": False, "convention": PAGE.key, "angles": [0.4, math.pi / 2, 0.0], "axes": "turns"}


@lru_cache(maxsize=64)
def example(robot: Robot) -> Array:
    """A configuration near home in which the tool is turned about all axes, if it can be, all well seen."""
    q = robot.q_home + 0.5 * (robot.random_q(np.random.default_rng(5), _SAMPLES) - robot.q_home)
    R = fk(robot, q)[:, :3, :3]
    ahead = np.abs(DIRECTION @ R / np.linalg.norm(DIRECTION)).max(axis=1)
    seen = ahead < math.sqrt(1.0 - SEEN**2)
    entries = np.abs(R).reshape(_SAMPLES, 9)
    least = np.where(entries < 1e-9, 1.0, entries).min(axis=1)  # those of planar arms that are always zero aside
    return np.asarray(q[int(np.argmax(seen + least))])


@lru_cache(maxsize=128)
def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares; rows and columns count from 1."""
    q = example(robot)
    T, start = fk(robot, q), as_configuration(q)
    R, p = T[:3, :3], T[:3, 3]
    i, j = max(((0, 1), (0, 2), (1, 2)), key=lambda at: abs(abs(R[at]) - abs(R[at[::-1]])))
    theta, back = axis_angle(R)[1], inverse(T)[:3, 3]
    k = int(np.argmax(np.abs(back)))
    row, column = _first_entry(R, k, {(i, j), (j, i), (2, 0), (2, 2)})
    between = math.acos(max(-1.0, min(1.0, float(R[row, column]))))
    numbers: dict[str, float | Quantity] = {
        "row": row + 1,
        "at": column + 1,
        "exchanged": R[column, row],
        "between": Quantity(between, "angle"),
        "i": i + 1,
        "j": j + 1,
        "rij": R[i, j],
        "rji": R[j, i],
        "r31": np.clip(R[2, 0], -1.0, 1.0),
        "r33": np.clip(R[2, 2], -1.0, 1.0),
        "theta": Quantity(theta, "angle"),
        "trace": np.clip(np.trace(R), -1.0, 3.0),
        "k": k + 1,
        "origin": back[k],
        "same_p": p[k],
        "by_row": R[k] @ p,
        "far": Quantity(slide_of(robot), "length"),
    }
    words = {
        "fixed_axis": "xyz"[row],
        "angle_between": units.angles.text(between, 1),
        "own_axis": "xyz"[column],
        "own_vector": _vector(R[:, column]),
        "name_ij": _entry(i, j),
        "name_ji": _entry(j, i),
        "shown_ij": fixed(float(R[i, j])),
        "shown_ji": fixed(float(R[j, i])),
        "shown_r31": fixed(float(R[2, 0])),
        "shown_r33": fixed(float(R[2, 2])),
        "shown_trace": fixed(float(np.trace(R))),
        "shown_cosine": fixed(math.cos(theta)),
        "quarter": units.angles.brief(math.pi / 2),
        "coordinate": "xyz"[k],
        "column": _vector(R[:, k]),
        "p": "(" + ", ".join(units.lengths.number(v) for v in p.tolist()) + f"){units.lengths.suffix}",
    }
    poses = _poses(robot, start, R)
    values = {name: x if isinstance(x, Quantity) else float(x) for name, x in numbers.items()}
    length = LENGTH * body(robot).radius
    shapes = {
        "entry": Cosine(anchor(robot), np.eye(3)[row], R[:, column], length),
        "entry of the inverse": Cosine(anchor(robot), np.eye(3)[j], R[:, i], length),
    }
    return LessonFacts(values, {}, words, poses, leads=leads(robot, T), shapes=shapes)


def _first_entry(R: Array, k: int, given: set[tuple[int, int]]) -> tuple[int, int]:
    """Row and column of the largest entry of R ``(3, 3)`` that no other step gives: those, or column `k`."""
    places = [(i, j) for i in range(3) for j in range(3) if j != k and (i, j) not in given]
    return max(places, key=lambda at: abs(float(R[at])))


def _poses(robot: Robot, start: Configuration, R: Array) -> dict[str, Pose]:
    """What the steps show beside the arm at a configuration ``(n,)``."""
    poses = {
        "tool": Pose(start, drawing=turned(R, PAGE, "none")),
        "tool, its turns": Pose(start, drawing=turned(R, PAGE, "turns")),
        "tool, its axis": Pose(start, drawing=turned(R, PAGE, "whole")),
        "z-y-z": Pose(start, drawing=turned(R, ZYZ, "turns")),
        "z-y-x": Pose(start, drawing=turned(R, PAGE.twin, "turns")),
        "locked": Pose(start, drawing=LOCKED),
        "no turns": Pose(start, drawing={"chained": True, "chain": []}),
        "two turns": Pose(start, drawing={"chained": True, "chain": as_json(TWO_TURNS)}),
        "placed": Pose(start, drawing={"chained": True, "chain": as_json(placed(robot))}),
        "camera": Pose(start, drawing={"chained": True, "chain": as_json(camera(robot))}),
    }
    poses["home"] = poses["tool"]  # of steps without a pose of their own
    return poses


def leads(robot: Robot, T: Array) -> dict[str, Lead | None]:
    """Where options lead, beside the arm: there the lesson draws its frames. `T` is the tool's pose ``(4, 4)``."""
    length, beside = LENGTH * body(robot).radius, np.eye(4)
    beside[:3, 3] = anchor(robot)
    alpha, beta, gamma = PAGE.twin.angles(T[:3, :3])
    there, on = (_product(part) for part in (camera(robot)[:2], camera(robot)[2:]))
    frames = {
        "fixed order": rotation(2, alpha) @ rotation(1, beta) @ rotation(0, gamma),
        "other order": rotation(0, gamma) @ rotation(1, beta) @ rotation(2, alpha),
        "other angles": rotation(2, gamma) @ rotation(1, beta) @ rotation(0, alpha),
        "camera then workpiece": there @ on,
        "workpiece then camera": on @ there,
        "back and workpiece": inverse(there) @ on,
    }
    ways = {"minus y": (0.0, -1.0, 0.0), "plus x": (1.0, 0.0, 0.0), "minus x": (-1.0, 0.0, 0.0)}
    return {
        **up_or_down(robot, anchor(robot), T[:3, 2], LEVEL),
        **{name: direction(robot, anchor(robot), np.array(way)) for name, way in ways.items()},
        **{name: place(beside @ F, length) for name, F in frames.items()},
    }


def _product(motions: tuple[Motion, ...]) -> Array:
    return np.asarray(places(motions)[-1])


def camera(robot: Robot) -> tuple[Motion, ...]:
    """The way to a camera that looks down, and from it to a workpiece."""
    far = round(0.3 * robot.reach, 2)
    return Motion(False, 2, far, True), Motion(True, 0, math.pi, True), Motion(False, 2, round(0.6 * far, 2), True)


def slide_of(robot: Robot) -> float:
    """By how much the frame of the last step slides (m), in steps of 50 mm."""
    return max(round(0.4 * robot.reach / 0.05), 2) * 0.05


def placed(robot: Robot) -> tuple[Motion, ...]:
    """The motions of the last step."""
    slide = Motion(False, 2, slide_of(robot), True)
    return slide, Motion(True, 0, math.pi / 2, True), slide


def turned(R: Array, convention: Convention, axes: str) -> dict[str, object]:
    """The drawing of a rotation ``(3, 3)`` beside the arm, with its angles in a convention and these axes."""
    return {"chained": False, "convention": convention.key, "angles": list(convention.angles(R)), "axes": axes}


def _vector(values: Array) -> str:
    return "(" + ", ".join(fixed(value) for value in values.tolist()) + ")"


def _entry(row: int, column: int) -> str:
    return f"r{'₁₂₃'[row]}{'₁₂₃'[column]}"
