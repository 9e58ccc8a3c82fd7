"""The tree of branches: where each one forks off, and what becomes of it."""

from __future__ import annotations

from dataclasses import dataclass

from app.viewer.lessons.inverse.exercise import Branch
from app.viewer.lessons.inverse.mistakes import split_name
from app.viewer.lessons.inverse.sheet import DerivedStep, StepKey


@dataclass(frozen=True, eq=False)
class Node:
    """A choice.

    Attributes:
        depth: how many choices are before it.
        word: what is chosen: shoulder front.
        key, angle, value: the step, the angle that it gives, and its value (rad), None if the step fails.
        failed: the step that has no solution on all branches from here.
        leaf: the branch that ends here.
    """

    depth: int
    word: str
    key: StepKey
    angle: str
    value: float | None
    failed: DerivedStep | None
    leaf: Branch | None
    followed: bool


def tree(branches: tuple[Branch, ...], signs: tuple[int, ...]) -> list[Node]:
    """All choices of a target, depth first; `signs`: of the branch that is followed."""
    forks = _forks(branches)
    return list(_nodes(branches, signs, forks, 0))


def _forks(branches: tuple[Branch, ...]) -> list[tuple[int, StepKey]]:
    """(index of the sign, step) of each choice, in the order of the derivation."""
    longest = max(branches, key=lambda branch: len(branch.derivation.steps)).derivation
    found = [(step.split, step.key) for step in longest.steps if step.split >= 0]
    planar = len(longest.signs) == 1
    srs = "S" in longest.values
    orders: list[tuple[int, StepKey]] = [(0, "theta1"), (1, "elbow"), (2, "wrist")]
    if planar:
        orders = [(0, "elbow")]
    elif srs:
        orders = [(1, "elbow"), (0, "shoulder"), (2, "wrist")]
    return found if len(found) == len(orders) else orders


def _nodes(
    branches: tuple[Branch, ...], signs: tuple[int, ...], forks: list[tuple[int, StepKey]], depth: int
) -> list[Node]:
    if depth == len(forks):
        return []
    split, key = forks[depth]
    out: list[Node] = []
    for sign in (1, -1):
        here = tuple(branch for branch in branches if branch.derivation.signs[split] == sign)
        one = here[0].derivation
        step, angle = one.step(key), split_name(key, one)
        failed = one.failed if len({branch.q is None for branch in here}) == 1 and here[0].q is None else None
        value = one.number(angle) if step is not None and step.failure is None and angle in one.values else None
        leaf = here[0] if len(here) == 1 else None
        ends = failed is not None and (step is None or step.failure is not None)
        followed = all(branch.derivation.signs[split] == signs[split] for branch in here) and any(
            branch.derivation.signs == signs for branch in here
        )
        out.append(
            Node(
                depth,
                part_of_any(here, split),
                key,
                angle,
                value,
                failed if ends or leaf else None,
                leaf,
                followed,
            )
        )
        if not ends:
            out += _nodes(here, signs, forks, depth + 1)
    return out


def part_of_any(branches: tuple[Branch, ...], split: int) -> str:
    """What the choice that these branches share is called."""
    return branches[0].name.split(" · ")[split]
