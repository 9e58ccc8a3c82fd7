"""REST: the options of `ik`, and paths, agree with the core and refuse what is wrong by name."""

from __future__ import annotations

import numpy as np
import pytest

import kin

SRS = kin.get_robot("redundant7-craig")
PIONEER = kin.get_robot("pioneer5")
API = "/api/v1/robots"


def post(client, robot, what, status=200, **body):
    response = client.post(f"{API}/{robot.id}/{what}", json=body)
    assert response.status_code == status, response.text
    return response.json()


def target_of(robot, q):
    return {"matrix": kin.fk(robot, q).tolist()}


@pytest.mark.parametrize(
    "options",
    [
        {"branch": "elbow positive"},
        {"branch": ["shoulder front · elbow negative · wrist flip", "seed"]},
        {"limits": [None, [-1.0, 1.5], None, None, [-2.0, 2.0], None, None]},
        {"locked": [None, None, None, None, None, None, 0.0]},
        {"images": "all"},
        {"prefer": "limits"},
        {"prefer": "manipulability"},
        {"redundancy": {"psi": 0.3}},
        {"task": "approach", "redundancy": {"psi": 0.3, "theta7": 1.0}},
        {"mask": [True, True, True, False, False, True], "mask_frame": "base"},
        {"solver": "numeric"},
    ],
    ids=lambda options: " ".join(options),
)
def test_every_option_reaches_the_core(client, options):
    q = np.array(SRS.home)
    answer = post(client, SRS, "ik", target=target_of(SRS, q), q_seed=q.tolist(), **options)
    result = kin.solve_ik(SRS, kin.fk(SRS, q), q_seed=q, **options)
    assert answer["status"] == result.status == "solved"
    assert np.allclose([s["q"] for s in answer["solutions"]], result.q, atol=1e-6)
    assert [s["branch"] for s in answer["solutions"]] == [s.branch for s in result.solutions]
    plain = kin.solve_ik(SRS, kin.fk(SRS, q), q_seed=q)
    assert plain.q.tolist() != result.q.tolist(), "it has an effect"


def test_blocked_branches_orientation_and_singularities_are_reported(client):
    beyond = np.radians([0, 30, 0, 118, 0, 40, 0])
    answer = post(client, SRS, "ik", target=target_of(SRS, beyond))
    assert (answer["status"], answer["cause"]) == ("limits", "joint limits")
    assert len(answer["blocked"]) > 1
    assert answer["violations"] == answer["blocked"][0]["violations"]
    assert {b["branch"] for b in answer["blocked"]} <= set(kin.branch_names(SRS))
    answer = post(client, SRS, "ik", target={"position": [1.0, 0, 0.3], "wxyz": [1, 0, 0, 0]})
    assert (answer["status"], answer["cause"]) == ("orientation", "orientation")
    assert answer["nearest_orientation"]["position_error"] <= 1e-9
    straight = np.radians([10, 40, 20, 0, 0, 30, 0])
    answer = post(client, SRS, "ik", target=target_of(SRS, straight), q_seed=straight.tolist())
    assert "elbow" in [s["kind"] for s in answer["singularities"]]


def test_a_mask_of_positions_accepts_a_point_without_orientation(client):
    p = kin.fk(PIONEER, PIONEER.home)[:3, 3].tolist()
    answer = post(client, PIONEER, "ik", target={"position": p}, mask=[True, True, True, False, False, False])
    assert (answer["status"], answer["task"]) == ("solved", "position")
    answer = post(client, PIONEER, "ik", target={"position": p}, mask=[True, False, True, False, False, False])
    assert (answer["status"], answer["task"]) == ("solved", "mask")
    post(client, PIONEER, "ik", 422, target={"position": p}, mask=[True, False, True, False, False, True])


def test_the_robot_lists_its_branches(client):
    for robot in kin.files.classic_robots().values():
        answer = client.get(f"{API}/{robot.id}").json()
        assert answer["branches"] == list(kin.branch_names(robot))
        assert answer["branch_meanings"] == kin.ik.branch_meanings(robot)


@pytest.mark.parametrize("robot", [PIONEER, SRS], ids=lambda robot: robot.id)
def test_a_path_agrees_with_the_core(client, robot):
    q = np.linspace(robot.q_home, 0.7 * robot.q_home + 0.3 * robot.upper, 12)
    task = "approach" if robot.n == 5 else "pose"
    targets = [target_of(robot, row) for row in q]
    answer = post(client, robot, "ik/path", targets=targets, task=task, q_start=q[0].tolist())
    result = kin.solve_path(robot, kin.fk(robot, q), task=task, q_start=q[0])
    assert answer["continuous"] is result.continuous is True
    assert (answer["jumps"], answer["gaps"]) == ([], [])
    assert np.allclose(answer["q"], result.q, atol=1e-9)
    assert max(answer["position_error"]) <= 1e-9
    assert max(answer["rotation_error"]) <= 1e-9
    assert answer["reason"] == result.reason


