"""The benchmark itself: its targets, its checks of answers, its timing and its output."""

from __future__ import annotations

import json
import math
import re
import tomllib
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kin
from app.bench import command, judge, report
from app.bench.arms import arm_of, ortho
from app.bench.contestants import FLOOR, KINBOARD, OURS, PEERS, SOLVE_IK, Contestant, Peer
from app.bench.contestants.motions import limits_of
from app.bench.measure import Turns, measure, ratio
from app.bench.rows import ROWS, prepare
from app.bench.run import Settings, run
from app.cli import parser

ROOT = Path(__file__).parents[2]
ROWS_BY_ID = {row.id: row for row in ROWS}
TURNING = [robot for robot in kin.files.classic_robots().values() if robot.revolute.all()]
BRIEF = replace(Settings(peers=()).quick(), targets=4, batch=8, rounds=3, turn=1e-4)


def brief(*ids, peers=()):
    return replace(BRIEF, rows=tuple(ROWS_BY_ID[name] for name in ids), peers=peers)


@pytest.fixture(autouse=True)
def one_thread(monkeypatch):
    """What the command sets before it imports libraries."""
    for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR"):
        monkeypatch.setenv(f"{name}_NUM_THREADS", "1")


# -- arms in other forms -----------------------------------------------------------------------------------------


def by_screws(arm, q):
    """The product of exponentials of an arm's axes and offsets, in the form other libraries use."""
    H, P, tool = arm.screws
    T = np.eye(4)
    for h, p, angle in zip(H, P, q, strict=False):
        K = np.array([[0, -h[2], h[1]], [h[2], 0, -h[0]], [-h[1], h[0], 0]])
        T[:3, 3] += T[:3, :3] @ p
        T[:3, :3] = T[:3, :3] @ (np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K)
    T[:3, 3] += T[:3, :3] @ P[-1]
    T[:3, :3] = T[:3, :3] @ tool
    return T


@pytest.mark.parametrize("robot", TURNING, ids=lambda robot: robot.id)
def test_every_form_is_the_same_arm(robot):
    arm = arm_of(robot)
    rng = np.random.default_rng(3)
    q = robot.random_q(rng, 5)
    T = kin.fk(robot, q)
    assert np.allclose(arm.fk(q), T, atol=1e-14)
    assert np.allclose([by_screws(arm, x) for x in q], T, atol=1e-14)
    for joint in range(robot.n):
        fewer = np.delete(q[0], joint)
        assert np.allclose(by_screws(arm.locked(joint, q[0, joint]), fewer), T[0], atol=1e-14)
    turned = arm.with_turn()
    assert np.allclose(turned.fk(np.append(q[0], 0.0)), T[0], atol=1e-14)
    assert np.allclose(turned.lines(np.append(q[0], 0.0))[0][-1], T[0, :3, 0], atol=1e-14)
    rolled = arm.with_roll().fk(np.append(q[0], 0.7))
    assert np.allclose(rolled[:3, 2:], T[0, :3, 2:], atol=1e-14)
    assert rolled[:3, 0] @ T[0, :3, 0] == pytest.approx(math.cos(0.7))


def test_an_arm_is_recognised_by_its_axes():
    pioneer, craig = (arm_of(kin.get_robot(name)) for name in ("pioneer5", "redundant7-craig"))
    assert pioneer.family == ""
    assert pioneer.with_roll().family == "spherical_two_parallel"
    assert craig.locked(2, 0.3).family == "spherical_two_intersecting"
    assert ortho(craig.locked(2, 0.3)) is None


def test_the_upright_arm_has_the_lengths_of_its_table():
    shape = ortho(arm_of(kin.get_robot("pioneer5")).with_roll())
    lengths = {"a1": 0.07, "a2": 0.0, "b": 0.0, "c1": 0.13, "c2": 0.16, "c3": 0.14, "c4": 0.0}
    assert shape.lengths == pytest.approx(lengths, abs=1e-15)
    assert shape.tool[:3, 3] == pytest.approx([0, 0, 0.12], abs=1e-15)


# -- the judge ---------------------------------------------------------------------------------------------------


