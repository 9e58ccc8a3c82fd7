"""Every number of every step is true of the pose that the scene has there.

The words of a step are searched for the sentences listed here. The numbers in them are compared with the arm at
the step's pose, computed by NumPy alone from its table. A number in a sentence that is not listed fails the test,
unless it is one of a formula. So does a question whose answer is not listed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy_arm
import pytest
from lesson_arms import ASKED, IDS, arms_of

from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.outline import Choice, Number, Outline, Step
from app.viewer.lessons.numeric.example import example
from app.viewer.lessons.rotations.conventions import Convention
from app.viewer.lessons.trajectories.motions import sketched, ways
from kin import Robot
from kin.differential.task import natural_task
from kin.motion import motion_limits
from kin.units import Units

EACH = pytest.mark.parametrize(("lesson", "robot"), ASKED, ids=IDS)
N = r"([−-]?\d+(?:\.\d+)?)"
POWER = r"([\d.]+(?:·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?)"
TRIPLE = rf"\({N}, {N}, {N}\)"
LOW = "₀₁₂₃₄₅₆₇₈₉"
# Lessons whose formulas are still made by code: only what is listed is compared.
OPEN = {"dh", "inverse"}


@dataclass
class Here:
    """The arm in the scene of a step: at its pose, and when the question has been answered."""

    robot: Robot
    step: Step
    q: np.ndarray
    drawing: dict[str, Any]
    start: np.ndarray  # the pose of the first step

    @property
    def T(self) -> np.ndarray:
        return numpy_arm.pose(self.robot, self.q)

    @property
    def end(self) -> np.ndarray:
        return self.q if self.step.end is None else np.array(self.step.end.q)

    @property
    def J(self) -> np.ndarray:
        return numpy_arm.jacobian(self.robot, self.q)

    @property
    def screws(self) -> np.ndarray:
        """ω and v of each joint ``(6, n)``, at the origin, with all joints at zero."""
        zero = np.zeros(self.robot.n)
        J, p = numpy_arm.jacobian(self.robot, zero), numpy_arm.pose(self.robot, zero)[:3, 3]
        return np.concatenate([J[3:], J[:3] - np.cross(J[3:].T, p).T])


def mm(values: Any) -> list[float]:
    return [1e3 * float(value) for value in np.atleast_1d(values)]


def deg(values: Any) -> list[float]:
    return [math.degrees(float(value)) for value in np.atleast_1d(values)]


def axis_angle(R: np.ndarray) -> float:
    w = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return math.atan2(float(np.linalg.norm(w)), float(np.trace(R)) - 1.0)


# Newton's method


@dataclass
class Iterates:
    """Newton from the step's pose to the target that the lesson draws."""

    here: Here

    @property
    def rows(self) -> int:
        return 6

    def run(self, count: int) -> tuple[list[float], np.ndarray]:
        """Errors before and after each step, and the last Jacobian, with lengths in sizes of the arm."""
        robot, q = self.here.robot, self.here.q.copy()
        T, size, errors = np.array(self.here.drawing["target"]).reshape(4, 4), self.size, []
        for _ in range(count + 1):
            at = numpy_arm.pose(robot, q)
            turn = _rotation_vector(T[:3, :3] @ at[:3, :3].T)
            e = np.concatenate([(T - at)[:3, 3] / size, turn])
            J = numpy_arm.jacobian(robot, q) * np.where(robot.revolute, 1.0, size)
            J[:3] /= size
            errors.append(float(np.linalg.norm(e)))
            q = q + np.linalg.pinv(J[: len(e)], 1e-6) @ e * np.where(robot.revolute, 1.0, size)
        return errors, J[: len(e)]

    @property
    def size(self) -> float:
        return example(self.here.robot).problem.size


def _rotation_vector(R: np.ndarray) -> np.ndarray:
    angle = axis_angle(R)
    w = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return angle * w / max(float(np.linalg.norm(w)), 1e-12)


def aim(h: Here) -> np.ndarray:
    return np.array(h.drawing["target"]).reshape(4, 4)[:3, 3]


