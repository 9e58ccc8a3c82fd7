"""Workpiece frames of a page: named in the tab Robot, chosen above the read-out, kept in the link."""

from __future__ import annotations

import html
import json
import math
import re

import numpy as np
import pytest
from fake_browser import FakeBrowser
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.shared.store import Store
from app.viewer.frames import MOST, Frames, Workpiece, pack, unpack
from app.viewer.session.state import PageState, decode, encode

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, UR5 = STORE.get("pioneer5"), STORE.get("ur5")
TABLE = Workpiece("table", (0.1, 0.2, -0.3, 0.1, -0.2, 0.3))


def stored(state: PageState) -> str:
    return json.dumps({"state": encode(state)})


def shown(tab: FakeBrowser) -> list[float]:
    """x y z and roll pitch yaw of the read-out."""
    (content,) = [m["props"]["content"] for m in tab.gui.values() if "kb-readout" in m["props"].get("content", "")]
    texts = re.findall(r'class="kb-number">([^<]*)<', content)[:6]
    return [float(html.unescape(text).replace("−", "-")) for text in texts]


def offered(tab: FakeBrowser) -> tuple[list[str], str]:
    """The frames of the menu above the read-out, and the chosen one."""
    (content,) = [m["props"]["content"] for m in tab.gui.values() if "data-frame" in m["props"].get("content", "")]
    (chosen,) = re.findall(r'value="([^"]*)" selected', content)
    return re.findall(r'<option value="([^"]*)"', content), chosen


def say(tab: FakeBrowser, *key: object, value: object = None) -> None:
    tab.say("feature", ["robot", list(key), value])


def near(shown: list[float], T: np.ndarray) -> bool:
    rotation = kin.pose_from_xyz_rpy([0, 0, 0], np.radians(shown[3:]))
    same = np.allclose(rotation[:3, :3], T[:3, :3], atol=2e-3)
    return bool(np.allclose(shown[:3], 1000 * T[:3, 3], atol=0.051) and same)


