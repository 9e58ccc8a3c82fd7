"""The visitor's own arm as data: compact, bounded, and refused where it is no arm."""

from __future__ import annotations

import base64
import json
import math
from dataclasses import replace
from unittest.mock import MagicMock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.shared.answers.inspection import inspect
from app.viewer.own_arm import DESCRIPTION, KEY, NAME, ROW_NAME, clean, label, own_arm, pack, unpack
from app.viewer.panel.robots import RobotMenu
from app.viewer.session.state import MAX_TEXT, PageState, decode, encode
from app.viewer.tabs.robot.presets import PRESETS
from kin import KinematicsError
from kin.calibration.chain import Chain
from kin.files.read import MAX_ROWS
from kin.robot import NominalTable
from tests.kin.calibration.simulated import random_errors

ROBOTS = tuple(kin.files.classic_robots().values())


def packed(said: object) -> str:
    return base64.urlsafe_b64encode(json.dumps(said).encode()).rstrip(b"=").decode()


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda r: r.id)
def test_every_arm_comes_back_bit_by_bit_from_its_compact_form(robot):
    own = own_arm(kin.robot_to_dict(robot), robot.id)
    back = unpack(json.loads(json.dumps(pack(own))))
    assert back == own
    assert back.robot.model.tobytes() == robot.model.tobytes()
    assert back.robot.home == robot.home
    assert len(json.dumps(pack(own), separators=(",", ":"))) < 2500


def test_an_arm_has_another_id_after_every_change():
    one = own_arm(PRESETS["planar-2r"])
    data = {**PRESETS["planar-2r"], "name": "Another"}
    assert one.robot.id.startswith(KEY)
    assert own_arm(PRESETS["planar-2r"]).robot.id == one.robot.id
    assert own_arm(data).robot.id != one.robot.id
    assert own_arm({**PRESETS["planar-2r"], "id": "ur5"}).robot.id == one.robot.id


@pytest.mark.parametrize("key", PRESETS)
def test_every_example_is_an_arm_with_a_regular_home(key):
    own = own_arm(PRESETS[key], key)
    assert unpack(pack(own)) == own
    assert label(own.robot) in ("My arm", f"My arm ({PRESETS[key]['name']})")
    assert not inspect(own.robot).singular_at_home


@pytest.mark.parametrize(("key", "robot_id"), [("planar-2r", "planar2r"), ("planar-3r", "planar3r")])
def test_the_planar_examples_are_the_arms_of_the_service(key, robot_id):
    own, builtin = own_arm(PRESETS[key], key).robot, kin.files.classic_robots()[robot_id]
    assert own.rows == builtin.rows
    assert own.name == builtin.name
    assert np.allclose(own.q_home, builtin.q_home, atol=1e-12)


def test_a_link_of_a_planar_example_with_its_former_lengths_still_opens():
    own = unpack({"n": "Planar 2R", "r": [[0, 0, 400, 0], [0, 0, 300, 0, [-150, 150]]], "from": "planar-2r"})
    assert own.start == "planar-2r"
    assert [row.a for row in own.robot.rows] == [0.4, 0.3]


def test_mounting_and_floor_are_in_the_link_and_arms_without_them_are_as_before():
    plain = own_arm(PRESETS["wrist-6r"])
    assert {"m", "z"}.isdisjoint(pack(plain))
    for mounting, floor in (("wall", -0.31), ("table", None), (None, 0.2)):
        robot = replace(plain.robot, mounting=mounting, floor=floor)
        own = own_arm(kin.robot_to_dict(robot))
        back = unpack(json.loads(json.dumps(pack(own))))
        assert back == own
        assert (back.robot.mounting, back.robot.floor) == (mounting, floor)
        assert back.robot.id != plain.robot.id


def test_motors_are_in_the_link_with_the_names_that_the_rows_have_now():
    so101 = kin.get_robot("so101")
    motors = [replace(motor, range=(740, 3331), sign=-1, offset=91.4) for motor in so101.motors]
    rows = [replace(so101.rows[0], name="shoulder\npan"), *so101.rows[1:]]
    data = kin.robot_to_dict(replace(so101, motors=motors))
    data["rows"][0]["name"] = rows[0].name
    data["motors"][0]["joint"] = rows[0].name
    own = own_arm(data)
    assert own.robot.motors == (replace(motors[0], joint="shoulder pan"), *motors[1:])
    back = unpack(json.loads(json.dumps(pack(own))))
    assert back == own
    assert back.robot.id != own_arm(kin.robot_to_dict(replace(so101, motors=()))).robot.id
    assert "o" not in pack(own_arm(PRESETS["wrist-6r"]))


