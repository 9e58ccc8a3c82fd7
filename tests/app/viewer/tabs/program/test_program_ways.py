"""*Find a way* in a page: waypoints around an obstacle, cancelled, not found, refused, undone."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import program_page
import pytest
from fake_browser import FakeBrowser
from program_page import press
from versions import needs_ompl

import kin
from app.shared.store import Store
from app.viewer.session.choices import ViewState
from app.viewer.session.state import PageState, decode, encode
from app.viewer.tabs.program import ways
from app.viewer.tabs.program.program import MOST, recorded
from kin.motion import Circ, Dwell, Ptp

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

ROBOTS = Store().robots
UR5, PLANAR = kin.get_robot("ur5"), kin.get_robot("planar2r")
# The first link of the arm with two joints cannot leave the half between these posts.
START, GOAL = (0.0, 0.3), (np.pi / 2, 0.3)
POSTS = tuple(
    kin.Obstacle("sphere", (0.3 * np.cos(a), 0.3 * np.sin(a), 0.0), radius=0.05, name="post")
    for a in (np.pi / 4, -3 * np.pi / 4)
)
DURATION = 40.0  # s of a search that is cancelled: longer than anything here takes


def opened(robot: kin.Robot, obstacles: tuple[kin.Obstacle, ...], rows: list[list[object]]) -> str:
    """The memory of a page with obstacles and a program."""
    program = {"programs": {robot.id: rows}}
    state = PageState(robot.id, obstacles=obstacles, features={"program": program})
    return json.dumps({"address": "http://a/", "state": encode(state)})


def part(tab: FakeBrowser, name: str) -> str:
    return html.unescape(program_page.part(tab, name))


def rows(tab: FakeBrowser) -> int:
    return part(tab, "list").count("data-program-item")


@pytest.fixture
def blocked(port: int) -> Iterator[FakeBrowser]:
    """A page whose program has no way to its second waypoint."""
    with FakeBrowser(port, memory=opened(PLANAR, POSTS, [["p", START], ["p", GOAL]])) as tab:
        tab.wait(lambda: rows(tab) == 2)
        yield tab


def around_a_post() -> tuple[np.ndarray, np.ndarray, kin.Obstacle]:
    """Start, goal, and a post between them, for the UR5."""
    start, goal = UR5.q_home.copy(), UR5.q_home.copy()
    goal[0] += 2.2
    x, y, z = kin.fk(UR5, 0.5 * (start + goal))[:3, 3].tolist()
    return start, goal, kin.Obstacle("box", (x, y, z), size=(0.12, 0.12, 0.9), name="post")


@needs_ompl
def test_a_way_around_a_post_is_put_into_the_program_in_one_step(port: int) -> None:
    start, goal, post = around_a_post()
    line = ["p", [round(value, 7) for value in goal.tolist()], "above", 0.5]
    with FakeBrowser(port, memory=opened(UR5, (post,), [["p", start.tolist()], ["w", 0.5], line])) as tab:
        tab.wait(lambda: rows(tab) == 3)
        assert "touches post" in part(tab, "summary")
        assert 'data-program-do="way" data-index="2"' in part(tab, "summary")
        press(tab, "way", 2)
        assert "Puts waypoints between 1 and 3, so that the arm does not touch itself or the obstacle" in part(
            tab, "way"
        )
        press(tab, "way-seed", value="3")
        press(tab, "way-seconds", value="60")
        press(tab, "search")
        tab.wait(lambda: rows(tab) > 3)
        assert part(tab, "way") == ""
        assert "touches" not in part(tab, "summary")
        assert "A way to 3 was found" in html.unescape(tab.html)
        tab.wait(lambda: bool(tab.kept) and len(programs(tab)) > 3)
        found = programs(tab)
        assert found[0].target.q == pytest.approx(start.tolist())
        assert found[1] == Dwell(0.5)
        assert (found[-1].target.q, found[-1].name) == (pytest.approx(goal.tolist()), "above")
        assert all(row.speed == 0.5 for row in found[2:])
        motion = kin.plan_motion(UR5, found[2:], start)
        q = motion.derivatives(np.linspace(0.0, motion.duration, 2000))[0]
        assert kin.clearance(UR5, q, [post]).min() > -1e-7
        tab.wait(lambda: tab.script["undo"] == "Find a way")
        tab.say("undo")
        tab.wait(lambda: rows(tab) == 3)


def programs(tab: FakeBrowser) -> tuple[Any, ...]:
    """The rows of the only program in the page's link."""
    (found,) = decode(tab.kept[-1], ROBOTS).features["program"]["programs"].values()  # type: ignore[union-attr]
    return kin.motion.program_from_dict(found, UR5).segments