def answers_of(task):
    (thin,) = [c for c in KINBOARD.enter(task) if c.name == OURS]
    return [q for arguments in thin.inputs for q in thin.read(thin.call(*arguments))]


def test_right_answers_are_accepted_up_to_whole_turns():
    task = prepare(ROWS_BY_ID["ik-pioneer5"], 6, 1)
    ours = answers_of(task)
    sets, check = judge.right_sets(task, ours)
    assert (check.success, check.wrong) == (1.0, 0.0)
    assert 4 <= check.branches <= 8
    assert max(check.position_error, check.rotation_error) < 1e-9
    turned, _ = judge.right_sets(task, [q[::-1] + 2 * math.pi for q in ours])
    assert judge.share_of_same(sets, turned) == 1.0


def test_the_generating_configuration_is_looked_for():
    task = prepare(ROWS_BY_ID["ik-jaco"], 6, 1)
    ours = answers_of(task)
    sets, check = judge.right_sets(task, ours)
    assert (check.success, check.recall, check.wrong) == (1.0, 1.0, 0.0)
    others = [q[np.abs(q - own).max(axis=1) > 1e-3] for q, own in zip(sets, task.q, strict=True)]
    assert judge.right_sets(task, [*others[:3], *ours[3:]])[1].recall == 0.5
    answer = prepare(ROWS_BY_ID["solve-redundant7"], 2, 1)
    assert judge.right_sets(answer, [q[None] for q in answer.q])[1].recall is None


@pytest.mark.parametrize("name", ["ik-jaco", "ik-crx", "ik-sawyer", "ik-scorbot", "ik-elbow5", "ik-panda"])
def test_every_arm_without_a_geometry_of_its_own_is_solved(name):
    task = prepare(ROWS_BY_ID[name], 8, 2)
    _, check = judge.right_sets(task, answers_of(task))
    assert (check.success, check.recall) == (1.0, 1.0)
    assert (check.wrong > 0.0) == task.row.unverified


@pytest.mark.parametrize("off", [3e-6, -0.1])
def test_an_inaccurate_answer_is_rejected(off):
    task = prepare(ROWS_BY_ID["ik-pioneer5"], 6, 1)
    sets, check = judge.right_sets(task, [q + np.array([0, off, 0, 0, 0]) for q in answers_of(task)])
    assert check.success == 0.0
    assert check.wrong >= 4
    assert not any(len(q) for q in sets)


def test_missing_and_duplicate_branches_are_detected():
    task = prepare(ROWS_BY_ID["ik-srs"], 4, 1)
    ours = answers_of(task)
    sets, check = judge.right_sets(task, ours)
    fewer, less = judge.right_sets(task, [q[1:] for q in ours])
    assert less.success == 1.0
    assert less.branches == check.branches - 1
    assert judge.share_of_same(sets, fewer) == 0.0
    twice, same = judge.right_sets(task, [np.concatenate([q[1:], q[1:]]) for q in ours])
    assert same.branches == less.branches
    assert judge.share_of_same(fewer, twice) == 1.0


def test_an_answer_outside_the_limits_is_rejected_where_limits_apply():
    row = ROWS_BY_ID["solve-redundant7-craig"]
    task = prepare(row, 4, 1)
    beyond = task.q + np.array([0, 2 * math.pi, 0, 0, 0, 0, 0])
    assert judge.right_sets(task, [q[None] for q in task.q])[1].success == 1.0
    assert judge.right_sets(task, [q[None] for q in beyond])[1].success == 0.0


def test_a_wrong_pose_is_detected():
    task = prepare(ROWS_BY_ID["fk"], 4, 1)
    assert judge.judge_poses(task, list(task.T)).success == 1.0
    shifted = task.T.copy()
    shifted[0, 0, 3] += 1e-5
    assert judge.judge_poses(task, list(shifted)).success == 0.75
    assert judge.judge_poses(task, list(task.T.swapaxes(1, 2))).success == 0.0


