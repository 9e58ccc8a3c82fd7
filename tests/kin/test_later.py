"""A `Later` is the tuple that it becomes, and computes it once, when something asks for it."""

from __future__ import annotations

import copy
import pickle
import threading

import pytest

from kin.later import Later


@pytest.fixture
def asked() -> list[int]:
    return []


@pytest.fixture
def later(asked) -> Later[str]:
    return Later(lambda: asked.append(1) or ["a", "b", "c"])


def test_nothing_is_computed_before_it_is_asked_for(later, asked):
    assert later
    assert asked == []
    assert (len(later), later[1], later[1:], list(later), "c" in later) == (
        3,
        "b",
        ("b", "c"),
        ["a", "b", "c"],
        True,
    )
    assert asked == [1]


def test_it_is_equal_to_its_tuple_both_ways_and_hashes_and_prints_like_it(later):
    assert later == ("a", "b", "c")
    other: object = ("a", "b", "c")
    assert other == later
    assert later != ("a", "b")
    assert later != ["a", "b", "c"], "as for tuples"
    assert later == Later(lambda: "abc")
    assert hash(later) == hash(("a", "b", "c"))
    assert repr(later) == "('a', 'b', 'c')"


def test_a_copy_and_a_pickle_are_the_tuple(later):
    for found in (copy.deepcopy(later), pickle.loads(pickle.dumps(later))):
        assert found == ("a", "b", "c")
        assert type(found) is tuple


def test_what_fails_is_asked_for_again(asked):
    def compute():
        asked.append(1)
        if len(asked) == 1:
            raise MemoryError("once")
        return "ab"

    found = Later(compute)
    with pytest.raises(MemoryError):
        len(found)
    assert found == ("a", "b")


def test_threads_that_ask_at_the_same_time_all_get_the_elements():
    inside = threading.Barrier(4)

    def compute():
        inside.wait(10.0)  # all four are computing
        return "ab"

    later, found = Later(compute), []
    threads = [threading.Thread(target=lambda: found.append(later[:])) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(10.0)
    assert found == 4 * [("a", "b")]
