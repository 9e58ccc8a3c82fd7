"""What goes on in a feature by itself, and facts that last as long as what they have read."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from threading import Event
from typing import Any

import numpy as np
import pytest
from bare_page import STORE, bare_page

from app.shared.computations import ComputationCache, SharedComputation, Subscription
from app.viewer.arm import Arm
from app.viewer.declared.facts import ArmReads, Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, memory
from app.viewer.declared.panel import Html, Node, same
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.scene import frame
from app.viewer.declared.work import NOTHING, Runner, Sweep, Wait, Work, in_background
from app.viewer.feature import Feature
from kin import InputError, Obstacle

UR5 = STORE.get("ur5")


def runner() -> Runner:
    return Runner(lambda: None)


def work(begin: Callable[..., Any], *args: object, **more: Any) -> Work:
    return Work("one", begin, args, **more)


def items(*found: object) -> Callable[..., Iterator[object]]:
    return lambda *_: iter(found)


def test_work_is_done_once_for_its_arguments_and_again_for_others() -> None:
    asked: list[object] = []
    one = runner()

    def begin(x: np.ndarray) -> float:
        asked.append(x)
        return float(x.sum())

    for x in (np.ones(2), np.ones(2), np.zeros(2)):
        again, _ = one.go_on([work(begin, x)], 0.0)
        assert again is None
    assert len(asked) == 2
    assert one.results["one"].value == 0.0
    assert one.go_on([], 0.0) == (None, [])
    assert one.results == {}, "what is no longer declared has no result"


def test_an_iterator_gives_one_item_a_time_each_the_result_so_far() -> None:
    one, declared = runner(), [work(items(None, 1, None, 2))]
    values, news = [], []
    while (found := one.go_on(declared, 0.0))[0] is not None:
        news += found[1]
        values.append(one.results["one"].value if "one" in one.results else None)
    assert values == [None, 1, 1, 2, 2]
    assert news == ["one"] * 3, "two results and the end"
    assert one.results["one"].finished


def test_only_one_slice_is_taken_at_a_time_and_the_first_work_comes_first() -> None:
    one = runner()
    declared = [Work("a", items(1, 2)), Work("b", items(3))]
    order = []
    while one.go_on(declared, 0.0)[0] is not None:
        order.append({key: found.value for key, found in one.results.items()})
    assert order[0] == {"a": 1}
    assert order[-1] == {"a": 2, "b": 3}


def test_work_begins_when_its_arguments_rest_and_not_more_often_than_its_pace() -> None:
    one = runner()
    for now, x in ((0.0, 1), (0.1, 2), (0.2, 3)):
        assert one.go_on([work(abs, x, rest=0.25)], now) == (0.25, [])
    assert one.go_on([work(abs, 3, rest=0.25)], 0.5) == (None, ["one"])
    two = runner()
    assert two.go_on([work(abs, -1, pace=0.2, keep=True)], 1.0) == (None, ["one"])
    again, _ = two.go_on([work(abs, -2, pace=0.2, keep=True)], 1.05)
    assert again == pytest.approx(0.15)
    assert two.results["one"].value == 1, "the last result stays"
    two.go_on([work(abs, -3, pace=0.2, keep=True)], 1.3)
    assert two.results["one"].value == 3


def test_results_are_the_same_object_while_work_waits() -> None:
    one = runner()
    before = one.results
    for k in range(3):
        one.go_on([work(str, k, rest=1.0)], 0.1 * k)
    assert one.results is before, "so facts are not made again for it"


def test_what_is_under_way_is_finished_first_if_its_result_is_kept_and_dropped_otherwise() -> None:
    for keep, expected in ((True, [1, 1, 1, 1, 2, 2]), (False, [2, 2])):
        one, values = runner(), []
        assert one.go_on([work(lambda x: iter([None, x, x]), 1, keep=keep)], 0.0)[0] == 0.0
        while one.go_on([work(lambda x: iter([None, x]), 2, keep=keep)], 1.0)[0] is not None:
            found = one.results.get("one")
            values += [] if found is None else [found.value]
        assert values == expected


def test_an_iterator_may_wait() -> None:
    one, declared = runner(), [work(items(1, Wait(0.5), 2)), Work("other", items(3))]
    assert one.go_on(declared, 0.0) == (0.0, ["one"])
    assert one.go_on(declared, 0.0) == (0.0, ["other"]), "other work goes on meanwhile"
    assert one.results["one"].value == 1
    assert one.go_on(declared, 0.0) == (0.0, ["one"]), "it is asked again whenever something happens"
    assert one.results["one"].value == 2


def test_work_that_goes_on_begins_with_its_last_result_which_stays_meanwhile() -> None:
    one = runner()

    def count(to: int, last: int | None) -> Iterator[int | None]:
        yield None
        yield from range((last or 0) + 1, to + 1)

    def until(to: int, value: int) -> None:
        while one.results.get("one", NOTHING).value != value:
            assert one.go_on([work(count, to, goes_on=True)], 0.0)[0] == 0.0

    until(9, 2)
    one.go_on([work(count, 4, goes_on=True)], 0.0)
    assert (one.results["one"].value, one.results["one"].finished) == (2, False), "it stays"
    until(4, 4)
    while one.go_on([work(count, 4, goes_on=True)], 0.0)[0] is not None:
        pass
    assert one.results["one"].finished
    one.go_on([work(count, 6, goes_on=True)], 0.0)
    assert (one.results["one"].value, one.results["one"].finished) == (4, False)
    one.go_on([], 0.0)
    assert one.results == {}


def test_errors_are_results() -> None:
    def broken() -> Iterator[int]:
        yield 1
        raise ValueError("why")

    one = runner()
    while one.go_on([work(broken)], 0.0)[0] is not None:
        pass
    found = one.results["one"]
    assert (found.value, found.finished, str(found.error)) == (1, True, "why")
    one.go_on([Work("two", lambda: 1 // 0)], 0.0)
    assert isinstance(one.results["two"].error, ZeroDivisionError)


def test_a_shared_computation_tells_its_progress_and_is_left() -> None:
    starts, began, goes_on, woke = Event(), Event(), Event(), Event()
    cache = ComputationCache[str](ThreadPoolExecutor(1), 4)

    def compute(shared: SharedComputation[str]) -> str:
        assert starts.wait(30)
        shared.done, shared.total, shared.latest = 1, 2, "half"
        began.set()
        assert goes_on.wait(30)
        shared.check()
        return "whole"

    one = Runner(woke.set)
    declared = [work(lambda: cache.subscribe("key", compute), poll=0.5)]
    one.go_on(declared, 0.0)
    starts.set()
    assert began.wait(30)
    assert one.go_on(declared, 0.1) == (0.5, ["one"])
    found = one.results["one"]
    assert (found.value, found.done, found.total, found.finished) == ("half", 1, 2, False)
    goes_on.set()
    assert woke.wait(30)
    assert one.go_on(declared, 0.2)[1] == ["one"]
    assert (one.results["one"].value, one.results["one"].finished) == ("whole", True)

    goes_on.clear()
    two = runner()
    two.go_on([work(lambda: cache.subscribe("other", compute))], 0.0)
    assert "other" in cache
    two.go_on([], 0.0)
    assert "other" not in cache, "nobody waits for it"
    goes_on.set()


def test_work_in_the_background_is_its_visitors_alone_and_ends_with_the_interest_in_it() -> None:
    began, goes_on, ended = Event(), Event(), Event()

    def compute(shared: SharedComputation[object], *args: object) -> object:
        began.set()
        assert goes_on.wait(30)
        try:
            shared.check()
        finally:
            ended.set()
        return object(), args

    woke = [Event(), Event()]
    declared = [work(in_background(compute), 1, 2)]
    one, two = (Runner(event.set) for event in woke)
    for each in (one, two):
        each.go_on(declared, 0.0)
    goes_on.set()
    assert all(event.wait(30) for event in woke)
    for each in (one, two):
        each.go_on(declared, 0.1)
    assert one.results["one"].value[1] == (1, 2)
    assert one.results["one"].value[0] is not two.results["one"].value[0], "nothing is shared or kept"

    goes_on.clear()
    began.clear()
    ended.clear()
    one.go_on([work(in_background(compute), 3)], 0.2)
    assert began.wait(30)
    one.go_on([], 0.3)
    goes_on.set()
    assert ended.wait(30)
    assert one.results == {}


class Ends(Subscription[str]):
    """A subscription whose computation ends, with the result or with an error, while its progress is read."""

    def __init__(self, error: Exception | None) -> None:
        self.computation: SharedComputation[str] = SharedComputation("key")
        self.computation.latest = "half"
        self.error = error
        super().__init__(self.computation, lambda: None)

    @property
    def total(self) -> int:
        if not self.finished:
            if self.error is None:
                self.computation.latest = "whole"
                self.future.set_result("whole")
            else:
                self.future.set_exception(self.error)
        return 2


def test_a_computation_that_ends_while_it_is_looked_at_is_seen_whole() -> None:
    failed = ValueError("why")
    for error, value in ((None, "whole"), (failed, "half")):
        one, ends = runner(), Ends(error)
        declared = [work(lambda ends=ends: ends, poll=0.5)]
        while one.go_on(declared, 0.0)[0] is not None:
            pass
        found = one.results["one"]
        assert (found.value, found.finished, found.error) == (value, True, error)


def test_a_motion_gets_the_seconds_that_have_passed_but_no_long_pause() -> None:
    passed: list[float] = []
    one, declared = runner(), [Sweep(passed.append, 0.25)]
    assert one.go_on(declared, 1.0)[0] == 0.25
    assert one.go_on(declared, 1.1)[0] == pytest.approx(0.15)
    one.go_on([Sweep(passed.append, 0.25, most=9.0)], 1.5)
    one.go_on(declared, 9.0)
    assert passed == [0.1, pytest.approx(0.5), 0.1]


# Facts


def test_an_arm_follows_another_one_as_long_as_all_that_was_read_is_the_same() -> None:
    q, other = UR5.q_home, UR5.q_home + 0.1
    first = Arm(UR5, q, q)
    reads = ArmReads(first)
    assert reads.follow(Arm(UR5, other, q)), "nothing was read"
    assert reads.q is other
    assert reads.follow(Arm(UR5, other.copy(), other))
    assert not reads.follow(Arm(UR5, q, q))
    assert reads.q.tolist() == other.tolist(), "it stays what it was"
    of_goal = ArmReads(first)
    assert of_goal.aim is first.T_goal
    assert of_goal.follow(Arm(UR5, other, q))
    assert of_goal.contacts_at(q) == ()
    assert of_goal.follow(Arm(UR5, other, q, target=first.T_goal.copy())), "the same pose is wanted"
    assert not of_goal.follow(Arm(UR5, other, other))


NAMES = sorted({field.name for field in fields(Arm)} | {n for n in vars(Arm) if not n.startswith("_")})


@pytest.mark.parametrize("name", [field.name for field in fields(Arm)])
def test_every_value_that_differs_when_one_field_of_an_arm_does_is_named(name: str) -> None:
    q = UR5.q_home
    others: dict[str, Any] = {
        "robot": STORE.get("puma560"),
        "q": q + 0.1,
        "goal": q + 0.1,
        "target": np.eye(4),
        "task": "position",
        "branch": "seed",
        "locks": (True,) * 6,
        "obstacles": (Obstacle("table", (0.6, 0.0, 0.4), size=(0.8, 0.6, 0.1)),),
        "avoid": True,
    }
    first = Arm(UR5, q, q, locks=(False,) * 6)
    second = replace(first, **{name: others[name]})
    differ = {each for each in NAMES if not same((getattr(first, each),), (getattr(second, each),))}
    assert name in differ
    assert second.changes(first) >= differ - {"changes"}
    reads = ArmReads(first)
    assert reads.task == "pose"
    assert reads.untouched(second.changes(first)) == (name not in ("task", "robot"))


@dataclass(frozen=True)
class Nothing(Settings):
    ticks: int = memory(0)
    runs: bool = memory(False)


class Still(DeclaredFeature[Nothing, Facts[Nothing]]):
    """Its panel reads the goal, its scene nothing."""

    key, title, settings_of, facts_of = "still", "Still", Nothing, Facts

    def started(self) -> None:
        self.panels, self.scenes = 0, 0

    def panel(self) -> Sequence[Node]:
        self.panels += 1
        return [Html("{} {}".format, (self.read.arm.goal.tolist(), self.settings.ticks))]

    def scene(self) -> Sequence[SceneNode]:
        self.scenes += 1
        return [frame("one")]

    def running(self) -> Sequence[Work | Sweep]:
        fail = [Work("fails", self.fail)] if self.settings.ticks == 3 else []
        return [*fail, *([Sweep(self.count, 0.01)] if self.settings.runs else [])]

    def count(self, seconds: float) -> None:
        self.change(ticks=self.settings.ticks + 1, runs=self.settings.ticks < 2)

    def fail(self) -> None:
        raise InputError("this", 5, "something else")


def test_a_panel_and_a_scene_that_do_not_read_the_configuration_are_not_made_again_for_it() -> None:
    with bare_page(UR5) as page:
        still = page.open(Still)
        made = still.panels, still.scenes
        for k in range(1, 4):
            page.now = replace(page.now, q=UR5.q_home + 0.1 * k)
            still.on_arm_changed(page.now.changes(None))
            page.rest()
        assert (still.panels, still.scenes) == made
        assert still.read.q is page.now.q, "facts are those of the arm on show"
        for k in range(1, 4):
            page.now = replace(page.now, goal=UR5.q_home + 0.1 * k)
            still.on_arm_changed(page.now.changes(None))
            page.rest()
        assert still.panels == made[0] + 3


def test_a_motion_changes_settings_that_are_shown_and_errors_of_work_are_raised_after_it_is() -> None:
    with bare_page(UR5) as page:
        still = page.open(Still)
        still.change(runs=True)
        still.schedule()
        with pytest.raises(InputError, match="this: got 5"):
            page.rest()
        assert still.settings.ticks == 3
        page.rest()
        assert not still.settings.runs
        assert page.panel()[0]["content"].endswith(" 3")


class Tab(Feature):
    """A tab with a part whose work ends in a thread."""

    key, title = "tab", "Tab"

    def __init__(self, stage: Any) -> None:
        super().__init__(stage)
        self.posted: list[Hashable] = []
        self.woken = Event()

    def post(self, key: Hashable, value: object = None) -> None:
        self.posted.append(key)
        self.woken.set()


class Late(Still):
    def running(self) -> Sequence[Work | Sweep]:
        return [Work("five", in_background(lambda _: 5))]


def test_the_end_of_work_in_a_part_wakes_the_tab_that_it_is_in() -> None:
    with bare_page(UR5) as page:
        tab = Tab(page)
        part = Late(page, tab)
        part.tick(time.perf_counter())
        assert tab.woken.wait(30)
        assert tab.posted == [("done", ())], "as if it were the tab's own: it completes what the visitor did"
        part.tick(time.perf_counter())
        assert part.facts.work("five").value == 5
