"""The lesson "Rotations and frames": conventions against scipy, chains, questions, the page."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator

import numpy as np
import pytest
from arms import CLASSICS
from fake_browser import FakeBrowser
from hypothesis import given, settings
from hypothesis import strategies as st
from lesson_arms import arms_of
from live_server import serve_viewer
from scipy.spatial.transform import Rotation

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings as ServiceSettings
from app.shared.store import Store
from app.viewer.lessons.guide.outline import Choice, Number
from app.viewer.lessons.rotations import questions, views
from app.viewer.lessons.rotations.conventions import CONVENTIONS, PAGE, Angles, Convention, axis_angle
from app.viewer.lessons.rotations.frames import MOST, Motion, as_json, factors, from_json, places, swapped
from app.viewer.lessons.rotations.lesson import RotationsLesson
from app.viewer.lessons.rotations.typed import read_rotation
from app.viewer.server import ViewerServer
from kin import InputError, Robot
from kin.poses import roll_pitch_yaw
from kin.transforms import pose_from_position_wxyz
from kin.typed import EntryError
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
ROBOTS = CLASSICS
DEGREES, RADIANS = Units(), Units(degrees=False, length="m")
ANGLE = st.floats(-math.pi, math.pi)
TRIPLES = st.tuples(ANGLE, ANGLE, ANGLE)
QUARTERS = st.tuples(*[st.sampled_from([k * math.pi / 2 for k in range(-2, 3)])] * 3)
convention = pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.key)


def scipys(convention: Convention) -> str:
    """scipy's name: small letters for fixed axes."""
    return convention.axes if convention.fixed else convention.axes.upper()


# Conventions


def test_there_are_24_conventions_in_12_pairs() -> None:
    assert len(CONVENTIONS) == len({c.key for c in CONVENTIONS}) == len({c.title for c in CONVENTIONS}) == 24
    assert sum(c.is_proper for c in CONVENTIONS) == 12
    assert len({frozenset((c, c.twin)) for c in CONVENTIONS}) == 12


@convention
@settings(max_examples=15)
@given(angles=TRIPLES)
def test_rotations_and_angles_agree_with_scipy(convention: Convention, angles: Angles) -> None:
    R = convention.rotation(angles)
    assert np.allclose(R, Rotation.from_euler(scipys(convention), angles).as_matrix(), atol=1e-12)
    assert np.allclose(R, convention.twin.rotation(angles[::-1]), atol=1e-12)
    found = convention.angles(R)
    assert np.allclose(convention.rotation(found), R, atol=1e-7)
    assert np.allclose(convention.rotation(convention.other(found)), R, atol=1e-7)
    if convention.room(found) > 1e-4:
        assert np.allclose(found, Rotation.from_matrix(R).as_euler(scipys(convention)), atol=1e-9) or math.isclose(
            max(map(abs, found)), math.pi, abs_tol=1e-6
        )


@convention
@settings(max_examples=15)
@given(angles=QUARTERS)
def test_angles_at_gimbal_lock(convention: Convention, angles: Angles) -> None:
    R = convention.rotation(angles)
    found = convention.angles(R)
    assert np.allclose(convention.rotation(found), R, atol=1e-9)
    if convention.room(found) < 1e-9:
        assert found[0 if convention.fixed else 2] == 0.0
        first, _, third = convention.axes_now(found)
        assert abs(first @ third) == pytest.approx(1.0)


@convention
def test_axes_are_those_about_which_the_angles_turn(convention: Convention) -> None:
    angles = (0.4, 0.7, -1.1)
    R = convention.rotation(angles)
    for k, axis in enumerate(convention.axes_now(angles)):
        changed = list(angles)
        changed[k] += 1e-7
        spin = (convention.rotation((changed[0], changed[1], changed[2])) - R) / 1e-7 @ R.T
        assert np.allclose([spin[2, 1], spin[0, 2], spin[1, 0]], axis, atol=1e-6)


@given(angles=TRIPLES)
def test_the_page_uses_one_convention_everywhere(angles: Angles) -> None:
    R = PAGE.rotation(angles)
    assert np.allclose(R, kin.pose_from_xyz_rpy([0.0, 0.0, 0.0], angles)[:3, :3], atol=1e-12)
    shown = kin.pose_from_xyz_rpy([0.0, 0.0, 0.0], roll_pitch_yaw(R))
    assert np.allclose(PAGE.rotation(PAGE.angles(R)), shown[:3, :3], atol=1e-9)
    assert PAGE.name.startswith("Roll pitch yaw about fixed axes")