def smallest(h: Here) -> float:
    return float(np.linalg.svd(Iterates(h).run(12)[1], compute_uv=False)[Iterates(h).rows - 1])


# Sentences: the numbers in them, as the arm has them. `m` has what the expression found; None is not compared.

Expected = Sequence[float | str | None]
Sentence = tuple[str, Callable[[Here, Sequence[str]], Expected]]


def line_gap(h: Here) -> float:
    """How far the tool leaves its line on the way that is drawn (m); it leads from the step's pose to its end."""
    found = ways(h.robot)
    assert found is not None
    q = found.ptp.sample(np.linspace(0.0, found.ptp.duration, 161)).q
    assert np.allclose(q[[0, -1]], [h.q, h.end], atol=1e-9)
    points = np.array([numpy_arm.pose(h.robot, each)[:3, 3] for each in q])
    way = points[-1] - points[0]
    return float(np.linalg.norm(np.cross(points - points[0], way / np.linalg.norm(way)), axis=1).max())


def elbow_end(h: Here, q: np.ndarray) -> np.ndarray:
    """The end of the second link of a planar arm."""
    return numpy_arm.frames(h.robot, q)[1][:2, 3]


def on_axis(h: Here, m: Sequence[str]) -> list[float | None]:
    """ω of a joint, and the point of its axis nearest to the given one."""
    S, p = h.screws[:, int(m[0]) - 1], np.array([_value(x) for x in m[4:7]]) / 1e3
    foot = np.cross(S[:3], S[3:])
    return [None, *S[:3], *mm(foot + (p @ S[:3]) * S[:3])]


def reach(h: Here) -> float:
    assert h.step.end is not None
    assert h.step.end.target is not None
    return float(np.linalg.norm(h.step.end.target[:3])) / h.robot.reach


def rows_of(h: Here, m: Sequence[str]) -> list[float]:
    row = int(m[0]) - 1
    return [row + 1, row + 1, 1e3 * h.robot.rows[row].d, row + 1, 1e3 * h.robot.rows[row].a]