@needs_ompl
def test_none_found_in_time_is_not_called_none_and_loses_nothing(blocked: FakeBrowser) -> None:
    press(blocked, "way", 1)
    press(blocked, "way-seconds", value="0.1")
    press(blocked, "search")
    blocked.wait(lambda: "None was found in 0.1 s. That does not mean that there is none" in part(blocked, "way"))
    assert rows(blocked) == 2
    assert 'value="0.1"' in part(blocked, "way"), "it can be searched again"
    press(blocked, "way-seconds", value=f"{DURATION:g}")
    press(blocked, "way-seed", value="7")
    blocked.settle()
    assert "<progress" not in part(blocked, "way"), "on a press alone"
    assert "None was found in 0.1 s" in part(blocked, "way")
    press(blocked, "close-way")
    assert part(blocked, "way") == ""


@pytest.mark.full
@needs_ompl
def test_a_search_shows_its_progress_and_is_cancelled(blocked: FakeBrowser) -> None:
    press(blocked, "way", 1)
    press(blocked, "way-seconds", value=f"{DURATION:g}")
    press(blocked, "search")
    assert f"Searching for at most {DURATION:g} s" in part(blocked, "way")

    def share() -> float:
        return float(re.findall(r'<progress max="1" value="([\d.]+)"', part(blocked, "way"))[0])

    blocked.wait(lambda: share() > 0.0)
    press(blocked, "search")  # a second press does nothing
    assert "Searching" in part(blocked, "way")
    press(blocked, "close-way")
    assert "<progress" not in part(blocked, "way")
    assert "Find a way</button>" in part(blocked, "way")
    press(blocked, "search")
    assert share() < 0.5, "the next one begins at once"
    press(blocked, "delete", 1)
    assert part(blocked, "way") == "", "another program has another way"
    assert rows(blocked) == 1


@needs_ompl
@pytest.mark.parametrize("lapses", ["row", "obstacle"])
def test_a_search_that_has_lapsed_does_not_begin_again_with_undo(blocked: FakeBrowser, lapses: str) -> None:
    press(blocked, "way", 1)
    press(blocked, "way-seconds", value=f"{DURATION:g}")
    press(blocked, "search")
    assert "<progress" in part(blocked, "way")
    if lapses == "row":
        press(blocked, "delete", 1)
    else:
        blocked.say("feature", ["obstacles", ["add", "sphere", 1], None])
    blocked.wait(lambda: part(blocked, "way") == "")
    blocked.say("undo")
    blocked.wait(lambda: rows(blocked) == 2 and not blocked.script["undo"])
    blocked.settle()
    assert part(blocked, "way") == ""


@needs_ompl
@pytest.mark.parametrize(
    ("name", "text", "valid"),
    [
        ("way-seconds", "0", "Valid: 0.1 to 60 s"),
        ("way-seconds", "nan", "Valid: 0.1 to 60 s"),
        ("way-seconds", "1e9", "Valid: 0.1 to 60 s"),
        ("way-seed", "-1", "Valid: a whole number from 0 to 4294967295."),
        ("way-seed", "1.5", "Valid: a whole number from 0 to 4294967295."),
        ("way-seed", "x" * 5000, "Valid: a whole number from 0 to 4294967295."),
    ],
)
def test_what_cannot_be_a_time_limit_or_a_seed_is_refused(
    blocked: FakeBrowser, name: str, text: str, valid: str
) -> None:
    press(blocked, "way", 1)
    press(blocked, name, value=text)
    blocked.wait(lambda: valid in html.unescape(blocked.html))
    assert 'value="5"' in part(blocked, "way")
    assert 'value="0"' in part(blocked, "way")


@pytest.mark.full
@needs_ompl
def test_a_waypoint_inside_an_obstacle_and_a_start_that_touches_are_answers(port: int) -> None:
    goal = UR5.q_home.copy()
    goal[0] += 1.0
    ball = kin.Obstacle("sphere", kin.fk(UR5, goal)[:3, 3].tolist(), radius=0.1, name="ball")
    program = [["p", UR5.q_home.tolist()], ["p", goal.tolist()], ["p", UR5.q_home.tolist()]]
    with FakeBrowser(port, memory=opened(UR5, (ball,), program)) as tab:
        tab.wait(lambda: rows(tab) == 3)
        for index, words in (
            (1, "The goal touches something: link 6 touches ball."),
            (2, "The start touches something"),
        ):
            press(tab, "way", index)
            press(tab, "search")
            tab.wait(lambda words=words: words in part(tab, "way"))  # type: ignore[misc]
        press(tab, "way", 0)
        assert part(tab, "way") == "", "nothing leads to the start"
        assert rows(tab) == 3


