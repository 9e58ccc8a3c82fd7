"""Notations of rotations in the page: shown, typed as targets, and kept in links."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from fake_browser import FakeBrowser
from scipy.spatial.transform import Rotation

import kin
from app.viewer.panel.readout import html
from app.viewer.session.choices import ViewState
from app.viewer.session.state import PageState, decode, encode
from kin.poses import ANGLES, QUATERNIONS, Rotations, read_pose
from kin.typed import EntryError
from kin.units import Units

RANDOM = Rotation.random(20, rng=np.random.default_rng(7)).as_matrix()


@pytest.mark.parametrize("turned", [0.0, 0.3, -2.0])
def test_a_pose_with_coinciding_axes_reads_the_same_after_a_reload(turned: float) -> None:
    robot = kin.get_robot("puma560")
    q = robot.q_home + turned * np.eye(robot.n)[0]
    again = decode(encode(PageState(robot.id, q=q)), (robot,)).q
    assert again is not None
    for notations in (Rotations(angles, quaternion) for angles in ANGLES for quaternion in QUATERNIONS):
        before, after = (html(kin.fk(robot, values), Units(), rotations=notations) for values in (q, again))
        assert before == after
    assert abs(ANGLES["rpy"].values(kin.fk(robot, q)[:3, :3])[1] - math.pi / 2) < 1e-9, "roll and yaw coincide"


@pytest.mark.parametrize("angles", ANGLES)
@pytest.mark.parametrize("units", [Units(), Units(degrees=False, length="m")])
def test_a_pose_is_typed_as_it_is_shown(angles: str, units: Units) -> None:
    rotations = Rotations(angles, "xyzw")
    for R in RANDOM:
        for notation in (rotations.notation, rotations.quaternion):
            words = [
                repr(value * units.angles.scale if turn else value)
                for value, turn in zip(notation.values(R), notation.turns, strict=True)
            ]
            if notation is rotations.quaternion and len(rotations.notation.turns) == 4:
                T, _ = read_pose("quaternion", " ".join(words), units, np.eye(4), rotations)
            else:
                T, given = read_pose("pose", " ".join(("10", "0", "-20", *words)), units, np.eye(4), rotations)
                assert given == "pose"
                assert np.allclose(T[:3, 3] * units.lengths.scale, (10.0, 0.0, -20.0))
            assert np.allclose(T[:3, :3], R, atol=1e-12)


def test_a_pose_of_a_ur_arm_is_in_metres_and_radians_whatever_is_on_screen() -> None:
    T, given = read_pose("pose", " p[0.3, -0.2, 0.45, 0, 3.1415926535, 0]", Units(), np.eye(4))
    assert given == "pose"
    assert np.allclose(T[:3, 3], (0.3, -0.2, 0.45))
    assert np.allclose(T[:3, :3], np.diag([-1.0, 1.0, -1.0]), atol=1e-9)
    with pytest.raises(EntryError, match=r"Six numbers are needed for UR \(script\)"):
        read_pose("pose", "p[1, 2, 3]", Units(), np.eye(4))


@pytest.mark.parametrize(
    ("kind", "text", "rotations", "why"),
    [
        ("angles", "0 0 0 30", Rotations("axis"), "The axis has no length"),
        ("angles", "1 0 0", Rotations("axis"), "4 numbers are needed here"),
        ("quaternion", "1 1 0 0", Rotations("rpy", "xyzw"), "Not a unit quaternion"),
        ("pose", "1 2 3 4 5", Rotations("zyz"), "The target needs another count of numbers"),
        ("angles", "1 2 nan", Rotations("vector"), "The target was not changed"),
    ],
)
def test_what_is_wrong_is_said(kind: str, text: str, rotations: Rotations, why: str) -> None:
    with pytest.raises(EntryError) as caught:
        read_pose(kind, text, Units(), np.eye(4), rotations)  # type: ignore[arg-type]
    assert caught.value.title == why


@pytest.mark.full
def test_the_page_writes_and_reads_the_chosen_notation(port: int) -> None:
    ur5 = kin.get_robot("ur5")
    with FakeBrowser(port) as tab:
        tab.choose(ur5.name)
        tab.set("Rotations", "rotation vector")
        tab.set("Quaternions", "x y z w")
        tab.settle()
        assert "rx ry rz" in tab.html
        assert "x y z w" in tab.html
        tab.say("target", ["pose", "300 -200 400 0 90 0"])
        T = np.eye(4)
        T[:3, :3] = Rotation.from_rotvec([0.0, math.pi / 2, 0.0]).as_matrix()
        T[:3, 3] = 0.3, -0.2, 0.4
        tab.wait(lambda: np.allclose(tab.tool_pose(), T, atol=1e-6))
        tab.settle()
        tab.settle(0.8)
        state = decode(tab.kept[-1], (ur5,))
        assert state.view.rotations == Rotations("vector", "xyzw")
        assert decode(encode(state), (ur5,)).view == state.view
        tab.say("undo")
        tab.say("undo")
        tab.say("undo")
        tab.settle()
        assert "roll pitch yaw" in tab.html


def test_a_link_opens_with_the_notation_it_was_made_with(port: int) -> None:
    state = encode(PageState("ur5", view=ViewState(angles="zyz", quaternions="xyzw")))
    with FakeBrowser(port, memory=json.dumps({"address": "", "state": state})) as tab:
        tab.wait(lambda: "α β γ" in tab.html)
        tab.settle()
        assert "x y z w" in tab.html
        assert (tab.value("Rotations"), tab.value("Quaternions")) == ("Euler Z-Y-Z", "x y z w")