@given(angles=TRIPLES)
def test_axis_and_angle(angles: Angles) -> None:
    R = PAGE.rotation(angles)
    axis, angle = axis_angle(R)
    assert np.linalg.norm(axis) == pytest.approx(1.0)
    assert np.allclose(Rotation.from_rotvec(angle * axis).as_matrix(), R, atol=1e-9)


def test_no_turn_has_an_axis_too() -> None:
    axis, angle = axis_angle(np.eye(3))
    assert (axis.tolist(), angle) == ([0.0, 0.0, 1.0], 0.0)


# What is typed


def test_typed_rotations() -> None:
    expected = PAGE.rotation((0.1, 0.2, 0.3))
    degrees = ", ".join(repr(math.degrees(v)) for v in (0.1, 0.2, 0.3))
    wxyz = " ".join(map(repr, kin.wxyz_from_rotation(expected).tolist()))
    matrix = repr(expected.tolist())
    for text in (degrees, "0.1rad 0.2rad 0.3rad", wxyz, matrix):
        assert np.allclose(read_rotation(text, PAGE, DEGREES), expected, atol=1e-9), text
    assert np.allclose(read_rotation("0.1 0.2 0.3", PAGE, RADIANS), expected)
    moving = Convention("zyx", False)
    assert np.allclose(read_rotation("0.3 0.2 0.1", moving, RADIANS), expected)
    for text in ("", "1 2", "x 2 3", "1 1 1 1", "1 0 0 0 1 0 0 0 2"):
        with pytest.raises(EntryError):
            read_rotation(text, PAGE, DEGREES)


# Chains


def chain(own: bool) -> tuple[Motion, ...]:
    return (Motion(True, 2, math.pi / 2, own), Motion(False, 0, 0.3, own), Motion(True, 0, 0.4, own))


def test_own_axes_multiply_from_the_right_and_fixed_ones_from_the_left() -> None:
    for own in (True, False):
        motions = chain(own)
        A, B, C = (motion.matrix for motion in motions)
        assert np.allclose(places(motions)[-1], A @ B @ C if own else C @ B @ A)
        assert factors(motions) == ([0, 1, 2] if own else [2, 1, 0])
    # A shift along the own x after a quarter turn about z goes along the fixed y.
    assert places(chain(True))[2][:3, 3] == pytest.approx([0.0, 0.3, 0.0])
    assert places(chain(False))[2][:3, 3] == pytest.approx([0.3, 0.0, 0.0])


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 2), st.floats(-3, 3), st.booleans()), max_size=MOST))
def test_the_product_shown_is_the_frame_drawn(raw: list[tuple[bool, int, float, bool]]) -> None:
    motions = tuple(Motion(*each) for each in raw)
    T = np.eye(4)
    for k in factors(motions):
        T = T @ motions[k].matrix
    assert np.allclose(T, places(motions)[-1], atol=1e-9)
    assert from_json(json.loads(json.dumps(as_json(motions)))) == motions
    assert len(swapped(motions)) == len(motions)
    assert f'data-chain="{len(motions)}"' in views.chain_html(motions, DEGREES)


def test_links_with_other_chains_are_refused() -> None:
    good = [True, 0, 0.5, True]
    wrong: list[list[object]] = [[True, 3, 0.5, True], [1, 0, 0.5, True], [True, 0, math.nan, True]]
    wrong += [[False, 0, 99.0, True], [True, 0, "1", True], [True, True, 0.5, True], [True, 0, 0.5]]
    for value in (None, [good] * (MOST + 1), *([item] for item in wrong)):
        with pytest.raises(InputError, match="chain"):
            from_json(value)


