"""REST: answers with a few fields are those of whole answers, however many targets a request has."""

import numpy as np
import pytest

import kin
from app.api.options import OptionsBody, Target
from app.shared.answers.ik import Brief
from kin.transforms import wxyz_from_rotation

QUICK = "q,status,reachable,cause,distance"


def poses(robot, count, seed=1):
    """Targets inside the workspace, one at the home pose and one out of reach."""
    q = robot.random_q(np.random.default_rng(seed), count)
    q[1] = robot.q_home
    T = kin.fk(robot, q)
    T[2, :3, 3] = 9.0
    return T


FORMS = {
    "matrix": lambda T: {"matrix": T.tolist()},
    "wxyz": lambda T: {"position": T[:3, 3].tolist(), "wxyz": wxyz_from_rotation(T[:3, :3]).tolist()},
    "approach": lambda T: {"position": T[:3, 3].tolist(), "approach": (3.0 * T[:3, 2]).tolist()},
    "position": lambda T: {"position": T[:3, 3].tolist()},
}


def ask(client, robot, what, fields=None, **body):
    given = {} if fields is None else {"fields": fields}
    response = client.post(f"/api/v1/robots/{robot.id}/{what}", json=body, params=given)
    assert response.status_code == 200, response.text
    return response.json()


@pytest.mark.full
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("robot_id", ["pioneer5", "ur5", "iiwa14", "scara"])
def test_few_fields_of_many_targets_are_those_of_whole_answers(client, robot_id, form):
    robot = kin.get_robot(robot_id)
    targets = [FORMS[form](T) for T in poses(robot, 6)]
    whole = ask(client, robot, "ik", target=targets)["results"]
    few = ask(client, robot, "ik", QUICK + ",reason", target=targets)["results"]
    quick = ask(client, robot, "ik", QUICK, target=targets)["results"]
    assert [set(each) for each in quick] == [set(QUICK.split(","))] * 6
    for short, middle, long in zip(quick, few, whole, strict=True):
        assert short["q"] == (long["solutions"][0]["q"] if long["solutions"] else None)
        assert short["reachable"] == (long["status"] == "solved")
        assert [short[name] for name in ("status", "cause", "distance")] == [
            long[name] for name in ("status", "cause", "distance")
        ]
        assert middle == short | {"reason": long["reason"]}
    assert {each["status"] for each in quick} > {"solved"}


@pytest.mark.full
@pytest.mark.parametrize("given", [{}, {"max_solutions": 1}, {"respect_limits": False, "max_solutions": 3}])
@pytest.mark.parametrize("robot_id", ["pioneer5", "ur5", "iiwa14"])
@pytest.mark.parametrize("form", ["matrix", "approach"])
def test_answers_to_a_list_are_those_to_single_targets_to_the_byte(client, robot_id, form, given):
    robot = kin.get_robot(robot_id)
    T = poses(robot, 12)
    T[3] = kin.fk(robot, np.zeros(robot.n))  # most arms are singular there
    targets = [FORMS[form](each) for each in T]
    for what, options in (("ik", given), ("reachable", {})):
        path = f"/api/v1/robots/{robot_id}/{what}"
        many = client.post(path, json={"target": targets, **options})
        single = [client.post(path, json={"target": each, **options}).content for each in targets]
        assert many.content == b'{"results":[' + b",".join(single) + b"]}"


@pytest.mark.parametrize("robot_id", ["pioneer5", "ur5"])
def test_few_fields_of_reachable_are_those_of_whole_answers(client, robot_id):
    robot = kin.get_robot(robot_id)
    targets = [FORMS["wxyz"](T) for T in poses(robot, 20)]
    whole = ask(client, robot, "reachable", target=targets, task="approach")["results"]
    quick = ask(client, robot, "reachable", QUICK, target=targets, task="approach")["results"]
    assert quick == [{name: each[name] for name in QUICK.split(",")} for each in whole]
    assert [each["reachable"] for each in quick].count(False) == 1


