"""What the lesson "Rotations and frames" knows, without a page, against products of elementary matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest
from bare_page import STORE, bare_page

from app.viewer.arm import Arm
from app.viewer.lessons.rotations.conventions import CONVENTIONS
from app.viewer.lessons.rotations.facts import RotationsFacts
from app.viewer.lessons.rotations.frames import Motion
from app.viewer.lessons.rotations.lesson import RotationsLesson
from app.viewer.lessons.rotations.settings import RotationsSettings

ROBOT = STORE.get("ur5")


def facts(**settings: object) -> RotationsFacts:
    return RotationsFacts(RotationsSettings(**settings), Arm(ROBOT, ROBOT.q_home, ROBOT.q_home))


def turned(axis: int, angle: float) -> np.ndarray:
    """Rodrigues' formula for a coordinate axis."""
    e = np.eye(3)[axis]
    K = np.cross(np.eye(3), e)
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K)


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda each: each.key)
def test_a_rotation_is_the_product_of_its_turns(convention) -> None:
    rng = np.random.default_rng(4)
    for _ in range(5):
        angles = tuple(rng.uniform(-3, 3, 3).tolist())
        R = np.eye(3)
        for axis, angle in zip(convention.axes, angles, strict=True):
            turn = turned("xyz".index(axis), angle)
            R = turn @ R if convention.fixed else R @ turn
        known = facts(convention=convention.key, angles=angles)
        assert np.abs(known.R - R).max() < 1e-12


def test_frames_of_a_chain_are_products_from_the_left_and_from_the_right() -> None:
    rng = np.random.default_rng(7)
    for _ in range(20):
        chain = tuple(
            Motion(bool(rng.integers(2)), int(rng.integers(3)), float(rng.uniform(-2, 2)), bool(rng.integers(2)))
            for _ in range(6)
        )
        T = np.eye(4)
        for motion, place in zip(chain, facts(chain=chain).places[1:], strict=True):
            step = np.eye(4)
            if motion.turns:
                step[:3, :3] = turned(motion.axis, motion.amount)
            else:
                step[motion.axis, 3] = motion.amount
            T = T @ step if motion.own else step @ T
            assert place == pytest.approx(T, abs=1e-12)


def test_another_convention_keeps_the_rotation_even_in_one_batch_of_events() -> None:
    with bare_page(ROBOT) as page:
        lesson = page.open(RotationsLesson)
        for convention in CONVENTIONS:
            before = lesson.facts.R
            page.set("Angles", convention.title)
            page.rest()
            assert np.abs(lesson.facts.R - before).max() < 1e-9
        page.set("Angles", "X-Y-Z fixed")
        page.rest()
        page.set("β about y", 90.0)
        page.set("Angles", "Z-Y-X moving")
        page.rest()
        assert lesson.facts.R[:, 0] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)