SENTENCES: dict[str, tuple[Sentence, ...]] = {
    "rotations": (
        (
            rf"tool’s ([xyz]) axis is at an angle of {N}° to the fixed ([xyz])",
            lambda h, m: [m[0], *deg(math.acos(h.T["xyz".index(m[2]), "xyz".index(m[0])])), m[2]],
        ),
        (
            rf"Column {N}, the tool’s ([xyz]) axis, is {TRIPLE}",
            lambda h, m: [1 + "xyz".index(m[1]), m[1], *h.T[:3, "xyz".index(m[1])]],
        ),
        (rf"r([₁₂₃])([₁₂₃]) = {N}", lambda h, m: [m[0], m[1], h.T[LOW.index(m[0]) - 1, LOW.index(m[1]) - 1]]),
        (rf"the trace is {N}", lambda h, m: [np.trace(h.T[:3, :3])]),
        (rf"cos(?: θ =|ine is) {N}", lambda h, m: [(np.trace(h.T[:3, :3]) - 1) / 2]),
        (rf"slides by {N} mm along its own z axis", lambda h, m: mm(sliding(h))),
        (
            rf"x = {N} mm, y = {N} mm, z = {N} mm; its axes: x = {TRIPLE}, y = {TRIPLE}, z = {TRIPLE}",
            lambda h, m: [0, *mm([-sliding(h), sliding(h)]), 1, 0, 0, 0, 0, 1, 0, -1, 0],
        ),
        (
            rf"column {N} of R is {TRIPLE}, and p = {TRIPLE} mm",
            lambda h, m: [None, *h.T[:3, int(m[0]) - 1], *mm(h.T[:3, 3])],
        ),
    ),
    "numeric": (
        (rf"The tool is at {TRIPLE} mm, its target at {TRIPLE} mm", lambda h, m: mm([*h.T[:3, 3], *aim(h)])),
        (rf"J is {N} × {N}", lambda h, m: [Iterates(h).rows, h.robot.n]),
        (
            rf"the error is {POWER} at the start, then {POWER}, then {POWER}, with",
            lambda h, m: Iterates(h).run(2)[0],
        ),
        (rf"smallest σ of this arm is {N}", lambda h, m: [smallest(h)]),
        (rf"Let λ = {N}", lambda h, m: [h.drawing["damping"]]),
        (
            rf"It is {N} % of the arm’s reach",
            lambda h, m: [100 * float(np.linalg.norm(aim(h) - h.T[:3, 3])) / h.robot.reach],
        ),
        (rf"A share of {N} remains", lambda h, m: [0.01 / (round(smallest(h), 3) ** 2 + 0.01)]),
    ),
    "screws": (
        (rf"along z of the world: {N} of {N}", lambda h, m: [upright(h), h.robot.n]),
        (rf"axis {N} has ω = {TRIPLE} and passes through p = {TRIPLE} mm", on_axis),
    ),
    "equations": (
        (rf"At home the tool points along {TRIPLE}", lambda h, m: h.T[:3, 2].tolist()),
        (rf"the equations of p give {TRIPLE} mm", lambda h, m: mm(h.T[:3, 3])),
        (rf"a = {TRIPLE}", lambda h, m: h.T[:3, 2].tolist()),
        (rf"o(?: is the tool’s y axis, here|\s=) {TRIPLE}", lambda h, m: h.T[:3, 1].tolist()),
    ),
    "inverse": (
        (rf"The target: p = {TRIPLE} mm(?:, a = {TRIPLE})?", lambda h, m: [*mm(h.T[:3, 3]), *h.T[:3, 2]]),
        (
            rf"The target: p = \({N}, {N}\) mm(?:, and the tool points along φ = {N}°)?",
            lambda h, m: [*mm(h.T[:2, 3]), math.degrees(math.atan2(h.T[1, 0], h.T[0, 0]))],
        ),
    ),
    "dh": (
        (
            rf"Row {N} has d([₀-₉]) = {N} mm along z and a([₀-₉]) = {N} mm along x",
            lambda h, m: [None, None, rows_of(h, m)[2], None, rows_of(h, m)[4]],
        ),
        (rf"Joint {N} moves by {N}°", lambda h, m: [None, *deg((h.end - h.q)[int(m[0]) - 1])]),
        (rf"The table has {N} rows", lambda h, m: [len(h.robot.rows)]),
    ),
    "postures": (
        (rf"to {N} times the length of all links", lambda h, m: [reach(h)]),
        (rf"From base to tool it is {N} % of that length", lambda h, m: [100 * spread(h)]),
        (rf"l₁ = {N} mm and l₂ = {N} mm", lambda h, m: mm([row.a for row in h.robot.rows[:2]])),
        (
            rf"ring from {N} mm to {N} mm",
            lambda h, m: mm([abs(h.robot.rows[0].a - h.robot.rows[1].a), h.robot.rows[0].a + h.robot.rows[1].a]),
        ),
        (rf"come to \(x, y\) = \({N}, {N}\) mm", lambda h, m: mm(elbow_end(h, h.end))),
        (
            rf"stays at \(x, y\) = \({N}, {N}\) mm",
            lambda h, m: mm(elbow_end(h, h.q)),
        ),
    ),
    "redundancy": ((rf"The arm has {N} joints", lambda h, m: [h.robot.n]),),
    "velocity": (
        (rf"It is {N} at home", lambda h, m: [smallest_task_value(h)]),
        (rf"Which (?:torque|force) does joint {N} apply", lambda h, m: [1 + int(np.argmax(np.abs(effort(h))))]),
        (rf"A weight of {N} N|\(0, 0, {N}\)|{N} N times", lambda h, m: [10, -10, 10]),
        (rf"axis {N} parallel to axes {N}, {N} and {N}", lambda h, m: parallel_axes(h, [int(x) for x in m])),
        (rf"\(θ([₁-₇]) = {N}°\)", lambda h, m: [None, *deg(h.end["₁₂₃₄₅₆₇".index(m[0])])]),
        (
            rf"two semi-axes are {N} m/s and {N} m/s long, and the product of all three is {N} m³/s³",
            lambda h, m: [*semi_axes(h)[1:], semi_axes(h).prod()],
        ),
        (rf"has rank {N}\.", lambda h, m: [task_rank(h, h.q + 0.1)]),
    ),
    "trajectories": (
        (
            rf"goes {N}° in {N} s, from rest to rest, with at most {N} °/s and {N} °/s²",
            lambda h, m: [*deg(sketched(h.robot).way), sketched(h.robot).time, *deg(limits_of_first(h.robot))],
        ),
        (
            rf"goes {N}° from rest to rest with a trapezoidal profile: at most {N} °/s and {N} °/s²",
            lambda h, m: deg([1.5 * sketched(h.robot).way, *limits_of_first(h.robot)]),
        ),
        (rf"\) goes {N}° from rest", lambda h, m: deg((h.end - h.q)[0])),
        (rf"leaves the line by up to {N} mm", lambda h, m: mm(line_gap(h))),
        (
            rf"rate: {N} °/s, {N} °/s, {N} °/s at {N} mm, {N} mm, {N} mm",
            lambda h, m: [*deg([0.2 / (_value(x) / 1e3) for x in m[3:]]), *(None,) * 3],
        ),
    ),
}


