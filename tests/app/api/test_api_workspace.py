"""REST: workspace clouds as files, workspace dimensions, and reachability of targets."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import httpx2
import numpy as np
import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from live_server import serve, wait_for
from pydantic import TypeAdapter

import kin
from app.api import StreamLimit, UploadMemory, api_routes, install_problem_handlers
from app.api.work import ComputeSlots
from app.api.workspace import reachable
from app.api.workspace.streaming import ThreadedGenerator
from app.exports.formats import FORMATS, encode
from app.service.main import create_app
from app.shared.answers.ik import ReachableAnswer
from app.shared.answers.workspace import WorkspaceAnswer
from app.shared.clouds import Cloud, Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.shared.summaries import Summaries

PIONEER = kin.get_robot("pioneer5")
SRS = kin.get_robot("redundant7-craig")
API = "/api/v1/robots"
WORKSPACE = f"{API}/pioneer5/workspace"


@pytest.fixture
def live():
    """REST alone on a real port, two streams at a time, and a client: disconnecting needs a real connection."""
    app = FastAPI()
    app.state.settings, app.state.store = Settings(), Store()
    app.state.compute = ComputeSlots(16, 300.0)
    app.state.clouds, app.state.streams = Clouds(max_bytes=0, threads=1), StreamLimit(2)
    app.state.summaries, app.state.uploads = Summaries(threads=1), UploadMemory(1 << 20, 1.0)
    install_problem_handlers(app)
    app.router.routes.extend(api_routes())
    with serve(app) as port, httpx2.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False, timeout=60) as c:
        yield app, c
    app.state.clouds.close()
    app.state.summaries.close()


@pytest.fixture
def slices(monkeypatch):
    """The start of each slice, appended when its computation starts."""
    begun = []
    slice_of = Cloud.slice

    def counting(self, start, *rest):
        begun.append(start)
        return slice_of(self, start, *rest)

    monkeypatch.setattr(Cloud, "slice", counting)
    return begun


# -- clouds ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", FORMATS)
def test_a_cloud_is_the_file_of_its_format(client, app, name):
    parameters = {
        "n": 5000,
        "seed": 3,
        "strategy": "quasi",
        "measure": ["limits", "manipulability", "limits"],
        "limit": ["1:-0:0.5", "2:0.1:1"],
        "lock": "3:0.2",
        "q": "true",
        "format": name,
    }
    answer = client.get(WORKSPACE, params=parameters)
    assert answer.status_code == 200, answer.text
    cloud = Cloud(
        PIONEER,
        5000,
        3,
        "quasi",
        ("limits", "manipulability"),
        kin.JointConstraints(((0.0, 0.5), (0.1, 1.0), None, None, None), (None, None, 0.2, None, None)),
    )
    assert answer.content == b"".join(encode(name, app.state.clouds, cloud, True))
    kind = FORMATS[name]
    assert answer.headers["content-type"].partition(";")[0] == kind.media_type
    assert answer.headers["content-disposition"] == f'attachment; filename="pioneer5-quasi-5000.{name}"'
    assert answer.headers["x-cloud-count"] == "5000"
    assert answer.headers["x-cloud-columns"] == "x,y,z,limits,manipulability,q1,q2,q3,q4,q5"
    length = answer.headers.get("content-length")
    assert length == (None if kind.size is None else str(len(answer.content)))


def test_defaults_give_the_plain_cloud(client, app):
    answer = client.get(WORKSPACE)
    assert answer.content == b"".join(encode("ndjson", app.state.clouds, Cloud(PIONEER, 10_000)))
    assert answer.headers["x-cloud-columns"] == "x,y,z"


def test_all_strategies_and_all_arms(client):
    for robot in kin.files.classic_robots().values():
        answer = client.get(f"{API}/{robot.id}/workspace?n=100&format=csv&q=true")
        assert answer.text.count("\n") == 101
    answers = {s: client.get(WORKSPACE, params={"n": 50, "strategy": s}).content for s in kin.workspace.STRATEGIES}
    assert len(set(answers.values())) == 4


@pytest.mark.parametrize(
    ("query", "field", "value", "said"),
    [
        ("n=0", "n", '"0"', "greater than or equal to 1"),
        ("n=many", "n", '"many"', "integer"),
        ("n=1000000001", "n", "1000000001", "from 1 to 100000000"),
        ("seed=-1", "seed", '"-1"', "greater than or equal to 0"),
        (f"seed={2**64}", "seed", f'"{2**64}"', "less than"),
        ("strategy=even", "strategy", '"even"', "'boundary'"),
        ("measure=limits&measure=beauty", "measure[1]", '"beauty"', "'limit_margin' or 'limits'"),
        ("format=xls", "format", '"xls"', "'ply'"),
        ("q=perhaps", "q", '"perhaps"', "boolean"),
        ("sed=1", "sed", '"1"', "seed"),
        ("limit=1:0", "limit[0]", '"1:0"', "JOINT:LOWER:UPPER"),
        ("limit=6:0:1", "limit[0]", '"6:0:1"', "joint from 1 to 5"),
        ("limit=0:0:1", "limit[0]", '"0:0:1"', "joint from 1 to 5"),
        ("limit=1:nan:1", "limit[0]", '"1:nan:1"', "JOINT:LOWER:UPPER"),
        ("limit=2:0:1&limit=1:-9:9", "limit[1]", '"1:-9:9"', "inside the joint's own"),
        ("limit=2:1:0.5", "limit[0]", '"2:1:0.5"', "not below"),
        ("limit=2:0:1&limit=2:0:1", "limit[1]", '"2:0:1"', "limit[0] is for the same joint"),
        ("lock=3:a", "lock[0]", '"3:a"', "JOINT:VALUE"),
        ("lock=5:0.1&lock=2:9", "lock[1]", '"2:9"', "inside the limits"),
        ("lock=²:1", "lock[0]", '"²:1"', "joint from 1 to 5"),
    ],
)
@pytest.mark.parametrize("where", ["", "/summary"])
def test_a_wrong_value_is_named(client, query, field, value, said, where):
    if where and query.partition("=")[0] not in ("limit", "lock"):
        query, field, value, said = "limt=1:0:1", "limt", '"1:0:1"', "limit"
    answer = client.get(f"{WORKSPACE}{where}?{query}")
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    error = answer.json()["errors"][0]
    assert (error["field"], error["value"]) == (field, value)
    assert said in error["expected"]


def test_an_unknown_robot_is_a_404(client):
    for what in ("workspace", "workspace/summary"):
        assert client.get(f"{API}/nobody/{what}").json()["type"].endswith("unknown-robot")
    assert client.post(f"{API}/nobody/reachable", json={"target": {"position": [0, 0, 0]}}).status_code == 404


def test_a_reader_that_disconnects_cancels_the_cloud(live, slices):
    app, client = live
    with client.stream("GET", f"{WORKSPACE}?n=100000000&format=bin") as answer:
        parts = answer.iter_bytes()  # held: a dropped one may hang up
        assert next(parts).startswith(b"KINCLOUD")
        assert app.state.streams.open == 1
    wait_for(lambda: app.state.streams.open == 0)
    wait_for(lambda: app.state.clouds._executor._work_queue.empty())
    begun = len(slices)
    time.sleep(0.2)
    assert len(slices) == begun
    assert begun < 1000  # of 1526


def test_a_slow_reader_slows_the_computation(live, slices):
    _, client = live
    with client.stream("GET", f"{WORKSPACE}?n=100000000&format=bin") as answer:
        next(answer.iter_bytes())
        time.sleep(1.0)  # enough for a gigabyte without backpressure
        assert len(slices) < 100


def test_streams_are_limited_and_other_requests_are_served(live):
    app, client = live
    endless = f"{WORKSPACE}?n=100000000&format=bin"
    with client.stream("GET", endless) as first, client.stream("GET", endless) as second:
        parts = [stream.iter_bytes() for stream in (first, second)]  # held: a dropped one may hang up
        assert all(next(part) for part in parts)
        refused = client.get(f"{WORKSPACE}?n=10")
        assert refused.status_code == 503
        assert refused.headers["retry-after"] == "2"
        assert refused.json()["type"] == "urn:kinboard:problem:busy"
        assert "KINBOARD_MAX_STREAMS" in refused.json()["hint"]
        assert client.get(f"{API}/pioneer5").status_code == 200
        assert (
            client.post(f"{API}/pioneer5/reachable", json={"target": [{"position": [0, 0, 9]}]}).status_code == 200
        )
    wait_for(lambda: app.state.streams.open == 0)
    assert client.get(f"{WORKSPACE}?n=10").status_code == 200


def test_refused_and_finished_streams_free_their_slot(client, app):
    for query in ("n=10", "n=0", "n=1000000001", "limit=9:0:1", "n=100000&format=npz"):
        client.get(f"{WORKSPACE}?{query}")
        assert app.state.streams.open == 0


def test_the_gate_frees_a_slot_in_every_case():
    gate = StreamLimit(1)
    with pytest.raises(ZeroDivisionError), gate.slot("a"):
        raise ZeroDivisionError
    with gate.slot("a"), pytest.raises(Exception, match="1 clouds"), gate.slot("b"):
        pass
    assert gate.open == 0


def test_pieces_can_be_closed_by_any_thread_after_the_current_piece():
    working, go, closed = threading.Event(), threading.Event(), []

    def work():
        try:
            while True:
                working.set()
                go.wait(10)
                yield b"x"
        finally:
            closed.append(threading.get_ident())

    pieces = ThreadedGenerator(work())
    with ThreadPoolExecutor(2) as threads:
        taken = threads.submit(pieces.take)
        working.wait(10)
        closing = threads.submit(pieces.close)
        assert not closed
        go.set()
        assert taken.result(10) == b"x"
        closing.result(10)
    assert len(closed) == 1
    assert pieces.take() is None


# -- dimensions --------------------------------------------------------------------------------------------------


def span(found):
    return [(end.value, end.q.tolist(), end.point.tolist()) for end in found]


def extent(answer):
    return [(answer[end]["value"], answer[end]["q"], answer[end]["point"]) for end in ("least", "largest")]


@pytest.mark.full
def test_the_summary_agrees_with_the_core(client):
    answer = client.get(f"{WORKSPACE}/summary?section=true&resolution=24&effort=2").json()
    TypeAdapter(WorkspaceAnswer).validate_python(answer, strict=True)
    facts = kin.workspace.workspace_facts(PIONEER, effort=2)
    for name in ("x", "y", "z", "radius", "reach"):
        assert extent(answer[name]) == span(getattr(facts, name))
    for name in ("axis_point", "axis", "shoulder"):
        assert answer[name] == getattr(facts, name).tolist()
    for name in ("volume", "surface"):
        estimate = getattr(facts, name)
        assert answer[name] == {"value": estimate.value, "error": estimate.error, "method": estimate.method}
    cut = kin.workspace.workspace_section(PIONEER, resolution=24)
    assert answer["section"]["curves"] == [curve.tolist() for curve in cut.curves]
    assert answer["section"]["area"] == cut.area
    assert len(answer["section"]["arcs"]) == len(cut.arcs) > 0
    for arc, expected in zip(answer["section"]["arcs"], cut.arcs, strict=True):
        assert (arc["joint"], arc["start"], arc["stop"]) == (expected.joint, expected.start, expected.stop)
        assert arc["points"] == expected.points.tolist()
        assert arc["radius"] == expected.radius


def test_any_plane_can_be_cut(client):
    answer = client.get(f"{WORKSPACE}/summary?volume=false&resolution=16&plane=0:0:0.1:0:0:2&lock=5:0.5").json()
    TypeAdapter(WorkspaceAnswer).validate_python(answer, strict=True)
    locked = [None, None, None, None, 0.5]
    cut = kin.workspace.workspace_section(
        PIONEER, ([0.0, 0.0, 0.1], [0.0, 0.0, 1.0]), locked=locked, resolution=16
    )
    assert answer["section"]["area"] == cut.area > 0.1
    assert answer["section"]["curves"] == [curve.tolist() for curve in cut.curves]
    assert (answer["section"]["u"], answer["section"]["v"]) == (cut.u.tolist(), cut.v.tolist())
    assert answer["section"]["arcs"] == []
    other = client.get(f"{WORKSPACE}/summary?volume=false&resolution=16&plane=0:0:9:0:0:1&lock=5:0.5").json()
    assert other["section"]["area"] == 0.0
    assert other["section"]["curves"] == []


@pytest.mark.parametrize(
    "plane", ["", "0:0:0.1", "0:0:0.1:0:0:0", "0:0:0:0:0:nan", "0:0:0:1e-300:0:0", "a:0:0:0:0:1", "0:0:1e99:0:0:1"]
)
def test_an_invalid_plane_is_refused(client, plane):
    answer = client.get(f"{WORKSPACE}/summary?volume=false&plane={plane}")
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "plane"


def test_limits_and_locks_are_respected(client):
    limits, locked = [None, (0.5, 1.0), None, None, None], [0.25, None, None, None, None]
    answer = client.get(f"{WORKSPACE}/summary?volume=false&limit=2:0.5:1&lock=1:0.25").json()
    facts = kin.workspace.workspace_facts(PIONEER, limits=limits, locked=locked, volume=False)
    assert extent(answer["x"]) == span(facts.x)
    assert extent(answer["x"]) != span(kin.workspace.workspace_facts(PIONEER, volume=False).x)


def test_parts_that_are_not_requested_are_null(client):
    answer = client.get(f"{WORKSPACE}/summary?volume=false").json()
    assert answer["volume"] is answer["surface"] is answer["section"] is None
    assert answer["x"]["largest"]["value"] > 0.4


def test_a_repeated_summary_is_served_from_the_cache(client, monkeypatch):
    address = f"{WORKSPACE}/summary?volume=false&lock=5:0.25"
    first = client.get(address)
    monkeypatch.setattr(
        "app.shared.summaries.workspace_facts", lambda *args, **options: pytest.fail("computed again")
    )
    assert client.get(address).content == first.content
    assert client.get(f"{address}&effort=9&resolution=50").content == first.content  # no effect here


def test_rest_uses_what_the_viewer_has_computed(app, client, monkeypatch):
    for requested in (app.state.summaries.facts(SRS, effort=None), app.state.summaries.section(SRS)):
        requested.future.result(60)  # as the workspace tab requests them
    for name in ("workspace_facts", "workspace_section"):
        monkeypatch.setattr(f"app.shared.summaries.{name}", lambda *_, **__: pytest.fail("computed again"))
    answer = client.get(f"{API}/{SRS.id}/workspace/summary?volume=false&section=true")
    assert answer.status_code == 200
    assert answer.json()["section"]["curves"]


def test_an_arm_with_a_prismatic_first_joint_has_no_section(client, tmp_path):
    (tmp_path / "rail.toml").write_text(
        'id = "rail"\nname = "Rail"\nsource = "this test"\nconvention = "standard"\n'
        'units = { length = "m", angle = "deg" }\n'
        '[[rows]]\nname = "slide"\nkind = "prismatic"\nlimits = [0, 1]\n[[rows]]\nname = "turn"\na = 0.1\n',
        encoding="utf-8",
    )
    answer = TestClient(create_app(Settings(robots=tmp_path))).get(f"{API}/rail/workspace/summary?section=true")
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "section"
    assert "slides" in answer.json()["errors"][0]["expected"]
    address = f"{API}/rail/workspace/summary?volume=false&plane=0:0:0.5:1:0:0"
    level = TestClient(create_app(Settings(robots=tmp_path))).get(address)
    assert level.status_code == 200


# -- reachable ---------------------------------------------------------------------------------------------------


def ask(client, robot, status=200, **body):
    answer = client.post(f"{API}/{robot.id}/reachable", json=body)
    assert answer.status_code == status, answer.text
    return answer.json()


@pytest.mark.full
@pytest.mark.parametrize("robot", [PIONEER, SRS, kin.get_robot("scara")], ids=lambda robot: robot.id)
def test_every_point_of_a_cloud_is_reachable_and_points_outside_are_not(client, robot):
    cloud = Cloud(robot, 21, strategy="quasi")
    inside = cloud.slice(0, cloud.n).points.astype(float)
    outside = inside + np.array([0.0, 0.0, 3.0 * robot.reach])
    points = np.concatenate([inside, outside])
    # If the workspace has no volume, rounding to single precision may put a point slightly outside.
    results = ask(client, robot, target=[{"position": p.tolist()} for p in points])["results"]
    for p, answer in zip(points, results, strict=True):
        TypeAdapter(ReachableAnswer).validate_python(answer, strict=True)
        expected = kin.solve_ik(robot, p, task="position", max_solutions=1)
        assert answer["reachable"] == (answer["status"] == "solved") == (expected.status == "solved")
        assert (answer["reason"], answer["distance"]) == (expected.reason, expected.distance)
        at = kin.fk_positions(robot, answer["q"])
        assert np.linalg.norm(at - p) == pytest.approx(answer["position_error"], abs=1e-9)
    assert all(answer["reachable"] for answer in results[: len(inside)])
    assert not any(answer["reachable"] for answer in results[len(inside) :])
    assert all(answer["distance"] > 0.9 * robot.reach for answer in results[len(inside) :])


def test_targets_of_every_form_are_accepted_and_limits_are_respected(client):
    q = np.array(SRS.home)
    pose = {"matrix": kin.fk(SRS, q).tolist()}
    answer = ask(client, SRS, target=pose)
    assert answer["reachable"] is True
    assert np.allclose(kin.fk(SRS, answer["q"]), kin.fk(SRS, q), atol=1e-9)
    far = ask(client, SRS, target=pose, locked=[None, None, None, 0.0, None, None, None])
    assert far["reachable"] is False
    assert (
        far["status"] == kin.solve_ik(SRS, kin.fk(SRS, q), locked=[None, None, None, 0.0, None, None, None]).status
    )
    p, z = kin.fk(PIONEER, PIONEER.home)[:3, 3].tolist(), kin.fk(PIONEER, PIONEER.home)[:3, 2].tolist()
    assert ask(client, PIONEER, target={"position": p, "approach": z})["reachable"]
    # Five joints meet a pose except for its roll, so the pose is not reachable.
    turned = ask(client, PIONEER, target={"position": p, "wxyz": [0.3, 0.5, -0.2, 0.7]})
    assert (turned["reachable"], turned["status"]) == (False, "approximate")
    assert turned["reason"]
    none = ask(client, SRS, target={"position": [0.4, 0.1, 0.3]}, branch="elbow positive")
    assert none["reachable"]


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"target": []}, "target"),
        ({"target": [{"position": [0, 0, 0]}, {"position": [0, 0]}]}, "target[1].position"),
        ({"target": {"position": [0, 0, 0]}, "task": "pose"}, "target"),
        ({"target": [{"position": [0, 0, 0]}] * 3, "branch": "sideways"}, "branch"),
        ({"target": [{"position": [0, 0, 0]}] * 3, "limits": [[0, 1]]}, "limits"),
        ({"target": {"position": [0, 0, 0]}, "q_seed": [0] * 7}, "q_seed"),
    ],
)
def test_an_invalid_request_is_refused_and_names_the_field(client, body, field):
    assert ask(client, SRS, 422, **body)["errors"][0]["field"] == field


def test_too_many_targets_are_refused(client, app):
    most = app.state.settings.max_batch
    assert str(most) in ask(client, SRS, 413, target=[{"position": [0, 0, 0]}] * (most + 1))["detail"]


def test_checking_targets_stops_when_the_client_disconnects(live, monkeypatch):
    app, client = live
    judged = []
    solve = reachable.solve

    def slow(*args, **options):
        judged.append(1)
        time.sleep(0.005)
        return solve(*args, **options)

    monkeypatch.setattr(reachable, "solve", slow)
    # Targets of two kinds are judged one by one.
    point = {"position": [0.0, 0.2, -0.2]}
    body = {"target": [point, {**point, "approach": [0, 0, -1]}] * 2500}
    with pytest.raises(httpx2.ReadTimeout):
        client.post(f"{API}/pioneer5/reachable", json=body, timeout=1.0)
    wait_for(lambda: app.state.compute.used == 0)
    assert 0 < len(judged) < 1000
