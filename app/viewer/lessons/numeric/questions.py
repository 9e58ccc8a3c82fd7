"""The facts that the texts of the lesson "Numeric IK" use (``lesson.toml``): numbers of an example."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from markupsafe import Markup

from app.exports.curves import Curve, Row, with_legend
from app.viewer.lessons.guide.content import LessonFacts
from app.viewer.lessons.guide.leads import bar
from app.viewer.lessons.guide.outline import Lead, Pose
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.numeric import iteration
from app.viewer.lessons.numeric.example import Example, example
from app.viewer.lessons.numeric.iteration import Method, Problem, Run, Settings
from app.viewer.lessons.numeric.settings import LIMITS
from app.viewer.lessons.numeric.views import NAMES, error_chart
from kin import Robot, fk, get_robot
from kin.transforms import Array
from kin.units import Units, power

NEVER = 1e6  # steps of a method that does not arrive
DAMPING, ERROR = 0.1, 0.2
# Settings of the lesson that show what the steps speak of, and what changes with the answers.
DRAWING: dict[str, object] = {"start": None, "at": None, "damping": DAMPING, "gain": 1.0, "longest": LIMITS[1]}
SHOWN: dict[str, dict[str, object]] = {
    "start": {"method": "newton", "limits": False},
    "transpose": {"method": "transpose", "limits": False},
    "damped": {"method": "damped", "limits": False},
    "within limits": {"method": "newton", "limits": True},
}
_COMPARED: tuple[Method, ...] = ("newton", "damped")


@lru_cache(maxsize=128)
def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares."""
    known = example(robot)
    problem, newton, lengths = known.problem, known.newton, units.lengths
    transpose, damped = (
        iteration.run(problem, Settings(*how), known.start) for how in (("transpose",), ("damped", DAMPING))
    )
    here, there = fk(robot, known.start)[:3, 3], problem.T[:3, 3]
    sigma = round(max(smallest_value(known), 1e-3), 3)
    numbers = {
        "far": np.linalg.norm(there - here),
        "sum": np.abs(there - here).sum(),
        "newton": newton.count,
        "sigma": sigma,
        "damping": DAMPING,
        "error": ERROR,
    }
    words = {
        "here": _place(here, units),
        "there": _place(there, units),
        "first_error": power(float(newton.errors[0])),
        "second_error": ", then ".join(power(float(v)) for v in newton.errors[1:3]),
        "newton_error": power(float(newton.errors[-1])),
        "sigma_shown": f"{sigma:.3f}",
        "remaining": f"{DAMPING**2 / (sigma**2 + DAMPING**2):.3f}",
        "coarse": lengths.brief(0.1),
        "fine": lengths.brief(1e-4),
    }
    drawing = {**DRAWING, "target": problem.T.ravel().tolist(), "match": problem.match}
    poses = {
        name: Pose(as_configuration(known.start), drawing={**drawing, **more}) for name, more in SHOWN.items()
    }
    poses["home"] = poses["start"]  # of steps without a pose of their own
    figures = {
        "newton": error_chart(problem, [("newton", newton)], units),
        "transpose": error_chart(problem, [("newton", newton), ("transpose", transpose)], units),
        "damped": error_chart(problem, [("newton", newton), ("damped", damped)], units),
        "three": error_chart(problem, [("newton", newton), ("damped", damped), ("transpose", transpose)], units),
        "singularity": _near_singularity(units),
    }
    values = {name: float(value) for name, value in numbers.items()}
    words |= {
        f"needs{place}": f"{each.count} steps" if each.outcome == "reached" else "does not arrive"
        for place, each in enumerate((newton, damped, transpose), 1)
    }
    steps = [_steps(each) for each in (newton, damped, transpose)]
    functions = {"needs": lambda place: steps[int(place) - 1]}
    return LessonFacts(values, functions, words, poses, figures, leads(robot, here, there))


def leads(robot: Robot, here: Array, there: Array) -> dict[str, Lead | None]:
    """From the tool towards its target, as far as an estimate says; the true one leads to the target."""
    way = there - here
    part = float(np.linalg.norm(way)) / robot.reach
    shares = {"near": 0.05, "middle": part, "distant": 0.7}
    return {name: bar(here, here + share / part * way) for name, share in shares.items()}


def _steps(run: Run) -> float:
    """How many steps it takes; more than any number of steps if it does not arrive."""
    return float(run.count) if run.outcome == "reached" else NEVER


def _place(point: Array, units: Units) -> str:
    return "(" + ", ".join(units.lengths.number(v) for v in point.tolist()) + f"){units.lengths.suffix}"


def smallest_value(known: Example) -> float:
    """The smallest singular value at the target of the example."""
    q = known.newton.q[-1]
    return float(np.linalg.svd(known.problem.jacobian(q), compute_uv=False)[-1])


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
def _near_singularity(units: Units) -> Markup:
    """The first steps of both methods near the straight arm."""
    bends = np.radians(np.geomspace(0.2, 40.0, 40))
    unit = units.angles
    curves = tuple(
        Curve(NAMES[method], bends * unit.scale, (steps * unit.scale,))
        for method, steps in zip(_COMPARED, first_steps(bends), strict=True)
    )
    rows = (Row(f"Length of the first step, {unit.name}", log=True),)
    label = "First step of Newton and of damped least squares near the straight arm"
    return with_legend(rows, curves, label, f"{unit.name} of θ₂")