def test_the_chain_in_words() -> None:
    html = views.chain_html(chain(True), DEGREES)
    for words in ("turn by 90.0° about the own z", "shift by 300.0 mm along the own x"):
        assert words in html
    assert "T = Rz(90.0°) · Tx(300.0 mm) · Rx(22.9°)" in html
    assert "T = Rx(22.9°) · Tx(300.0 mm) · Rz(90.0°)" in views.chain_html(chain(False), DEGREES)
    assert "Tx(0.3000 m)" in views.chain_html(chain(True), RADIANS)
    assert "they commute" in views.chain_html(chain(True), DEGREES), "a shift along x and a turn about x"
    apart = views.chain_html(chain(True)[:2], DEGREES)
    assert f"{300 * math.sqrt(2):.0f} mm and 0.0° away" in apart


def test_matrices_of_the_chain_are_inverse() -> None:
    html = views.chain_html(chain(True), DEGREES)
    T, back = (
        np.array([float(v.replace("−", "-")) for v in re.findall(r"<mn>([−\d.]+)</mn>", part)]).reshape(4, 4)
        for part in re.findall(r'data-matrix="\w+">(.*?)</div>', html, re.DOTALL)
    )
    T[:3, 3] /= 1e3
    back[:3, 3] /= 1e3
    assert np.allclose(T, places(chain(True))[-1], atol=6e-4)
    assert np.allclose(back, np.linalg.inv(places(chain(True))[-1]), atol=6e-4)


# Words and numbers


def test_all_forms_of_a_rotation_are_shown() -> None:
    zyz = Convention("zyz", False)
    angles = (math.radians(10.0), math.radians(20.0), math.radians(30.0))
    html = views.rotation_html(zyz, angles, DEGREES)
    R = Rotation.from_euler("ZYZ", [10, 20, 30], degrees=True)
    x, y, z, w = R.as_quat()
    assert f"{w:.3f}, {x:.3f}, {y:.3f}, {z:.3f}".replace("-", "−") in html
    assert "Z-Y-Z fixed with (30.0, 20.0, 10.0)°" in html
    assert "(−170.0, −20.0, −150.0)°" in html
    roll, pitch, yaw = R.as_euler("xyz", degrees=True)
    assert f"({roll:.1f}, {pitch:.1f}, {yaw:.1f})°".replace("-", "−") in html
    assert "R = Rz(yaw)·Ry(pitch)·Rx(roll)" in html
    assert f"{math.degrees(R.magnitude()):.1f}°" in html


def test_gimbal_lock_is_worded() -> None:
    for second, state in ((0.0, "far"), (85.0, "near"), (90.0, "at")):
        html = views.lock_html(PAGE, (0.3, math.radians(second), 0.1), DEGREES)
        assert f'data-lock="{state}"' in html
    assert "β = 0 or 180°" in views.lock_html(Convention("zxz", False), (0.3, 1.0, 0.1), DEGREES)
    assert "β = ±π/2" in views.lock_html(PAGE, (0.3, 0.5, 0.1), RADIANS)
    locked = views.rotation_html(PAGE, (0.3, math.pi / 2, 0.1), DEGREES)
    assert "infinitely many" in locked


@pytest.mark.parametrize("robot", arms_of("rotations"), ids=lambda robot: robot.id)
def test_numbers_of_the_questions(robot: Robot) -> None:
    outline = RotationsLesson.outline(robot, DEGREES)
    pose = outline.steps[0].pose
    assert pose is not None
    T = kin.fk(robot, np.array(pose.q))
    R, p = T[:3, :3], T[:3, 3]
    turn = Rotation.from_matrix(R)
    found = {k: q.answer for k, q in outline.questions() if isinstance(q, Number)}
    named = re.search(r"tool’s (\w) axis is at an angle of .* to the fixed (\w) axis", outline.steps[0].text)
    own, fixed = np.eye(3)[["xyz".index(name) for name in named.groups()]]  # type: ignore[union-attr]
    assert found["1"] == pytest.approx(fixed @ R @ own)
    i, j = (int(v) - 1 for v in re.findall(r"(?:row|column) (\d)", outline.steps[1].question.prompt))  # type: ignore[union-attr]
    assert found["2"] == pytest.approx(np.linalg.inv(R)[i, j])
    roll, pitch, yaw = roll_pitch_yaw(R)
    assert found["5"] == pytest.approx(pitch)
    assert np.allclose(kin.pose_from_xyz_rpy([0.0, 0.0, 0.0], (roll, pitch, yaw))[:3, :3], R, atol=1e-9)
    assert found["6"] == pytest.approx(math.acos(max(-1.0, min(1.0, R[2, 2]))), abs=1e-6)
    assert found["7"] == pytest.approx(turn.magnitude(), abs=1e-6)
    assert found["8"] == pytest.approx(math.cos(turn.magnitude() / 2.0), abs=1e-6)
    assert (abs(np.linalg.inv(T)[:3, 3] - found["10"]) < 1e-9).any()
    assert np.linalg.norm(np.linalg.inv(T)[:3, 3]) == pytest.approx(np.linalg.norm(p))


