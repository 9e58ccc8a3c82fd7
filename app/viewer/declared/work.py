"""Long work and motions of a feature, as values: what goes on is what the feature declares for its present facts.

Work of the same key goes on as long as its arguments are the same; other arguments begin it anew, and what is no
longer declared ends. Results are in `Facts.works`, so that a feature keeps none of them itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

from app.shared.computations import ComputationCache, Subscription
from app.shared.threads import lower_priority
from app.viewer.declared.panel import same

_END = object()
# Nothing is kept: no visitor needs the result of another.
_ALONE = ComputationCache[Any](ThreadPoolExecutor(64, "feature-work", lower_priority), 0)


@dataclass(frozen=True, eq=False)
class Work:
    """What takes longer than a frame.

    Attributes:
        key: of its result.
        begin: called with `args`. It returns the result; or an iterator, of which the worker takes one item when
            it is idle, each the result so far, or None, or a `Wait`; or a subscription of a shared computation.
        rest: begins when the arguments have been the same for so long (s).
        pace: begins at most once in so many seconds.
        poll: looks at the progress of a shared computation at this interval (s); 0: at its end alone.
        keep: whether its last result stays until there is another. What is under way with other arguments is then
            finished first, so that there are results while an arm moves.
        every: an iterator goes on after so many seconds, or earlier if something else happens.
        goes_on: whether it goes on with other arguments from what it has come to: `begin` also gets its last
            result, None at first, which stays until there is another.
    """

    key: str
    begin: Callable[..., Any]
    args: tuple[Any, ...] = ()
    rest: float = 0.0
    pace: float = 0.0
    poll: float = 0.0
    keep: bool = False
    every: float = 0.0
    goes_on: bool = False


@dataclass(frozen=True)
class Wait:
    """What an iterator gives if it has nothing to do for so many seconds, unless something happens."""

    seconds: float


def in_background(compute: Callable[..., Any]) -> Callable[..., Subscription[Any]]:
    """What begins work in a thread of low priority, for this visitor alone.

    `compute` gets the computation, a `SharedComputation`, before the arguments of the work.
    """
    return lambda *args: _ALONE.subscribe(object(), lambda computation: compute(computation, *args))


@dataclass(frozen=True)
class Sweep:
    """What moves by itself: `step` is called every so many seconds, with those that have passed since.

    After a pause it goes on where it was: `most` seconds pass.
    """

    step: Callable[[float], None]
    every: float
    most: float = 0.1


@dataclass(frozen=True, eq=False)
class Result:
    """What long work has come to.

    Attributes:
        value: the result, or the newest partial one; None: there is none yet.
        done, total: progress of a shared computation; `total` is 0 until it is known.
        finished: whether it has ended.
        error: why there is no result.
        args: the arguments that it was computed from. The feature may declare others before the work begins anew.
    """

    value: Any = None
    done: int = 0
    total: int = 0
    finished: bool = False
    error: BaseException | None = None
    args: tuple[Any, ...] = ()


NOTHING = Result()
Results = Mapping[str, Result]


@dataclass(slots=True, eq=False)
class _Job:
    args: tuple[Any, ...]
    since: float  # when these were first asked for
    waits: bool = True
    begun: float = -math.inf
    task: Any = None  # an iterator, a subscription


class Runner:
    """Carries on what a feature declares; time is `time.perf_counter`'s.

    Args:
        wake: called by any thread when a shared computation has ended.

    Attributes:
        results: of all work that is declared, by keys; another object whenever one of them changes.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._jobs: dict[str, _Job] = {}
        self._stepped: dict[Callable[[float], None], float] = {}
        self.results: Results = {}

    def go_on(self, declared: Sequence[Work | Sweep], now: float) -> tuple[float | None, list[str]]:
        """Do what is due, one slice of work at most.

        Returns in how many seconds to go on (None: there is nothing), and the keys of work that has come further.
        """
        works = [one for one in declared if isinstance(one, Work)]
        for key in self._jobs.keys() - {work.key for work in works}:
            self._end(self._jobs.pop(key))
            self._set(key, None)
        waits, news = [], list[str]()
        for work in works:
            before = self.results.get(work.key)
            waits.append(self._carry_on(work, now))
            if self.results.get(work.key) is not before:
                news.append(work.key)
            if waits[-1] == 0.0:
                break
        return min((wait for wait in (*waits, *self._step(declared, now)) if wait is not None), default=None), news

    def end(self) -> None:
        """End all work, and forget the results."""
        for job in self._jobs.values():
            self._end(job)
        self._jobs, self._stepped, self.results = {}, {}, {}

    def _step(self, declared: Sequence[Work | Sweep], now: float) -> list[float]:
        sweeps = [one for one in declared if isinstance(one, Sweep)]
        stepped = {one.step: self._stepped.get(one.step, now - one.every) for one in sweeps}
        self._stepped = stepped
        for one in sweeps:
            if (passed := now - stepped[one.step]) >= one.every:
                stepped[one.step] = now
                one.step(min(passed, one.most))
        return [one.every - (now - stepped[one.step]) for one in sweeps]

    def _carry_on(self, work: Work, now: float) -> float | None:
        job = self._jobs.get(work.key)
        if job is None:
            job = self._jobs[work.key] = _Job(work.args, now)
        elif not (job.task is not None and work.keep) and not same(work.args, job.args):
            self._end(job)
            job.args, job.since, job.waits = work.args, now, True
            if not (work.keep or work.goes_on):
                self._set(work.key, None)
        if job.waits:
            if (wait := max(work.rest - (now - job.since), work.pace - (now - job.begun))) > 0.0:
                return wait
            job.waits, job.begun = False, now
            self._begin(work, job)
        return None if job.task is None else self._look(work, job)

    def _begin(self, work: Work, job: _Job) -> None:
        last = self.results.get(work.key, NOTHING).value
        try:
            found = work.begin(*job.args, last) if work.goes_on else work.begin(*job.args)
        except Exception as error:  # noqa: BLE001 - it is in the result
            self._set(work.key, Result(finished=True, error=error))
            return
        if isinstance(found, Iterator | Subscription):
            job.task = found
            if work.goes_on:
                self._set(work.key, Result(last))  # not finished any more
        else:
            self._set(work.key, Result(found, finished=True))
        if isinstance(found, Subscription) and not found.finished:
            found.future.add_done_callback(lambda _: self._wake())

    def _look(self, work: Work, job: _Job) -> float | None:
        """Take the next slice, or look at the progress; returns in how many seconds to look again."""
        last = self.results.get(work.key, NOTHING)
        if isinstance(job.task, Subscription):
            task = job.task
            finished = task.finished  # first: what is read after the end is whole
            error = task.future.exception() if finished else None
            now = Result(task.latest, task.done, task.total, finished, error)
            seen = last.done, last.total, last.finished
            if now.value is not last.value or (now.done, now.total, now.finished) != seen:
                self._set(work.key, now)
            if now.finished:
                self._end(job)
            return 0.0 if now.finished else work.poll or None
        try:
            found = next(job.task, _END)
        except Exception as error:  # noqa: BLE001 - it is in the result
            job.task = None
            self._set(work.key, Result(last.value, finished=True, error=error))
            return 0.0
        if found is _END:
            job.task = None
            self._set(work.key, Result(last.value, finished=True))
        elif isinstance(found, Wait):
            return found.seconds
        elif found is not None and found is not last.value:
            self._set(work.key, Result(found))
        return work.every

    @staticmethod
    def _end(job: _Job) -> None:
        if isinstance(job.task, Subscription):
            job.task.leave()
        job.task = None

    def _set(self, key: str, result: Result | None) -> None:
        if result is None and key not in self.results:
            return
        others = {name: one for name, one in self.results.items() if name != key}
        self.results = others if result is None else {**others, key: replace(result, args=self._jobs[key].args)}
