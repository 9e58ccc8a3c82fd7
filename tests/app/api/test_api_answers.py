"""REST: responses to valid requests, checked against the core and against forward kinematics."""

import asyncio
import json

import numpy as np
import pytest
from pydantic import TypeAdapter

import kin
from app.shared.answers.fk import FkAnswer, fk_answers
from app.shared.answers.ik import IkAnswer
from app.shared.answers.jacobian import JacobianAnswer
from app.shared.answers.robots import RobotAnswer
from kin.transforms import rotation_from_wxyz

ROBOTS = tuple(kin.files.classic_robots().values())
each_robot = pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.id)


def post(client, robot, what, **body):
    response = client.post(f"/api/v1/robots/{robot.id}/{what}", json=body)
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == "application/json"
    return json.loads(response.text, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


def random_q(robot, count, seed=0):
    return robot.random_q(np.random.default_rng(seed), count)


def check_shape(kind, answer):
    """The answer matches the published schema of this kind and has no other keys."""
    assert TypeAdapter(kind).validate_python(answer, strict=True) == answer  # validating drops unknown keys


# -- robots --------------------------------------------------------------------------------------------------


def test_the_list_of_robots_describes_every_robot_in_order(client):
    listed = client.get("/api/v1/robots").json()["robots"]
    ids = list(kin.builtin_robots())
    assert [robot["id"] for robot in listed] == ids
    assert listed == [client.get(f"/api/v1/robots/{robot_id}").json() for robot_id in ids]


@each_robot
def test_a_robot_can_be_rebuilt_from_its_description(client, robot):
    """A robot built from the REST description alone has the same forward kinematics."""
    answer = client.get(f"/api/v1/robots/{robot.id}").json()
    check_shape(RobotAnswer, answer)
    rebuilt = kin.Robot(
        id=answer["id"],
        name=answer["name"],
        source=answer["source"],
        convention=answer["convention"],
        rows=tuple(kin.Joint(**row) for row in answer["rows"]),
        home=tuple(answer["home"]),
        base=tuple(map(tuple, answer["base"])),
        tool=tuple(map(tuple, answer["tool"])),
    )
    q = random_q(robot, 20)
    assert np.array_equal(kin.fk(rebuilt, q), kin.fk(robot, q))
    assert [joint["limits"] for joint in answer["joints"]] == np.stack([robot.lower, robot.upper], 1).tolist()
    assert [joint["home"] for joint in answer["joints"]] == answer["home"]
    assert answer["reach"] == robot.reach


# -- fk ------------------------------------------------------------------------------------------------------


@each_robot
def test_fk_of_one_configuration(client, robot):
    q = random_q(robot, 1)[0]
    answer = post(client, robot, "fk", q=q.tolist())
    check_shape(FkAnswer, answer)
    T = kin.fk(robot, q)
    assert answer["pose"]["matrix"] == T.tolist()
    assert answer["pose"]["position"] == T[:3, 3].tolist()
    assert np.allclose(rotation_from_wxyz(np.array(answer["pose"]["wxyz"])), T[:3, :3], rtol=0, atol=1e-14)
    assert answer["in_limits"] is True
    assert answer["frames"] is None


@each_robot
def test_fk_of_a_list_keeps_its_order_and_a_list_of_one_is_a_list(client, robot):
    q = random_q(robot, 600)  # more than one block
    answers = post(client, robot, "fk", q=q.tolist())["results"]
    assert np.array_equal([answer["pose"]["matrix"] for answer in answers], kin.fk(robot, q))
    alone = post(client, robot, "fk", q=q[:1].tolist())
    assert alone == {"results": answers[:1]}


@each_robot
def test_fk_frames_follow_the_rows_of_the_table(client, robot):
    q = random_q(robot, 3)
    for answer, frames in zip(
        post(client, robot, "fk", q=q.tolist(), frames=True)["results"], kin.link_frames(robot, q), strict=True
    ):
        check_shape(FkAnswer, answer)
        assert [frame["name"] for frame in answer["frames"]] == [row.name for row in robot.rows]
        assert np.array_equal([frame["pose"]["matrix"] for frame in answer["frames"]], frames)


@each_robot
def test_fk_reports_a_joint_outside_its_limits(client, robot):
    q = robot.upper + 0.01 * np.eye(robot.n)[-1]
    assert post(client, robot, "fk", q=q.tolist())["in_limits"] is False
    assert post(client, robot, "fk", q=robot.upper.tolist())["in_limits"] is True


# -- jacobian ------------------------------------------------------------------------------------------------


@each_robot
@pytest.mark.parametrize("frame", ["base", "tool"])
def test_jacobian_of_one_and_of_a_list(client, robot, frame):
    q = random_q(robot, 5)
    answers = post(client, robot, "jacobian", q=q.tolist(), frame=frame)["results"]
    assert post(client, robot, "jacobian", q=q[2].tolist(), frame=frame) == answers[2]
    for answer, row in zip(answers, q, strict=True):
        check_shape(JacobianAnswer, answer)
        J = kin.jacobian(robot, row, "tool" if frame == "tool" else "world")
        assert answer["jacobian"] == J.tolist()
        for part, rows in {"all": J, "linear": J[:3], "angular": J[3:]}.items():
            product = np.prod(np.linalg.svd(rows, compute_uv=False))
            assert answer["manipulability"][part] == pytest.approx(product, abs=1e-12)
        assert answer["singular_values"] == pytest.approx(np.linalg.svd(J, compute_uv=False), abs=1e-12)


# -- ik ------------------------------------------------------------------------------------------------------


def closes(robot, pose, solution, task):
    T = kin.fk(robot, np.array(solution["q"]))
    goal = np.array(pose["matrix"])
    assert np.abs(T[:3, 3] - goal[:3, 3]).max() < 1e-8
    if task == "pose":
        assert np.abs(T - goal).max() < 1e-8
    if task == "approach":
        assert np.abs(T[:3, 2] - goal[:3, 2]).max() < 1e-8
    assert solution["position_error"] < 1e-8
    assert solution["in_limits"] is bool(robot.in_limits(np.array(solution["q"]), 1e-9))


@each_robot
@pytest.mark.parametrize("task", ["pose", "approach", "position"])
def test_ik_solves_the_poses_of_fk(client, robot, task):
    """A pose in the form fk returns is a valid target, and every solution reaches it."""
    for q in random_q(robot, 4, seed=1):
        pose = post(client, robot, "fk", q=q.tolist())["pose"]
        answer = post(client, robot, "ik", target=pose, task=task)
        check_shape(IkAnswer, answer)
        assert answer["status"] == "solved", answer["reason"]
        assert answer["task"] == task
        assert answer["closest"] is None
        assert answer["solutions"]
        for solution in answer["solutions"]:
            closes(robot, pose, solution, task)
        distances = [solution["distance"] for solution in answer["solutions"]]
        assert distances == sorted(distances)


@each_robot
def test_every_form_of_a_target_gives_the_same_answer(client, robot):
    pose = post(client, robot, "fk", q=random_q(robot, 1, seed=2)[0].tolist())["pose"]
    z = [row[2] for row in pose["matrix"][:3]]
    forms = {
        "pose": [{"matrix": pose["matrix"]}, {"position": pose["position"], "wxyz": pose["wxyz"]}, pose],
        "approach": [{"position": pose["position"], "approach": [9 * x for x in z]}],
        "position": [{"position": pose["position"]}],
    }
    for task, targets in forms.items():
        whole = post(client, robot, "ik", target=pose, task=task, max_solutions=1)
        for target in targets:
            answer = post(client, robot, "ik", target=target, max_solutions=1)  # the task follows from the form
            assert answer["task"] == task
            assert answer["status"] == whole["status"] == "solved"
            closes(robot, pose, answer["solutions"][0], task)


@pytest.mark.full
@each_robot
def test_ik_agrees_with_the_core(client, robot):
    q, seed = random_q(robot, 2, seed=3)
    T = kin.fk(robot, q)
    task = "approach" if robot.n < 6 else "pose"
    answer = post(client, robot, "ik", target={"matrix": T.tolist()}, task=task, q_seed=seed.tolist())
    result = kin.solve_ik(robot, T, task=task, q_seed=seed)
    # REST normalises the rotation again; a descent passes that rounding on to the redundant elbow.
    near = 1e-9 if kin.branch_names(robot) else 1e-5
    assert np.allclose([s["q"] for s in answer["solutions"]], result.q, rtol=0, atol=near)
    assert [s["branch"] for s in answer["solutions"]] == [s.branch for s in result.solutions]
    assert (answer["reason"], answer["solver"]) == (result.reason, result.solver)
    assert answer["solver_reason"] == result.solver_reason
    assert [free["name"] for free in answer["redundancy"]] == [free.name for free in result.redundancy]
    for found, free, own in zip(
        answer["redundancy"], result.redundancy, answer["solutions"][0]["redundancy"], strict=True
    ):
        assert np.allclose(found["intervals"], free.intervals, rtol=0, atol=1e-9)
        assert found["value"] == own["value"]
        for interval in own["intervals"]:
            assert any(
                low - 1e-9 <= interval[0] and interval[1] <= high + 1e-9 for low, high in found["intervals"]
            )


@each_robot
def test_ik_of_a_list_with_one_seed_or_one_each(client, robot):
    q = random_q(robot, 6, seed=4)
    targets = [{"matrix": T.tolist()} for T in kin.fk(robot, q)]
    task = "approach" if robot.n < 6 else "pose"
    same = post(client, robot, "ik", target=targets, task=task, q_seed=q[0].tolist())["results"]
    own = post(client, robot, "ik", target=targets, task=task, q_seed=q.tolist())["results"]
    for i, target in enumerate(targets):
        assert same[i] == post(client, robot, "ik", target=target, task=task, q_seed=q[0].tolist())
        # The seed is the configuration that generated the target, so it is the nearest solution.
        assert own[i]["solutions"][0]["distance"] < 1e-6


@pytest.mark.parametrize("robot_id", ["redundant7", "redundant7-craig"])
def test_the_requested_redundancy_is_used(client, robot_id):
    robot = kin.get_robot(robot_id)
    pose = post(client, robot, "fk", q=list(robot.home))["pose"]
    (free,) = post(client, robot, "ik", target=pose)["redundancy"]
    low, high = max(free["intervals"], key=lambda pair: pair[1] - pair[0])
    wanted = low + 0.3 * (high - low)
    answer = post(client, robot, "ik", target=pose, redundancy=wanted)
    assert answer == post(client, robot, "ik", target=pose, redundancy={free["name"]: wanted})
    assert answer["status"] == "solved"
    for solution in answer["solutions"]:
        turns = (solution["redundancy"][0]["value"] - wanted) / (2 * np.pi)
        assert turns == pytest.approx(round(turns), abs=1e-9)
        closes(robot, pose, solution, "pose")


@each_robot
def test_ik_options_shorten_and_extend_the_answer(client, robot):
    task = "approach" if robot.n < 6 else "pose"
    target = {"matrix": kin.fk(robot, random_q(robot, 1, seed=5)[0]).tolist()}
    inside = post(client, robot, "ik", target=target, task=task)["solutions"]
    first = post(client, robot, "ik", target=target, task=task, max_solutions=1)["solutions"]
    assert first == inside[:1]
    free = post(client, robot, "ik", target=target, task=task, respect_limits=False)["solutions"]
    assert len(free) >= len(inside)
    assert all(solution["in_limits"] for solution in inside)
    if robot.id == "pioneer5":
        assert not all(solution["in_limits"] for solution in free)


@each_robot
def test_out_of_reach_is_an_answer(client, robot):
    answer = post(client, robot, "ik", target={"position": [5.0, 0.0, 0.0]})
    check_shape(IkAnswer, answer)
    assert answer["status"] == "unreachable"
    assert answer["solutions"] == []
    assert answer["closest"]["in_limits"] is True
    assert answer["distance"] == pytest.approx(answer["closest"]["position_error"])
    assert 5.0 - robot.reach - 1e-9 <= answer["distance"] < 5.0
    assert f"by {1000 * answer['distance']:.1f} mm" in answer["reason"]


def test_violated_limits_are_named(client):
    robot = kin.get_robot("pioneer5")
    q = np.array([1.5, 0.6, 0.8, 0.5, 1.3])  # the last joint is 29° outside its limits
    answer = post(client, robot, "ik", target={"matrix": kin.fk(robot, q).tolist()}, task="approach")
    assert answer["status"] == "limits"
    assert answer["solutions"] == []
    assert {"joint": 4, "name": "pivoting wrist", "limit": robot.upper[4]}.items() <= answer["violations"][
        0
    ].items()
    assert answer["violations"][0]["value"] == pytest.approx(1.3)
    assert answer["closest"]["in_limits"] is True


def test_the_compromise_of_a_five_joint_arm_is_reported(client):
    robot = kin.get_robot("pioneer5")
    T = kin.fk(robot, random_q(robot, 1, seed=6)[0])
    c, s = np.cos(0.1), np.sin(0.1)
    T[:3, :3] = T[:3, :3] @ [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    answer = post(client, robot, "ik", target={"matrix": T.tolist()})
    assert answer["status"] == "approximate"
    roll = next(solution for solution in answer["solutions"] if solution["compromise"] == "roll")
    assert roll["rotation_error"] == pytest.approx(0.1, abs=1e-9)
    least = next(solution for solution in answer["solutions"] if solution["compromise"] == "rotation")
    assert least["rotation_error"] <= roll["rotation_error"]


@pytest.mark.full
def test_extreme_but_finite_numbers_never_put_nan_into_an_answer(client):
    for robot in ROBOTS:
        for value in (1e6, -1e6, 1e-300, 5e-324, 0.0):
            post(client, robot, "fk", q=[value] * robot.n, frames=True)
            post(client, robot, "jacobian", q=[value] * robot.n)
            post(client, robot, "ik", target={"position": [value] * 3})
            post(
                client,
                robot,
                "ik",
                target={"position": [value] * 3, "wxyz": [1, 0, 0, 0]},
                q_seed=[value] * robot.n,
            )


@pytest.mark.parametrize(("count", "inline"), [(3, True), (40, False)])
@pytest.mark.usefixtures("computes_here")
def test_few_poses_run_on_the_event_loop_and_more_in_a_thread(client, monkeypatch, count, inline):
    on_the_loop = []

    def watched(*arguments):
        try:
            asyncio.get_running_loop()
            on_the_loop.append(True)
        except RuntimeError:
            on_the_loop.append(False)
        return fk_answers(*arguments)

    monkeypatch.setattr("app.api.fk.fk_answers", watched)
    answer = client.post("/api/v1/robots/pioneer5/fk", json={"q": [[0.0] * 5] * count})
    assert len(answer.json()["results"]) == count
    assert set(on_the_loop) == {inline}
