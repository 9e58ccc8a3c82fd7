"""One run: prepare the rows, check every contestant, time them all in turns, compare."""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import kin
from app.bench.contestants import FLOOR, KINBOARD, OURS, PEERS, SOLVE_IK, Contestant, Peer, quiet
from app.bench.contestants.motions import limits_of
from app.bench.judge import (
    Check,
    judge_distances,
    judge_motions,
    judge_poses,
    judge_verdicts,
    right_sets,
    share_of_same,
)
from app.bench.measure import Clock, Turns, measure, ratio
from app.bench.rows import COLLISIONS, MOTIONS, ROWS, Row, Task, prepare
from kin.solvers import closed_form_of
from kin.transforms import Array

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Settings:
    """What is measured, and how precisely.

    Attributes:
        rows, peers: all by default. Kinboard and the floor always take part.
        targets, batch: number of targets in a row, and in a row that takes a batch.
        rounds: turns of each contestant.
        turn: seconds of a turn.
        seed: of the random targets.
        clock: nanoseconds; wall time by default, which is fair to libraries with several threads.
    """

    rows: tuple[Row, ...] = ROWS
    peers: tuple[Peer, ...] = PEERS
    targets: int = 64
    batch: int = 4096
    rounds: int = 25
    turn: float = 0.02
    seed: int = 1
    clock: Clock = time.perf_counter_ns

    def quick(self) -> Settings:
        """Settings for a run of seconds instead of minutes."""
        return replace(self, targets=16, batch=512, rounds=7, turn=0.004)


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """One contestant of a row: its check (None for a floor), its times, and their ratios to ours.

    The ratios are to our array-level call and to `kin.solve_ik`; None where the row has no such call.
    """

    contestant: Contestant
    check: Check | None
    turns: Turns
    to_array: float | None = None
    to_solve: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class RowReport:
    """A row's task and its entries, ours first."""

    task: Task
    entries: tuple[Entry, ...]

    def named(self, name: str) -> Entry | None:
        """The entry of a contestant."""
        return next((entry for entry in self.entries if entry.contestant.name == name), None)

    @property
    def reference(self) -> str:
        """Name of our call that the others are compared with: the array-level call, where the row has one."""
        return OURS if self.named(OURS) is not None else SOLVE_IK

    @property
    def floor(self) -> Entry:
        """The floor that the gate compares the row's times with."""
        return next(entry for entry in self.entries if entry.contestant.name.startswith("floor"))


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """Result of a run.

    Attributes:
        rows: the measured rows.
        skipped: ids of rows whose arm is not built in or lacks the closed form they need.
        versions: of Kinboard and of the peers that took part.
        missing: peers that are not installed.
        refused: (row, peer, message) of peers that raised instead of answering.
        rounds: completed rounds.
        interrupted: whether the run was ended early.
    """

    settings: Settings
    rows: tuple[RowReport, ...]
    skipped: tuple[str, ...]
    versions: dict[str, str]
    missing: tuple[str, ...]
    refused: tuple[tuple[str, str, str], ...]
    rounds: int
    interrupted: bool

    @property
    def faults(self) -> tuple[str, ...]:
        """Errors in our own answers. A numeric search may miss a solution; a closed form may not."""
        found = []
        for row in self.rows:
            closed = closed_form_of(row.task.robot) is not None
            for entry in row.entries:
                check = entry.check
                if check is None or entry.contestant.name not in (OURS, SOLVE_IK):
                    continue
                expected = row.task.row.unverified and entry.contestant.name == OURS
                if (check.wrong and not expected) or (closed and check.success < 1.0):
                    found.append(f"{row.task.row.id}: {entry.contestant.name} misses targets or answers wrongly")
        return tuple(found)