def test_a_motion_that_exceeds_a_limit_or_misses_its_end_is_detected():
    task = prepare(ROWS_BY_ID["motion-ptp"], 4, 1)
    limits = limits_of(task)
    ours = answers_of(task)
    assert judge.judge_motions(task, ours, limits).success == 1.0
    assert (
        judge.judge_motions(task, [m * np.array([1, 1, 1, 1.01])[:, None, None] for m in ours], limits).wrong
        == 1.0
    )
    assert judge.judge_motions(task, [m + 1e-3 for m in ours], limits).wrong == 1.0
    assert judge.judge_motions(task, [m[:, :-5] for m in ours], limits).success == 0.0


def test_distances_between_links_are_compared_with_plain_numpy():
    task = prepare(ROWS_BY_ID["collision"], 64, 1)
    ours = answers_of(task)
    check = judge.judge_distances(task, ours)
    assert (check.success, check.wrong) == (1.0, 0.0)
    assert check.position_error < 1e-12
    assert judge.judge_distances(task, [ours[0] + 1e-3, *ours[1:]]).wrong == 1 / 64


def test_a_verdict_is_that_of_plain_numpy_on_the_bodies_that_are_compared():
    task = prepare(ROWS_BY_ID["cage-panda-batch"], 64, 1)
    ours = answers_of(task)
    assert 0.25 < np.mean(ours) < 0.75
    assert judge.judge_verdicts(task, ours, None).success == 1.0
    assert judge.judge_verdicts(task, [not ours[0], *ours[1:]], None).wrong == 1 / 64
    thin = replace(task.robot, capsules=[replace(each, radius=0.01) for each in task.robot.capsules])
    assert judge.judge_verdicts(task, ours, thin).success < 1.0


def test_motions_are_judged_between_their_ends():
    task = prepare(ROWS_BY_ID["edge-panda"], 12, 1)
    ours = answers_of(task)
    assert judge.judge_verdicts(task, ours, None).success == 1.0
    ends = replace(task, q=task.ends, ends=None)
    assert 0 < judge.touching(ends, task.robot).sum() < np.sum(ours) < 12
    assert not judge.touching(replace(task, ends=None), task.robot).any()


@pytest.mark.parametrize("name", ["motion-points", "motion-pace"])
def test_motions_of_all_rows_keep_the_limits(name):
    task = prepare(ROWS_BY_ID[name], 4, 1)
    assert judge.judge_motions(task, answers_of(task), limits_of(task)).success == 1.0


# -- timing ------------------------------------------------------------------------------------------------------


class Machine:
    """A clock that advances only with work, on a machine that gets slower and slower."""

    def __init__(self):
        self.now = 0.0
        self.log = []

    def clock(self):
        return int(self.now)

    def worker(self, name, cost, per_call=1):
        def work(target):
            self.now += cost * (1.0 + self.now / 1e6)
            self.log.append((name, target))

        return Turns(Contestant(name, work, [(k,) for k in range(5)], lambda _: [], per_call))


@pytest.mark.full
def test_ratios_are_robust_to_a_machine_that_slows_down():
    machine = Machine()
    fast, slow = machine.worker("fast", 1000), machine.worker("slow", 3000)
    measure([fast, slow], 40, 1e-5, clock=machine.clock)
    assert fast.seconds[-1] > 2 * fast.seconds[0]
    assert ratio(slow, fast) == pytest.approx(3, rel=0.1)
    assert fast.best < fast.median
    assert fast.noise > 0.1


@pytest.mark.full
def test_contestants_take_turns_and_every_target_is_used():
    machine = Machine()
    workers = [machine.worker(name, 1000, per_call=4) for name in "abc"]
    measure(workers, 6, 3e-6, clock=machine.clock)
    assert [len(worker.seconds) for worker in workers] == [6, 6, 6]
    played = machine.log[-sum(w.calls for w in workers) * 6 :]
    turns = [name for k, (name, _) in enumerate(played) if k == 0 or played[k - 1][0] != name]
    assert all(turns.count(name) >= 4 for name in "abc")
    assert {target for name, target in played if name == "a"} == set(range(5))
    assert workers[0].seconds[0] == pytest.approx(250e-9, rel=0.5)


# -- whole runs --------------------------------------------------------------------------------------------------