@needs_ompl
def test_units_that_are_changed_while_a_search_goes_on_neither_end_it_nor_lose_anything(port: int) -> None:
    start, goal, post = around_a_post()
    line = ["p", goal.tolist(), "above", 1.0, {"v": 0.25}]
    with FakeBrowser(port, memory=opened(UR5, (post,), [["p", start.tolist()], line])) as tab:
        tab.wait(lambda: rows(tab) == 2)
        press(tab, "choose", 1)
        assert 'value="250"' in part(tab, "list")
        press(tab, "way", 1)
        press(tab, "way-seconds", value="60")
        press(tab, "way-seed", value="3")
        press(tab, "search")
        tab.set("Lengths", "m")
        tab.set("Radians", True)
        tab.wait(lambda: 'value="0.25"' in part(tab, "list"))
        tab.wait(lambda: rows(tab) > 2)
        assert "A way to 2 was found" in html.unescape(tab.html)
        assert "touches" not in part(tab, "summary")
        tab.wait(lambda: bool(tab.kept) and len(programs(tab)) > 2)
        found = programs(tab)
        assert found[-1].target.q == pytest.approx(goal.tolist())
        assert [row.tool_speed for row in found[1:]] == [0.25] * (len(found) - 1)
        assert f'value="{goal[0]:.5f}"' in part(tab, "list"), "joint values in radians"


@pytest.mark.full
@needs_ompl
def test_units_that_are_changed_while_a_form_is_open_leave_what_was_typed(blocked: FakeBrowser) -> None:
    press(blocked, "way", 1)
    press(blocked, "way-seconds", value=f"{DURATION:g}")
    press(blocked, "way-seed", value="7")
    press(blocked, "search")
    blocked.set("Radians", True)
    blocked.settle()
    assert "Searching for at most" in part(blocked, "way"), "it goes on"
    press(blocked, "close-way")
    assert f'value="{DURATION:g}"' in part(blocked, "way")
    assert 'value="7"' in part(blocked, "way")


def test_with_collisions_avoided_a_start_that_touches_and_a_goal_inside_keep_the_program(port: int) -> None:
    goal = UR5.q_home.copy()
    goal[0] += 1.0
    for q, where, driven in ((UR5.q_home, "at its start", False), (goal, "on the way to 3 of 3", True)):
        ball = kin.Obstacle("sphere", kin.fk(UR5, q)[:3, 3].tolist(), radius=0.05, name="ball")
        near = UR5.q_home + np.array([-0.8, 0.0, 0.0, 0.0, 0.0, 0.0])
        program = [["p", UR5.q_home.tolist()], ["p", near.tolist()], ["p", goal.tolist()]]
        features = {"program": {"programs": {"ur5": program}}}
        state = PageState("ur5", q=near, view=ViewState(avoid=True), obstacles=(ball,), features=features)
        memory = json.dumps({"address": "http://a/", "state": encode(state)})
        with FakeBrowser(port, memory=memory) as tab:
            tab.wait(lambda: rows(tab) == 3)
            index = 2 if driven else 0
            items = part(tab, "list").split("<li")[1:]
            assert ["touches ball" in item for item in items] == [i == index for i in range(3)]
            assert ("Find a way…" in items[index]) == driven, "nothing leads to the start"
            assert ('aria-disabled="true" aria-label="Play"' in part(tab, "player")) != driven
            press(tab, "field", 1, value=["speed", "50"])
            tab.wait(lambda where=where: f"The program ends {where}" in html.unescape(tab.html))  # type: ignore[misc]
            assert rows(tab) == 3


def test_where_the_search_is_not_installed_the_page_says_how_to_install_it(
    blocked: FakeBrowser, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kin.way.is_installed", lambda: False)
    press(blocked, "way", 1)
    assert "The search needs the package ompl" in part(blocked, "way")
    assert "<code>pip install 'kinboard[ways]'</code>" in part(blocked, "way")
    press(blocked, "search")
    assert "<progress" not in part(blocked, "way")


@needs_ompl
def test_without_obstacles_there_is_nothing_to_go_around(port: int) -> None:
    with FakeBrowser(port, memory=opened(PLANAR, (), [["p", START], ["p", GOAL]])) as tab:
        tab.wait(lambda: rows(tab) == 2)
        press(tab, "way", 1)
        assert "There is nothing that the arm could touch" in part(tab, "way")
        assert 'data-program-do="search" aria-disabled="true"' in part(tab, "way")


@needs_ompl
def test_a_way_that_has_no_room_in_the_program_is_said(port: int) -> None:
    start, goal, post = around_a_post()
    program = [["p", start.tolist()]] * (MOST - 1) + [["p", goal.tolist()]]
    with FakeBrowser(port, memory=opened(UR5, (post,), program)) as tab:
        tab.wait(lambda: rows(tab) == MOST)
        press(tab, "way", MOST - 1)
        press(tab, "way-seconds", value="60")
        press(tab, "search")
        tab.wait(lambda: "The way has too many waypoints" in part(tab, "way"))
        assert rows(tab) == MOST


def test_a_line_to_the_end_of_a_way_becomes_a_ptp_and_the_arm_stops_at_both_ends() -> None:
    a, b, c, d = (Ptp(recorded(np.array([k, 0.0]))) for k in range(4))
    arc = Circ((1.0, 0.0, 0.0), c.target, blend=0.1)
    found = ways.with_way((a, replace(b, blend=0.05), Dwell(1.0), arc, d), 1, 3, [d], c)
    assert found == (a, b, Dwell(1.0), d, c, d)
