"""How large the workspace is: bounding box, reach, holes, volume, surface, and its section."""

from __future__ import annotations

import math
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from queue import SimpleQueue
from typing import Annotated

from fastapi import Query, Request, Response
from pydantic import Field

from app.api.body import versioned
from app.api.problems import FieldError, invalid, show
from app.api.schemas import RobotId, refusals, reply, robot_of
from app.api.work import busy, work_of
from app.api.workspace.query import NUMBER, RegionQuery, number
from app.shared.answers.workspace import WorkspaceAnswer, workspace_answer
from app.shared.processor import spread
from kin import section, workspace_facts

router = versioned("workspace")


class SummaryQuery(RegionQuery):
    """What is wanted."""

    volume: bool = Field(
        True, description="Whether volume and surface are wanted: seconds the first time, the rest a tenth of one."
    )
    effort: int = Field(
        4, ge=2, le=16, description="How much work goes into volume and surface; errors shrink with it."
    )
    section: bool = Field(
        False, description="Whether the section in r and z is wanted, with the arcs of its boundary."
    )
    plane: str | None = Field(
        None,
        max_length=200,
        description="The section in this plane instead, `X:Y:Z:NX:NY:NZ`: a point of it in metres, and a normal.",
        examples=["0:0:0.1:0:0:1"],
        json_schema_extra={"pattern": rf"^{NUMBER}(:{NUMBER}){{5}}$"},
    )
    resolution: int = Field(96, ge=8, le=400, description="Squares along the longer side of the section.")

    def cut(self) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """Point and normal of the plane; raises 422."""
        if self.plane is None:
            return None
        values = tuple(map(number, self.plane.split(":")))
        if len(values) != 6 or not all(map(math.isfinite, values)) or not any(values[3:]):
            expected = "X:Y:Z:NX:NY:NZ, a point in metres and a normal that is not zero"
            raise invalid(FieldError(field="plane", value=show(self.plane), expected=expected))
        return values[:3], values[3:]


class Threads:
    """Threads that work futures off, and that nobody waits for when the process ends, as for an executor's."""

    def __init__(self, most: int, name: str) -> None:
        self._most = most
        self._name = name
        self._running = 0
        self._waiting: SimpleQueue[tuple[Future[WorkspaceAnswer], Callable[[], WorkspaceAnswer]] | None]
        self._waiting = SimpleQueue()

    def submit(self, compute: Callable[[], WorkspaceAnswer]) -> Future[WorkspaceAnswer]:
        """What `compute` will return; not to be called by several threads at a time."""
        future: Future[WorkspaceAnswer] = Future()
        self._waiting.put((future, compute))
        if self._running < self._most:
            self._running += 1
            threading.Thread(target=self._run, name=f"{self._name}-{self._running}", daemon=True).start()
        return future

    def close(self) -> None:
        """Begin nothing more; returns at once."""
        while not self._waiting.empty():
            task = self._waiting.get()
            if task is not None:
                task[0].cancel()
        for _ in range(self._running):
            self._waiting.put(None)

    def _run(self) -> None:
        spread()
        while (task := self._waiting.get()) is not None:
            future, compute = task
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(compute())
            except BaseException as error:  # noqa: BLE001 - it is for whoever waits for the result
                future.set_exception(error)


class Memory:
    """Answers that are dear, kept and shared: who asks for one that is being computed waits for it.

    They have threads of their own: whoever waits takes none from the rest of the service.

    Args:
        most: how many answers are kept, the one asked for longest ago goes first.
        threads: how many are computed at a time.
        waiting: how many may be under way.
    """

    def __init__(self, most: int, threads: int, waiting: int) -> None:
        self._most = most
        self._waiting = waiting
        self._lock = threading.Lock()
        self._threads = Threads(threads, "summary")
        self._answers: OrderedDict[Hashable, Future[WorkspaceAnswer]] = OrderedDict()

    def get(self, key: Hashable, compute: Callable[[], WorkspaceAnswer]) -> Future[WorkspaceAnswer]:
        """The answer to `key`, there already or under way; raises 503 where too many are.

        What fails is not kept. Do not cancel it: others may wait for it.
        """
        with self._lock:
            known = self._answers.get(key)
            if known is not None:
                self._answers.move_to_end(key)
                return known
            if sum(not answer.done() for answer in self._answers.values()) >= self._waiting:
                raise busy(f"{self._waiting} summaries are being computed already.")
            answer = self._answers[key] = self._threads.submit(compute)
            while len(self._answers) > self._most:
                self._answers.popitem(last=False)
        answer.add_done_callback(lambda done: self._forget(key, done))
        return answer

    def close(self) -> None:
        """Begin nothing more; returns at once."""
        self._threads.close()

    def _forget(self, key: Hashable, done: Future[WorkspaceAnswer]) -> None:
        if done.cancelled() or done.exception() is not None:
            with self._lock:
                self._answers.pop(key, None)


def memory() -> Memory:
    """As the service needs it: some 100 kB for an answer with a section, a core left for everybody else."""
    return Memory(most=64, threads=max(1, (os.cpu_count() or 2) - 1), waiting=32)


@router.get(
    "/robots/{robot_id}/workspace/summary",
    summary="Sizes of the workspace",
    response_model=WorkspaceAnswer,
    responses=refusals(404, 422, 500, 503),
)
async def summary(request: Request, robot_id: RobotId, query: Annotated[SummaryQuery, Query()]) -> Response:
    """Bounding box, reach and holes, exact and with configurations; volume and surface with their errors.

    `section` adds the cut with a half-plane through the line of joint 1: closed curves and the arcs they are made
    of; `plane` the cut with any plane instead. Answers are kept for a while, so only the first visitor waits for
    the seconds they take; who is told that it takes too long finds it when coming again.
    """
    robot = robot_of(request, robot_id)
    limits, locked = query.bounds(robot)
    plane = query.cut()
    wanted = query.section or plane is not None
    if query.section and plane is None and robot.joints[0].kind != "revolute":
        expected = f"false: joint 1 of {robot.id} slides, so there is no section in r and z"
        raise invalid(FieldError(field="section", value="true", expected=expected))

    def compute() -> WorkspaceAnswer:
        facts = workspace_facts(robot, limits=limits, locked=locked, effort=query.effort, volume=query.volume)
        cut = None
        if wanted:
            cut = section(robot, plane, limits=limits, locked=locked, resolution=query.resolution)
        return workspace_answer(facts, cut)

    # What was not asked for makes no other answer.
    effort = query.effort if query.volume else None
    resolution = query.resolution if wanted else None
    answer = request.app.state.sizes.get((robot, limits, locked, effort, plane, resolution), compute)
    return reply(await work_of(request).wait(answer))
