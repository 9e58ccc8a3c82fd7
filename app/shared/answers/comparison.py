"""Whether two arms are the same, and what was mistyped if not."""

from __future__ import annotations

from typing import Annotated, Any

from app.shared.answers.answer import Answer, From
from kin import Robot, robot_to_dict
from kin.comparison import Comparison, Explanation, messages
from kin.comparison.mistakes import Mistake
from kin.comparison.results import Quantity, Verdict


class MappingAnswer(Answer):
    """How b maps to a: ``T_a(q) = base · T_b(signs∘q + offsets) · tool``."""

    base: list[list[float]]
    """4×4 homogeneous transform, row by row, in metres."""
    tool: list[list[float]]
    """The same after the last joint."""
    signs: Annotated[list[int], From(lambda mapping: [1 if sign > 0.0 else -1 for sign in mapping.signs.tolist()])]
    """1, or −1 where a joint of b counts the other way."""
    offsets: list[float]
    """What a joint of b shows where that of a is at zero, in radians or metres."""


class DifferenceAnswer(Answer):
    """A quantity of the joint axes that differs."""

    joints: list[int]
    """Indices of the joints that it relates; empty for the number of joints."""
    quantity: Quantity
    """Number of joints, kind of a joint, angle or distance of two neighbouring axes, offset along an axis between
    its two common normals; `direction` where an axis lies otherwise to those before it."""
    in_a: float | str | None
    """Its value in the reference: radians, metres, a number or a kind."""
    in_b: float | str | None
    """Its value in the other arm."""
    text: str
    """The same in words."""


class ChangeAnswer(Answer):
    """One change of the other table."""

    mistake: Mistake
    """What it undoes."""
    rows: list[int]
    """Indices of the rows; empty if it concerns the whole table."""
    columns: list[str]
    """theta, d, a, alpha; empty if it concerns whole rows."""
    was: float | None
    """A single number before the change, in radians or metres; null if there is none."""
    now: float | None
    """The same after the change."""


class ExplanationAnswer(Answer):
    """One or two changes that make the other table the reference."""

    text: str
    """The mistakes in words, and what is left when they are undone."""
    changes: list[ChangeAnswer]
    """The changes, in the order in which they are made."""
    mapping: MappingAnswer
    """What is left then."""
    robot: dict[str, Any]
    """The changed table as the fields of a robot file, as other requests take it."""
    cost: float
    """How unlikely this is; the smallest comes first."""
    position: float
    """Largest distance between the poses then, as found, in metres."""
    rotation: float
    """Largest angle between them, in radians."""


class LimitDifferenceAnswer(Answer):
    """Limits of a joint that differ although the arms are the same."""

    joint: int
    """Index of the joint."""
    in_a: list[float] | None
    """Limits in the reference, null if there are none."""
    in_b: list[float] | None
    """Those of the other arm, as joint values of the reference."""


class ComparisonAnswer(Answer):
    """Whether two tables describe one arm."""

    verdict: Verdict
    """`identical`: equal joint values give equal poses. `same`: one arm, but base, tool, or a joint's sense or
    zero differ. `close`: one arm within `tolerance`. `different`."""
    text: str
    """The same in words."""
    mapping: MappingAnswer | None
    """The plainest mapping; of different arms the best one, where they are nearly the same, else null."""
    sign_choices: int
    """With how many vectors of signs there is a mapping."""
    free_offsets: list[list[int]]
    """Joints whose offset poses cannot tell from that of base, tool or the other joints of the group."""
    position: float | None
    """Largest distance between the poses under `mapping`, as found, in metres."""
    rotation: float | None
    """Largest angle between them, in radians."""
    worst_q: list[float] | None
    """Configuration of the reference where they differ most."""
    differences: list[DifferenceAnswer]
    """What differs in the axes, from the base on."""
    limits: list[LimitDifferenceAnswer]
    """Joints with other limits, of arms that are the same."""
    rounded: bool
    """Whether each number of the other table is that of the reference with fewer digits."""
    explanations: list[ExplanationAnswer]
    """Likely mistakes in the other table, the likeliest first."""
    complete: bool
    """False if the time ran out before all pairs of mistakes were tried."""


def comparison_answer(found: Comparison, a: Robot, b: Robot) -> ComparisonAnswer:
    """The comparison of arm b with the reference a."""
    return ComparisonAnswer.of(
        found,
        text=" ".join(filter(None, (messages.verdict(found, a, b), messages.nearly(found)))),
        differences=[
            DifferenceAnswer.of(each, text=messages.difference(each, a, b)) for each in found.differences
        ],
        explanations=[_explanation(each, a, b) for each in found.explanations],
    )


def _explanation(found: Explanation, a: Robot, b: Robot) -> ExplanationAnswer:
    text, robot = messages.explanation(found, a, b), robot_to_dict(found.robot)
    return ExplanationAnswer.of(found, text=text, robot=robot)
