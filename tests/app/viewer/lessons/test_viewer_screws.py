"""The lesson "Screws": its numbers against forward kinematics and the Jacobian, for all arms."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator

import numpy as np
import pytest
from arms import CLASSICS
from fake_browser import FakeBrowser
from lesson_arms import arms_of
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.lessons.axes import axes_at
from app.viewer.lessons.guide.outline import Choice, Number
from app.viewer.lessons.screws import lesson as views
from app.viewer.lessons.screws.drawing import foot, spread_tips
from app.viewer.lessons.screws.lesson import (
    FORMS,
    PLACES,
    Form,
    ScrewsLesson,
    joints,
    partial,
    product,
)
from app.viewer.server import ViewerServer
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
UNITS = Units()
BOTH: tuple[Form, Form] = ("space", "body")

ASKED = pytest.mark.parametrize("robot", arms_of("screws"), ids=lambda robot: robot.id)


@pytest.fixture(params=CLASSICS, ids=[robot.id for robot in CLASSICS])
def robot(request: pytest.FixtureRequest) -> kin.Robot:
    found: kin.Robot = request.param
    return found


def shown(html: str, mark: str) -> list[float]:
    """The numbers in the elements with this attribute."""
    cells = re.findall(rf"<td {mark}><span>([^<]+)</span>", html)
    return [float(cell.replace("−", "-")) for cell in cells]


def matrix(html: str, by: str) -> list[str]:
    """The numbers of a product, as they are shown."""
    block = html.split(f'data-by="{by}"')[1].split("</div>")[0]
    return re.findall(r"<mn>([^<]+)</mn>", block)


def test_the_screws_are_those_of_the_axes(robot: kin.Robot) -> None:
    for q in (np.zeros(robot.n), robot.q_home):
        found = kin.dh.screws(robot, q)
        points, z = axes_at(robot, q)
        for i in range(robot.n):
            S = found.S[:, i]
            if robot.revolute[i]:
                assert pytest.approx(z[i], abs=1e-12) == S[:3]
                assert pytest.approx(-np.cross(S[:3], points[i]), abs=1e-12) == S[3:]
                across = points[i] - (points[i] @ z[i]) * z[i]
                assert foot(S) == pytest.approx(across, abs=1e-12)
            else:
                assert S[:3].tolist() == [0.0, 0.0, 0.0]
                assert pytest.approx(z[i], abs=1e-12) == S[3:]
        # Where they are now: the columns of the Jacobian, at the world's origin or at the tool.
        J = kin.jacobian(robot, q)
        T = kin.fk(robot, q)
        assert np.allclose(found.S[:3], J[3:], atol=1e-12)
        at_tool = found.S[3:] + np.cross(found.S[:3].T, T[:3, 3]).T
        assert np.allclose(at_tool, J[:3], atol=1e-12)
        assert np.allclose(found.M, T, atol=1e-12)


@pytest.mark.parametrize("form", BOTH)
def test_the_table_and_both_products_agree_with_the_core(robot: kin.Robot, form: Form) -> None:
    zero = kin.dh.screws(robot)
    q = robot.random_q(np.random.default_rng(4))
    columns = zero.S if form == "space" else zero.B
    html = views.table_html(robot, columns, form, False, 0)
    assert shown(html, "data-s") == pytest.approx(columns.T.ravel(), abs=0.5001e-3)
    assert re.findall(r"data-pitch>(.)<", html) == ["0" if turns else "∞" for turns in robot.revolute]
    for factors in range(robot.n + 1):
        part = partial(q, factors, form)
        T = kin.fk(robot, part)
        assert np.abs(product(zero, part, form) - T).max() < 1e-12
        # The factors next to M, multiplied by hand.
        expected = zero.M
        joints = range(robot.n - 1, robot.n - 1 - factors, -1) if form == "space" else range(factors)
        for i in joints:
            step = kin.dh.exp_screw(columns[:, i], q[i])
            expected = step @ expected if form == "space" else expected @ step
        assert np.abs(expected - T).max() < 1e-12
        html = views.product_html(robot, zero, part, factors, form)
        assert matrix(html, "screws") == matrix(html, "table"), "equal to the last digit shown"
        assert [float(n.replace("−", "-")) for n in matrix(html, "table")[:12]] == pytest.approx(
            T[:3].ravel(), abs=0.5001 * 10.0**-views.DIGITS
        )
        assert html.count("rgba(0,114,178") == factors


@ASKED
def test_the_body_form_asks_for_a_length_that_is_not_zero(robot: kin.Robot) -> None:
    """The length in the space form is a known mistake."""
    step = next(step for step in ScrewsLesson.outline(robot, UNITS).steps if step.title == "Body form")
    assert isinstance(step.question, Number)
    assert step.question.answer > 0.01 * robot.reach
    joint = int(re.findall(r"joint (\d+)", step.question.prompt)[0]) - 1
    space = float(np.linalg.norm(kin.dh.screws(robot).S[3:, joint]))
    named = [mistake.value for mistake in step.question.mistakes if "space form" in mistake.reason]
    assert named == [pytest.approx(space)] or abs(space - step.question.answer) < 1e-3


def test_a_wrong_screw_shows_in_the_product() -> None:
    robot = STORE.get("ur5")
    zero = kin.dh.screws(robot)
    wrong = zero._replace(S=np.where(np.arange(6)[:, None] == 3, zero.S + 1e-4, zero.S))
    html = views.product_html(robot, wrong, robot.q_home, robot.n, "space")
    assert matrix(html, "screws") != matrix(html, "table")
    assert "10⁻⁴" in html or "10⁻⁵" in html


def test_one_screw_in_numbers() -> None:
    robot = STORE.get("scara")
    S = kin.dh.screws(robot).S
    slide = int(np.flatnonzero(~robot.revolute)[0])
    html = views.one_html(robot, slide, S[:, slide], 0.05, "space", UNITS)
    assert "Pitch ∞" in html
    assert "50.0 mm" in html
    turn = 1
    html = views.one_html(robot, turn, S[:, turn], math.pi / 2, "space", UNITS)
    assert f"{1000 * np.linalg.norm(S[3:, turn]):.1f} mm" in html
    assert "90.0°" in html


def test_axes_of_one_line_have_ends_apart() -> None:
    points, z = np.zeros((4, 3)), np.tile([0.0, 0.0, 1.0], (4, 1))
    z[3] = 1.0, 0.0, 0.0
    tips = spread_tips(points, z, 1.0, 0.2)
    assert tips[:, 2].tolist() == pytest.approx([1.0, 1.2, 1.4, 0.0])
    assert tips[3].tolist() == [1.0, 0.0, 0.0]


@ASKED
def test_the_questions_by_another_way(robot: kin.Robot) -> None:
    made = ScrewsLesson.outline(robot, UNITS)
    asked = dict(made.questions())
    frames = np.concatenate([robot.T_world_base[None], kin.link_frames(robot, np.zeros(robot.n))])

    def line(joint: int) -> tuple[np.ndarray, np.ndarray]:
        row = robot.joint_rows[joint] + (robot.convention == "modified")
        return frames[row, :3, 3], frames[row, :3, 2]

    first = asked["1"]
    assert isinstance(first, Number)
    axis, joint = "xyz".index(first.prompt.split()[2]), int(first.prompt.split("joint ")[1].split(",")[0]) - 1
    assert first.answer == pytest.approx(line(joint)[1][axis], abs=1e-12)
    assert abs(first.answer) > 0.5
    assert not first.judge(-first.answer).right

    far = asked["2"]
    assert isinstance(far, Number)
    point, z = line(int(far.prompt.split("joint ")[1].split()[0]) - 1)
    assert far.answer == pytest.approx(np.linalg.norm(np.cross(point, z)), abs=1e-12)
    near = asked["c4"]
    assert isinstance(near, Number)
    point, z = line(int(near.prompt.split("joint ")[1].split(",")[0]) - 1)
    across = point - (point @ z) * z
    assert near.answer == pytest.approx(across["xyz".index(near.prompt.split("its ")[1][0])], abs=1e-12)

    body = asked["5"]
    assert isinstance(body, Number)
    J = kin.jacobian(robot, np.zeros(robot.n))
    joint = int(re.findall(r"joint (\d+)", body.prompt)[0]) - 1
    assert body.answer == pytest.approx(np.linalg.norm(J[:3, joint]), abs=1e-9)
    asked |= dict(ScrewsLesson.asked(robot, UNITS).questions())
    for key, right in (("3", "ω = 0, v = its direction"), ("c2", "M"), ("c3", "v becomes zero")):
        question = asked[key]
        assert isinstance(question, Choice)
        assert [option.text for option in question.options if option.right] == [right]


# In a page


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port:
        yield port


@pytest.mark.full
def test_the_controls_change_table_product_and_scene(server: int) -> None:
    pioneer = CLASSICS[0]
    zero = kin.dh.screws(pioneer)
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", "Screws")
        tab.wait(lambda: "This is asked about PUMA 560" in tab.html)
        tab.choose(pioneer.name)  # about which nothing is asked
        tab.wait(lambda: 'data-form="space"' in tab.html)
        assert shown(tab.html, "data-s") == pytest.approx(zero.S.T.ravel(), abs=0.5001e-3)
        assert "both products are the pose of the tool" in tab.html
        tab.set("Axes", list(PLACES)[1])
        now = kin.dh.screws(pioneer, pioneer.q_home)
        tab.wait(lambda: shown(tab.html, "data-s") == pytest.approx(now.S.T.ravel(), abs=0.5001e-3))
        tab.set("Form", list(FORMS)[1])
        tab.wait(lambda: shown(tab.html, "data-s") == pytest.approx(now.B.T.ravel(), abs=0.5001e-3))
        tab.set("Axes", next(iter(PLACES)))
        tab.set("Factors", 2)
        tab.wait(lambda: "The factors of the first 2 joints act on M" in tab.html)
        tab.set("Joint", list(joints(pioneer))[3])
        tab.wait(lambda: "v of joint 4, direction only" in tab.html and "after the factors" in tab.html)
        tab.wait(lambda: sum(name.startswith("/screws-") for name in tab.nodes) > 3 * pioneer.n)
        kept = tab.stored()
    memory = json.dumps({"address": "http://127.0.0.1/", "state": kept})
    with FakeBrowser(server, memory=memory) as tab:
        tab.wait(lambda: "The factors of the first 2 joints act on M" in tab.html)
        tab.wait(lambda: "v of joint 4, direction only" in tab.html and 'data-form="body"' in tab.html)
        tab.choose(STORE.get("scara").name)
        tab.wait(lambda: len(shown(tab.html, "data-s")) == 24 and "∞" in tab.html)
        tab.set("Lesson", "None")
        tab.wait(lambda: not any(name.startswith("/screws-") for name in tab.nodes))
