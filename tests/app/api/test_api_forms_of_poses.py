"""Targets over REST in the forms of textbooks and makers, and poses answered so."""

from __future__ import annotations

import numpy as np
import pytest

import kin

DOWN = kin.pose_from_xyz_rpy([0.4, 0.1, 0.3], [np.pi, 0.0, 0.0])
POINT = {"position": [0.4, 0.1, 0.3]}
TEN_TWENTY_THIRTY = "X 400 Y 100 Z 300 A 10 B 120 C 30"


def solved(client, target, arm="ur5", **options):
    reply = client.post(f"/api/v1/robots/{arm}/ik", json={"target": target, "max_solutions": 1, **options})
    assert reply.status_code == 200, reply.text
    found = reply.json()
    assert found["status"] == "solved", found["reason"]
    return kin.fk(arm, found["solutions"][0]["q"])


@pytest.mark.parametrize(
    "target",
    [
        {**POINT, "xyzw": [1, 0, 0, 0]},
        {**POINT, "rpy": [np.pi, 0, 0]},
        {**POINT, "rotvec": [-np.pi, 0, 0]},
        {"matrix": DOWN[:3].tolist()},
        {"text": "X 400 Y 100 Z 300 W 180 P 0 R 0"},
        {"text": "400 100 300 0 0 180", "form": "kuka"},
        {"text": "0.4 0.1 0.3 1 0 0 0", "form": "xyzw"},
        {"text": "0.4 0.1 0.3 pi 0 0"},
    ],
    ids=lambda target: "-".join(target),
)
def test_a_target_may_have_any_form(client, target):
    assert np.allclose(solved(client, target), DOWN, atol=1e-9)
    reply = client.post("/api/v1/robots/ur5/ik", json={"target": [target, {**POINT, "wxyz": [0, 1, 0, 0]}]})
    first, second = reply.json()["results"]
    assert np.allclose(first["solutions"][0]["q"], second["solutions"][0]["q"], atol=1e-9)


def test_a_text_implies_its_task_and_is_in_its_frame(client):
    body = {"target": {"text": "0.05 0.13 0.1", "frame": "table"}, "workpieces": {"table": {"xyz": [0.3, 0, 0.2]}}}
    found = client.post("/api/v1/robots/ur5/ik", json=body).json()
    assert found["status"] == "solved"
    assert np.allclose(kin.fk("ur5", found["solutions"][0]["q"])[:3, 3], [0.35, 0.13, 0.3])
    reply = client.post("/api/v1/robots/ur5/ik", json={"target": {"text": "0.4 0.1 0.3"}, "task": "pose"})
    assert reply.status_code == 422
    assert reply.json()["errors"][0]["expected"] == "a whole pose for task pose"


def test_letters_of_several_makers_are_those_of_the_arms_maker(client):
    meant = kin.pose_from_text(TEN_TWENTY_THIRTY, "kuka")
    assert np.allclose(solved(client, {"text": TEN_TWENTY_THIRTY}, "kr6"), meant, atol=1e-9)
    assert np.allclose(solved(client, {"text": TEN_TWENTY_THIRTY, "form": "kuka"}), meant, atol=1e-9)


@pytest.mark.parametrize(
    ("target", "field", "expected"),
    [
        ({"text": TEN_TWENTY_THIRTY}, "target.text", "begin with kuka or doosan or mitsubishi"),
        ({"text": "p[400, 100, 300, 0, 3.14, 0]"}, "target.text", "lengths look like mm"),
        ({"text": "1 2 3", **POINT}, "target.position", "nothing besides"),
        ({"text": "1" * 5000}, "target.text", "2000"),
        ({"text": "1 2 3", "form": "kukka"}, "target.form", "'kuka'"),
        ({**POINT, "form": "kuka"}, "target.form", "`text` as well"),
        ({**POINT, "wxyz": [0, 0, 0, 0.24]}, "target.wxyz", "this one has the length 0.24"),
        ({**POINT, "xyzw": [0, 0, 0, 0]}, "target.xyzw", "this one is zero"),
        ({**POINT, "rpy": [0, 0, 0], "wxyz": [1, 0, 0, 0]}, "target.rpy", "one of the two"),
        ({**POINT, "rpy": [0, 0, 0], "approach": [0, 0, 1]}, "target.approach", "one of the two"),
        ({"rpy": [0, 0, 0]}, "target", "`position` and `wxyz`"),
        ({"matrix": DOWN[:2].tolist()}, "target.matrix", "3"),
        ({"matrix": DOWN.tolist(), "rpy": [0, 0, 0]}, "target.rpy", "the rotation the matrix has"),
    ],
)
def test_a_target_that_is_none_names_its_field(client, target, field, expected):
    for body in ({"target": target}, {"target": [{**POINT}, target]}):
        reply = client.post("/api/v1/robots/ur5/ik", json=body)
        assert reply.status_code == 422, reply.text
        (error,) = reply.json()["errors"]
        place = field.replace("target", "target[1]", 1) if isinstance(body["target"], list) else field
        assert error["field"] == place
        assert expected in error["expected"]


def test_a_quaternion_far_from_unit_length_is_refused_in_a_list_of_many(client):
    targets = [{**POINT, "wxyz": [0, 1, 0, 0]}] * 20 + [{**POINT, "wxyz": [0, 0.5, 0, 0]}]
    reply = client.post("/api/v1/robots/ur5/ik", json={"target": targets})
    assert reply.status_code == 422
    assert reply.json()["errors"][0]["field"] == "target[20].wxyz"


def test_fk_answers_the_pose_as_a_text(client):
    body = {"q": np.radians([0, -90, 90, 0, 0, 0]).tolist(), "form": "kuka"}
    answer = client.post("/api/v1/robots/kr6/fk", json=body).json()
    assert answer["text"] == "{X 525, Y 0, Z 890, A 0, B 90, C 0}"
    assert client.post("/api/v1/robots/kr6/fk", json={"q": body["q"]}).json()["text"] is None
    assert np.allclose(solved(client, {"text": answer["text"]}, "kr6"), answer["pose"]["matrix"], atol=1e-9)
    several = client.post("/api/v1/robots/kr6/fk", json={"q": [body["q"]] * 2, "form": "rpy"}).json()
    assert [each["text"] for each in several["results"]] == ["0.525 0 0.89 0 1.570796 0"] * 2