def sliding(h: Here) -> float:
    """By how much the chain that is drawn at the end slides (m)."""
    assert h.step.end is not None
    return float(h.step.end.drawing["chain"][0][2])  # type: ignore[index]


def parallel_axes(h: Here, joints: list[int]) -> list[float]:
    """These joints if their axes are parallel at the end of the step; none of them is right otherwise."""
    z = numpy_arm.jacobian(h.robot, h.end)[3:, [joint - 1 for joint in joints]].T
    return [
        joint if np.linalg.norm(np.cross(z[0], other)) < 1e-9 else -1
        for joint, other in zip(joints, z, strict=True)
    ]


def semi_axes(h: Here) -> np.ndarray:
    """The semi-axes of the tool point's velocities that are not zero: roots of the eigenvalues of J Jᵀ."""
    values = np.linalg.eigvalsh(h.J[:3] @ h.J[:3].T)[::-1]
    return np.asarray(np.sqrt(values[values > 1e-12]))


def smallest_task_value(h: Here) -> float:
    """The smallest singular value of the motions of the arm's task that is not always zero."""
    values = np.linalg.svd(task_rows(h, h.q), compute_uv=False)
    return float(values[task_rank(h, h.q + 0.1) - 1])


def limits_of_first(robot: Robot) -> list[float]:
    """Velocity and acceleration of the first joint (rad/s, rad/s²)."""
    found = motion_limits(robot)
    return [float(found.velocity[0]), float(found.acceleration[0])]


def effort(h: Here) -> np.ndarray:
    """What each joint applies to hold a weight of 10 N; of equal ones, the first is meant."""
    return np.round(10.0 * h.J[2], 9)


def task_rank(h: Here, q: np.ndarray) -> int:
    """How many motions the arm's task has at a configuration."""
    return rank(task_rows(h, q))


def task_rows(h: Here, q: np.ndarray) -> np.ndarray:
    """The rows of the Jacobian that the arm's task has; those of others are zero."""
    J, a, task = numpy_arm.jacobian(h.robot, q), numpy_arm.pose(h.robot, q)[:3, 2], natural_task(h.robot)
    turning = {"pose": J[3:], "approach": J[3:] - np.outer(a, a @ J[3:]), "position": 0.0 * J[3:]}[task]
    return np.concatenate([J[:3], turning])


def rank(J: np.ndarray) -> int:
    return int(np.linalg.matrix_rank(J, 1e-6))


