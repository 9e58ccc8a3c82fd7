"""What the page *How Kinboard knows* counts: the script, and that page and record are of one run."""

from __future__ import annotations

import json
import os
import sys
import time
from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

import kin

sys.path.insert(0, str(Path(__file__).parent))
from evidence import __main__ as evidence
from evidence import counting, times

ROOT = Path(__file__).parents[2]


def test_the_table_of_the_page_is_that_of_the_recorded_run():
    record = json.loads(evidence.RECORD.read_text(encoding="utf-8"))
    page = evidence.PAGE.read_text(encoding="utf-8")
    assert evidence.BEGIN + evidence.table(record["rows"]) + evidence.END in page
    assert record["run"]["targets"] >= 400
    for kind, row in record["rows"].items():
        assert row["targets"] > 0, kind
        assert row["false"] == 0, kind
        assert row["left_out"] <= 0.002 * row["targets"], kind
        assert max(row["position_error"], row["rotation_error"]) < 1e-9, kind


def test_the_recorded_run_has_every_arm_of_every_kind():
    record = json.loads(evidence.RECORD.read_text(encoding="utf-8"))
    recorded = {kind: row["arms"] for kind, row in record["rows"].items()}
    arms = Counter(each.kind for each in counting.questions(1, 1))
    assert recorded == arms, "python tests/bench/evidence --record --only KIND counts the arms of one kind"


def test_counts_of_one_kind_are_recorded_beside_the_others(monkeypatch, tmp_path):
    page, file = tmp_path / "evidence.md", tmp_path / "evidence.json"
    other, row = asdict(counting.Tally(1, 10, 0, 9)), asdict(counting.Tally(2, 3, 0, 3))
    before = {"run": {"commit": "0123abcd"}, "rows": {"slides3": {}, "pair2": other}}
    file.write_text(json.dumps(before), encoding="utf-8")
    page.write_text(f"before\n{evidence.BEGIN}{evidence.END}after\n", encoding="utf-8")
    monkeypatch.setattr(evidence, "PAGE", page)
    monkeypatch.setattr(evidence, "RECORD", file)
    monkeypatch.setattr(evidence, "tallies", lambda asked, processes: {asked[0].kind: counting.Tally(2, 3, 0, 3)})
    monkeypatch.setattr(sys, "argv", ["evidence", "--record", "--only", "slides3"])
    assert evidence.main() == 0
    record = json.loads(file.read_text(encoding="utf-8"))
    assert record["rows"] == {"slides3": row, "pair2": other}
    assert list(record["rows"]) == ["slides3", "pair2"]
    assert record["run"]["commit"] == "0123abcd"
    assert [each["rows"] for each in record["run"]["later"]] == [["slides3"]]
    shown = evidence.BEGIN + evidence.table(record["rows"]) + evidence.END
    assert page.read_text(encoding="utf-8") == f"before\n{shown}after\n"


@pytest.mark.parametrize("name", ["pioneer5", "iiwa14", "panda", "palletiser"])
def test_the_configuration_is_found(name):
    _, tally = counting.ask(counting.Question("arm", kin.get_robot(name), 3, seed=2))
    assert (tally.found, tally.false, tally.targets) == (3, 0, 3)
    assert tally.position_error < 1e-9


def test_an_answer_without_the_configuration_is_counted_as_false(monkeypatch):
    solve = kin.solve_ik

    def without_the_first(robot, T, **options):
        result = solve(robot, T, **options)
        q = evidence_q[0]
        kept = tuple(each for each in result.solutions if counting.apart(robot, each.q, q) > 1e-6)
        return replace(result, solutions=kept)

    robot = kin.get_robot("ur5")
    evidence_q = robot.random_q(np.random.default_rng(2), 1)
    monkeypatch.setattr(kin, "solve_ik", without_the_first)
    _, tally = counting.ask(counting.Question("arm", robot, 1, seed=2))
    assert (tally.found, tally.false) == (0, 1)


def test_counts_add_up_and_are_printed():
    one = counting.Tally(1, 10, 0, 9, 0, 1, {"proved": 9, "unknown": 1}, 1e-12, 2e-12)
    both = counting.Tally()
    both.add(one)
    both.add(counting.Tally(2, 990, 0, 990, 0, 0, {"proved": 990}, 3e-12, 0.0))
    line = evidence.table({"made up": asdict(both)}).splitlines()[-1]
    assert line == "| made up | 3 | 1000 | 99.90 % | 0 | 99.90 % | – | – | 0.10 % | 3e-12 |"


