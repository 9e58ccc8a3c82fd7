"""The facts that the texts of the lesson "Postures" use (``lesson.toml``): the tool's pose of an arm at home."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from app.exercises.lesson_text import LessonText
from app.exports.worksheet.sheet import indexed
from app.viewer.lessons.guide.content import LessonFacts, outline_of
from app.viewer.lessons.guide.outline import Configuration, Ghost, Lead, Outline, Pose
from app.viewer.lessons.guide.poses import as_configuration, distance
from app.viewer.lessons.postures import planar
from app.viewer.lessons.postures.loop import Round, loop_of
from app.viewer.scene.chain import rotation
from kin import IKOptions, Robot, Status, branch_names, branch_of, fk
from kin.ik import IKSolution, branch_meanings, solve
from kin.transforms import Array, wxyz_from_rotation
from kin.units import Units

ROLL = math.radians(30.0)
BEYOND = 1.2  # lengths of all links: a target that no arm has


class Solved(NamedTuple):
    """What inverse kinematics says about the pose that the arm has at home.

    Attributes:
        names: of all branches.
        here: the branch of home.
        found: the solutions within the limits.
        other: the solution that differs most from home; None if there is no other one.
        rolled: how many solutions within the limits there are if the tool is rolled by `ROLL`.
        goal: the posture of another solution, the one that differs in the fewest parts; "" if there is none.
        postures: a configuration of each branch that reaches the pose within the limits.
    """

    names: tuple[str, ...]
    here: str
    found: int
    other: Configuration | None
    rolled: int
    goal: str
    postures: dict[str, Configuration]


@lru_cache(maxsize=64)
def solved(robot: Robot) -> Solved:
    """Solve for the pose of home, and for the one that is rolled."""
    names = branch_names(robot)
    T, q = fk(robot, robot.q_home), robot.q_home
    solutions = _exact(robot, T)
    turns = robot.revolute
    away = [float(np.abs(np.angle(np.exp(1j * (s.q - q)[turns]))).sum()) for s in solutions]
    other = as_configuration(solutions[int(np.argmax(away))].q) if away and max(away) > 1e-3 else None
    rolled = _exact(robot, T @ rotation(2, ROLL))
    here = branch_of(robot, q) if names else ""
    postures = {branch_of(robot, s.q): as_configuration(s.q) for s in solutions if names}
    reached = postures.keys() - {here}
    goal = min(sorted(reached), key=lambda name: _parts_apart(name, here), default="")
    return Solved(names, here, len(solutions), other, len(rolled), goal, postures)


def _parts_apart(one: str, other: str) -> int:
    """In how many parts two names of postures differ."""
    return sum(a != b for a, b in zip(one.split(" · "), other.split(" · "), strict=True))


def _exact(robot: Robot, T: Array) -> tuple[IKSolution, ...]:
    """The solutions that meet the whole pose: compromises do not."""
    result = solve(robot, T, IKOptions(), robot.q_home)
    return result.solutions if result.status is Status.SOLVED else ()


def outline(robot: Robot, units: Units, text: LessonText | None = None) -> Outline:
    """The outline for this arm."""
    known = facts(robot, units)
    found, driven = outline_of("postures", robot, units, known, text), known.poses.get("round")
    steps = (
        replace(one, question=Round(robot, units)) if one.end is not None and one.end is driven else one
        for one in found.steps
    )
    return replace(found, steps=tuple(steps))


def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares."""
    known, loop = solved(robot), loop_of(robot)
    wrong = _others(known)
    numbers = {
        "named": len(known.names),
        "signs": max(0, len(known.names).bit_length() - 1),
        "found": known.found,
        "stretched": distance(fk(robot, robot.q_home), robot.T_world_base) / robot.reach,
        "beyond": BEYOND,
        "rolled": known.rolled,
    }
    words = {
        "here": known.here,
        "goal_posture": known.goal,
        "roll": units.angles.brief(ROLL),
        "meanings": _meanings(robot),
    }
    words["stretched_shown"] = f"{100.0 * numbers['stretched']:.0f} %"
    for place in (1, 2, 3):
        words[f"other{place}"], words[f"part{place}"] = wrong.get(place, ("", ""))
    by_hand, by_hand_words = planar.facts(robot, units)
    home = Pose(as_configuration(robot.q_home))
    poses = {"home": home, "another posture": home if known.other is None else Pose(known.other)}
    poses["beyond"] = Pose(home.q, beyond(robot))
    if loop is not None:
        poses["round"] = Pose(as_configuration(loop[-1]))
    if planar.is_planar(robot):
        poses |= planar.poses(robot)
    values = {name: float(value) for name, value in numbers.items()}
    leads: dict[str, Lead | None] = {"here": Ghost(home.q)}
    for place in (1, 2, 3):
        q = known.postures.get(wrong.get(place, ("", ""))[0])
        leads[f"other{place}"] = None if q is None else Ghost(q)
    return LessonFacts(values | by_hand, {}, words | by_hand_words, poses, leads=leads)


def beyond(robot: Robot) -> tuple[float, ...]:
    """The pose of home, moved away from the base beyond the reach: position (m) and quaternion w, x, y, z."""
    T, base = fk(robot, robot.q_home), robot.T_world_base[:3, 3]
    out = T[:3, 3] - base
    far = float(np.linalg.norm(out))
    way = out / far if far > 1e-9 else np.array([1.0, 0.0, 0.0])
    point = base + BEYOND * robot.reach * way
    return (*point.tolist(), *wxyz_from_rotation(T[:3, :3]).tolist())


def _meanings(robot: Robot) -> str:
    """What one word of each pair in the names of postures means."""
    said = [f"“{part}”: {meaning}." for part, meaning in list(branch_meanings(robot).items())[::2]]
    return indexed(" ".join(said))


def _others(known: Solved) -> dict[int, tuple[str, str]]:
    """Three postures that the arm does not have, by their places: their names, and the only part that differs."""
    here, found = known.here.split(" · "), list[tuple[str, str]]()
    for name in known.names:
        differing = [a for a, b in zip(name.split(" · "), here, strict=True) if a != b]
        if len(differing) == 1:
            found.append((name, differing[0]))
    return dict(enumerate(found[:3], 1))