def run(settings: Settings, say: Say = lambda words: None) -> Report:
    """Measure, with status messages to `say`. Ctrl-C ends the rounds; what was measured by then is returned."""
    installed = [peer for peer in settings.peers if peer.installed]
    refused: list[tuple[str, str, str]] = []
    prepared: list[tuple[Task, list[tuple[Contestant, Check | None]]]] = []
    skipped = []
    for row in settings.rows:
        say(f"checking {row.id}")
        task = prepare(row, settings.batch if row.batch else settings.targets, settings.seed)
        if task is None:
            skipped.append(row.id)
            continue
        prepared.append((task, _checked(task, installed, refused)))
    turns = [Turns(contestant) for _, checked in prepared for contestant, _ in checked]
    interrupted = False
    try:
        say("finding out how long a turn is")
        measure(
            turns,
            settings.rounds,
            settings.turn,
            clock=settings.clock,
            after_round=lambda done: say(f"round {done} of {settings.rounds}"),
        )
    except KeyboardInterrupt:
        interrupted = True
    rounds = min((len(entry.seconds) for entry in turns), default=0)
    times = iter(turns)
    rows = [
        RowReport(task, tuple(Entry(contestant, check, next(times)) for contestant, check in checked))
        for task, checked in prepared
    ]
    versions = {peer.name: peer.version for peer in (KINBOARD, *installed)}
    return Report(
        settings,
        tuple(_compared(row) for row in rows) if rounds else (),
        tuple(skipped),
        versions,
        tuple(peer.name for peer in settings.peers if not peer.installed),
        tuple(refused),
        rounds,
        interrupted,
    )


def _checked(
    task: Task, peers: Sequence[Peer], refused: list[tuple[str, str, str]]
) -> list[tuple[Contestant, Check | None]]:
    """The contestants of a row, each with the check of its answers to all targets."""
    found: list[tuple[Contestant, Check | None]] = []
    ours: list[Array] | None = None
    for peer in (KINBOARD, *peers, FLOOR):
        own = peer in (KINBOARD, FLOOR)
        try:
            with quiet():
                for contestant in peer.enter(task):
                    answers = [
                        x for arguments in contestant.inputs for x in contestant.read(contestant.call(*arguments))
                    ]
                    if contestant.floor:
                        found.append((contestant, None))
                    elif task.row.kind in ("fk", "cloud", "line"):
                        found.append((contestant, judge_poses(task, answers)))
                    elif task.row.kind == "collision":
                        found.append((contestant, judge_distances(task, answers)))
                    elif task.row.kind in COLLISIONS:
                        ours = answers if ours is None else ours
                        same = float(np.mean([a == b for a, b in zip(ours, answers, strict=True)]))
                        check = judge_verdicts(task, answers, contestant.bodies)
                        found.append((contestant, replace(check, same=same)))
                    elif task.row.kind in MOTIONS:
                        found.append((contestant, judge_motions(task, answers, limits_of(task))))
                    else:
                        sets, check = right_sets(task, answers)
                        if contestant.name == OURS and _comparable(task):
                            ours = sets
                        if ours is not None and not contestant.one:
                            check = replace(check, same=share_of_same(ours, sets))
                        if own and not _comparable(task):  # our parameter is not the joint that was locked
                            check = replace(check, recall=None)
                        found.append((contestant, check))
        except Exception as error:
            # An error of another library is reported and affects only its own entry.
            if own:
                raise
            refused.append((task.row.id, peer.name, f"{type(error).__name__}: {error}"))
    return found


def _comparable(task: Task) -> bool:
    """Whether all contestants return the same set: no redundancy, or one that a locked joint removes."""
    if task.row.kind != "branches" or task.row.lock is None:
        return task.row.kind == "branches"
    match = closed_form_of(task.robot)
    freedoms = () if match is None else match.redundancies(0)
    return any(freedom.joint == task.row.lock for freedom in freedoms)


def _compared(row: RowReport) -> RowReport:
    """The row with its ratios to our two calls."""
    array, solve = row.named(OURS), row.named(SOLVE_IK)
    return RowReport(
        row.task,
        tuple(
            replace(
                entry,
                to_array=None if array is None else ratio(entry.turns, array.turns),
                to_solve=None if solve is None else ratio(entry.turns, solve.turns),
            )
            for entry in row.entries
        ),
    )


def machine() -> dict[str, str]:
    """The machine and the versions of a run."""
    name = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    return {
        "time": time.strftime("%Y-%m-%d %H:%M:%S %z"),
        "processor": name,
        "cores": str(os.cpu_count()),
        "load": f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "",
        "system": f"{platform.system()} {platform.release()}",
        "python": sys.version.split()[0],
        "numpy": np.__version__,
        "kinboard": kin.__version__,
    }
