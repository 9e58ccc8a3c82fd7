"""Contacts of the drawn arm with its pedestal and the floor, compared with the drawn meshes."""

from __future__ import annotations

import numpy as np
import pytest
from arms import CLASSICS
from fake_browser import FakeBrowser

import kin
from app.viewer.scene.bodies.drawing import drawing
from app.viewer.scene.chain import link_poses
from app.viewer.scene.clearance import clearance
from app.viewer.scene.meshes import body
from app.viewer.scene.mounting import COLUMN

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

ROBOTS = list(CLASSICS)
SOLID = ("link", "housing", "body-")


def drawn(robot: kin.Robot, q: np.ndarray, skeleton: bool) -> list[tuple[int, np.ndarray]]:
    """Index and vertices in the world of every solid part that moves with a joint."""
    made, shell = body(robot), drawing(robot)
    links = made.parts if skeleton or shell is None else shell.parts
    poses = link_poses(robot, q[None])[0]
    found = [
        (link.index, part.mesh.vertices @ T[:3, :3].T + T[:3, 3])
        for link, parts, T in zip(made.chain.links, links, poses, strict=True)
        for part in parts
        if link.index >= 0 and part.name.startswith(SOLID) and not part.fixed_to_parent
    ]
    if skeleton or shell is None:
        tool = poses[-1] @ made.chain.T_last_tool
        gripper = next(part for part in made.gripper if part.name == "gripper")
        found.append((robot.n, gripper.mesh.vertices @ tool[:3, :3].T + tool[:3, 3]))
    return found


@pytest.mark.parametrize("skeleton", [False, True])
@pytest.mark.parametrize("robot", ROBOTS, ids=[r.id for r in ROBOTS])
def test_contacts_agree_with_the_meshes(robot: kin.Robot, skeleton: bool) -> None:
    made, test = body(robot), clearance(robot, skeleton)
    assert test.at(robot.q_home) is None
    for q in robot.random_q(np.random.default_rng(4), 60):
        contact = test.at(q)
        parts = drawn(robot, q, skeleton)
        depth = max(made.mount.floor - vertices[:, 2].min() for _, vertices in parts)
        if contact is None:
            assert depth < 0.8 * made.size, "a part under the floor is found"
            for index, vertices in parts[len(parts) // 2 :]:
                x, y, z = (vertices - robot.T_world_base[:3, 3]).T
                core = (np.hypot(x, y) < 0.5 * COLUMN * made.size) & (z < -made.size) & (z > made.mount.floor)
                assert not core.any(), f"link {index + 1} is inside the column"
        elif contact.obstacle == "floor":
            assert depth > 0.0
            low = min(v[:, 2].min() for index, v in parts if index == contact.link)
            assert low < made.mount.floor + 0.3 * made.size, "the link that is named is the one under the floor"
        else:
            aside = np.hypot(*(contact.point - robot.T_world_base[:3, 3])[:2])
            assert aside < 6.0 * made.size
            assert contact.point[2] < robot.T_world_base[2, 3] + 2.0 * made.size


def test_a_contact_is_named() -> None:
    robot = kin.get_robot("ur5")
    down = np.radians([0.0, 60.0, 0.0, 0.0, 0.0, 0.0])
    contact = clearance(robot).at(down)
    assert contact is not None
    assert contact.obstacle == "floor"
    assert contact.text(robot) == f"Link {contact.link + 1} passes through the floor."
    assert clearance(robot).at(np.radians([0.0, -90.0, 0.0, 0.0, 0.0, 0.0])) is None
    pioneer = kin.get_robot("pioneer5")
    found = [clearance(pioneer).at(q) for q in pioneer.random_q(np.random.default_rng(1), 100)]
    assert any(c is not None and c.text(pioneer).endswith("passes through the pedestal.") for c in found)
    assert any(c is not None and c.text(pioneer).startswith("The gripper") for c in found)


@pytest.mark.parametrize("name", ["gantry", "prr", "rpp", "cylindrical"])
def test_a_lift_is_guided_by_its_column_and_passes_through_nothing(name: str) -> None:
    robot = kin.get_robot(name)
    test = clearance(robot)
    assert test.at(robot.q_home) is None
    found = [test.at(q) for q in robot.random_q(np.random.default_rng(1), 100)]
    assert all(contact is None or contact.link > 1 for contact in found)


def test_a_slide_beside_the_column_is_guided_by_nothing() -> None:
    slide = {"kind": "prismatic", "a": 0.1, "limits": (-2.0, 0.0)}
    beside = kin.Robot.from_dh([(0.0, 0.3, 0.6, 0.0), slide])
    found = [clearance(beside).at(np.array([0.0, z])) for z in (0.0, -2.0)]
    assert found[0] is None
    assert found[1] is not None
    assert found[1].obstacle == "floor"


def test_the_page_marks_a_contact_and_says_so(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose("UR5")
        mark = next(name for name in tab.nodes if name.endswith("-contact"))
        assert not tab.visible[mark]
        assert "passes through" not in tab.html
        tab.set("2 shoulder", 60.0)
        tab.wait(lambda: tab.visible[mark])
        tab.wait(lambda: "passes through the floor." in tab.html)
        assert "passes through the floor." in tab.nodes[f"{mark}/text"]["props"]["text"]
        tab.set("2 shoulder", -90.0)
        tab.wait(lambda: not tab.visible[mark] and "passes through" not in tab.html)


NOTHING = (0.0, 0.0, 0.0, 0.0)
STRANGE = {
    "32 joints at a point": [NOTHING] * 31 + [(0.0, 0.0, 0.05, 0.0)],
    "a tiny last step": [(0.0, 0.3, 0.0, 1.0), (0.0, 1e-5, 300.0, 0.0)],
    "a tiny and a long link": [(0.0, 2e-6, 0.0, 0.0), (0.0, 2e-6, 999.0, 0.0)],
}


@pytest.mark.parametrize("rows", STRANGE.values(), ids=STRANGE)
def test_the_cover_of_any_arm_is_bounded(rows: list[tuple[float, float, float, float]]) -> None:
    robot = kin.Robot.from_dh(rows)
    test = clearance(robot)
    assert len(test._radii) < 5000
    assert np.abs(body(robot).parts[-1][0].mesh.vertices).max() < 10.0 * robot.reach