def test_gaps_of_a_path_are_reported(client):
    points = [[-0.018, 0.31, -0.181], [-0.018, 0.9, -0.171]]
    answer = post(client, PIONEER, "ik/path", targets=[{"position": p} for p in points])
    (gap,) = answer["gaps"]
    assert (gap["index"], gap["status"]) == (1, "unreachable")
    assert f"by {1000 * gap['distance']:.1f} mm" in gap["reason"]
    assert gap["distance"] == pytest.approx(answer["position_error"][1], abs=1e-6)


@pytest.mark.parametrize(
    ("what", "body", "field", "said"),
    [
        ("ik", {"branch": "elbow sideways"}, "branch", "elbow positive"),
        ("ik", {"branch": [1]}, "branch[0]", "string"),
        ("ik", {"limits": [[0, 1]]}, "limits", "7 pairs"),
        ("ik", {"limits": [[0, 1, 2]]}, "limits[0]", "at most 2"),
        ("ik", {"limits": [[-9, 9], *[None] * 6]}, "limits[0]", "inside the joint's own"),
        ("ik", {"locked": [9, *[None] * 6]}, "locked[0]", "inside the limits"),
        ("ik", {"locked": ["x", *[None] * 6]}, "locked[0]", "number"),
        ("ik", {"mask": [1, 1, 1, 1, 1, 1]}, "mask[0]", "boolean"),
        ("ik", {"mask": [False] * 6}, "mask", "at least one"),
        ("ik", {"mask": [True] * 6, "task": "approach"}, "task", "besides a mask"),
        ("ik", {"mask_frame": "world"}, "mask_frame", "'tool' or 'base'"),
        ("ik", {"prefer": "beauty"}, "prefer", "'manipulability'"),
        ("ik", {"images": 2}, "images", "'all'"),
        ("ik", {"redundancy": {"phi": 1}}, "redundancy", "psi"),
        ("ik", {"redundancy": {"psi": 1e9}}, "redundancy.psi", "1000000"),
    ],
)
def test_a_wrong_option_is_named(client, what, body, field, said):
    pose = {"position": [0.4, 0.1, 0.3], "wxyz": [1, 0, 0, 0]}
    document = post(client, SRS, what, 422, target=pose, **body)
    error = document["errors"][0]
    assert error["field"] == field
    assert said in error["expected"]


def test_a_wrong_path_is_refused_by_name(client):
    pose = {"position": [0.4, 0.1, 0.3], "wxyz": [1, 0, 0, 0]}
    for body, field in (
        ({"targets": []}, "targets"),
        ({"targets": [pose, {"position": [0, 0]}]}, "targets[1].position"),
        ({"targets": [pose, {"position": [0, 0, 0]}]}, "targets[1]"),
        ({"targets": [pose], "max_step": 0}, "max_step"),
        ({"targets": [pose], "q_start": [1, 2]}, "q_start"),
        ({"targets": [pose], "q_seed": [0] * 7}, "q_seed"),
    ):
        document = post(client, SRS, "ik/path", 422, **body)
        assert document["errors"][0]["field"] == field, document
    document = post(client, SRS, "ik/path", 413, targets=[pose] * 1001)
    assert "1001" in document["detail"]


def test_a_matrix_of_few_digits_is_met_as_closely_as_it_says(client):
    robot = kin.get_robot("pioneer5")
    T = kin.fk(robot, robot.q_home + 0.2)
    answer = post(client, robot, "ik", target={"matrix": T.round(4).tolist()})
    assert answer["status"] == "solved"
    assert answer["tolerances"]["target_error"] >= 1e-4
    assert answer["solutions"][0]["position_error"] <= answer["tolerances"]["position"]
    assert "The target is rounded" in answer["reason"]
    exact = post(client, robot, "ik", target={"matrix": T.tolist()})
    assert "tolerances" not in exact
    asked = post(
        client, robot, "ik", target={"matrix": T.tolist()}, position_tolerance=1e-3, rotation_tolerance=0.01
    )
    assert asked["tolerances"] == {"position": 1e-3, "rotation": 0.01, "target_error": 0.0}
    post(client, robot, "ik", target={"matrix": T.tolist()}, position_tolerance=0.0, status=422)
    scaled = T.copy()
    scaled[:3, :3] *= 1.1
    post(client, robot, "ik", target={"matrix": scaled.tolist()}, status=422)


def test_a_path_of_rounded_matrices_is_met_as_closely_as_they_say(client):
    robot = kin.get_robot("pioneer5")
    line = kin.fk(robot, np.linspace(robot.q_home, robot.clip(robot.q_home + 0.1), 4))
    answer = post(client, robot, "ik/path", targets=[{"matrix": T.round(4).tolist()} for T in line])
    assert answer["gaps"] == []
    assert answer["tolerances"]["target_error"] >= 1e-4
    assert "Targets are rounded" in answer["reason"]
    exact = [{"matrix": T.tolist()} for T in line]
    assert "tolerances" not in post(client, robot, "ik/path", targets=exact)
    asked = post(client, robot, "ik/path", targets=exact, position_tolerance=1e-3, rotation_tolerance=0.01)
    assert asked["tolerances"] == {"position": 1e-3, "rotation": 0.01, "target_error": 0.0}
    post(client, robot, "ik/path", targets=exact, rotation_tolerance=1.0, status=422)