# The numbers that belong to formulas, names and what does not depend on the arm.
ALWAYS = (
    r"For instance over .*$",  # test_loop.py has this way
    r"(?:For instance j|J)oint 1 at .*$",  # test_varied_verbs.py has the answers of these steps
    r"For instance 0, .* 0 (?:°|mm)/s\.",
    r"In order: .*?\)\.",
    r"[Jj]oints? \d+(?: (?:and|to) \d+)?",
    r"[Rr]ow \d+",
    r"[Cc]olumn \d+",
    r"step \d+",
    r"[Ff]rame \d+",
    r"\d+ joints",
    r"J q̇ = 0",
    r"[Aa]x[ei]s \d(?: and \d)?",
)
FORMULAS: dict[str, tuple[str, ...]] = {
    "rotations": (
        r"90°",
        r"\d+ conventions make \d+",
        r"I \+ .*",
        r"\d (?:\+ )?cos θ",
        r"1 \+",
        r"− 1\)",
        r"Subtract 1",
        r"cos²",
        r"\b0 1 · 1 2 = 0 2",
        r"indices \d and \d",
        r"index \d",
        r"1st|3rd",
        r"from 0 to half|/ ?2\b|\b[01]\b",
    ),
    "numeric": (
        r"(?:transpose|Newton): (?:\d+ steps|does not arrive)",
        r"½|1/\(?2?λ?σ?\)?|\d+ iterations(?: to \S+)?|needs \d+|misses by [^;]*",
        r"λ = 0(?:\.1)?|σ = 0",
        r"0\.2",
        r"→ 0",
        r"θ₂ > 0",
        r"J⁻¹",
        r"from 0 to 1|a share of 1",
    ),
    "screws": (r"1 (?:rad|m)/s", r"length 1\b", r"v = 0|ω = 0|= 1\b|p = 0|= 0\b"),
    "equations": (r"p[xyz] = 0|is not 1|instead of 0|entries of that row are 0|is [−-]?[\d.]+ then",),
    "postures": (
        r"above 1",
        r"\d+ × a choice of two: 2 to the power \d+",
        r"\d+ self-motions?",
        r"rank \d",
        r"\b2 l₁ l₂",
        r"θ₃ is 0|θ₂ is 0",
        r"\d+ postures?",
        r"30°",
        r"axes \d, \d and \d|z\d × z\d",
    ),
    "redundancy": (r"by \d+° or more", r"times any factor|speed is [\d.]+", r"joints are \(.*\)"),
    "velocity": (r"1 (?:rad|m)/s", r"is [01] rad/s per", r"Press 1 ", r"4/3 π"),
    "trajectories": (
        r"\d s[²³]|1\.5 for|1\.875 for|½",
        r"after [\d.]+ s|takes [\d.]+ s(?: more)?|LIN [\d.]+ s",
        r"swings \S+ times|[\d.]+ times as far",
        r"200 mm/s|at 100 mm",
        r"\d+ (?:°|mm)/s, and acc",
        r"at 180°",
        r"Two links .*? negative x axis",
        r"after \d+ %",
    ),
}


def words(step: Step) -> list[str]:
    found = [step.text, step.shown, step.practice]
    if step.question is not None:
        found += [step.question.prompt, step.question.solution()]
    for each in (step.estimate, step.question):
        if isinstance(each, Choice):
            found += [each.prompt, *(text for option in each.options for text in (option.text, option.reason))]
    return found


def _value(text: str) -> float:
    if "·10" in text:
        mantissa, power = text.split("·10")
        digits = power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
        return float(mantissa) * 10.0 ** int(digits)
    return float(text.replace("−", "-"))


def _unit_of_last_digit(text: str) -> float:
    mantissa, _, power = text.partition("·10")
    step: float = 10.0 ** -len(mantissa.partition(".")[2])
    return step * (_value(f"1·10{power}") if power else 1.0)