def test_a_workpiece_is_added_named_placed_and_chosen(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        say(tab, "frame-add")
        tab.wait(lambda: offered(tab) == (["world", "base", "table"], "world"))
        at_tool = np.round(kin.fk(PIONEER, PIONEER.q_home)[:3, 3], 3)
        name = next(n for n, m in tab.nodes.items() if m["props"].get("text") == "table")
        assert np.allclose(tab.poses[name.rpartition("/")[0]]["position"], at_tool, atol=1e-9)
        for column, text in (
            ("name", "my <b>box</b>"),
            ("x", "100"),
            ("y", "20 cm"),
            ("z", "-300"),
            ("yaw", "pi/2"),
        ):
            say(tab, "cell", "frame-0", column, value=[0, text])
        tab.wait(lambda: "my <b>box</b>" in [html.unescape(name) for name in offered(tab)[0]])
        tab.say("frame", "my <b>box</b>")
        box = kin.pose_from_xyz_rpy([0.1, 0.2, -0.3], [0, 0, math.pi / 2])
        expected = np.linalg.solve(box, kin.fk(PIONEER, PIONEER.q_home))
        tab.wait(lambda: near(shown(tab), expected))
        assert "<b>box" not in "".join(m["props"].get("content", "") for m in tab.gui.values())
        say(tab, "frame-remove", value="0")
        tab.wait(lambda: offered(tab) == (["world", "base"], "world"))
        tab.wait(lambda: near(shown(tab), kin.fk(PIONEER, PIONEER.q_home)))
        tab.say("undo")
        tab.wait(lambda: len(offered(tab)[0]) == 3)


def test_typed_targets_are_in_the_frame_of_the_read_out_or_of_the_tool(port: int) -> None:
    state = PageState(robot="ur5", frames=Frames((TABLE,), "table"))
    T_table = kin.pose_from_xyz_rpy(TABLE.values[:3], TABLE.values[3:])
    with FakeBrowser(port, memory=stored(state)) as tab:
        tab.settle()
        assert offered(tab) == (["world", "base", "table"], "table")
        home = kin.fk(UR5, UR5.q_home)
        assert near(shown(tab), np.linalg.solve(T_table, home))
        goal = kin.fk(UR5, UR5.q_home + 0.1)
        matrix = np.linalg.solve(T_table, goal)
        tab.say("target", ["pose", " ".join(f"{v:.12f}" for v in matrix[:3].ravel()) + " m"])
        tab.wait(lambda: np.allclose(tab.tool_pose(), goal, atol=1e-6))
        tab.say("target", ["position", "0 0 -20", "tool"])
        ahead = goal @ kin.pose_from_xyz_rpy([0.0, 0.0, -0.02])
        tab.wait(lambda: np.allclose(tab.tool_pose(), ahead, atol=1e-6))
        tab.say("target", ["angles", "0 0 10", "tool"])
        turned = ahead @ kin.pose_from_xyz_rpy([0, 0, 0], [0, 0, math.radians(10)])
        tab.wait(lambda: np.allclose(tab.tool_pose(), turned, atol=1e-6))


def test_a_wrong_value_is_marked_and_the_frame_stays(port: int) -> None:
    state = PageState(robot="ur5", frames=Frames((TABLE, Workpiece("box", (0.0,) * 6))))
    with FakeBrowser(port, memory=stored(state)) as tab:
        tab.settle()
        for column, text, said in (
            ("x", "oops", "is not a number"),
            ("y", "2000 m", "at most 1000 m"),
            ("name", "box", "a name that no other frame has"),
            ("name", " ", "a name that no other frame has"),
        ):
            say(tab, "cell", "frame-0", column, value=[0, text])
            tab.wait(lambda said=said: said in html.unescape(tab.html))
        assert offered(tab)[0] == ["world", "base", "table", "box"]
        for wrong in (("cell", "frame-2", "x"), ("cell", "frame-0", "alpha")):
            say(tab, *wrong, value=[0, "1"])
            tab.wait(lambda: "a cell of a workpiece frame" in tab.html)
        say(tab, "frame-remove", value="2")
        tab.wait(lambda: "0 to 1" in tab.html)
        tab.say("frame", "desk")
        tab.wait(lambda: "one of world, base, table, box" in tab.html)


NAMES = st.text(max_size=30)
VALUES = st.lists(st.floats() | st.integers() | st.none() | st.text(max_size=3), max_size=8)


@given(
    st.lists(
        st.one_of(st.tuples(NAMES, VALUES).map(lambda row: [row[0], *row[1]]), st.integers(), NAMES), max_size=12
    )
)
def test_whatever_a_link_says_the_frames_are_valid(value: list[object]) -> None:
    frames = unpack(value)
    assert frames.shown in frames.names
    assert len(frames.workpieces) <= MOST
    assert len(set(frames.names)) == len(frames.names)
    assert all(np.isfinite(T).all() for T in frames.poses.values())
    assert unpack(pack(frames)) == Frames(
        tuple(Workpiece(each.name, tuple(round(v, 12) + 0.0 for v in each.values)) for each in frames.workpieces),
        frames.shown,
    )


def test_a_link_keeps_the_frames() -> None:
    frames = Frames((TABLE, Workpiece("Kiste", (1.0, 0.0, 0.0, 0.0, 0.0, math.pi))), "Kiste")
    found = decode(encode(PageState(robot="ur5", frames=frames)), STORE.robots).frames
    assert [each.name for each in found.workpieces] == ["table", "Kiste"]
    assert np.allclose(found.poses["Kiste"], frames.poses["Kiste"], atol=1e-9)
    assert found.shown == "Kiste"
    full = Frames()
    for _ in range(MOST):
        full = full.add(np.zeros(3))
    assert len(full.names) == MOST + 2