@pytest.mark.parametrize("robot_id", ["ur5e", "so101", "panda", "palletiser"])
def test_a_calibrated_arm_keeps_its_nominal_table_in_the_link(robot_id):
    nominal = kin.get_robot(robot_id)
    chain = Chain(nominal)
    made = chain.robot_with(random_errors(chain, np.random.default_rng(2)))
    data = kin.robot_to_dict(replace(made, nominal=NominalTable(nominal.rows, nominal.tool)))
    own = own_arm(data, robot_id)
    assert own.robot.nominal_arm is not None
    back = unpack(json.loads(json.dumps(pack(own))))
    assert back == own
    assert own_arm(kin.robot_to_dict(replace(own.robot, nominal=None))).robot.id != own.robot.id
    before = data["rows"][0]["name"]
    for key in ("capsules", "capsules_source", "motors", "pendant"):
        data.pop(key, None)
    for row in (*data["rows"], *data["nominal"]["rows"]):
        for key in ("name", "follows"):
            if row.get(key) == before:
                row[key] = before + " x" * 60
    assert own_arm(data).robot.nominal_arm is not None, "rows whose names are cut are the same rows"


def test_a_page_with_an_own_arm_is_restored_from_its_link():
    own = own_arm(PRESETS["wrist-6r"], "wrist-6r")
    q = own.robot.random_q(np.random.default_rng(1))
    text = encode(PageState(own.robot.id, q, own=own, branch=kin.branch_names(own.robot)[0]))
    back = decode(text, ROBOTS)
    assert (back.robot, back.own, back.branch) == (own.robot.id, own, kin.branch_names(own.robot)[0])
    assert np.abs(back.q - q).max() < 1e-9
    assert encode(back) == text
    aside = decode(encode(PageState("ur5", own=own)), ROBOTS)
    assert (aside.robot, aside.own) == ("ur5", own)


def test_the_largest_arm_fits_a_link():
    row = {
        "kind": "prismatic",
        "theta": 0.1234567890123,
        "d": 1.23456789012,
        "a": 3.3333333333,
        "alpha": 0.7777777777,
    }
    rows = [{**row, "name": f"{i:02}" + "é" * 60, "limits": [-0.123456789, 0.234567891]} for i in range(MAX_ROWS)]
    data = {
        **PRESETS["planar-2r"],
        "rows": rows,
        "name": "n" * 500,
        "description": "d" * 3000,
        "source": "s" * 3000,
    }
    data.pop("home")
    own = own_arm(data)
    assert (len(own.robot.name), len(own.robot.description)) == (NAME, DESCRIPTION)
    assert all(len(joint.name) <= ROW_NAME for joint in own.robot.joints)
    text = encode(PageState(own.robot.id, own.robot.q_home, own=own, features={"w": {"x": "y" * 5000}}))
    assert len(text) <= MAX_TEXT
    assert decode(text, ROBOTS).own == own


