"""Which kernels are compiled: the order and what is wanted first."""

from __future__ import annotations

import subprocess
import sys

import pytest

from app.shared.preparation import Preparation
from kin.files import classic_robots
from kin.solvers import NUMERIC, family_of
from kin.warmup import MADE_UP, all_of, first_family, made_up_arms, parts


def begun() -> Preparation:
    made = Preparation()
    made.begin()
    return made


def finish_part(preparation: Preparation, name: str) -> None:
    while not preparation.ready((name,)):
        preparation.done(name)


def test_every_family_has_its_parts():
    for robot in classic_robots().values():
        assert (family_of(robot) in parts()) == (family_of(robot) != first_family())
        assert all_of(family_of(robot)) in parts()
    assert all(steps for steps in parts().values())


@pytest.mark.full
def test_parts_are_listed_without_compiling_for_arms_that_visitors_may_bring():
    """Matching a general arm compiles for many seconds, which an event loop would wait for."""
    assert tuple(map(family_of, made_up_arms())) == MADE_UP
    program = (
        "from kin import warmup; from kin.solvers.general6.batch import solve_all\n"
        "warmup.parts(); assert not solve_all.overloads\n"
        "warmup.family_of(warmup.made_up_arms()[2]); assert solve_all.overloads"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_parts_come_in_their_order_and_are_ready_with_their_last_step():
    preparation, seen = begun(), []
    while (task := preparation.next()) is not None:
        name, step = task
        done, of = preparation.steps((name,))
        assert step is parts()[name][done]
        assert of == len(parts()[name])
        assert not preparation.complete
        assert not preparation.ready((name,))
        assert preparation.state[1] == name
        preparation.done(name)
        seen.append(task)
    assert seen == [(name, step) for name, steps in parts().items() for step in steps]
    assert preparation.complete
    assert preparation.ready(parts())
    assert preparation.state == ([first_family(), *parts()], None, [])


def test_what_is_wanted_comes_next_even_within_another_part():
    preparation = begun()
    first, *others = parts()
    preparation.done(first)
    preparation.want((others[4], "no part", others[2]))
    assert preparation.next() == (others[2], parts()[others[2]][0])
    assert preparation.state[2] == [name for name in parts() if name != others[2]]
    finish_part(preparation, others[2])
    assert preparation.next() == (others[4], parts()[others[4]][0])
    finish_part(preparation, others[4])
    assert preparation.next() == (first, parts()[first][1])
    assert not preparation.ready((others[2], first))
    assert preparation.ready((others[2], others[4]))


def test_other_names_are_never_waited_for():
    preparation = begun()
    assert preparation.ready((first_family(), NUMERIC, "no part"))
    assert preparation.ready(())
    assert preparation.steps(("no part",)) == (0, 0)


def test_nothing_is_waited_for_before_the_begin_and_after_the_end():
    preparation = Preparation()
    assert preparation.ready(parts())
    preparation.begin()
    assert not preparation.ready(parts())
    preparation.finish()
    assert preparation.ready(parts())
