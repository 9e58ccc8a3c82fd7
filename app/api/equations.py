"""The equations of an arm: the chapter's as printed and corrected, or a closed form derived from the DH table."""

from __future__ import annotations

import contextlib
import threading
from functools import partial
from typing import Literal

from fastapi import Request, Response
from pydantic import Field

from app.api import schemas
from app.api.arms.operation import operation
from app.api.batches import Batch, one_or_all
from app.api.body import versioned
from app.api.problems import invalid
from app.api.schemas import (
    POST_REFUSALS,
    Configurations,
    example,
    refusals,
    reply,
    settings_of,
)
from app.api.work import Deadline, TooSlowError, busy, computed
from app.equations import Book, DerivationError, Equation, Symbol, book_later, typeset
from app.equations.expression import Expression
from app.shared.answers.answer import Answer
from app.shared.computations import TooManyPendingError
from app.shared.problems import FieldError
from kin import Robot
from kin.transforms import Array

router = versioned("robots")

GOES_ON = "The derivation goes on: repeat the request later"
LOOK = 0.1  # s between two looks at the client and the time of a request that waits for a derivation
ENTRIES, VALUE = 13, 240  # equations of an arm, and bytes of one's values, about

EXAMPLES = {
    "one": example("One configuration", {"q": [1.5708, 0.5236, 1.0472, 0.5236, 0.5236]}),
    "worst": example("Where equation (6) is worst", {"q": [0.0, 1.2741, 0.2967, 0.0, 0.2618]}),
    "many": example("Several configurations", {"q": [[0.0, 0.0, 0.0, 0.0, 0.5], [1.2, 0.4, 0.9, 0.3, 0.6]]}),
}


class Formula(Answer):
    """An expression or equation, typeset as MathML and LaTeX."""

    mathml: str
    """A whole `<math>` element."""
    latex: str
    """The same in LaTeX, for math mode."""


class SymbolAnswer(Answer):
    """A symbol of the equations."""

    id: str
    """The name in plain letters, such as `c23` or `d6`."""
    mathml: str
    """The name as a whole `<math>` element."""
    latex: str
    """The same in LaTeX, for math mode."""
    meaning: str
    """Its meaning, such as `cos(θ2 + θ3)`."""
    value: float | None
    """Its value in `unit` if it does not depend on the configuration; else null."""
    unit: Literal["m", ""]
    """m for lengths and values of prismatic joints; empty for pure numbers."""


class LineAnswer(Answer):
    """A named intermediate result."""

    id: str
    """The name in plain letters."""
    formula: Formula
    """Its definition."""


class EquationAnswer(Answer):
    """One equation of an arm: an entry of the tool's pose [n o a p]."""

    id: str
    """Its key: the chapter's number, or the entry for a derived one."""
    name: str
    """Which entry of [n o a p], such as `p_x`; `T` for the whole matrix."""
    reference: int | None
    """Number in the source chapter; null for a derived equation."""
    verdict: Literal["right", "misprinted", "unreadable", "derived"]
    """Whether the printed equation is correct. "derived": not printed, checked by forward kinematics."""
    as_printed: Formula | None
    """As the chapter prints it; null for a derived equation and for one that cannot be read."""
    corrected: Formula | None
    """The correct form of a misprinted equation; else null."""
    derived: Formula | None
    """The closed form derived from the DH table; null for an equation of the chapter."""
    note: str
    """What is wrong with the printed form; empty if nothing is."""
    worst_q: list[float] | None
    """For a misprinted equation, the configuration inside the limits, in radians, at which the error of
    the tool point or of the axis is largest; else null."""
    uses: list[str]
    """Ids of the `symbols` and `lines` that it depends on; other equations are not listed."""


class EquationsAnswer(Answer):
    """The equations of one arm."""

    source: Literal["chapter", "derived"]
    """Whether they are the source chapter's, or were derived from the DH table."""
    equations: list[EquationAnswer]
    """In the chapter's order; derived ones position first."""
    symbols: list[SymbolAnswer]
    """The symbols."""
    lines: list[LineAnswer]
    """Intermediate results; each uses only earlier ones."""


class EquationValue(Answer):
    """Value of one equation at one configuration."""

    id: str
    """Which equation."""
    name: str
    """Which entry of [n o a p]."""
    printed: float | None
    """By the equation as printed, in `unit`; null for a derived one."""
    corrected: float
    """By the corrected or the derived equation, in `unit`."""
    dh: float
    """By the product of the DH matrices, in `unit`."""
    difference: float
    """Difference of the printed (or else derived) value from the DH product, in `unit`."""
    turn: float
    """For an axis (n, o, a) the angle in radians between it and the axis with this entry replaced; 0 for p."""
    unit: Literal["m", ""]
    """m for p; empty for n, o, a, which are pure numbers."""


class EquationValues(Answer):
    """Values of all equations at one configuration."""

    values: list[EquationValue]
    """One for every readable equation, in order."""


class EquationValuesList(Answer):
    """Answers to a list of configurations."""

    results: list[EquationValues]
    """One per configuration, in the same order."""