def wrong_numbers(lesson: str, h: Here) -> list[str]:
    """Numbers in the words of a step that are not those of the arm, or that nobody has listed."""
    found = []
    for text in words(h.step):
        left = text
        if isinstance(h.step.question, Number) and text == h.step.question.solution():
            left = text.removeprefix(h.step.question.value_text)
        left = re.sub(r"\s+", " ", left)
        for pattern, true in SENTENCES[lesson]:
            for match in re.finditer(pattern, left):
                shown = match.groups()
                for given, expected in zip(shown, true(h, shown), strict=False):
                    if given is None or expected is None or isinstance(expected, str):
                        continue
                    if abs(_value(given) - expected) > 0.6 * _unit_of_last_digit(given) + 1e-6:
                        found.append(f"{h.step.title}: {match[0]} ({expected:.5g})")
            left = re.sub(pattern, " ", left)
        for pattern in (*FORMULAS.get(lesson, ()), *ALWAYS):
            left = re.sub(pattern, " ", left)
        if lesson not in OPEN:
            found += [
                f"{h.step.title}: {x} in “{text}”" for x in re.findall(r"(?<![\w.])[−-]?\d+(?:\.\d+)?", left)
            ]
    return found


# Answers, in radians and metres.


def entry(h: Here, at: tuple[int, int], back: bool = False) -> float:
    R = np.linalg.inv(h.T[:3, :3]) if back else h.T[:3, :3]
    return float(R[at[0] - 1, at[1] - 1])


def prompted(h: Here, pattern: str) -> tuple[str, ...]:
    assert h.step.question is not None
    match = re.search(pattern, h.step.question.prompt)
    assert match is not None, h.step.question.prompt
    return match.groups()


def inverse_entry(h: Here) -> float:
    row, column = prompted(h, r"row (\d) and column (\d)")
    return entry(h, (int(row), int(column)), back=True)


def at_rest(h: Here, rows: int) -> float:
    return h.robot.n - rank(h.J[:rows])


def body_v(h: Here) -> float:
    joint = int(prompted(h, r"v of joint (\d+)")[0])
    return float(np.linalg.norm(numpy_arm.jacobian(h.robot, np.zeros(h.robot.n))[:3, joint - 1]))


def component(h: Here) -> float:
    axis, letter, joint = prompted(h, r"the ([xyz]) component of ([ωv]) of joint (\d+)")
    return float(h.screws["xyz".index(axis) + (0 if letter == "ω" else 3), int(joint) - 1])


def far_axis(h: Here) -> float:
    assert h.step.question is not None
    return float(np.linalg.norm(h.screws[3:, int(prompted(h, r"axis of joint (\d+)")[0]) - 1]))


def apart(h: Here) -> float:
    i, j = map(int, prompted(h, r"frame (\d+) from the origin of frame (\d+)"))
    frames = [np.array(h.robot.base), *numpy_arm.frames(h.robot, h.q)]
    return float(np.linalg.norm(frames[i][:3, 3] - frames[j][:3, 3]))


def shortest(h: Here) -> float:
    """The least time by trying: ramps of the largest acceleration around a plateau, which cover the way."""
    (v, a), way = limits_of_first(h.robot), 1.5 * sketched(h.robot).way
    times = np.linspace(0.0, 4.0 * (way / v + v / a), 400001)
    ramp = np.minimum(0.5 * times, v / a)
    covered = a * ramp**2 + a * ramp * (times - 2.0 * ramp)
    return float(times[np.searchsorted(covered, way)])