GOOD = pack(own_arm(PRESETS["planar-2r"]))


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"r": []}, "rows"),
        ({"r": [[0, 0, 100, 0]] * 200}, "rows"),
        ({"r": "x" * 1000}, "rows"),
        ({"r": None}, "rows"),
        ({"r": [7]}, "rows[0]"),
        ({"r": [[0] * 10]}, "rows[0]"),
        ({"r": [{"theta": 1}]}, "rows[0]"),
        ({"r": [[0, 0, 0, 0], [0, 0, 0, 0]], "h": [0, 0]}, "reach"),
        ({"r": [[math.nan, 0, 100, 0]]}, "rows[0].theta"),
        ({"r": [[0, 1e308, 100, 0]]}, "rows[0].d"),
        ({"r": [[0, 0, 10**400, 0]]}, "rows[0].a"),
        ({"r": [[0, 0, 100, "1 m"]]}, "rows[0].alpha"),
        ({"r": [[0, 0, 100, True]]}, "rows[0].alpha"),
        ({"r": [[0, 0, 100, [1]]]}, "rows[0].alpha"),
        ({"r": [[0, 0, 100, 0, [20, 10]]]}, "rows[0].limits"),
        ({"r": [[0, 0, 100, 0, "none", "p"]]}, "rows[0].limits"),
        ({"r": [[0, 0, 100, 0, None, "q"]]}, "rows[0].kind"),
        ({"r": [[0, 0, 100, 0, None, "f"]]}, "rows"),
        ({"r": [[0, 0, 100, 0, None, "", "a"], [0, 0, 100, 0, None, "", "a"]]}, "rows[].name"),
        ({"r": [[0, 0, 100, 0, None, "", 7]]}, "rows[0].name"),
        ({"r": [[0, 0, 999_999, 0]] * 2, "u": "m"}, "reach"),
        ({"h": [0]}, "home.q"),
        ({"h": [1e5, 0]}, "home.q"),
        ({"u": "inch"}, "units.length"),
        ({"b": {"xyz": [5000000, 0, 0]}}, "base"),
        ({"b": {"xyz": [50000, 0, 0]}, "u": "m"}, "base.xyz"),
        ({"t": {"matrix": [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}}, "tool.matrix"),
        ({"t": 7}, "tool"),
        ({"m": "sky"}, "mounting"),
        ({"m": ["wall"]}, "mounting"),
        ({"z": math.inf}, "floor"),
        ({"z": "low"}, "floor"),
        ({"z": 2000, "u": "m"}, "floor"),
        ({"o": 7}, "motors"),
        ({"o": [7]}, "motors[0]"),
        ({"o": [[0] * 12]}, "motors[0]"),
        ({"o": [[9, 1]]}, "motors[0].joint"),
        ({"o": [[True, 1]]}, "motors[0].joint"),
        ({"o": [[0, 1, 3]]}, "motors[0].sign"),
        ({"o": [[0, 1], [1, 1]]}, "motors[1].id"),
        ({"o": [[0, 1, 1, math.inf]]}, "motors[0].offset"),
    ],
)
def test_what_is_no_arm_is_refused_by_field_and_the_rest_of_the_link_is_kept(changes, field):
    said = {"v": 1, "robot": KEY, "own": {**GOOD, **changes}, "units": "rad"}
    with pytest.raises(KinematicsError) as caught:
        unpack(said["own"])
    assert field in str(caught.value)
    state = decode(packed(said), ROBOTS)
    assert (state.robot, state.own) == (None, None)
    assert field in state.refused
    assert len(state.refused) < 400
    assert not state.units.degrees


@pytest.mark.parametrize("own", [7, "x", [], [GOOD], True, {"r": {}}, {}, {"n": 7, "r": [[0, 0, 1, 0]], "s": 3}])
def test_a_link_with_anything_else_is_decoded(own):
    state = decode(packed({"v": 1, "robot": KEY, "own": own}), ROBOTS)
    assert state.own is None
    assert state.refused


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
        lambda inner: (
            st.lists(inner, max_size=6) | st.dictionaries(st.sampled_from("nsicbturh"), inner, max_size=9)
        ),
        max_leaves=20,
    )
)
def test_decode_never_raises(own):
    decode(packed({"v": 1, "robot": KEY, "own": own}), ROBOTS)


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("  Bob's\n arm\t2 ", "Bob's arm 2"),
        ("<script>alert(1)</script>", "<script>alert(1)</script>"),
        ("\u202egnp.exe", "gnp.exe"),
        ("a\u200bb\u2066c", "abc"),
        ("ذراع", "ذراع"),
        ("x" * 4000, "x" * (NAME - 1) + "…"),
        ("\ud800", "My arm"),
        ("   ", "My arm"),
    ],
)
def test_a_name_is_one_line_of_visible_characters(name, shown):
    assert own_arm({**PRESETS["planar-2r"], "name": name}).robot.name == shown


