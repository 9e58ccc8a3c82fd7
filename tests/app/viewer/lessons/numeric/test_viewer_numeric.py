"""The lesson "Numeric IK": what textbooks say about each method, the picture of the basins, the page."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Iterator

import numpy as np
import pytest
from arms import CLASSICS
from fake_browser import FakeBrowser
from hypothesis import given
from hypothesis import strategies as st
from lesson_arms import arms_of
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings as ServiceSettings
from app.shared.store import Store
from app.viewer.lessons.numeric import basins, questions, views
from app.viewer.lessons.numeric.drawing import COPIES, chosen
from app.viewer.lessons.numeric.example import example
from app.viewer.lessons.numeric.iteration import METHODS, Match, Method, Problem, Settings, advance, factors, run
from app.viewer.lessons.numeric.lesson import NumericLesson
from app.viewer.scene.clearance import clearance
from app.viewer.scene.meshes import body
from app.viewer.server import ViewerServer
from app.viewer.session.state import PageState, encode
from kin import Robot
from kin.angles import apart
from kin.transforms import Array
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
ROBOTS = CLASSICS
PLANAR, PIONEER, UR5, PANDA, SCARA, PUMA = (
    STORE.get(name) for name in ("planar2r", "pioneer5", "ur5", "panda", "scara", "puma560")
)
DEGREES, RADIANS = Units(), Units(degrees=False, length="m")


def point(x: float, y: float) -> Problem:
    T = np.eye(4)
    T[:2, 3] = x, y
    return Problem(PLANAR, T, "point")


def two_links(q: Array) -> Array:
    """The tool of the planar arm, by hand."""
    l1, l2 = 1.0, 0.6
    return np.array([l1 * np.cos(q[0]) + l2 * np.cos(q[0] + q[1]), l1 * np.sin(q[0]) + l2 * np.sin(q[0] + q[1])])


# Errors and Jacobians


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.id)
@pytest.mark.parametrize("match", ["point", "pose"])
def test_the_jacobian_is_minus_the_derivative_of_the_error(robot: Robot, match: Match) -> None:
    rng = np.random.default_rng(4)
    aim = robot.random_q(rng, 1)[0]
    problem = Problem(robot, kin.fk(robot, aim), match)
    assert np.abs(problem.error(aim)).max() < 1e-12
    # At the solution: elsewhere a rotation vector does not change by ω alone.
    J = problem.jacobian(aim)
    for k in range(robot.n):
        step = np.zeros(robot.n)
        step[k] = 1e-6 * problem.travel[k]
        change = (problem.error(aim + step) - problem.error(aim - step)) / 2e-6
        assert np.allclose(change, -J[:, k], atol=1e-7)
    dropped = np.setdiff1d(np.arange(3 if match == "point" else 6), problem.rows)
    assert np.abs(kin.jacobian(robot, aim)[dropped]).max(initial=0.0) < 1e-9


@pytest.mark.parametrize("robot", [PLANAR, PIONEER, UR5, SCARA], ids=lambda robot: robot.id)
def test_the_slope_of_the_squared_error_is_minus_the_transpose_times_the_error(robot: Robot) -> None:
    rng = np.random.default_rng(5)
    q, aim = robot.random_q(rng, 2)
    problem = Problem(robot, kin.fk(robot, aim), "pose" if robot.n >= 6 else "point")
    slope = -problem.jacobian(q).T @ problem.error(q)
    for k in range(robot.n):
        step = np.zeros(robot.n)
        step[k] = 1e-6 * problem.travel[k]
        halves = [0.5 * float(problem.error(q + way * step) @ problem.error(q + way * step)) for way in (1, -1)]
        assert (halves[0] - halves[1]) / 2e-6 == pytest.approx(slope[k], abs=1e-6)


def test_rows_and_shapes() -> None:
    shapes = {
        (r.id, match): (len(problem.rows), problem.is_finite)
        for r in (PLANAR, PIONEER, SCARA, UR5, PANDA)
        for match in ("point", "pose")
        for problem in [Problem(r, kin.fk(r, r.q_home), match)]  # type: ignore[arg-type]
    }
    assert shapes == {
        ("planar2r", "point"): (2, True),
        ("planar2r", "pose"): (3, True),
        ("pioneer5", "point"): (3, False),
        ("pioneer5", "pose"): (6, True),
        ("scara", "point"): (3, False),
        ("scara", "pose"): (4, True),
        ("ur5", "point"): (3, False),
        ("ur5", "pose"): (6, True),
        ("panda", "point"): (3, False),
        ("panda", "pose"): (6, False),
    }
    lifted = point(1.0, 0.5).T.copy()
    lifted[2, 3] = 0.1
    assert Problem(PLANAR, lifted, "point").rows.tolist() == [0, 1, 2], (
        "an error that no joint changes still counts"
    )


# The methods


def test_a_newton_step_by_hand() -> None:
    q = np.array([0.3, 0.8])
    problem = point(0.9, 0.7)
    s1, c1, s12, c12 = math.sin(0.3), math.cos(0.3), math.sin(1.1), math.cos(1.1)
    J = np.array([[-s1 - 0.6 * s12, -0.6 * s12], [c1 + 0.6 * c12, 0.6 * c12]])
    step = np.linalg.solve(J, np.array([0.9, 0.7]) - two_links(q))
    made = advance(problem, Settings("newton"), q[None], problem.error(q[None]))
    assert np.allclose(made.q[0], q + step, atol=1e-12)
    assert made.step[0] == pytest.approx(np.linalg.norm(step))
    assert problem.size * np.linalg.norm(made.error) == pytest.approx(
        np.linalg.norm(np.array([0.9, 0.7]) - two_links(q + step))
    )


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.id)
def test_newton_converges_quadratically_near_a_regular_solution(robot: Robot) -> None:
    known = example(robot)
    assert known.newton.outcome == "reached"
    errors = known.newton.errors
    asymptotic = [(a, b) for a, b in itertools.pairwise(errors) if 1e-7 < a < 2e-2]
    assert asymptotic
    for before, after in asymptotic:
        assert after < 60.0 * before**2 + 1e-13
    gauss = run(known.problem, Settings("gauss-newton"), known.start)
    assert gauss.outcome == "reached"
    assert (np.diff(gauss.errors) < 0.0).all(), "Gauss–Newton never lets the error grow"


@pytest.mark.parametrize("robot", CLASSICS, ids=lambda robot: robot.id)
def test_the_example_touches_neither_floor_nor_base(robot: Robot) -> None:
    known = example(robot)
    for q in (known.start, known.newton.q[-1]):
        assert robot.in_limits(q)
        assert clearance(robot).at(q) is None


@pytest.mark.parametrize("robot", [PLANAR, PIONEER, UR5, SCARA], ids=lambda robot: robot.id)
def test_the_transpose_descends_with_a_small_gain(robot: Robot) -> None:
    rng = np.random.default_rng(6)
    problem = Problem(robot, kin.fk(robot, robot.random_q(rng, 1)[0]), "point")
    found = run(problem, Settings("transpose", gain=0.25), robot.random_q(rng, 1)[0])
    assert (np.diff(found.errors) < 1e-12).all()
    assert found.errors[-1] < 0.2 * found.errors[0]


@given(st.floats(0.005, 0.5), st.integers(0, 2**32 - 1))
def test_damped_steps_are_bounded_and_agree_with_the_normal_equations(damping: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    q, aim = PLANAR.random_q(rng, 2)
    q[1] *= 10.0 ** -rng.uniform(0.0, 9.0)  # as near to the straight arm as you like
    problem = Problem(PLANAR, kin.fk(PLANAR, aim), "point")
    e, J = problem.error(q), problem.jacobian(q)
    made = advance(problem, Settings("damped", damping), q[None], e[None])
    assert made.step[0] <= np.linalg.norm(e) / (2.0 * damping) * (1.0 + 1e-12)
    expected = np.linalg.solve(J.T @ J + damping**2 * np.eye(2), J.T @ e)
    assert np.allclose(made.q[0] - q, expected, atol=1e-9)


def test_newton_has_no_step_at_a_singularity_and_long_ones_near_it() -> None:
    straight = np.zeros(2)
    inwards = point(1.2, 0.0)
    assert run(inwards, Settings("newton"), straight).outcome == "singular"
    assert run(inwards, Settings("damped"), straight).outcome == "stuck", "the slope is zero there, too"
    bends = np.array([1e-2, 1e-3])
    newton, damped = questions.first_steps(bends)
    assert newton[1] / newton[0] == pytest.approx(10.0, rel=0.05), "as 1/σ"
    assert damped.max() <= questions.ERROR / (2.0 * questions.DAMPING)


def test_factors_of_the_singular_values() -> None:
    s, w = np.array([[2.0, 0.5]]), np.array([[0.1, 0.2]])
    assert factors(Settings("newton"), s, w).tolist() == [[0.5, 2.0]]
    assert factors(Settings("damped", 0.5), s, w).tolist() == [[2.0 / 4.25, 1.0]]
    gain = (0.2**2 + 0.1**2) / (0.4**2 + 0.05**2)  # |Jᵀe|² / |JJᵀe|²
    assert factors(Settings("transpose"), s, w) == pytest.approx(gain * s)


def test_a_step_limit_shortens_steps_in_their_direction() -> None:
    q, problem = np.array([0.3, 0.05]), point(0.5, 0.2)
    free = advance(problem, Settings("newton"), q[None], problem.error(q[None]))
    kept = advance(problem, Settings("newton", longest=0.1), q[None], problem.error(q[None]))
    assert np.abs(kept.q - q).max() == pytest.approx(0.1)
    assert kept.shortened[0]
    assert not free.shortened[0]
    assert np.cross(*np.pad(np.vstack([free.q - q, kept.q - q]), ((0, 0), (0, 1))))[2] == pytest.approx(
        0.0, abs=1e-9
    )


def test_limits_stop_an_iteration_that_would_leave_them() -> None:
    q = PUMA.q_home.copy()
    aim = q.copy()
    aim[2] = PUMA.upper[2] + 0.3
    problem = Problem(PUMA, kin.fk(PUMA, aim), "pose")
    free = run(problem, Settings("newton"), q)
    assert free.outcome == "reached"
    held = run(problem, Settings("newton", limits=True), q)
    assert held.outcome in ("limits", "unfinished")
    assert held.held.any()
    assert ((PUMA.lower <= held.q) & (held.q <= PUMA.upper)).all()


def test_out_of_reach_ends_at_the_stretched_arm_or_not_at_all() -> None:
    problem, start = point(2.0, 0.5), np.array([0.2, 0.9])
    nearest = np.hypot(2.0, 0.5) - 1.6
    for settings in (Settings("damped", 0.5), Settings("gauss-newton"), Settings("transpose")):
        found = run(problem, settings, start)
        assert found.outcome in ("stuck", "unfinished")
        assert found.far[-1] == pytest.approx(nearest, rel=0.01)
        assert found.far.min() >= nearest - 1e-9
    cycling = run(problem, Settings("damped", 0.1), start)
    assert cycling.outcome == "unfinished"
    text = views.outcome_html(problem, cycling, np.empty((0, 2)), DEGREES)
    assert "no configuration within the limits" in text
    assert "The error does not settle" in text


# The picture


@pytest.mark.parametrize("method", METHODS)
def test_the_basins_agree_with_single_runs(method: Method) -> None:
    problem = Problem(PLANAR, kin.fk(PLANAR, PLANAR.q_home), "point")
    settings = Settings(method, limits=method == "damped")
    found = last(basins.search(problem, settings, 12))
    assert len(found.solutions) == 2
    assert sum(found.share(k) for k in range(3)) == pytest.approx(1.0)
    checked = 0
    for i, j in ((2, 6), (7, 3), (9, 9), (5, 5)):
        single = run(problem, settings, np.array([found.q1[j], found.q2[i]]), basins.MOST)
        if single.outcome == "reached":
            near = apart(single.q[-1], found.solutions, PLANAR.revolute)
            assert found.reached[i, j] == int(np.argmin(near)) + 1
            checked += 1
    assert checked or method == "transpose"


def last(search: Iterator[basins.Basins | None]) -> basins.Basins:
    found = [each for each in search if each is not None]
    assert len(found) == 1
    return found[0]


def test_solutions_of_the_picture_are_those_of_the_arm() -> None:
    problem = point(0.9, 0.7)
    solutions = basins.exact(problem)
    assert len(solutions) == 2
    for q in solutions:
        assert two_links(q) == pytest.approx([0.9, 0.7])
    assert solutions[0, 1] < 0.0 < solutions[1, 1]
    assert len(basins.exact(point(2.0, 0.0))) == 0
    far = last(basins.search(point(2.0, 0.0), Settings("damped"), 6))
    assert far.share(0) == 1.0
    assert (basins.pixels(far)[..., :3] == basins.COLOURS[0]).all()


def test_the_picture_has_its_second_angle_upwards() -> None:
    found = last(basins.search(point(0.9, 0.7), Settings("damped"), 16))
    rgba = basins.pixels(found)
    for i, j in ((0, 3), (15, 9)):
        base = basins.COLOURS[found.reached[i, j]]
        shown = rgba[15 - i, j, :3] / base
        assert np.ptp(shown) < 0.02, "a darker shade of its colour"


def test_whole_turns_and_limits() -> None:
    q = UR5.q_home + 2.0 * math.pi * np.array([1, -2, 0, 3, 0, 0])
    assert basins.within(PUMA, PUMA.q_home + 2.0 * math.pi) == pytest.approx(PUMA.q_home)
    found = basins.within(UR5, q)
    assert found is not None
    assert np.allclose(kin.fk(UR5, found), kin.fk(UR5, q))
    beyond = PUMA.q_home.copy()
    beyond[2] = PUMA.upper[2] + 0.2
    assert basins.within(PUMA, beyond) is None


# Words and numbers


def test_numbers_of_the_steps() -> None:
    for robot in arms_of("numeric"):
        known = example(robot)
        made = NumericLesson.outline(robot, DEGREES)
        far = made.steps[0].question
        ends = kin.fk(robot, np.stack([known.start, known.newton.q[-1]]))[:, :3, 3]
        assert far.answer == pytest.approx(np.linalg.norm(ends[1] - ends[0]), abs=1e-9)  # type: ignore[union-attr]
        shape = made.steps[1].question
        rights = [option.text for option in shape.options if option.right]  # type: ignore[union-attr]
        J = kin.jacobian(robot, robot.random_q(np.random.default_rng(8), 6))
        assert rights == ["One"]
        assert J.shape[1:] == (6, 6)
        assert np.linalg.matrix_rank(J[0]) == 6
        sigma = float(re.search(r"of this arm is (\d\.\d+)", made.steps[4].text)[1])  # type: ignore[index]
        scaled = kin.jacobian(robot, known.newton.q[-1])
        scaled[:3] /= known.problem.size
        scaled = (scaled * known.problem.travel)[known.problem.rows]
        assert sigma == pytest.approx(np.linalg.svd(scaled, compute_uv=False)[-1], abs=6e-4)
        share = made.steps[4].question
        # One damped step on the linear model.
        step = sigma / (sigma**2 + questions.DAMPING**2)
        assert share.answer == pytest.approx(1.0 - (1.0 - sigma * step))  # type: ignore[union-attr]


def test_amounts_are_written_in_the_chosen_units() -> None:
    assert views.amount(DEGREES.lengths, 0.0123) == "12.3 mm"
    assert views.amount(DEGREES.lengths, 3.2e-8) == "3.2·10⁻⁵ mm"
    assert views.amount(RADIANS.lengths, 3.2e-8) == "3.2·10⁻⁸ m"
    assert views.amount(DEGREES.angles, math.radians(20.0)) == "20.0°"
    known = example(UR5)
    for units, unit in ((DEGREES, "mm"), (RADIANS, " m")):
        table = views.table_html(known.problem, known.newton, 2, units)
        assert unit in table
        assert 'data-iterate="2"' in table
    assert 'aria-label="Error and step length' in views.chart_html(
        known.problem, [("newton", known.newton)], DEGREES
    )


def test_endings_are_worded() -> None:
    solved = example(UR5)
    exact = basins.exact(solved.problem)
    text = views.outcome_html(solved.problem, solved.newton, exact, DEGREES)
    assert "Converged in" in text
    assert f"{len(exact)} solutions within the limits; this is number" in text
    assert "infinitely many" in views.outcome_html(solved.problem, solved.newton, None, DEGREES)
    beyond = PUMA.q_home.copy()
    beyond[2] = PUMA.upper[2] + math.radians(10.0)
    problem = Problem(PUMA, kin.fk(PUMA, beyond), "pose")
    ended = run(problem, Settings("newton"), PUMA.q_home)
    assert ended.outcome == "reached"
    singular = run(point(1.2, 0.0), Settings("newton"), np.zeros(2))
    assert "J has lost rank" in views.outcome_html(point(1.2, 0.0), singular, np.empty((0, 2)), DEGREES)


def test_only_so_many_ghosts_are_drawn() -> None:
    assert chosen(1) == [0]
    assert chosen(COPIES) == list(range(COPIES))
    assert chosen(80) == [*range(COPIES - 1), 79]


# In a page


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, ServiceSettings(), Clouds())) as port:
        yield port


@pytest.mark.full
def test_a_visitor_watches_an_iteration(server: int) -> None:
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", "Numeric IK")
        tab.choose(PLANAR.name)  # about which nothing is asked
        tab.wait(lambda: "Converged in" in tab.html and 'data-plot="iterations"' in tab.html)
        # The target follows: nothing is left to do.
        press(tab, "Aim", "Target here")
        tab.wait(lambda: "Converged in 0 iterations" in tab.html)
        first = PLANAR.lower[0] + 0.1
        tab.set("1 shoulder", round(math.degrees(first), 1))
        tab.wait(lambda: "Converged in 0 iterations" not in tab.html and "this is number" in tab.html)
        tab.set("Method", "Damped least squares")
        tab.wait(lambda: "at most 1/(2λ)" in tab.html and "Damped least squares</span>" in tab.html)
        press(tab, "Iterate", "First")
        tab.wait(lambda: 'data-iterate="0"' in tab.html)
        press(tab, "Iterate", "Next")
        tab.wait(lambda: 'data-iterate="1"' in tab.html)
        tab.set("Compare all methods", True)
        tab.wait(lambda: "Gauss–Newton</span>" in tab.html)
        tab.set("Basins of attraction", True)
        tab.wait(lambda: "data:image/png" in tab.html and "the present start" in tab.html)
        press(tab, "Iterate", "Run")
        tab.wait(lambda: 'data-iterate="3"' in tab.html)
        tab.set("Lesson", "None")
        tab.settle()


def test_all_iterates_are_in_view_until_the_lesson_is_closed(server: int) -> None:
    def distance() -> float:
        return float(np.linalg.norm(np.subtract(tab.camera["position"], tab.camera["look_at"])))

    with FakeBrowser(server) as tab:
        tab.settle()
        before = distance()
    # A link: the lesson opened by hand goes to the pose of its step.
    some = PIONEER.random_q(np.random.default_rng(2), 400)
    stretched = some[int(np.linalg.norm(kin.fk(PIONEER, some)[:, :3, 3] - body(PIONEER).center, axis=1).argmax())]
    answered = {"guide": {"revealed": ["1"]}, "numeric": {"start": stretched.tolist(), "follow": False}}
    state = encode(PageState(robot=PIONEER.id, q=PIONEER.q_home, lesson="numeric", features=answered))
    with FakeBrowser(server, memory=json.dumps({"address": "http://127.0.0.1/", "state": state})) as tab:
        tab.wait(lambda: "Converged in" in tab.html and distance() > 1.1 * before)
        tab.set("Lesson", "None")
        tab.wait(lambda: abs(distance() - before) < 1e-6)


def press(tab: FakeBrowser, group: str, button: str) -> None:
    uuid = tab.element(group)
    tab.send("GuiUpdateMessage", uuid=uuid, updates={"value": button})