ANSWERS: dict[tuple[str, str], Callable[[Here], float]] = {
    ("rotations", "Columns"): lambda h: entry(h, tuple(map(int, prompted(h, r"row (\d) and column (\d)")))),  # type: ignore[arg-type]
    ("rotations", "The inverse"): inverse_entry,
    ("rotations", "Roll pitch yaw"): lambda h: math.atan2(-h.T[2, 0], math.hypot(h.T[0, 0], h.T[1, 0])),
    ("rotations", "The same in Z-Y-Z"): lambda h: math.atan2(math.hypot(h.T[0, 2], h.T[1, 2]), h.T[2, 2]),
    ("rotations", "Axis and angle"): lambda h: axis_angle(h.T[:3, :3]),
    ("rotations", "Quaternion"): lambda h: math.cos(axis_angle(h.T[:3, :3]) / 2),
    ("rotations", "T⁻¹"): lambda h: float(
        np.linalg.inv(h.T)["xyz".index(prompted(h, r"the ([xyz]) coord")[0]), 3]
    ),
    ("numeric", "The error"): lambda h: float(np.linalg.norm(aim(h) - h.T[:3, 3])),
    ("numeric", "Damping"): lambda h: round(smallest(h), 3) ** 2 / (round(smallest(h), 3) ** 2 + 0.01),
    ("numeric", "Near a singularity"): lambda h: max(
        s / (s * s + 0.01) * 0.2 for s in np.linspace(1e-3, 1.0, 9991)
    ),
    ("screws", "Six numbers for an axis"): component,
    ("screws", "How far the axis is"): far_axis,
    ("screws", "Body form"): body_v,
    ("equations", "The tool point"): lambda h: float(np.linalg.norm(h.T[:3, 3])),
    ("equations", "A column from two others"): lambda h: float(
        h.T["xyz".index(prompted(h, r"the ([xyz]) component of n")[0]), 0]
    ),
    ("redundancy", "Joints and conditions"): lambda h: at_rest(h, 6),
    ("redundancy", "Only the point"): lambda h: at_rest(h, 3),
    ("velocity", "A column"): lambda h: float(np.linalg.norm(h.J[:3, 0])),
    ("velocity", "Turning"): lambda h: float(np.linalg.norm(h.J[3:, -1])),
    ("velocity", "Torques from a force"): lambda h: float(effort(h)[np.argmax(np.abs(effort(h)))]),
    ("velocity", "The ellipsoid"): lambda h: float(semi_axes(h)[0]),
    ("velocity", "A singular configuration"): lambda h: task_rank(h, h.end),
    ("postures", "By hand: the ring"): lambda h: float(
        np.linalg.norm(elbow_end(h, np.concatenate([h.q[:1], [math.pi], h.q[2:]])))
    ),
    ("postures", "By hand: the triangle"): lambda h: abs(h.end[1]),
    ("postures", "By hand: the other elbow"): lambda h: h.end[0],
    ("dh", "A joint and its column"): lambda h: float(
        np.linalg.norm(numpy_arm.pose(h.robot, h.end)[:3, 3] - h.T[:3, 3])
    ),
    ("trajectories", "Past a singularity"): lambda h: 0.2 / 0.1,
    ("trajectories", "How long it takes"): shortest,
}
# Counts of closed forms, which tests of their own compare; and a number that is the same for all arms.
ELSEWHERE = {
    ("postures", "Signs"),
    ("postures", "Within the limits"),
    ("trajectories", "Profiles side by side"),
}


# What is to be seen: how many of the options before the right one do not hold.


def place(value: float, *steps: float) -> int:
    return sum(value > step for step in steps)


ESTIMATES: dict[str, Callable[[Here], int]] = {
    "rotations": lambda h: place(-h.T[2, 2], -0.1, 0.1),
    "numeric": lambda h: place(float(np.linalg.norm(aim(h) - h.T[:3, 3])) / h.robot.reach, 0.1, 0.5),
    "equations": lambda h: int(abs(h.T[2, 3]) > 1e-3),
    "redundancy": lambda h: int(at_rest(h, 6) == 0),
    "velocity": lambda h: 0 if abs(h.J[2, 0]) > 1e-6 else 1 if float(np.linalg.norm(h.J[:3, 0])) > 1e-3 else 2,
    "trajectories": lambda h: 1,
    "screws": lambda h: (lambda count: 0 if count == 0 else 1 if count < h.robot.n else 2)(upright(h)),
    "dh": lambda h: (lambda side, up: 1 if 2.0 * side > abs(up) else 0 if up > 0.0 else 2)(*from_base(h)),
    "postures": lambda h: place(spread(h), 0.5, 0.9),
    "inverse": lambda h: (
        place(float(np.linalg.norm(from_base(h))) / h.robot.reach, 0.5)
        if "planar" in h.robot.id
        else place(-h.T[2, 2], -0.3, 0.3)
    ),
}


def upright(h: Here) -> int:
    directions = np.where(h.robot.revolute, h.screws[2], h.screws[5])
    return int((np.abs(directions) > 0.999).sum())