@pytest.mark.parametrize(
    ("part", "whole", "text"),
    [(0, 7, "–"), (7, 7, "all"), (1, 3, "33.3 %"), (1, 1000, "0.10 %"), (999, 1000, "99.90 %")],
)
def test_shares_do_not_round_to_all_or_none(part, whole, text):
    assert evidence.share(part, whole) == text


# Times


def test_the_times_of_the_page_are_those_of_the_recorded_run():
    page = evidence.PAGE.read_text(encoding="utf-8")
    shown = page.split(times.BEGIN)[1].split(times.END)[0]
    if not times.RECORD.exists():
        assert shown == "", "figures without a run behind them"
        return
    record = json.loads(times.RECORD.read_text(encoding="utf-8"))
    assert shown == times.section(record)
    assert times.why_not(record["run"]) == ""
    families = [times.family_of(kin.get_robot(name)) for name in record["rows"]]
    assert sorted(families) == sorted(times.family_of(arm) for arm in times.arms())


@pytest.fixture
def measured(monkeypatch, tmp_path):
    """Runs the command on one arm, in turns of a moment; returns its exit code and the page."""
    page = tmp_path / "evidence.md"
    page.write_text(f"before\n{times.BEGIN}{times.END}after\n", encoding="utf-8")
    monkeypatch.setattr(evidence, "PAGE", page)
    monkeypatch.setattr(times, "RECORD", tmp_path / "times.json")
    monkeypatch.setattr(times, "arms", lambda: [kin.get_robot("planar2r")])
    whole = times.run
    monkeypatch.setattr(times, "run", lambda arms: whole(arms, rounds=3, turn=1e-4))

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["evidence", "--times", *words])
        return evidence.main(), page.read_text(encoding="utf-8")

    return run


@pytest.mark.full
def test_times_of_an_idle_machine_are_recorded_with_its_name(measured, monkeypatch):
    monkeypatch.setattr(times, "busy_seconds", times.own_seconds)
    monkeypatch.setattr(times, "commit", lambda: "0123abcd")
    code, page = measured("--record")
    record = json.loads(times.RECORD.read_text(encoding="utf-8"))
    assert code == 0
    assert page == f"before\n{times.BEGIN}{times.section(record)}{times.END}after\n"
    about, row = record["run"], record["rows"]["planar2r"]
    for said in (about["processor"], f"{about['cores']} cores", "commit 0123abcd"):
        assert said in page
    assert row["family"] == "pair2"
    assert 1e-8 < row["pose"] < row["answer"]
    assert (row["in_batch"] > 0.0, row["batch"] >= 64) == (True, True)


@pytest.mark.full
@pytest.mark.parametrize(
    ("busy", "commit", "said"),
    [(2.0, "0123abcd", "other processes used"), (0.0, "0123abcd+", "kin/ or app/ has changes")],
)
def test_times_beside_other_work_or_of_changed_code_are_not_recorded(
    measured, monkeypatch, capsys, busy, commit, said
):
    def busy_seconds():
        return times.own_seconds() + busy * time.perf_counter()

    monkeypatch.setattr(times, "busy_seconds", busy_seconds)
    monkeypatch.setattr(times, "commit", lambda: commit)
    code, page = measured("--record")
    assert code == 1
    assert page == f"before\n{times.BEGIN}{times.END}after\n"
    assert not times.RECORD.exists()
    assert f"not recorded: {said}" in capsys.readouterr().err
    assert measured()[0] == 0


def test_a_part_is_never_recorded(measured, capsys):
    with pytest.raises(SystemExit):
        measured("--record", "--only", "planar2r")
    assert "without --only" in capsys.readouterr().err


def test_processor_time_is_read_as_the_kernel_writes_it(tmp_path):
    stat = tmp_path / "stat"
    stat.write_text("cpu  100 20 30 9000 400 5 6 7 0 0\ncpu0 1 2 3\n", encoding="utf-8")
    assert times.busy_seconds(stat) == 168 / os.sysconf("SC_CLK_TCK")
    assert times.busy_seconds() > times.own_seconds() > 0.0
