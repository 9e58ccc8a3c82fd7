"""The collision bodies of a URDF as capsules: against coal on makers' meshes, and what files state wrongly."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import kin
from kin.collision.bodies import bodies_of
from kin.files.urdf import collisions
from kin.files.urdf.collisions import MAX_BODIES, fitted
from kin.files.urdf.visuals import MeshFile
from kin.fitting import bodies as solids
from kin.fitting import capsule_around, capsules_around
from tests.described import ARMS, imported, triangles
from tests.kin.fitting.test_fitting import outside

GOLDEN = json.loads((Path(__file__).parents[2] / "data" / "golden-bodies.json").read_text("utf-8"))
# Pairs with one link between that are never compared though the meshes graze each other, by 8 mm at most.
NEIGHBOURS = {"ur5": {(3, 5)}, "puma560": {(1, 3)}}
FALSE_ALARMS = {"ur5": 0.3, "fr3": 0.05, "iiwa14": 0.02, "puma560": 0.3}

# All meshes of an arm are fitted, which takes about two seconds.
QUICK = [pytest.param(name, marks=() if name == "ur5" else pytest.mark.slow) for name in ARMS]

LINKS = """<robot name="two">
<link name="base"><collision><geometry><cylinder radius="0.1" length="0.2"/></geometry></collision></link>
<link name="upper">{upper}</link><link name="fore">{fore}</link><link name="plate"/><link name="hand">
<collision><origin xyz="0.1 0 0" rpy="0 1.5708 0"/><geometry><capsule radius="0.03" length="0.1"/></geometry>
</collision></link>
<joint name="one" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"/>
<axis xyz="0 0 1"/><limit lower="-2" upper="2"/></joint>
<joint name="two" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.5 0 0" rpy="0 0 0.3"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>
<joint name="flange" type="fixed"><parent link="fore"/><child link="plate"/><origin xyz="0.4 0 0"/></joint>
<joint name="grip" type="fixed"><parent link="plate"/><child link="hand"/></joint></robot>"""
BOX = '<collision><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.06 0.06"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="package://two/fore.stl"/></geometry></collision>'


def read(upper: str = BOX, fore: str = BOX, **more) -> kin.files.UrdfRobot:
    return kin.files.read_urdf(LINKS.format(upper=upper, fore=fore), tip="hand", **more)


@pytest.mark.full
@pytest.mark.parametrize("name", QUICK)
def test_no_contact_of_the_makers_meshes_is_missed(name):
    """Recorded by tests/data/make_golden_bodies.py with coal; takes a while, because all meshes are fitted."""
    robot = imported(name)[0].robot
    links = np.array([each.link for each in robot.capsules])
    compared = {tuple(pair) for pair in links[bodies_of(robot).pairs].tolist()}
    q, touching = np.array(GOLDEN[name]["q"]), GOLDEN[name]["touching"]
    ours = kin.clearance(robot, q) < 0.0
    left_out = set()
    for verdict, pairs in zip(ours, touching, strict=True):
        seen = [tuple(pair) for pair in pairs if tuple(pair) in compared]
        left_out |= {tuple(pair) for pair in pairs} - set(seen)
        assert verdict or not seen
    assert left_out <= NEIGHBOURS.get(name, set())
    true = np.array([bool(pairs) for pairs in touching])
    assert (ours & ~true).sum() <= FALSE_ALARMS[name] * (~true).sum()
    assert not ours.all()


@pytest.mark.full
@pytest.mark.parametrize("name", QUICK)
def test_the_capsules_hold_every_corner_of_the_makers_meshes(name):
    (robot, report), links = imported(name)
    assert {body.link for body in report.bodies if body.capsules} == set(range(robot.n + 1))
    assert not any(body.assumed or body.missing for body in report.bodies)
    assert kin.clearance(robot, robot.q_home) > 0.0
    rng = np.random.default_rng(1)
    for link in links:
        own = [c for c in robot.capsules if c.link == link.link]
        assert {c.row for c in own} == {-1 if link.link == 0 else robot.joint_rows[link.link - 1]}
        for shape, pose in link.pieces:
            if isinstance(shape, MeshFile):
                corners = triangles(name, shape.path).reshape(-1, 3) * shape.scale
                some = corners[rng.choice(len(corners), min(300, len(corners)), replace=False)]
                assert outside(some @ pose[:3, :3].T + pose[:3, 3], own).max() < 1e-9


@pytest.mark.parametrize("name", QUICK)
def test_an_import_with_capsules_survives_a_round_trip(name):
    robot = imported(name)[0].robot
    for length in ("m", "mm"):
        again = kin.robot_from_dict(kin.robot_to_dict(robot, length=length))
        assert again.capsules == robot.capsules
        assert again.capsules_source == robot.capsules_source
    assert kin.load_robot(kin.robot_to_toml(robot)) == robot


@pytest.mark.full
def test_shapes_are_where_the_urdf_places_them():
    """At random configurations, sampled points of the bodies are inside of capsules, in the world frame."""
    robot, report = read()
    assert [body.names for body in report.bodies] == [("base",), ("upper",), ("fore", "hand")]
    assert "for every link" in report.about_bodies
    for q in robot.random_q(np.random.default_rng(2), 5):
        frames = kin.link_frames(robot, q)
        tool = kin.fk(robot, q)
        hand = tool[:3, 3] + tool[:3, :3] @ [0.18, 0.0, 0.0]  # the end of the capsule
        c, s = np.cos(q[0]), np.sin(q[0])
        elbow = np.array([c * 0.49, s * 0.49, 0.33])
        for link, point in ((2, hand), (1, elbow), (0, np.array([0.1, 0.0, 0.1]))):
            gaps = []
            for each in robot.capsules:
                T = robot.T_world_base if each.row < 0 else frames[each.row]
                if each.link == link:
                    local = T[:3, :3].T @ (point - T[:3, 3])
                    gaps.append(outside(local[None], [each])[0])
            assert min(gaps) <= 1e-6
            assert min(gaps) > -0.06


@pytest.mark.full
def test_a_mesh_that_is_not_at_hand_is_a_tube_and_the_words_say_so():
    robot, report = read(fore=MESH)
    assert [body.assumed for body in report.bodies] == [False, False, True]
    assert {c.assumed for c in robot.capsules if c.link == 2} == {True, False}, "the hand is known"
    assert not any(c.assumed for c in robot.capsules if c.link != 2)
    for words in ("except: link 2", "fore.stl", "sent along", "assumed tube besides"):
        assert words in report.about_bodies
    text = kin.robot_to_toml(robot)
    assert "assumed = true" in text
    assert kin.load_robot(text).capsules == robot.capsules


def test_a_mesh_that_can_be_read_is_fitted_with_its_scale():
    flat = np.array([[[0, 0, 0], [100, 0, 0], [100, 50, 0]]], float)

    def fit(links, reach):
        return [fitted(link.pieces, 1, reach, lambda path: flat) for link in links]

    mesh = MESH.replace("fore.stl", 'fore.stl" scale="0.001 0.001 0.001')
    robot, _ = read(fore=mesh, fit=fit)
    assert not any(each.assumed for each in robot.capsules)
    assert max(each.radius for each in robot.capsules if each.link == 2) < 0.06
    _, huge = read(fore=MESH, fit=fit)
    assert "more than 10 times the reach" in huge.about_bodies


@pytest.mark.full
@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("<collision/>", "geometry"),
        ('<collision><geometry><box size="1 2"/></geometry></collision>', "box size"),
        ('<collision><geometry><sphere radius="-1"/></geometry></collision>', "sphere radius"),
        ('<collision><geometry><capsule radius="0.1"/></geometry></collision>', "capsule length"),
        ('<collision><geometry><capsule radius="0" length="1"/></geometry></collision>', "capsule"),
        ("<collision><geometry><cone/></geometry></collision>", "another shape"),
        ('<collision><geometry><sphere radius="900"/></geometry></collision>', "times the reach"),
        ('<collision><origin xyz="nan 0 0"/><geometry><sphere radius="1"/></geometry></collision>', "origin xyz"),
        (BOX * (MAX_BODIES + 1), f"more than {MAX_BODIES} collision bodies"),
    ],
)
def test_a_malformed_body_is_a_tube_and_never_refuses_the_arm(wrong, words):
    robot, report = read(fore=wrong)
    assert robot.n == 2
    assert report.bodies[2].assumed
    assert words in report.about_bodies


def test_without_collision_bodies_all_is_assumed():
    text = kin.robot_to_urdf(kin.get_robot("puma560"))
    robot, report = kin.files.read_urdf(text, tip="tool")
    assert robot.capsules == ()
    assert "all bodies are assumed" in report.about_bodies
    assert "states no collision bodies" in report.about_bodies


@pytest.mark.full
def test_a_link_without_a_body_is_a_tube():
    robot, report = read(upper="")
    assert report.bodies[1].assumed
    assert {c.assumed for c in robot.capsules if c.link == 1} == {True}
    assert "the file states no body" in report.about_bodies


@pytest.mark.full
def test_the_home_of_an_import_is_free_of_contacts():
    """In the middle of its limits this arm is folded onto its base."""
    fold = '<limit lower="-2" upper="2"/>'
    text = LINKS.format(upper=BOX, fore=BOX).replace('<link name="plate"/>', '<link name="plate"/>')
    free = kin.files.read_urdf(text, tip="hand").robot
    long = text.replace('radius="0.1" length="0.2"', 'radius="0.1" length="0.1"')
    wall = '<collision><origin xyz="0.9 0 0.3"/><geometry><box size="0.1 0.3 0.3"/></geometry></collision>'
    walled = long.replace("</collision></link>", f"</collision>{wall}</link>", 1)
    assert fold in walled
    robot = kin.files.read_urdf(walled, tip="hand").robot
    assert robot.home != free.home
    assert kin.clearance(robot, robot.q_home) > 0.0
    assert kin.clearance(robot, free.q_home) < 0.0


def test_capsules_are_fitted_when_something_asks_for_them(monkeypatch):
    """Reading, FK and IK need none of them; the home is chosen by rough ones, which hold the bodies too."""
    asked = []
    fit = collisions.capsules_around
    monkeypatch.setattr(collisions, "capsules_around", lambda *args: asked.append(1) or fit(*args))
    robot, report = read()
    T = kin.fk(robot, robot.q_home)
    assert kin.solve_ik(robot, T, task="position").status == "solved"
    assert robot.with_tool(np.eye(4)).capsules
    assert "for every link" in report.about_bodies
    assert kin.load_robot(LINKS.format(upper=BOX, fore=BOX), tip="hand") is not robot
    assert asked == []
    assert [body.capsules > 0 for body in report.bodies] == [True, True, True]
    assert len(asked) == 4, "each URDF link with bodies once"
    assert len(robot.capsules) == sum(body.capsules for body in report.bodies)
    assert pickle.loads(pickle.dumps(robot)).capsules == robot.capsules
    assert len(asked) == 4


def test_a_rough_capsule_holds_its_body():
    for flat, round_ in (
        (solids.box(0.5, 0.06, 0.02), np.empty((0, 2, 4))),
        (solids.cylinder(0.1, 0.2), np.empty((0, 2, 4))),
        (np.empty((0, 3, 3)), solids.balls(0.05, 0.3)),
    ):
        rough = capsule_around(flat, round_)
        inside = np.concatenate([flat.reshape(-1, 3), round_[..., :3].reshape(-1, 3)])
        assert outside(inside, [rough]).max() <= (0.0 if len(flat) else -0.049)
        assert rough.volume < 2.5 * sum(each.volume for each in capsules_around(flat, round_, 1))
