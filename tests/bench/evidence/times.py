"""``python tests/bench/evidence --times``: how long answers take on a machine that does nothing else.

One arm of each family that is built in, in one thread. While it runs, the processor time of everything else on the
machine is counted: a run beside other work is printed, but not recorded, and neither is one of changed code.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import kin
from app.bench.board.words import time_text
from app.bench.contestants import Contestant
from app.bench.measure import Turns, measure
from app.bench.run import machine
from kin import Robot
from kin.solvers import family_of

ROOT = Path(__file__).parents[3]
RECORD = ROOT / "tests" / "data" / "times.json"
BEGIN, END = "<!-- times: python tests/bench/evidence --times --record -->\n", "<!-- end of the times -->\n"
IDLE = 0.1  # cores that everything else may use while we measure
TARGETS, ROUNDS = 64, 25
TURN = 0.02  # s of one round
BATCH = 1000


@dataclass(frozen=True)
class Times:
    """Seconds of one arm: of a pose, of an answer, and of an answer in a batch of so many."""

    family: str
    pose: float
    answer: float
    in_batch: float
    batch: int


class Watch:
    """How much processor everything else has used since this was made."""

    def __init__(self) -> None:
        self._began = time.perf_counter(), busy_seconds(), own_seconds()

    def others(self) -> float:
        """Cores in use by other processes, on average."""
        wall, busy, own = self._began
        return max(0.0, busy_seconds() - busy - (own_seconds() - own)) / (time.perf_counter() - wall)


def busy_seconds(stat: Path = Path("/proc/stat")) -> float:
    """Processor time of all processes since the machine was started; what a hypervisor took counts, too."""
    user, nice, system, _idle, _waiting, *rest = map(int, stat.read_text().split("\n", 1)[0].split()[1:9])
    return (user + nice + system + sum(rest)) / os.sysconf("SC_CLK_TCK")


def own_seconds() -> float:
    """Processor time of this process and of those it has waited for."""
    return sum(os.times()[:4])


def arms() -> list[Robot]:
    """The first built-in arm of each family."""
    found: dict[str, Robot] = {}
    for arm in kin.builtin_robots().values():
        found.setdefault(family_of(arm), arm)
    return list(found.values())


def measured(arm: Robot, rounds: int = ROUNDS, turn: float = TURN) -> Times:
    """The times of an arm, over random configurations inside its limits."""
    q = arm.random_q(np.random.default_rng(1), TARGETS)
    poses = kin.fk(arm, q)
    answer = median(lambda T: kin.solve_ik(arm, T), poses, rounds, turn)
    batch = min(BATCH, max(TARGETS, round(10 * turn / answer)))
    stack = np.resize(poses, (batch, 4, 4))
    return Times(
        family_of(arm),
        median(lambda each: kin.fk(arm, each), q, rounds, turn),
        answer,
        median(lambda many: kin.solve_ik_many(arm, many), [stack], rounds, turn, batch),
        batch,
    )


def median(
    call: Callable[[Any], object], inputs: Sequence[Any], rounds: int, turn: float, per_call: int = 1
) -> float:
    """Seconds per target: the median of rounds of `turn` seconds, with `per_call` targets in a call."""
    entry = Turns(Contestant("", call, [(each,) for each in inputs], list, per_call))
    measure([entry], rounds, turn)
    return entry.median


def run(chosen: Iterable[Robot], rounds: int = ROUNDS, turn: float = TURN) -> dict[str, Any]:
    """The times of these arms, and on what machine they were measured, as plain data."""
    chosen = list(chosen)
    for arm in chosen:  # compiles what is missing, which would count as work of others
        kin.solve_ik_many(arm, [kin.fk(arm, arm.q_home)])
        kin.solve_ik(arm, kin.fk(arm, arm.q_home))
    watch = Watch()
    rows = {arm.id: asdict(measured(arm, rounds, turn)) for arm in chosen}
    about = machine() | {
        "commit": commit(),
        "others": round(watch.others(), 3),
        "rounds": rounds,
        "targets": TARGETS,
    }
    return {"run": about, "rows": rows}


def commit() -> str:
    """The commit that is checked out, with a ``+`` if files were changed since; empty outside of a repository."""
    said = [
        subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()
        for words in (("rev-parse", "--short=8", "HEAD"), ("status", "--porcelain", "--", "kin", "app"))
    ]
    return said[0] + ("+" if said[1] else "")


def why_not(about: dict[str, Any]) -> str:
    """Why a run is not recorded; empty if it may be."""
    if about["others"] > IDLE:
        used = f"other processes used {about['others']:.2f} cores meanwhile"
        return f"{used}, more than {IDLE:g}; run it when they have ended"
    if not about["commit"] or about["commit"].endswith("+"):
        return "kin/ or app/ has changes that are in no commit: the figures would be of nobody's code"
    return ""


def section(found: dict[str, Any]) -> str:
    """What the page says about a run, with its heading."""
    about = found["run"]
    numba = f", numba {about['numba']}" if "numba" in about else ""  # which compiled the kernels of older runs
    lines = [
        "## What it takes",
        "",
        f"Measured by `python tests/bench/evidence --times` on {about['time'][:10]}: {about['processor']}, "
        f"{about['cores']} cores, of which everything else used {about['others']:.2f}; {about['system']}, "
        f"Python {about['python']}, NumPy {about['numpy']}{numba}, commit {about['commit']}. "
        f"Medians of {about['rounds']} rounds over {about['targets']} random configurations inside the limits, in "
        "one thread. An *answer* is that of `kin.solve_ik` without options: all postures in order, limits and "
        "reasons, each put through forward kinematics. *In a batch* is `kin.solve_ik_many` for as many targets as "
        "the last column says, each. Other libraries are on the page about [speed](../speed.md).",
        "",
        "| arm | family | pose | answer | in a batch | targets |",
        "|---|---|---:|---:|---:|---:|",
    ]
    for arm, row in found["rows"].items():
        times = " | ".join(time_text(row[name]) for name in ("pose", "answer", "in_batch"))
        lines.append(f"| {arm} | {row['family']} | {times} | {row['batch']} |")
    return "\n".join(lines) + "\n"
