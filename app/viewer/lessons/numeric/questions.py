"""What the lesson "Numeric IK" teaches and asks."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from app.viewer.lessons.guide.outline import (
    PLAIN,
    Choice,
    Mistake,
    Number,
    Option,
    Outline,
    Pose,
    Step,
    apart,
    count,
    one_right,
    two_percent,
)
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.numeric.example import Example, example
from app.viewer.lessons.numeric.views import NAMES, amount, error_chart
from app.viewer.lessons.trajectories.chart import Curve, Row, chart
from kin import Robot, fk, get_robot
from kin.differential import iteration
from kin.differential.iteration import Method, Problem, Settings
from kin.transforms import Array
from kin.units import Unit, Units, power

GOAL = (
    "You can write down one step of Newton, of the Jacobian transpose and of damped least squares, and say when "
    "each of them fails."
)
DAMPING, ERROR = 0.1, 0.2
SHARE = Unit("", 1.0, 2)
ITERATES, METHOD = frozenset({"iterates"}), frozenset({"method"})  # what questions withhold
_COMPARED: tuple[Method, ...] = ("newton", "damped")


@lru_cache(maxsize=128)
def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    known = example(robot)
    steps = (
        _missing(known, units),
        _linear(known),
        _newton(known, units),
        _transpose(known, units),
        _damping(known, units),
        _singular(units),
        _limits(),
        _basins(),
    )
    return Outline(GOAL, steps, _check(units), pose=Pose(as_configuration(known.start)))


def _missing(known: Example, units: Units) -> Step:
    problem, lengths = known.problem, units.lengths
    here, there = fk(problem.robot, known.start)[:3, 3], problem.T[:3, 3]
    far = float(np.linalg.norm(there - here))
    words = [", ".join(lengths.number(v) for v in point.tolist()) for point in (here, there)]
    turn = " For a pose, a rotation vector is added to e: axis times angle." if problem.match == "pose" else ""
    return Step(
        "The error",
        f"The tool is at ({words[0]}){lengths.suffix}, its target at ({words[1]}){lengths.suffix}. All methods "
        f"start from the error e, target minus present value.{turn}",
        apart(
            Number(
                "How far is the tool point from its target?",
                far,
                lengths,
                max(two_percent(far), 5e-4),
                "Subtract the coordinates, square, add, and take the root.",
                (Mistake(float(np.abs(there - here).sum()), "Add the squares, not the absolute values."),),
            )
        ),
        "An iteration makes e smaller step by step.",
        pose=Pose(as_configuration(known.start)),
        practice="“Target here” and a moved arm below make any error you like.",
        withheld=ITERATES,
    )


def _linear(known: Example) -> Step:
    rows, n = len(known.problem.rows), known.problem.robot.n
    what = "the pose" if known.problem.match == "pose" else "the point"
    options = (
        Option(
            "One",
            f"J is {rows} × {n}: square. Away from singularities, J⁻¹e is the only one."
            if rows == n
            else f"J is {rows} × {n}: not square, so it has no inverse.",
            rows == n,
        ),
        Option(
            "Infinitely many",
            f"J is {rows} × {n}: more joints than equations. J⁺e is the shortest step."
            if n > rows
            else f"J is {rows} × {n}: no joint is left over.",
            n > rows,
        ),
        Option(
            "In general none",
            f"J is {rows} × {n}: more equations than joints. J⁺e leaves the smallest error."
            if n < rows
            else f"J is {rows} × {n}: there are enough joints.",
            n < rows,
        ),
    )
    return Step(
        "Linearise",
        f"Near the present configuration, e changes as −J Δq. For {what}, this arm’s joints change {rows} "
        f"component{'s' * (rows > 1)} of e. Newton wants e to vanish: J Δq = e.",
        Choice("How many steps Δq solve J Δq = e for this arm, away from singularities?", options),
        "With J = U diag(σ) Vᵀ, the step is V diag(1/σ) Uᵀ e. All other methods replace 1/σ by another function.",
        withheld=METHOD,
    )


def _newton(known: Example, units: Units) -> Step:
    run = known.newton
    first = [power(float(v)) for v in run.errors[1:3]]
    return Step(
        "Newton near a solution",
        f"From the pose of step 1, the error is {power(float(run.errors[0]))} at the start, then "
        f"{', then '.join(first)}, with lengths as shares of the arm’s size.",
        one_right(
            "How does it go on?",
            (
                "The number of right digits doubles with each step.",
                "Quadratic convergence: what is neglected in J Δq = e is of the size of Δq².",
            ),
            (
                (
                    "Each step halves the error.",
                    "That would be linear convergence, with one digit in three steps.",
                ),
                (
                    "Each step adds one right digit.",
                    "That is linear convergence; damping has it, Newton is faster.",
                ),
            ),
            1,
        ),
        f"{run.count} iterations to {power(float(run.errors[-1]))}.",
        figure=error_chart(known.problem, [("newton", run)], units),
        pose=Pose(as_configuration(known.start)),
        withheld=ITERATES,
    )


def _transpose(known: Example, units: Units) -> Step:
    run = iteration.run(known.problem, Settings("transpose"), known.start)
    if run.outcome == "reached":
        words = f"The transpose needs {run.count} iterations"
    else:
        left = amount(units.lengths, float(run.far[-1]))
        words = f"After {run.count} iterations, the transpose still misses by {left}"
    newton = known.newton
    return Step(
        "The slope: Jacobian transpose",
        "The transpose needs no inverse: Δq = α Jᵀe. The slope of ½|e|² over the joints is −Jᵀe.",
        one_right(
            "Where does Jᵀe point?",
            ("Where the error falls fastest.", "Against the slope: with a small enough gain, each step helps."),
            (
                (
                    "Straight to the solution.",
                    "Only if all singular values are equal: Jᵀ counts with σ where J⁻¹ counts with 1/σ.",
                ),
                (
                    "Along the joints that are far from their limits.",
                    "Limits do not occur in Jᵀe: it knows only the error and J.",
                ),
            ),
            0,
        ),
        f"{words}; Newton needs {newton.count}. Directions with a small σ die out slowly.",
        figure=error_chart(known.problem, [("newton", newton), ("transpose", run)], units),
        pose=Pose(as_configuration(known.start)),
        withheld=METHOD,
    )


def smallest_value(known: Example) -> float:
    """The smallest singular value at the target of the example."""
    q = known.newton.q[-1]
    return float(np.linalg.svd(known.problem.jacobian(q), compute_uv=False)[-1])


def _damping(known: Example, units: Units) -> Step:
    sigma = round(max(smallest_value(known), 1e-3), 3)
    square = sigma * sigma + DAMPING**2
    answer = sigma * sigma / square
    run = iteration.run(known.problem, Settings("damped", DAMPING), known.start)
    return Step(
        "Damping",
        f"Damped least squares steps by f(σ) = σ/(σ² + λ²) along each direction; J then reduces the error by "
        f"σ f(σ). At the target, the smallest σ of this arm is {sigma:.3f}. Let λ = {DAMPING:g}.",
        apart(
            Number(
                "Which share of the error in that direction does one step remove?",
                answer,
                SHARE,
                max(two_percent(answer), 1e-3),
                "σ f(σ) = σ²/(σ² + λ²).",
                (
                    Mistake(sigma / square, "That is f(σ), the step for an error of 1. Multiply by σ."),
                    Mistake(1.0 - answer, "That is the share that remains."),
                ),
            ),
            1e-3,
        ),
        f"A share of {1.0 - answer:.3f} remains after each step: linear convergence. λ = 0 would be Newton, a "
        "large λ the transpose with a small gain.",
        figure=error_chart(known.problem, [("newton", known.newton), ("damped", run)], units),
        pose=Pose(as_configuration(known.start)),
    )


def first_steps(bends: Array) -> tuple[Array, Array]:
    """Lengths of the first steps of Newton and of damped least squares ``(k,)``, for the built-in planar 2R arm.

    Its elbow is bent by `bends` ``(k,)``, and the target is `ERROR` arm sizes nearer to axis 1.
    """
    robot = get_robot("planar2r")
    q = np.column_stack([np.zeros_like(bends), bends])
    lengths = []
    for method in _COMPARED:
        found = []
        for each in q:
            T = fk(robot, each)
            T[:3, 3] *= 1.0 - ERROR * _planar_size(robot) / np.linalg.norm(T[:3, 3])
            problem = Problem(robot, T, "point")
            moved = iteration.advance(problem, Settings(method, DAMPING), each[None], problem.error(each[None]))
            found.append(float(moved.step[0]))
        lengths.append(np.array(found))
    return lengths[0], lengths[1]


def _planar_size(robot: Robot) -> float:
    return Problem(robot, fk(robot, robot.q_home), "point").size


@lru_cache(maxsize=8)
def _singular(units: Units) -> Step:
    bends = np.radians(np.geomspace(0.2, 40.0, 40))
    unit = units.angles
    curves = tuple(
        Curve(NAMES[method], bends * unit.scale, (steps * unit.scale,))
        for method, steps in zip(_COMPARED, first_steps(bends), strict=True)
    )
    bound = ERROR / (2.0 * DAMPING)
    return Step(
        "Near a singularity",
        f"A planar arm with two joints is almost straight, and its target is nearer to the base, by {ERROR:g} of "
        f"its size. J loses rank where the arm is straight: σ → 0. Damped least squares has λ = {DAMPING:g}.",
        Number(
            "How long can its step become at most, whatever σ is? (The error has a length of 0.2.)",
            bound,
            unit,
            0.02 * bound,
            "f(σ) = σ/(σ² + λ²) is largest at σ = λ: 1/(2λ). Multiply by the error.",
            (
                Mistake(ERROR / DAMPING, "At σ = λ, f is λ/(λ² + λ²): half of that."),
                Mistake(ERROR * DAMPING, "A small λ allows long steps: divide by it."),
            ),
        ),
        "Newton’s step grows as 1/σ, to many turns; damping bounds it. At σ = 0 Newton has no step at all.",
        figure=chart(
            (Row(f"Length of the first step, {unit.name}", log=True),),
            curves,
            "First step of Newton and of damped least squares near the straight arm",
            f"{unit.name} of θ₂",
        ),
        withheld=METHOD,
    )


def _limits() -> Step:
    return Step(
        "Joint limits",
        "Each joint is kept within its limits after each step.",
        one_right(
            "Joint 2 is at its limit, and all steps push it further. What happens?",
            (
                "The iteration stops, though the target may be reachable.",
                "From this start there is no way. From another one there may be: try several.",
            ),
            (
                (
                    "It finds the other elbow by itself.",
                    "Steps follow the local slope; the other elbow is behind a hill.",
                ),
                (
                    "It proves that the target is out of reach.",
                    "Only that this way is closed. A closed form can prove it, an iteration cannot.",
                ),
            ),
            2,
        ),
        "That is why numeric solvers start from several configurations. Without the limits, an iteration may end "
        "outside them, or whole turns away.",
        practice="“Joint limits” below does it.",
        withheld=ITERATES,
    )


def _basins() -> Step:
    return Step(
        "Basins of attraction",
        "A planar arm with two joints reaches a point in two ways. Each start leads to one of them, or to none.",
        one_right(
            "Does Newton always find the solution that is nearer to the start?",
            (
                "No: near singular starts, tiny changes lead to another solution.",
                "Long steps throw the arm anywhere. The border between the basins is a fractal.",
            ),
            (
                ("Yes, Newton goes to the nearest one.", "Only from starts near a solution."),
                ("No, it always finds the elbow with θ₂ > 0.", "Both solutions are equal to Newton."),
            ),
            1,
        ),
        practice="Open Basins below: compare Newton with damped least squares, and move λ and the step limit.",
        withheld=ITERATES | {"basins"},
    )


def _check(units: Units) -> tuple[Number | Choice, ...]:
    lengths = units.lengths
    return (
        count(
            f"Each step makes the error ten times smaller. How many steps from {lengths.brief(0.1)} to "
            f"{lengths.brief(1e-4)}?",
            3,
            "Linear convergence: the same factor each time. Count the powers of ten.",
            [(1000, "That is the ratio of the errors. Each step divides by ten.")],
        ),
        count(
            "Newton’s error is 10⁻³, and each error is the square of the last. After two more steps it is 10 to "
            "the power −k. What is k?",
            12,
            "Squaring doubles the exponent: 3, 6, 12.",
            [
                (9, "Squaring doubles the exponent each time; it does not add 3."),
                (6, "That is after one step."),
                (5, "That would be one digit per step: linear convergence."),
            ],
        ),
        one_right(
            "The error of an iteration does not go to zero. What do you know?",
            (
                "Nothing certain: another start or method may reach the target.",
                "It may be out of reach, or this start may lead to a singularity, a limit or a cycle.",
            ),
            (
                ("The target is out of reach.", "Only a closed form, or a search from many starts, can tell."),
                ("λ is too small.", "Perhaps. Too large a λ, a limit or a singularity look the same."),
            ),
            0,
        ),
        Number(
            "A direction has σ = λ. Which share of the error there does one damped step remove?",
            0.5,
            PLAIN,
            0.01,
            "σ²/(σ² + λ²) with σ = λ.",
            (Mistake(1.0, "That is Newton’s step, without damping."),),
        ),
    )