@operation(
    router,
    "equations",
    method="GET",
    sent="equations/formulas",
    summary="Equations of a robot",
    response_model=EquationsAnswer,
    responses=refusals(404, 422, 500, 503),
)
async def equations(request: Request, robot: Robot) -> Response:
    """The tool's pose [n o a p] entry by entry, as MathML and LaTeX.

    For the arms of the source chapter: each of its equations as printed, and corrected where it is misprinted. For
    any other arm: a closed form derived from its DH table, checked against forward kinematics before it is shown.
    The first request for such an arm may take some seconds. It has at most 16 rows.
    """
    return await computed(request, partial(_formulas, robot))


def _formulas(robot: Robot, deadline: Deadline) -> Response:
    found = _book(robot, deadline)
    return reply(
        EquationsAnswer(
            source=found.source,
            equations=[_equation(found, equation) for equation in found.equations],
            symbols=[_symbol(symbol) for symbol in found.symbols.values()],
            lines=[LineAnswer(line.name, _formula(line.name, line.expression)) for line in found.lines],
        )
    )


class EquationsRequest(schemas.Body):
    """Where to evaluate the equations."""

    q: Configurations = Field(
        description="Joint values from base to tool, in radians (metres for sliding joints): "
        "one configuration of n numbers, or a list of configurations."
    )


@operation(
    router,
    "equations",
    examples=EXAMPLES,
    summary="Values of a robot's equations",
    response_model=EquationValues | EquationValuesList,
    responses=POST_REFUSALS,
)
async def equation_values(request: Request, robot: Robot, body: EquationsRequest) -> Response:
    """Values of every equation as printed and corrected (or derived), and of the product of the DH matrices.

    One configuration gets one answer; a list gets `{"results": [...]}` in the same order.
    """
    q, single = schemas.as_configurations(robot, body.q, settings_of(request))
    return await computed(request, partial(_all_values, robot, q, Batch("q", len(q), single, VALUE * ENTRIES)))


def _all_values(robot: Robot, q: Array, batch: Batch, deadline: Deadline) -> Response:
    found = _book(robot, deadline)
    return one_or_all(lambda some: _values(found, q[some]), batch, deadline)


def _book(robot: Robot, deadline: Deadline) -> Book:
    """The equations of an arm, for which this thread waits."""
    with contextlib.ExitStack() as subscriptions:
        try:
            waiting = subscriptions.enter_context(book_later(robot, limited=True))
            while True:
                with contextlib.suppress(TimeoutError):
                    return waiting.future.result(LOOK)
                deadline.check(GOES_ON)
        except TooManyPendingError as error:
            raise busy(f"The equations of {error.pending} arms are being derived already.") from None
        except DerivationError as error:
            expected = f"another arm: {error}"
            raise invalid(FieldError(field="robot", value=robot.id, expected=expected)) from None
        except TooSlowError:
            # The client may come back for it.
            leaving = threading.Timer(deadline.seconds, subscriptions.pop_all().close)
            leaving.daemon = True
            leaving.start()
            raise


def _equation(found: Book, equation: Equation) -> EquationAnswer:
    correct = None if equation.correct is None else _formula(equation.entry, equation.correct)
    return EquationAnswer(
        id=equation.id,
        name=equation.entry,
        reference=equation.number,
        verdict=equation.verdict,
        as_printed=None if equation.printed is None else _formula(equation.entry, equation.printed),
        corrected=correct if equation.verdict == "misprinted" else None,
        derived=correct if equation.verdict == "derived" else None,
        note=equation.note,
        worst_q=list(equation.worst) or None,
        uses=[
            *(symbol.name for symbol in found.symbols_of(equation)),
            *(line.name for line in found.lines_of(equation)),
        ],
    )


def _formula(name: str, expression: Expression) -> Formula:
    return Formula(typeset.mathml(expression, name), typeset.latex(expression, name))


def _symbol(symbol: Symbol) -> SymbolAnswer:
    return SymbolAnswer(
        id=symbol.name,
        mathml=typeset.mathml_name(symbol.name),
        latex=typeset.latex_name(symbol.name),
        meaning=symbol.meaning,
        value=symbol.constant if symbol.fixed and symbol.kind in ("length", "number") else None,
        unit="m" if symbol.kind in ("length", "slide") else "",
    )


def _values(found: Book, q: Array) -> list[EquationValues]:
    out = [EquationValues([]) for _ in q]
    for equation, values in found.compare(q):
        printed = [None] * len(q) if values.printed is None else values.printed.tolist()
        numbers = (values.correct, values.dh, values.difference, values.turn)
        rows = zip(printed, *(column.tolist() for column in numbers), strict=True)
        unit: Literal["m", ""] = "m" if equation.is_length else ""
        for answer, (as_printed, correct, dh, difference, turn) in zip(out, rows, strict=True):
            answer.values.append(
                EquationValue(equation.id, equation.entry, as_printed, correct, dh, difference, turn, unit)
            )
    return out
