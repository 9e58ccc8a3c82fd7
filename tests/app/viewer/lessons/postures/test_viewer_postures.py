"""The lesson "Postures": the list, the ghosts, causes and remedies of a missed target, the cone of directions."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np
import pytest
from arms import CLASSICS, eight_joints
from fake_browser import FakeBrowser

import kin
from app.shared.store import Store
from app.viewer.lessons.postures import remedies
from app.viewer.lessons.postures.directions import has_cone, patch, reachable, share, sphere
from app.viewer.lessons.postures.remedies import Remedy, Request
from app.viewer.panel.joints import label
from app.viewer.panel.posture import short
from app.viewer.postures.survey import Posture, html, limit_margin, survey
from app.viewer.scene.chain import chain, link_poses
from app.viewer.skeleton import places, skeleton
from kin.units import DEFAULT_UNITS, Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, SRS, PUMA, PANDA, STANFORD = (
    STORE.get(name) for name in ("pioneer5", "redundant7-craig", "puma560", "panda", "stanford")
)
SOME = (PIONEER, PUMA, STANFORD)


def home(robot: kin.Robot) -> np.ndarray:
    return kin.fk(robot, robot.q_home)


# The list


@pytest.mark.parametrize("robot", SOME, ids=lambda robot: robot.id)
def test_the_list_agrees_with_the_core_for_every_branch(robot: kin.Robot) -> None:
    T = home(robot)
    task: kin.ik.Task = "approach" if robot.n < 6 else "pose"
    found = survey(robot, T, kin.IKOptions(task=task), robot.q_home)
    assert tuple(p.name for p in found) == kin.branch_names(robot)
    blocked = 0
    for posture in found:
        alone = kin.solve_ik(robot, T, task=task, q_seed=robot.q_home, branch=posture.name)
        if posture.state == "reachable":
            assert alone.status == "solved"
            assert posture.q is not None
            assert np.allclose(kin.fk(robot, posture.q)[:3, 3], T[:3, 3], atol=1e-9)
            assert kin.branch_of(robot, posture.q) == posture.name
            assert posture.manipulability == pytest.approx(float(kin.manipulability(robot, posture.q)))
            assert 0.0 <= posture.share <= 1.0
        elif posture.state == "blocked":
            blocked += 1
            assert alone.status == "limits"
            numbers = {str(v.joint + 1) for v in alone.violations}
            (joint,) = re.findall(r"outside limit of joint (\d)", posture.words)
            assert joint in numbers
            assert posture.q is not None
            assert not robot.in_limits(posture.q, 1e-9)
        else:
            assert alone.status == "unreachable"
    assert blocked > 0
    assert any(p.state == "reachable" for p in found)


def test_the_excess_over_a_limit_follows_the_units() -> None:
    found = survey(PIONEER, home(PIONEER), kin.IKOptions(task="approach"), PIONEER.q_home)
    worst = next(p for p in found if p.state == "blocked")
    assert worst.q is not None
    over = np.maximum(worst.q - PIONEER.upper, PIONEER.lower - worst.q).max()
    assert f"by {math.degrees(over):.1f}°" in worst.words
    radians = survey(
        PIONEER, home(PIONEER), kin.IKOptions(task="approach"), PIONEER.q_home, units=Units(degrees=False)
    )
    assert f"by {over:.3f} rad" in next(p for p in radians if p.name == worst.name).words


@pytest.mark.parametrize("length", ["cm", "m"])
def test_the_distance_to_a_missed_target_follows_the_units(length: str) -> None:
    units, T = Units(length=length), home(PUMA)
    T[0, 3] += 2.0
    result = kin.solve_ik(PUMA, T, q_seed=PUMA.q_home)
    why = remedies.html(result, None, units)
    assert f" by {units.distance(result.distance)}" in why
    assert "mm" not in why
    found = remedies.remedies(Request(PUMA, T, kin.IKOptions(task="position"), PUMA.q_home, result), units)
    (move,) = [fix for fix in found if fix is not None and fix.kind == "move"]
    assert re.search(rf" \d+\.\d+ {length} away$", move.hint)


def test_a_blocking_lock_is_reported_as_a_lock() -> None:
    T = home(PUMA)
    other = next(s for s in kin.solve_ik(PUMA, T).solutions if abs(s.q[0] - PUMA.q_home[0]) > 0.5)
    locked = (float(PUMA.q_home[0]), *(None,) * 5)
    found = survey(PUMA, T, kin.IKOptions(constraints=kin.JointConstraints(locked=locked)), PUMA.q_home)
    assert "joint 1 is locked" in next(p for p in found if p.name == other.branch).words


def test_a_compromise_names_its_error() -> None:
    T = home(PIONEER)
    T[:3, :3] = T[:3, :3] @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    found = survey(PIONEER, T, kin.IKOptions(), PIONEER.q_home)
    assert any(p.state == "compromise" and p.words == "roll off by 90.0°" for p in found)


def test_the_margin_is_the_distance_to_the_nearest_limit() -> None:
    q = PIONEER.q_home.copy()
    q[3] = PIONEER.upper[3] - 0.02
    assert limit_margin(PIONEER, q) == (pytest.approx(0.02), 3)


def test_an_arm_without_named_branches_lists_the_nearest_posture() -> None:
    longer = eight_joints(PANDA)
    (only,) = survey(longer, home(longer), kin.IKOptions(), longer.q_home)
    assert only.available
    assert f'data-posture="{only.name}"' in html(longer, (only,), only.name, frozenset(), DEFAULT_UNITS)
    far = home(longer)
    far[:3, 3] *= 5
    assert [p.state for p in survey(longer, far, kin.IKOptions(), longer.q_home)] == ["absent"]


def test_the_row_of_the_list_is_escaped_and_marked() -> None:
    hostile = Posture("shoulder <b> · elbow up", "blocked", "beyond <i>")
    text = html(PIONEER, (hostile,), hostile.name, frozenset(), DEFAULT_UNITS)
    assert "<b> ·" not in text
    assert "<i>" not in text
    assert "data-here" in text


# Ghosts


@pytest.mark.parametrize("robot", CLASSICS, ids=lambda robot: robot.id)
def test_ghosts_are_posed_as_the_arm_would_be(robot: kin.Robot) -> None:
    q = robot.random_q(np.random.default_rng(3), 4)
    frames = link_poses(robot, q)
    assert np.allclose(frames[:, -1] @ chain(robot).T_last_tool, kin.fk(robot, q), atol=1e-12)
    positions, wxyz, anchors = places(robot, q)
    assert positions.shape == (4, len(skeleton(robot).links), 3)
    assert wxyz.shape == (4, len(skeleton(robot).links), 4)
    assert anchors.shape == (4, 3)


# Causes and remedies


def remedies_for(
    robot: kin.Robot, T: np.ndarray, task: kin.ik.Task = "pose", locked=None, branch=None
) -> list[Remedy]:
    target = T[:3, 3] if task == "position" else T
    q = robot.q_home
    options = kin.IKOptions(task=task, constraints=kin.JointConstraints(locked=locked), branch=branch)
    result = kin.ik.solve(robot, target, options, q)
    return [remedy for remedy in remedies.remedies(Request(robot, T, options, q, result)) if remedy is not None]


def test_a_reached_target_has_no_remedies() -> None:
    assert remedies_for(SRS, home(SRS)) == []


def test_the_only_remedy_for_a_point_out_of_reach_is_moving_it() -> None:
    T = home(SRS)
    T[:3, 3] *= 3
    (fix,) = remedies_for(SRS, T)
    assert fix.kind == "move"
    assert fix.q is not None
    assert np.linalg.norm(kin.fk(SRS, fix.q)[:3, 3]) < np.linalg.norm(T[:3, 3])


def test_an_impossible_orientation_can_be_turned_or_the_task_reduced() -> None:
    T = home(PUMA)
    T[:3, 3] = (0.75, 0.0, 0.2)
    T[:3, :3] = [[0, 0, -1], [0, 1, 0], [1, 0, 0]]
    result = kin.solve_ik(PUMA, T, q_seed=PUMA.q_home)
    assert result.status == "orientation"
    fixes = {fix.kind: fix for fix in remedies_for(PUMA, T)}
    assert fixes["relax"].task == "position"
    turned = fixes["turn"].q
    assert turned is not None
    assert np.allclose(kin.fk(PUMA, turned)[:3, 3], T[:3, 3], atol=1e-6)
    assert "move" in fixes


def test_a_blocking_lock_and_a_blocking_branch_are_named() -> None:
    T = home(PUMA)
    T[:3, 3] += (0.0, 0.08, 0.0)
    locked = (float(PUMA.q_home[0]), *(None,) * 5)
    kinds = [(fix.kind, fix.joint) for fix in remedies_for(PUMA, T, locked=locked)]
    assert kinds[0] == ("unlock", 0)
    blocked = next(p for p in survey(PUMA, home(PUMA), kin.IKOptions(), PUMA.q_home) if p.state == "blocked")
    assert remedies_for(PUMA, home(PUMA), branch=blocked.name)[0].kind == "branch"


def test_locks_that_block_only_jointly_are_unlocked_together() -> None:
    T = home(PUMA)
    T[:3, 3] += (0.05, 0.08, 0.02)
    locked = tuple(PUMA.q_home.tolist()[:3]) + (None,) * 3
    fixes = [fix for fix in remedies_for(PUMA, T, locked=locked) if fix.kind == "unlock"]
    assert [fix.joint for fix in fixes] == [None]


# The cone


def test_the_cone_contains_the_directions_that_the_solver_reaches() -> None:
    point = home(PIONEER)[:3, 3]
    mask = reachable(PIONEER, point)
    assert 0.0 < share(mask) < 0.5
    rng = np.random.default_rng(2)
    picked = np.concatenate([np.flatnonzero(mask)[:15], rng.choice(np.flatnonzero(~mask), 15)])
    for i in picked:
        T = sphere().frames[i].copy()
        T[:3, 3] = point
        solved = kin.solve_ik(PIONEER, T, task="approach").status == "solved"
        assert solved == mask[i]
    vertices, faces = patch(mask)
    assert np.allclose(np.linalg.norm(vertices, axis=1), 1.0)
    assert faces.max() == len(vertices) - 1
    assert len(patch(np.zeros_like(mask))[1]) == 0
    assert [robot.id for robot in CLASSICS if has_cone(robot)] == ["pioneer5"]


# In the page


@pytest.fixture
def tab(port: int) -> Iterator[FakeBrowser]:
    with FakeBrowser(port) as opened:
        opened.set("Lesson", "Postures")
        opened.say("feature", ["guide", ["go", 1], 10])  # the check; the questions before withhold the postures
        opened.wait(lambda: "data-posture" in opened.html)
        opened.settle()
        yield opened


def rows(tab: FakeBrowser) -> dict[str, str]:
    return dict(re.findall(r'data-posture="([^"]*)" data-state="([^"]*)"', tab.html))


def here(tab: FakeBrowser) -> str:
    (found,) = re.findall(r'data-posture="([^"]*)" data-state="[^"]*" data-here', tab.html)
    return found


def q_of(tab: FakeBrowser, robot: kin.Robot) -> np.ndarray:
    return np.radians([tab.value(label(robot, i)) for i in range(robot.n)])


def ghosts(tab: FakeBrowser) -> dict[str, str]:
    """The node of each ghost, by its number."""
    return {n.rsplit("/", 1)[1]: n for n, m in tab.nodes.items() if m["type"] == "BatchedMeshesMessage"}


def shown(tab: FakeBrowser) -> set[str]:
    """The numbers of the ghosts that are seen: they are below a node that is hidden with all of them."""
    found = ghosts(tab).items()
    return {number for number, name in found if tab.visible.get(name) and tab.visible[name.rpartition("/")[0]]}


def grab_to(tab: FakeBrowser, T: np.ndarray) -> None:
    tab.grab()
    tab.drag(T)
    tab.release()
    tab.settle(0.6)


def test_the_list_marks_the_branch_the_arm_is_on(tab: FakeBrowser) -> None:
    tab.choose(PUMA.name)
    assert tuple(rows(tab)) == kin.branch_names(PUMA)
    assert here(tab) == kin.branch_of(PUMA, PUMA.q_home)
    expected = {p.name: p.state for p in survey(PUMA, home(PUMA), kin.IKOptions(), PUMA.q_home)}
    assert rows(tab) == expected


@pytest.mark.full
def test_a_click_on_a_ghost_morphs_the_arm_into_it(tab: FakeBrowser) -> None:
    tab.choose(PUMA.name)
    postures = survey(PUMA, home(PUMA), kin.IKOptions(), PUMA.q_home)
    index = next(i for i, p in enumerate(postures) if p.available and p.name != here(tab))
    wanted = postures[index]
    tab.click(ghosts(tab)[str(index + 1)])
    tab.settle()
    assert np.allclose(q_of(tab, PUMA), wanted.q, atol=1e-4)
    assert np.allclose(tab.tool_pose(), home(PUMA), atol=1e-8)
    assert here(tab) == wanted.name
    assert str(index + 1) not in shown(tab), "the arm stands where its ghost would"


@pytest.mark.full
def test_a_number_moves_the_arm_or_explains_why_it_is_outside_limits(tab: FakeBrowser) -> None:
    tab.choose(PUMA.name)
    states = list(rows(tab).values())
    names = kin.branch_names(PUMA)
    blocked = states.index("blocked")
    tab.set("Go", str(blocked + 1))
    tab.wait(lambda: 'data-status="limits"' in tab.html)
    assert "Outside limit of joint" in tab.html
    assert here(tab) == kin.branch_of(PUMA, PUMA.q_home)
    other = next(i for i, s in enumerate(states) if s == "reachable" and names[i] != here(tab))
    tab.set("Go", str(other + 1))
    tab.settle()
    assert here(tab) == names[other]
    assert short(names[other]) in tab.html


@pytest.mark.full
def test_ghosts_can_be_hidden_one_by_one_and_all_together(tab: FakeBrowser) -> None:
    tab.choose(PUMA.name)
    before = shown(tab)
    assert len(before) == len(rows(tab)) - 1
    one = sorted(before)[0]
    tab.set("Show", one)
    tab.settle()
    assert shown(tab) == before - {one}
    tab.set("Ghosts", False)
    tab.settle()
    assert shown(tab) == set()
    tab.set("Ghosts", True)
    tab.set("Show", f"\N{WHITE CIRCLE}{one}")
    tab.settle()
    assert shown(tab) == before


@pytest.mark.full
def test_the_list_follows_the_target_and_is_not_sent_again_unchanged(tab: FakeBrowser) -> None:
    tab.choose(PUMA.name)
    T = home(PUMA)
    tab.grab()
    for _ in range(10):
        T[:3, 3] += (0.0, 0.03, -0.02)
        tab.drag(T)
        tab.settle(0.06)
    tab.release()
    tab.settle(0.6)
    q = q_of(tab, PUMA)
    assert rows(tab) == {p.name: p.state for p in survey(PUMA, tab.tool_pose(), kin.IKOptions(), q)}
    tab.log.clear()
    tab.settle(0.5)
    assert not tab.log


@pytest.mark.full
def test_a_missed_target_is_explained_and_one_click_moves_it(tab: FakeBrowser) -> None:
    tab.choose(PUMA.name)
    T = home(PUMA)
    T[:3, 3] = (3.0, 0.0, 0.5)
    grab_to(tab, T)
    assert 'data-why="unreachable"' in tab.html
    assert "Why not?" in tab.html
    assert "◀ the arm, off target" in tab.html
    tab.set("Nearest reachable pose", True)
    tab.settle()
    assert 'data-why=""' in tab.html
    assert np.allclose(tab.gizmo_pose(), tab.tool_pose(), atol=1e-6)
    assert "Nearest reachable pose" not in [m["props"].get("label") for m in tab.gui.values()]


@pytest.mark.full
def test_one_click_reduces_the_task_and_one_unlocks(tab: FakeBrowser) -> None:
    tab.choose(PUMA.name)
    tab.set("Locked", "1")
    tab.settle()
    T = home(PUMA)
    T[:3, 3] += (0.0, 0.08, 0.0)
    grab_to(tab, T)
    tab.set("Unlock joint 1", True)
    tab.settle(0.6)
    assert np.allclose(tab.tool_pose(), T, atol=1e-6)
    tab.choose(PIONEER.name)
    T = home(PIONEER)
    T[:3, :3] = T[:3, :3] @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    grab_to(tab, T)
    assert 'data-why="approximate"' in tab.html
    tab.set("Match point + approach only", True)
    tab.settle(0.6)
    assert tab.value("Target must match") == "Point + approach"
    assert 'data-status="reached"' in tab.html


@pytest.mark.full
def test_one_click_allows_any_posture(tab: FakeBrowser) -> None:
    tab.choose(PUMA.name)
    chosen = kin.branch_of(PUMA, PUMA.q_home)
    rng = np.random.default_rng(7)
    targets = (kin.fk(PUMA, PUMA.random_q(rng)) for _ in range(500))
    T = next(T for T in targets if kin.solve_ik(PUMA, T, branch=chosen).status != "solved")
    tab.set("Posture", short(chosen))
    tab.settle()
    grab_to(tab, T)
    assert not np.allclose(tab.tool_pose(), T, atol=1e-3)
    tab.set("Allow any posture", True)
    tab.wait(lambda: np.allclose(tab.tool_pose(), T, atol=1e-6))
    assert tab.value("Posture") == "Closest"


def test_the_cone_is_drawn_for_five_joints_and_can_be_hidden(tab: FakeBrowser) -> None:
    tab.choose(PIONEER.name)
    patches = [n for n in tab.nodes if "/cone/patch" in n]
    assert len(patches) == 1
    cone = patches[0].rsplit("/", 1)[0]
    assert tab.visible[cone]
    assert f'data-cone="{share(reachable(PIONEER, home(PIONEER)[:3, 3])):.3f}"' in tab.html
    tab.set("Approach cone", False)
    tab.wait(lambda: not tab.visible[cone])
    tab.choose(PUMA.name)
    assert not [n for n in tab.nodes if "/cone" in n]


@pytest.mark.full
def test_leaving_the_lesson_removes_its_nodes_and_controls(tab: FakeBrowser) -> None:
    for robot in (PANDA, SRS):
        tab.choose(robot.name)
    tab.set("Lesson", "None")
    tab.settle()
    assert not [n for n in tab.nodes if n.startswith("/postures")]
    assert not {"Go", "Show", "Ghosts"} & {m["props"].get("label") for m in tab.gui.values()}


def test_invalid_input_changes_nothing(tab: FakeBrowser) -> None:
    for name, value in (("Go", "99"), ("Go", "<b>"), ("Show", "99"), ("Show", ""), ("Show", "x1")):
        tab.set(name, value)
    tab.settle()
    assert np.allclose(tab.tool_pose(), home(PUMA), atol=1e-9)
    assert "Something went wrong" not in tab.html