def test_seeds_options_and_frames_count_for_few_fields(client):
    robot = kin.get_robot("ur5")
    T = poses(robot, 5)
    seeds = robot.random_q(np.random.default_rng(3), 5).tolist()
    table = {"xyz": [0.1, 0.2, 0.3], "rpy": [0.0, 0.0, 0.5]}
    cases = [
        {"target": [FORMS["matrix"](each) for each in T], "q_seed": seeds},
        {"target": [FORMS["matrix"](each) for each in T], "q_seed": seeds[0], "branch": "elbow positive"},
        {"target": [FORMS["matrix"](each) for each in T], "limits": [[-1.0, 1.0], *[None] * 5]},
        {"target": [FORMS["wxyz"](each) | {"frame": "table"} for each in T], "workpieces": {"table": table}},
        {"target": [FORMS["wxyz"](each) for each in T], "base": table},
        {"target": [FORMS["matrix"](T[0]), FORMS["position"](T[1])]},
        {"target": [FORMS["matrix"](each.round(4)) for each in T]},
        {"target": FORMS["matrix"](T[0])},
    ]
    for body in cases:
        whole, quick = ask(client, robot, "ik", **body), ask(client, robot, "ik", "status,q", **body)
        pairs = zip(quick["results"], whole["results"], strict=True) if "results" in whole else [(quick, whole)]
        for short, long in pairs:
            expected = long["solutions"][0]["q"] if long["solutions"] else None
            assert short == {"status": long["status"], "q": expected}


def test_an_arm_that_is_sent_along_may_be_asked_for_few_fields_too(client):
    sent = {
        "units": {"length": "m", "angle": "rad"},
        "convention": "standard",
        "rows": [{"a": 0.3, "limits": [-3, 3]}, {"a": 0.2, "limits": [-3, 3]}],
    }
    body = {"robot": sent, "target": [{"position": [0.4, 0.1, 0.0]}, {"position": [0.9, 0.0, 0.0]}]}
    response = client.post("/api/v1/ik?fields=status", json=body)
    assert response.json() == {"results": [{"status": "solved"}, {"status": "unreachable"}]}


@pytest.mark.parametrize("what", ["ik", "reachable"])
@pytest.mark.parametrize("fields", ["q,solutions", "", "q,,status", "Q"])
def test_a_field_that_does_not_exist_is_refused_by_name(client, what, fields):
    body = {"target": {"position": [0.1, 0.2, 0.0]}}
    response = client.post(f"/api/v1/robots/pioneer5/{what}?fields={fields}", json=body)
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert error["field"] == "fields"
    assert all(name in error["expected"] for name in Brief.__struct_fields__)


@pytest.mark.parametrize(
    ("target", "field"),
    [
        ({"position": [0.1, 0.2, 0.0], "wxyz": [0.0, 0.0, 0.0, 0.0]}, "target[3].wxyz"),
        ({"position": [0.1, 0.2, 0.0], "approach": [0.0, 0.0, 0.0]}, "target[3].approach"),
        ({"matrix": [[1, 0, 0, 0], [0, 2, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}, "target[3].matrix"),
    ],
)
@pytest.mark.parametrize("what", ["ik", "reachable"])
def test_a_wrong_target_is_named_as_without_fields(client, what, target, field):
    good = {key: [1.0, 0.0, 0.0, 0.0][: len(value)] for key, value in target.items() if key != "matrix"}
    good = good or {"matrix": np.eye(4).tolist()}
    given = {"target": [good, good, good, target, good]}
    url = f"/api/v1/robots/ur5/{what}"
    brief, whole = client.post(f"{url}?fields=q", json=given), client.post(url, json=given)
    assert brief.status_code == whole.status_code == 422
    assert brief.json() == whole.json()
    assert field in brief.json()["errors"][0]["field"]


@pytest.mark.parametrize("form", FORMS)
def test_targets_that_are_read_together_are_those_read_one_by_one(form):
    robot = kin.get_robot("ur5")
    targets = [Target(**FORMS[form](T)) for T in poses(robot, 300)]
    body = OptionsBody()
    task, T = body.poses_of_all(targets)
    goals = [body.resolve(robot, each, "target") for each in targets]
    assert {goal.task for goal in goals} == {task}
    assert np.array_equal(T, [goal.T for goal in goals])