@pytest.mark.full
def test_a_run_without_peers_measures_us_against_the_floor():
    found = run(brief("fk", "fk-batch", "ik-pioneer5", "ik-srs-batch", "solve-redundant7", "motion-line"))
    assert [row.task.row.id for row in found.rows] == [
        "fk",
        "fk-batch",
        "ik-pioneer5",
        "ik-srs-batch",
        "solve-redundant7",
        "motion-line",
    ]
    assert found.faults == ()
    assert found.rounds == 3
    names = [[entry.contestant.name for entry in row.entries] for row in found.rows]
    assert [OURS in n for n in names] == [True, True, True, True, False, True]
    assert [SOLVE_IK in n for n in names] == [False, False, True, False, True, False]
    both = found.rows[2]
    assert both.named(OURS).to_array == both.named(SOLVE_IK).to_solve == 1.0
    assert both.named(SOLVE_IK).check.same == 1.0
    assert both.named(SOLVE_IK).to_array > 1.0
    assert both.floor.to_array < 1.0


@pytest.mark.full
def test_an_arm_that_is_not_built_in_is_reported():
    row = replace(ROWS_BY_ID["fk"], id="nowhere", robot="nowhere")
    found = run(replace(BRIEF, rows=(row, ROWS_BY_ID["fk"])))
    assert found.skipped == ("nowhere",)
    assert "nowhere" in "\n".join(report.notes(found))


@pytest.mark.full
def test_a_library_that_is_missing_or_fails_does_not_end_the_run():
    def fails(task):
        raise ValueError("no such arm")

    def errs(task):
        return [Contestant("errs", lambda q: kin.fk(task.robot, q + 0.1), [(q,) for q in task.q], lambda T: [T])]

    peers = (
        Peer("absent", "no_such_module", fails),
        Peer("numpy", "numpy", fails),
        Peer("tomli-w", "tomli_w", errs),
    )
    found = run(brief("fk", peers=peers))
    assert found.missing == ("absent",)
    assert found.refused == (("fk", "numpy", "ValueError: no such arm"),)
    assert found.rows[0].named("errs").check.success == 0.0
    lines = "\n".join(report.notes(found))
    assert "not installed: absent" in lines
    assert "numpy could not take part: ValueError: no such arm" in lines
    assert found.faults == ()


@pytest.mark.full
def test_wrong_answers_of_kinboard_are_reported_as_faults(monkeypatch):
    monkeypatch.setattr(kin, "ik_branches", lambda robot, T, value: np.zeros((8, robot.n)))
    found = run(brief("ik-srs"))
    assert found.faults == (f"ik-srs: {OURS} misses targets or answers wrongly",)


@pytest.mark.full
def test_an_interrupted_run_reports_its_results_so_far():
    def stop(words):
        if words.startswith("round 2"):
            raise KeyboardInterrupt

    found = run(brief("fk"), stop)
    assert found.interrupted
    assert found.rounds == 2
    assert found.rows[0].named(OURS).turns.median > 0
    assert "interrupted" in "\n".join(report.notes(found))


@pytest.mark.full
@pytest.mark.parametrize(
    "row",
    [
        *("fk", "fk-batch", "ik-pioneer5", "ik-pioneer5-batch", "ik-srs", "solve-redundant7-craig"),
        *("touch-ur5e", "cage-panda-batch", "edge-panda"),
    ],
)
@pytest.mark.parametrize(
    "peer", [peer for peer in PEERS if peer.installed and peer.extra], ids=lambda peer: peer.name
)
def test_every_installed_peer_solves_the_same_task(peer, row):
    found = run(brief(row, peers=(peer,)))
    assert found.refused == ()
    for entry in found.rows[0].entries:
        if entry.check is not None and not entry.contestant.one:
            assert entry.check.success == 1.0
            assert entry.check.same in (None, 1.0)


# -- the command -------------------------------------------------------------------------------------------------


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(Settings, "quick", lambda self: replace(self, targets=4, batch=8, rounds=3, turn=1e-4))


def bench(capsys, *words):
    code = parser.main(["bench", *map(str, words)])
    out, err = capsys.readouterr()
    return code, out, err


