"""The list of a program: what it plans, what a link keeps of it, and files."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.viewer.tabs.program import items as lists
from app.viewer.tabs.program.files import toml_of
from app.viewer.tabs.program.items import Item
from app.viewer.tabs.program.player import Player
from app.viewer.tabs.program.views import assumption
from kin import InputError
from kin.motion import limits_of
from kin.units import DEFAULT_UNITS

PIONEER, UR5, SCARA = (kin.get_robot(name) for name in ("pioneer5", "ur5", "scara"))
POSES = [PIONEER.q_home, PIONEER.clip(PIONEER.q_home + 0.2), PIONEER.clip(PIONEER.q_home - 0.3)]
ITEMS = (
    lists.waypoint(POSES[0]),
    Item("ptp", lists.waypoint(POSES[1]).q, speed=0.5, name="above “the” part"),
    Item("pause", seconds=0.5),
    lists.waypoint(POSES[2]),
)


def test_item_i_is_segment_i_of_the_program() -> None:
    motion = kin.plan_motion(PIONEER, lists.program_of(ITEMS, PIONEER, loop=False), ITEMS[0].q)
    assert [segment.kind for segment in motion.segments] == ["ptp", "ptp", "dwell", "ptp"]
    assert motion.segments[0].end == 0.0, "the first waypoint is where it starts"
    for item, segment in zip(ITEMS, motion.segments, strict=True):
        if item.q:
            assert np.allclose(motion.derivatives(segment.end)[0], item.q, atol=1e-9)
    back = kin.plan_motion(PIONEER, lists.program_of(ITEMS, PIONEER, loop=True), ITEMS[0].q)
    assert np.allclose(back.derivatives(back.duration)[0], ITEMS[0].q, atol=1e-9)
    assert len(back.segments) == 5


def test_a_line_is_straight() -> None:
    items = (lists.waypoint(UR5.q_home), replace(lists.waypoint(UR5.clip(UR5.q_home + 0.15)), kind="lin"))
    motion = kin.plan_motion(UR5, lists.program_of(items, UR5, loop=False), items[0].q)
    points = motion.sample(np.linspace(0.0, motion.duration, 50)).T[:, :3, 3]
    along = points[-1] - points[0]
    off = np.linalg.norm(np.cross(points - points[0], along / np.linalg.norm(along)), axis=1)
    assert off.max() < 1e-5
    assert lists.unpack(lists.pack(items), UR5) == items
    text = toml_of(lists.program_of(items, UR5, loop=False), "UR5")
    assert [item.kind for item in lists.items_of(kin.parse_program(text, UR5), UR5, UR5.q_home)] == ["ptp", "lin"]


@pytest.mark.parametrize("field", ["blend = 0.1", "acceleration = 0.5", "tool_speed = 0.1"])
def test_a_file_with_more_than_the_list_holds_is_refused(field: str) -> None:
    text = f"[[segments]]\nkind = 'ptp'\nq = {list(ITEMS[0].q)}\n{field}\n"
    with pytest.raises(InputError, match=field.split()[0]):
        lists.items_of(kin.parse_program(text, PIONEER), PIONEER, PIONEER.q_home)


names = st.text(max_size=60)


@given(
    st.lists(
        st.one_of(
            st.builds(
                lambda name, speed: Item("ptp", ITEMS[1].q, round(speed, 3), name=lists.clean(name, lists.NAME)),
                names, st.floats(0.01, 1.0),
            ),
            st.builds(
                lambda name, seconds: Item("pause", seconds=seconds, name=lists.clean(name, lists.NAME)),
                names, st.floats(0.0, 3600.0),
            ),
        ),
        min_size=1, max_size=8,
    )
)  # fmt: skip
def test_a_link_keeps_the_list(found: list[Item]) -> None:
    packed = json.loads(json.dumps(lists.pack(tuple(found))))
    assert lists.unpack(packed, PIONEER) == tuple(found)


ROW = ["p", [0, 0, 0, 0, 0]]


@pytest.mark.parametrize(
    "value",
    [
        None, {}, [], [1], [["p"]], [["p", [0, 0]]], [["p", [0, 0, 0, 0, True]]], [["p", [0, 0, 0, 0, "1"]]],
        [["p", [0, 0, 0, 0, float("nan")]]], [["p", [0, 0, 0, 0, 1e9]]], [[*ROW, 5]], [[*ROW, "", 0]],
        [[*ROW, "", 2]], [[*ROW, "", 1, 1]], [["w", -1]], [["w", 1e9]], [["w", True]], [["w", 1, 2]], [["x", 1]],
        [ROW] * (lists.MOST + 1), [ROW, ["w"]],
    ],
)  # fmt: skip
def test_what_is_no_list_is_ignored(value: object) -> None:
    assert lists.unpack(value, PIONEER) is None
    assert lists.unpack([ROW], PIONEER) is not None


def test_changes_of_a_list() -> None:
    a, b, c, d = ITEMS
    assert lists.moved(ITEMS, 0, 2) == (b, c, a, d)
    assert lists.moved(ITEMS, 3, 0) == (d, a, b, c)
    assert lists.removed(ITEMS, 1) == (a, c, d)
    assert lists.inserted(ITEMS, 4, a) == (*ITEMS, a)
    assert lists.changed(ITEMS, 0, name="x")[0].name == "x"


def test_typed_values() -> None:
    assert lists.value_of("speed", " 50 % ") == {"speed": 0.5}
    assert lists.value_of("seconds", "0,25 s") == {"seconds": 0.25}
    assert lists.value_of("name", "a\nb" + "x" * 100)["name"] == "a b" + "x" * 36 + "…"
    for field, text in (("speed", "0"), ("speed", "101"), ("speed", "nan"), ("seconds", "-1"), ("seconds", "x")):
        with pytest.raises(InputError):
            lists.value_of(field, text)


def test_a_file_holds_the_whole_program() -> None:
    program = lists.program_of(ITEMS, PIONEER, loop=False)
    text = toml_of(program, "Pioneer\narm")
    assert kin.parse_program(text, PIONEER) == program
    assert lists.items_of(kin.parse_program(text, PIONEER), PIONEER, PIONEER.q_home) == ITEMS


def test_a_file_of_poses_becomes_waypoints() -> None:
    T = kin.fk(PIONEER, POSES[1])
    program = kin.program_from_dict({"segments": [{"kind": "ptp", "pose": T.tolist()}]}, PIONEER)
    (item,) = lists.items_of(program, PIONEER, PIONEER.q_home)
    assert np.allclose(kin.fk(PIONEER, np.array(item.q)), T, atol=1e-6)
    far = kin.program_from_dict({"segments": [{"kind": "ptp", "position": [9, 9, 9]}]}, PIONEER)
    with pytest.raises(InputError, match="cannot be driven"):
        lists.items_of(far, PIONEER, PIONEER.q_home)


def test_the_player_keeps_time() -> None:
    player = Player(rate=2.0, playing=True)
    player.advance(0.5, 3.0)
    assert (player.time, player.playing) == (1.0, True)
    player.advance(5.0, 3.0)
    assert (player.time, player.playing) == (3.0, False)
    player = Player(time=2.5, loop=True, playing=True)
    player.advance(1.0, 3.0)
    assert (player.time, player.playing) == (0.5, True)
    player.go_to(-1.0, 3.0)
    assert player.time == 0.0


def test_assumed_limits_are_said() -> None:
    panda = kin.get_robot("panda")
    assert assumption(limits_of(panda), False, DEFAULT_UNITS) == ""
    said = assumption(limits_of(UR5), False, DEFAULT_UNITS)
    assert said.startswith("The maker publishes no ")
    assert "full acceleration after 0.1 s" in said
    assert assumption(limits_of(PIONEER), True, DEFAULT_UNITS).startswith("Your arm states no velocities,")
