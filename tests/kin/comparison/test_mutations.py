"""How often the mistake that was made in a table is explained: every arm, every mistake, random frames.

A case counts as found if the first explanation makes the table the reference exactly, by forward kinematics, with
no more changes than were made, or if the arms are the same and the verdict says so. A mistake that changes no pose
is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from arms import CLASSICS

import kin
from kin.axes import size
from kin.comparison import Frames
from kin.comparison.mistakes import Edit, edits, fewer_rows
from kin.comparison.tables import Tables
from kin.robot import Robot
from kin.transforms import pose_from_position_wxyz

ARMS = CLASSICS
# What loses numbers that nothing but a guess could bring back.
LOSSY = {"twist", "offset", "shifted", "base", "tool"}


@dataclass(frozen=True)
class Case:
    """A table with mistakes, and what was done to it."""

    reference: Robot
    table: Robot
    made: tuple[Edit, ...]


def single(table: Tables, reference: Robot) -> list[Edit]:
    """All mistakes that can be made in a table and lose nothing."""
    several = [edit for edit in edits(table.rows, reference, False) if edit.mistake not in LOSSY]
    return [*several, *(edit for edit, _ in fewer_rows(table))]


def mutated(arm: Robot, count: int, rng: np.random.Generator) -> Case | None:
    """The arm with so many random mistakes; None if poses cannot see them, or no arm is left."""
    a = kin.dh.convert_dh(arm, str(rng.choice(["standard", "modified"])))
    table, made = Tables.of(a), []
    for _ in range(count):
        several = single(table, a)
        edit = several[int(rng.integers(len(several)))]
        table = edit.apply(table)
        made.append(edit)
    b = table.robot(0, a)
    if b.n == 0:
        return None
    probes = a.random_q(rng, 12)
    if b.n == a.n and np.abs(kin.fk(b, probes) - kin.fk(a, probes)).max() < 1e-6:
        return None
    return Case(a, b, tuple(made))


def in_random_frames(case: Case, rng: np.random.Generator) -> Case:
    """The reference with another base and tool."""
    before, after = (pose_from_position_wxyz(0.3 * rng.normal(size=3), rng.normal(size=4)) for _ in range(2))
    moved = case.reference.with_base(before @ case.reference.T_world_base)
    return replace(case, reference=moved.with_tool(moved.T_last_tool @ after))


def is_found(case: Case, frames: Frames, rng: np.random.Generator) -> bool:
    """Whether the mistakes of a case are explained; asserts that what is said is true."""
    a = case.reference
    found = kin.compare(a, case.table, frames=frames, seconds=20.0)
    probes = a.random_q(rng, 60)
    goal = kin.fk(a, probes)
    near = 5e-5 * max(1.0, size(a))
    if found.is_same:
        assert found.mapping is not None
        T = found.mapping.base @ kin.fk(case.table, found.to_b(probes)) @ found.mapping.tool
        assert np.abs(T - goal).max() < near, "a wrong “the same”"
        return True
    for each in found.explanations:
        T = each.mapping.base @ kin.fk(each.robot, each.mapping.to_b(probes)) @ each.mapping.tool
        assert np.abs(T - goal).max() < near, "an explanation that is none"
    return bool(found.explanations) and len(found.explanations[0].changes) <= len(case.made)


def share(arms: Sequence[Robot], count: int, frames: Frames, each: int, seed: int = 5) -> tuple[float, list[Case]]:
    """The share of cases that are found, and the cases that are not."""
    rng = np.random.default_rng(seed)
    cases, missed = 0, []
    for arm in arms:
        done = 0
        while done < each:
            case = mutated(arm, count, rng)
            if case is None:
                continue
            if frames == "free":
                case = in_random_frames(case, rng)
            done += 1
            if not is_found(case, frames, rng):
                missed.append(case)
        cases += done
    return 1.0 - len(missed) / cases, missed


@pytest.mark.slow
@pytest.mark.parametrize("frames", ["fixed", "free"])
def test_a_mistake_is_explained(frames: Frames):
    found, missed = share(ARMS, 1, frames, 20)
    assert found >= 0.995, [(case.reference.id, case.made) for case in missed]


@pytest.mark.slow
@pytest.mark.parametrize("frames", ["fixed", "free"])
def test_two_mistakes_are_explained(frames: Frames):
    found, missed = share(ARMS, 2, frames, 4)
    assert found >= 0.97, [(case.reference.id, case.made) for case in missed]