@pytest.mark.full
def test_the_command_prints_and_writes_the_same_report(capsys, quick, tmp_path):
    files = tmp_path / "bench.json", tmp_path / "bench.svg"
    words = (
        "--quick",
        "--rows",
        "fk",
        "ik-pioneer5",
        "--peers",
        "none",
        "--json",
        files[0],
        "--picture",
        files[1],
    )
    code, out, err = bench(capsys, *words)
    assert code == 0
    assert "round 3 of 3" in err
    assert "wall clock" in out
    assert re.search(r"^fk, kinboard: [\d.]+ × empty call, at most \d+: ", out, re.MULTILINE)
    data = json.loads(files[0].read_text("utf-8"), parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert [row["id"] for row in data["rows"]] == ["fk", "ik-pioneer5"]
    assert [verdict["row"] for verdict in data["gate"]] == ["fk", "ik-pioneer5", "ik-pioneer5"]
    for row in data["rows"]:
        assert f"{row['id']}: " in out
        for contestant in row["contestants"]:
            assert re.search(rf"^{re.escape(contestant['name'])} +\d", out, re.MULTILINE)
            assert len(contestant["seconds"]) == data["rounds"]
    drawn = "".join(ET.parse(files[1]).getroot().itertext())
    assert all(row.title in drawn for row in ROWS if row.id in ("fk", "ik-pioneer5"))
    assert OURS in drawn


@pytest.mark.full
def test_processor_time_can_be_selected(capsys, quick):
    code, out, _ = bench(capsys, "--quick", "--rows", "fk", "--peers", "none", "--cpu-time")
    assert code == 0
    assert "processor time" in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--rows", "juggling"), "expected of fk, fk-batch"),
        (("--peers", "abacus"), "expected of numpy, pin"),
        (("--json", "/no/such/folder/x.json"), "folder that exists"),
        (("--picture", "/"), "folder that exists"),
    ],
)
def test_invalid_arguments_are_refused_before_the_run(capsys, words, said):
    code, out, err = bench(capsys, *words)
    assert (code, out) == (2, "")
    assert said in err


def test_a_requested_peer_must_be_installed(capsys, monkeypatch):
    monkeypatch.setattr(Peer, "installed", property(lambda self: self.module != "eaik"))
    code, out, err = bench(capsys, "--peers", "eaik", "numpy")
    assert (code, out) == (2, "")
    assert "not installed: eaik. pip install 'kinboard[bench]'" in err


def test_what_the_extra_does_not_bring_is_named_and_not_missed(capsys, monkeypatch):
    monkeypatch.setattr(Peer, "installed", property(lambda self: False))
    code, _, err = bench(capsys, "--peers", "vamp-planner")
    assert code == 2
    assert "pip install 'kinboard[bench]' vamp-planner installs all of them" in err
    seen = []

    def stopped(settings, say):
        seen.extend(peer.name for peer in settings.peers)
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "run", stopped)
    bench(capsys)
    assert seen == [peer.name for peer in PEERS if peer.name != "vamp-planner"]


def test_uncompiled_code_is_not_measured(capsys, monkeypatch):
    monkeypatch.setattr(command, "PLAIN", True)
    code, _, err = bench(capsys, "--peers", "none")
    assert code == 2
    assert "unset KINBOARD_KERNELS" in err


def test_ctrl_c_before_the_first_round_exits_with_a_message(capsys, monkeypatch):
    def stopped(settings, say):
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "run", stopped)
    code, out, err = bench(capsys, "--peers", "none")
    assert (code, out) == (130, "")
    assert err.splitlines()[-1] == "kinboard: stopped before anything was measured"


def test_the_extra_installs_every_peer():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extra = {re.match(r"[\w-]+", wanted).group() for wanted in project["optional-dependencies"]["bench"]}
    assert extra - {"scipy"} == {peer.name for peer in PEERS if peer.extra} - {"numpy"}


def test_every_row_has_a_floor_and_kinboard():
    for row in ROWS:
        task = prepare(row, 2, 1)
        if task is not None:
            # Clouds have two floors: computing and writing.
            assert [c.floor for c in FLOOR.enter(task)] == [True] * (2 if row.kind == "cloud" else 1)
            assert KINBOARD.enter(task)
