"""What the page *How Kinboard knows* counts: the script, and that page and record are of one run."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

import kin

sys.path.insert(0, str(Path(__file__).parent))
from evidence import __main__ as evidence
from evidence import counting

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


def test_the_recorded_run_has_every_kind_of_arm():
    record = json.loads(evidence.RECORD.read_text(encoding="utf-8"))
    assert set(record["rows"]) == {each.kind for each in counting.questions(1, 1)}


@pytest.mark.parametrize("name", ["pioneer5", "iiwa14", "panda"])
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
    assert line == "| made up | 3 | 1000 | 99.90 % | 0 | 99.90 % | – | 0.10 % | 3e-12 |"


@pytest.mark.parametrize(
    ("part", "whole", "text"),
    [(0, 7, "–"), (7, 7, "all"), (1, 3, "33.3 %"), (1, 1000, "0.10 %"), (999, 1000, "99.90 %")],
)
def test_shares_do_not_round_to_all_or_none(part, whole, text):
    assert evidence.share(part, whole) == text