def test_names_that_only_cutting_makes_equal_get_a_number():
    long = "robot_namespace_left_manipulator_arm_link_"
    rows = [{"a": 100, "name": f"{long}{i}"} for i in range(3)]
    taken = f"{long[: ROW_NAME - 3]}…_2"
    names = [
        joint.name for joint in own_arm({**PRESETS["one-joint"], "rows": rows, "home": {"q": [0] * 3}}).robot.rows
    ]
    assert names == [f"{long[: ROW_NAME - 1]}…", taken, f"{long[: ROW_NAME - 3]}…_3"]
    assert all(len(name) <= ROW_NAME for name in names)
    rows = [{"a": 100, "name": name} for name in ("", "joint 1", "joint\t1", "joint 1_2")]
    own = own_arm({**PRESETS["one-joint"], "rows": rows, "home": {"q": [0] * 4}})
    assert [joint.name for joint in own.robot.rows] == ["joint 1_3", "joint 1", "joint 1_4", "joint 1_2"]
    assert unpack(pack(own)) == own


@given(
    st.lists(st.text(max_size=3) | st.text("ab", min_size=39, max_size=42), min_size=1, max_size=8, unique=True)
)
def test_any_different_names_give_an_arm(names):
    rows = [{"a": 100, "name": name} for name in names]
    shown = [
        joint.name
        for joint in own_arm({**PRESETS["one-joint"], "rows": rows, "home": {"q": [0] * len(names)}}).robot.rows
    ]
    assert len(set(shown)) == len(names)
    assert all(name == clean(name, ROW_NAME) for name in shown)


@given(st.text(max_size=200))
def test_a_cleaned_text_stays_as_it_is(text):
    once = clean(text, NAME)
    assert len(once) <= NAME
    assert clean(once, NAME) == once
    once.encode()


def test_the_menu_offers_every_robot_whatever_its_name():
    robots = [
        replace(robot, name=name) for robot, name in zip(ROBOTS, ("My arm", "My arm", "Other"), strict=False)
    ]
    own = own_arm(PRESETS["one-joint"])
    gui = MagicMock()
    gui.add_dropdown.return_value._impl.removed = False
    menu = RobotMenu(gui, robots, own, robots[1], MagicMock())
    options = [f"My arm{end}" for end in ("", f" ({robots[1].id})")] + ["Other", f"My arm ({own.robot.id})"]
    for name, robot in zip(options, (*robots, own.robot), strict=True):
        assert menu.read(name) == robot
        menu.show(robot, own)


@pytest.mark.parametrize("robot_id", ["ur5", "panda", "puma560"])
def test_capsules_are_in_the_link(robot_id: str) -> None:
    robot = kin.get_robot(robot_id)
    own = own_arm(kin.robot_to_dict(robot), robot_id)
    assert own.robot.capsules == robot.capsules
    text = json.dumps(pack(own))
    assert len(text) < 3000
    again = unpack(json.loads(text))
    assert again == own
    assert again.robot.capsules_source == robot.capsules_source[: len(again.robot.capsules_source)]


def test_capsules_keep_their_rows_when_names_are_cut() -> None:
    data = kin.robot_to_dict(kin.get_robot("ur5"))
    long = {row["name"]: row["name"] + " " + "x" * 50 for row in data["rows"]}
    for row in [*data["rows"], *data["capsules"]]:
        key = "name" if "name" in row else "row"
        if key in row:
            row[key] = long[row[key]]
    own = own_arm(data)
    assert max(len(row.name) for row in own.robot.rows) <= 40
    assert [c.row for c in own.robot.capsules] == [c.row for c in kin.get_robot("ur5").capsules]


PLACE = [0, 0, 0, 0, 0, 0]
ODD = [
    *(5, [], [0] * 7, [0] * 10, [9, *PLACE, 1], [-2, *PLACE, 1], ["x", *PLACE, 1], [True, *PLACE, 1]),
    *([0, *PLACE, -1], [0, *PLACE, None], [0, "x", *PLACE[1:], 1]),
]


@pytest.mark.parametrize("capsule", ODD)
def test_malformed_capsules_of_a_link_are_refused_by_name(capsule: object) -> None:
    with pytest.raises(kin.KinematicsError, match=r"capsules\[0\]"):
        unpack({**GOOD, "k": [capsule]})


def test_too_many_capsules_of_a_link_are_refused() -> None:
    with pytest.raises(kin.KinematicsError, match="capsules"):
        unpack({**GOOD, "k": [[0, 0, 0, 0, 0, 0, 0, 1]] * 65})