def from_base(h: Here) -> tuple[float, float]:
    """How far the tool is beside the base, and above it."""
    way = h.T[:3, 3] - np.array(h.robot.base)[:3, 3]
    return float(np.hypot(*way[:2])), float(way[2])


def spread(h: Here) -> float:
    """How far the tool is from the base, as a part of the length of all links."""
    return float(np.linalg.norm(from_base(h))) / h.robot.reach


def scenes(robot: Robot, outline: Outline) -> list[Here]:
    found, start = [], outline.pose_of(0)
    assert start is not None
    drawing: dict[str, Any] = dict(start.drawing)
    for at, step in enumerate(outline.steps):
        if not step.text:  # asked about other arms
            continue
        pose = outline.pose_of(at)
        assert pose is not None
        drawing |= pose.drawing
        found.append(Here(robot, step, np.array(pose.q), dict(drawing), np.array(start.q)))
        drawing |= step.end.drawing if step.end is not None else {}
    return found


@EACH
def test_numbers_in_words_are_those_of_the_scene(lesson: Any, robot: Robot) -> None:
    assert [x for h in scenes(robot, lesson.outline(robot, Units())) for x in wrong_numbers(lesson.key, h)] == []


@EACH
def test_answers_are_those_of_the_scene(lesson: Any, robot: Robot) -> None:
    for h in scenes(robot, lesson.outline(robot, Units())):
        question, name = h.step.question, (lesson.key, h.step.title)
        if not isinstance(question, Number) or name in ELSEWHERE:
            continue
        if name not in ANSWERS and lesson.key in OPEN:
            continue
        given, slack = ANSWERS[name](h), 1e-5 + 0.02 * question.tolerance
        away = question.answer - given
        away = math.remainder(away, math.tau) if question.whole_turns else away
        assert abs(away) <= slack, (name, question.answer, given)


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.key)
def test_estimates_are_those_of_the_scene(lesson: Any) -> None:
    for robot in arms_of(lesson.key):
        first, *others = scenes(robot, lesson.outline(robot, Units()))
        assert all(h.step.estimate is None for h in others)
        assert isinstance(first.step.estimate, Choice)
        rights = [i for i, option in enumerate(first.step.estimate.options) if option.right]
        assert ESTIMATES[lesson.key](first) in rights
        assert len(rights) == 1


@pytest.mark.parametrize("robot", arms_of("rotations"), ids=lambda robot: robot.id)
def test_the_frame_beside_the_arm_is_turned_as_the_words_say(robot: Robot) -> None:
    rotations = next(lesson for lesson in LESSONS if lesson.key == "rotations")
    outline = rotations.outline(robot, Units())
    for at, step in enumerate(outline.steps):
        pose = outline.pose_of(at)
        assert pose is not None
        for each in (pose, step.end):
            if each is None or each.drawing.get("chained", True) or step.title == "Gimbal lock":
                continue
            axes, _, whose = str(each.drawing["convention"]).partition("-")
            R = np.eye(3)
            for axis, angle in zip(axes, each.drawing["angles"], strict=True):  # type: ignore[call-overload]
                turn = numpy_arm._turn("xyz".index(axis), angle)[:3, :3]
                R = turn @ R if whose == "fixed" else R @ turn
            assert np.allclose(R, numpy_arm.pose(robot, np.array(each.q))[:3, :3], atol=1e-9), step.title
            assert Convention(axes, whose == "fixed").key == each.drawing["convention"]


def test_every_lesson_begins_with_an_estimate() -> None:
    assert ESTIMATES.keys() == {lesson.key for lesson in LESSONS}


def test_a_wrong_number_is_found() -> None:
    robot = arms_of("rotations")[-1]
    rotations = next(lesson for lesson in LESSONS if lesson.key == "rotations")
    first = scenes(robot, rotations.outline(robot, Units()))[0]
    assert wrong_numbers("rotations", first) == []
    first.q = first.q + 0.2
    assert wrong_numbers("rotations", first) != []
