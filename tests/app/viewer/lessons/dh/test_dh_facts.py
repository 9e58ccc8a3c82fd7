"""What the lesson on DH tables knows, without a page, against products of matrices by NumPy alone; its camera and
what it withholds."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS
from bare_page import EYE, STORE, BarePage, bare_page

import kin
from app.viewer.arm import Arm
from app.viewer.lessons.dh.facts import DHFacts
from app.viewer.lessons.dh.lesson import DHLesson
from app.viewer.lessons.dh.settings import DHSettings
from app.viewer.lessons.dh.steps import MOVED, length, value
from kin.units import DEFAULT_UNITS

ARMS = pytest.mark.parametrize("robot", CLASSICS, ids=[robot.id for robot in CLASSICS])
PIONEER, SCARA = STORE.get("pioneer5"), STORE.get("scara")


def known(robot: kin.Robot, q: np.ndarray, at: float) -> DHFacts:
    return DHFacts(replace(DHSettings.fresh(robot), at=at), Arm(robot, q, q))


def reread(robot: kin.Robot) -> kin.Robot:
    return replace(robot, convention="modified" if robot.convention == "standard" else "standard")


def elementary(name: str, amount: float) -> np.ndarray:
    """A turn about, or a slide along, z (theta, d) or x (a, alpha), as a power series of its generator."""
    A, k = np.zeros((4, 4)), 2 if name in ("theta", "d") else 0
    if name in ("theta", "alpha"):
        A[:3, :3] = np.cross(np.eye(3), np.eye(3)[k]) * amount
    else:
        A[k, 3] = amount
    term = total = np.eye(4)
    for i in range(1, 60):
        term = term @ A / i
        total = total + term
    return np.asarray(total)


def walked(robot: kin.Robot, q: np.ndarray, at: float) -> np.ndarray:
    """The moving frame after so many motions of the table, the last one in part."""
    values, T = iter(q.tolist()), np.array(robot.base)
    for row in robot.rows:
        numbers = {name: getattr(row, name) for name in ("theta", "d", "a", "alpha")}
        if row.kind != "fixed":
            numbers["theta" if row.kind == "revolute" else "d"] += next(values)
        for name in numbers if robot.convention == "standard" else ("alpha", "a", "theta", "d"):
            T = T @ elementary(name, numbers[name] * min(max(at, 0.0), 1.0))
            at -= 1.0
    return T


@ARMS
def test_the_walk_is_a_product_of_elementary_motions_in_both_conventions(robot: kin.Robot) -> None:
    rng = np.random.default_rng(4)
    for q, at in zip(robot.random_q(rng, 12), rng.uniform(0.0, length(robot), 12).tolist(), strict=True):
        f = known(robot, q, at)
        assert np.abs(f.frames - numpy_arm.frames(robot, q)).max() < 1e-12
        assert np.abs(f.place.T_0_now - walked(robot, q, at)).max() < 1e-12
        other = reread(robot)
        assert np.abs(f.other_frames - numpy_arm.frames(other, q)).max() < 1e-12
        assert np.abs(f.other_place.T_0_now - walked(other, q, at)).max() < 1e-12
        ends = [numpy_arm.frames(each, q)[-1][:3, 3] for each in (robot, other)]
        assert f.apart == pytest.approx(float(np.linalg.norm(ends[0] - ends[1])), abs=1e-12)


@ARMS
def test_the_walk_ends_at_the_last_frame(robot: kin.Robot) -> None:
    q = robot.random_q(np.random.default_rng(2))
    end = known(robot, q, float(length(robot)))
    assert np.abs(end.place.T_0_now - numpy_arm.frames(robot, q)[-1]).max() < 1e-12
    assert end.place.placed == len(robot.rows)
    start = known(robot, q, 0.0)
    assert np.abs(start.place.T_0_now - np.array(robot.base)).max() == 0.0
    assert start.place.placed == 0


@pytest.fixture
def page() -> Iterator[BarePage]:
    with bare_page(PIONEER) as opened:
        opened.open(DHLesson)
        yield opened


def texts(page: BarePage) -> str:
    return " ".join(str(part) for part in (page.panel(), page.scene()))


@pytest.mark.full
def test_what_a_joint_makes_of_its_row_is_withheld_while_it_is_asked(page: BarePage) -> None:
    lesson = page.feature
    assert isinstance(lesson, DHLesson)
    for robot in CLASSICS:
        page.change(robot)
        q = robot.random_q(np.random.default_rng(8))
        for row, compare in ((robot.joint_rows[0], False), (robot.joint_rows[-1], True)):
            factor = MOVED[robot.rows[row].kind]
            amount = DEFAULT_UNITS.of(factor == "theta").text(value(robot, row, factor, q))
            lesson.change(at=4.0 * (row + 1), compare=compare)
            for asked in (True, False):
                page.activity.withheld = frozenset({"motions"} if asked else ())
                lesson.on_activity()
                page.use(robot, q)
                lesson.refresh()
                assert (amount in texts(page)) != asked, (robot.id, row)
                assert ("?" in texts(page)) == asked


def test_the_camera_shows_both_arms_and_comes_back(page: BarePage) -> None:
    camera, near = page.client.camera, 0.3 * EYE
    camera.position = near
    page.set("Compare conventions", True)
    page.rest()
    far = np.array(camera.position)
    out, before = far - camera.look_at, near
    assert np.linalg.norm(np.cross(out, before)) < 1e-9 * np.linalg.norm(out), "its direction stays"
    assert np.linalg.norm(out) > np.linalg.norm(before)
    page.set("Assign it yourself", True)
    page.rest()
    assert np.array_equal(camera.position, near)
    page.set("Assign it yourself", False)
    page.rest()
    assert np.allclose(camera.position, far)
    camera.position = far + 0.5  # the visitor has chosen a view
    page.set("Compare conventions", False)
    page.rest()
    assert np.array_equal(camera.position, far + 0.5)


def test_an_attempt_is_a_value_that_steps_do_not_change(page: BarePage) -> None:
    page.set("Assign it yourself", True)
    page.rest()
    lesson = page.feature
    assert isinstance(lesson, DHLesson)
    first = lesson.settings.assign
    assert first is not None
    before = first.state()
    page.events.append((("feature", "dh", ("choose", "axis", 1)), 0))
    page.rest()
    assert first.state() == before
    assert lesson.state()["assign"] != before
    with pytest.raises(kin.InputError, match="index"):
        lesson.handle(("choose", "direction", 2), 99)
    page.change(SCARA)
    assert lesson.settings.assign is not None
    assert lesson.settings.assign.work.robot is SCARA
    page.set("Assign it yourself", False)
    page.rest()
    with pytest.raises(kin.InputError, match="on show"):
        lesson.handle(("choose", "direction", 3), 0)


def test_a_place_beyond_the_end_is_refused() -> None:
    fresh = DHSettings.fresh(SCARA)
    end = float(length(SCARA))
    assert fresh.restored({"at": end}, SCARA).at == end
    for at in (end + 1.0, -0.1, math.nan, True, "1"):
        assert fresh.restored({"at": at}, SCARA).at == 0.0
    spec = DHSettings.spec("at")
    assert spec.read("row", 1.25, SCARA, DEFAULT_UNITS) == 5.0
    assert spec.shown(6.5, SCARA, DEFAULT_UNITS) == 1.625
    with pytest.raises(kin.InputError, match="a number from 0 to 4"):
        spec.read("row", 4.01, SCARA, DEFAULT_UNITS)
