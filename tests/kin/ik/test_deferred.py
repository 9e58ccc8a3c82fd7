"""Results whose parts are made when they are read."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import numpy as np
import pytest

import kin.ik.assembly
from kin import IKResult, fk, get_robot, solve_ik
from kin.ik import IKSolution
from kin.ik.results import Deferred


def answer(name: str = "iiwa14", **options: object) -> IKResult:
    arm = get_robot(name)
    return solve_ik(arm, fk(arm, arm.q_home + 0.1), **options)  # type: ignore[arg-type]


def fields_of(value: Deferred) -> dict[str, str]:
    return {field.name: repr(getattr(value, field.name)) for field in dataclasses.fields(value)}  # type: ignore[arg-type]


def test_redundancies_are_made_when_one_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    made = kin.ik.assembly.redundancy_of
    monkeypatch.setattr(kin.ik.assembly, "redundancy_of", lambda *given: calls.append(1) or made(*given))
    result = answer()
    assert len(result.solutions) > 1
    assert result.best is not None
    assert not calls
    read = [solution.redundancy for solution in result.solutions]
    assert all(read)
    assert result.redundancy[0].value == read[0][0].value
    assert result.details.redundant  # type: ignore[union-attr]
    assert len(calls) == 1


@pytest.mark.parametrize("name", ["iiwa14", "puma560", "pioneer5", "ur5"])
def test_copies_and_pickles_of_an_unread_result_are_whole(name: str) -> None:
    expected = fields_of(answer(name))
    for twin in (copy.copy(answer(name)), copy.deepcopy(answer(name)), pickle.loads(pickle.dumps(answer(name)))):
        assert fields_of(twin) == expected
        assert twin.reason == answer(name).reason
        assert not hasattr(twin, "_source")
    first, second = answer(name).solutions[0], pickle.loads(pickle.dumps(answer(name).solutions[0]))
    assert fields_of(first) == fields_of(second)


def test_a_part_is_made_once_and_may_be_replaced() -> None:
    result = answer()
    assert result.solutions is result.solutions
    assert result.solutions[0].redundancy is result.solutions[0].redundancy
    result = answer()
    result.solutions = ()
    assert result.solutions == ()
    shorter = dataclasses.replace(answer(), task="other")
    assert (shorter.task, len(shorter.solutions)) == ("other", len(answer().solutions))


def test_names_that_do_not_exist_are_attribute_errors() -> None:
    for value in (answer(), answer().solutions[0]):
        with pytest.raises(AttributeError, match="no attribute 'angle'"):
            _ = value.angle  # type: ignore[attr-defined,union-attr]
    empty = IKSolution.__new__(IKSolution)
    with pytest.raises(AttributeError, match="_source"):
        _ = empty.q


def test_solutions_cannot_be_written_to_and_do_not_change_each_other() -> None:
    first, second = answer().solutions[:2]
    assert not first.q.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        first.q[0] = 0.0
    assert not np.array_equal(first.q, second.q)


def test_a_limit_on_solutions_does_not_change_what_is_said_about_all() -> None:
    few, all_of_them = answer(max_solutions=2), answer()
    assert len(few.solutions) == 2
    assert few.details == all_of_them.details
    assert few.redundancy == all_of_them.redundancy