def test_the_order_of_two_turns() -> None:
    rights = {
        k: [o.text for o in q.options if o.right]
        for k, q in RotationsLesson.outline(arms_of("rotations")[0], DEGREES).questions()
        if isinstance(q, Choice)
    }
    z = Rotation.from_euler("ZX", [90, 90], degrees=True).as_matrix()[:, 2]
    assert np.allclose(z, [1.0, 0.0, 0.0], atol=1e-12)
    assert rights["3"] == ["Along +x"]
    same = Rotation.from_euler("zyx"[::-1], [0.3, 0.2, 0.1]).as_matrix()
    assert np.allclose(Convention("zyx", False).rotation((0.1, 0.2, 0.3)), same)
    assert rights["4"] == ["x by γ, then y by β, then z by α"]
    assert rights["11"] == ["T₀₁ T₁₂"]


# In a page


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, ServiceSettings(), Clouds())) as port:
        yield port


def turned(tab: FakeBrowser) -> np.ndarray:
    """The turned frame in the scene."""
    name = next(n for n in tab.nodes if n.startswith("/rotations") and n.endswith("/turned"))
    return pose_from_position_wxyz((0, 0, 0), tab.poses[name]["wxyz"])[:3, :3]


@pytest.mark.full
def test_a_visitor_turns_a_frame_and_builds_a_chain(server: int) -> None:
    robot = arms_of("rotations")[0]
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.open_lesson("Rotations and frames")
        tab.wait(lambda: 'data-lock="far"' in tab.html)
        tab.set("Angles", "Z-Y-Z moving")
        tab.wait(lambda: "R = Rz(α) Ry(β) Rz(γ)" in tab.html)
        for name, value in (("α about z", 10.0), ("β about y′", 20.0), ("γ about z″", 30.0)):
            tab.set(name, value)
        R = Rotation.from_euler("ZYZ", [10, 20, 30], degrees=True).as_matrix()
        tab.wait(lambda: np.allclose(turned(tab), R, atol=1e-3))
        tab.set("Use", "To target")
        at = kin.fk(robot, questions.example(robot))[:3, 3]
        tab.wait(lambda: np.allclose(tab.gizmo_pose()[:3], np.column_stack([R, at]), atol=1e-3))
        tab.set("Use", "From tool")
        tab.settle()
        tab.set("Rotation", "0 1 0 0")
        tab.set("Use", "Set")
        half = np.diag([1.0, -1.0, -1.0])
        tab.wait(lambda: np.allclose(turned(tab), half, atol=1e-3))
        tab.set("Rotation", "nonsense")
        tab.set("Use", "Set")
        tab.wait(lambda: "“nonsense” is not a number. Valid: 3 angles" in tab.html)
        tab.set("Show", "Chain of frames")
        tab.set("Chain", "Add")
        tab.wait(lambda: "turn by 90.0° about the own z" in tab.html)
        tab.set("Motion", "Shift along x")
        tab.set("Axes", "fixed axes")
        tab.set("Chain", "Add")
        tab.wait(lambda: "T = Tx(200.0 mm) · Rz(90.0°)" in tab.html)
        kept = tab.stored()
    memory = json.dumps({"address": "http://127.0.0.1/", "state": kept})
    with FakeBrowser(server, memory=memory) as tab:
        tab.wait(lambda: "T = Tx(200.0 mm) · Rz(90.0°)" in tab.html)
        tab.set("Radians", True)
        tab.wait(lambda: "Rz(1.571 rad)" in tab.html)
        tab.set("Chain", "Clear")
        tab.wait(lambda: "No motion yet" in tab.html)
        tab.set("Lesson", "None")
        tab.settle()
