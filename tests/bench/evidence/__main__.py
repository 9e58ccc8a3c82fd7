"""``python tests/bench/evidence``: what answers of inverse kinematics claim, and what is true of them.

Each row is a kind of arm. Configurations are drawn at random inside the limits, poses are made from them by NumPy
alone (``tests/numpy_arm.py``), and `kin.solve_ik` is asked for all postures. *Found* is the share of answers that
have the configuration the pose was made from; *false* counts answers that claim to be complete and lack it. Errors
are those of all solutions, by NumPy again.

The parameter of a redundancy is given, as it is in that configuration. Singular configurations, with a singular
value of the Jacobian below 0.001, are left out: there postures merge. So are random tables whose joints move the
tool in fewer directions than they are: they meet each pose in infinitely many ways.

``--record`` writes the counts to ``tests/data/evidence.json`` and the table into ``docs/background/evidence.md``.
"""

from __future__ import annotations

import argparse
import datetime
import json
import multiprocessing
import platform
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from arms import random_table, with_slides  # noqa: E402
from numpy_arm import pose  # noqa: E402

import kin  # noqa: E402
from kin import Robot, Status  # noqa: E402
from kin.solvers import family_of  # noqa: E402
from kin.warmup import made_up_arms  # noqa: E402

PAGE, RECORD = ROOT / "docs" / "background" / "evidence.md", ROOT / "tests" / "data" / "evidence.json"
BEGIN, END = "<!-- table: python tests/bench/evidence --record -->\n", "<!-- end of the table -->\n"
HEAD = "| arms | number | targets | found | false | proved | agreed | unknown | largest error |"
SAME = 1e-6  # radians or metres: two configurations that are one
REGULAR = 1e-3  # smallest singular value of a configuration that counts
TABLES = 100  # random tables for each number of joints


@dataclass
class Tally:
    """The counts of one kind of arm; errors in metres and radians."""

    arms: int = 0
    targets: int = 0
    found: int = 0
    false: int = 0
    curves: int = 0
    completeness: dict[str, int] = field(default_factory=dict)
    position_error: float = 0.0
    rotation_error: float = 0.0

    def add(self, other: Tally) -> None:
        """Add the counts of another one."""
        for name in ("arms", "targets", "found", "false", "curves"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.completeness = dict(Counter(self.completeness) + Counter(other.completeness))
        self.position_error = max(self.position_error, other.position_error)
        self.rotation_error = max(self.rotation_error, other.rotation_error)


@dataclass(frozen=True)
class Question:
    """An arm, the kind it is counted under, and how many configurations are drawn."""

    kind: str
    robot: Robot
    targets: int
    seed: int


def questions(targets: int, seed: int) -> Iterator[Question]:
    """Every built-in arm and those of the other families, exact and with rounded angles; random tables."""
    exact = (*kin.builtin_robots().values(), *made_up_arms())
    for robot in exact:
        yield Question(family_of(robot), robot, targets, seed)
    for robot in exact:
        if (typed := with_angles(robot, 4)) != robot:
            yield Question(f"{family_of(robot)}, angles of four decimals", typed, targets, seed)
    few = max(1, targets // TABLES)
    for joints in range(1, 8):
        for number in range(TABLES):
            turning = random_table(joints, number)
            sliding = with_slides(turning, number)
            if rank(turning) == min(joints, 6):
                yield Question(f"random tables, {joints} turning", turning, few, seed)
            if joints < 7 and rank(sliding) == joints:
                yield Question(f"random tables, {joints}, some sliding", sliding, few, seed)


def with_angles(robot: Robot, decimals: int) -> Robot:
    """The table as somebody types it."""
    rows = tuple(
        replace(row, theta=round(row.theta, decimals), alpha=round(row.alpha, decimals)) for row in robot.rows
    )
    return replace(robot, rows=rows)


def ask(question: Question) -> tuple[str, Tally]:
    """Count what is answered to one question."""
    robot, tally = question.robot, Tally(arms=1)
    drawn = robot.random_q(np.random.default_rng(question.seed), question.targets)
    freedoms = rank(robot)
    for q in drawn:
        if singular_values(robot, q)[freedoms - 1] < REGULAR:
            continue
        T = pose(robot, q)
        result = kin.solve_ik(robot, T, redundancy=redundancy_at(robot, T, q))
        tally.targets += 1
        tally.curves += result.details.infinite
        tally.completeness[result.completeness] = tally.completeness.get(result.completeness, 0) + 1
        found = any(apart(robot, each.q, q) < SAME for each in result.solutions)
        tally.found += found
        tally.false += result.complete and not found and not result.details.infinite
        if result.status is Status.SOLVED:
            for each in result.solutions:
                position, rotation = errors(pose(robot, each.q), T)
                tally.position_error = max(tally.position_error, position)
                tally.rotation_error = max(tally.rotation_error, rotation)
    return question.kind, tally


def singular_values(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Those of the Jacobian, the largest first."""
    return np.linalg.svd(kin.jacobian(robot, q), compute_uv=False)


def rank(robot: Robot) -> int:
    """In how many directions the arm moves its tool, where it is not singular."""
    drawn = robot.random_q(np.random.default_rng(0), 8)
    return max(int(np.sum(singular_values(robot, q) > REGULAR)) for q in drawn)


def redundancy_at(robot: Robot, T: np.ndarray, q: np.ndarray) -> float | None:
    """The redundancy parameter of a configuration; None for an arm without one."""
    result = kin.solve_ik(robot, T, q_seed=q)
    nearest = min(result.solutions, key=lambda each: apart(robot, each.q, q), default=None)
    if nearest is None or not nearest.redundancy:
        return None
    parameter = nearest.redundancy[0]
    joints = [i for i in range(robot.n) if parameter.name == f"theta{i + 1}"]
    return float(q[joints[0]]) if joints else parameter.value


def apart(robot: Robot, a: np.ndarray, b: np.ndarray) -> float:
    """The largest difference of two configurations, whole turns aside."""
    turned = np.abs((a - b + np.pi) % (2 * np.pi) - np.pi)
    return float(np.where(robot.revolute, turned, np.abs(a - b)).max())


def errors(T: np.ndarray, target: np.ndarray) -> tuple[float, float]:
    """Distance of the tool points, and the angle between the orientations."""
    skew = T[:3, :3].T @ target[:3, :3]
    sine = 0.5 * np.linalg.norm([skew[2, 1] - skew[1, 2], skew[0, 2] - skew[2, 0], skew[1, 0] - skew[0, 1]])
    return float(np.linalg.norm(T[:3, 3] - target[:3, 3])), float(np.arctan2(sine, 0.5 * (np.trace(skew) - 1.0)))


def tallies(asked: Sequence[Question], processes: int) -> dict[str, Tally]:
    """The counts of all questions by kind, in their order."""
    found: dict[str, Tally] = {}
    if processes == 1:
        answers = map(ask, asked)
    else:
        pool = multiprocessing.get_context("forkserver").Pool(processes)
        answers = pool.imap(ask, asked, chunksize=4)
    for number, (kind, tally) in enumerate(answers, 1):
        found.setdefault(kind, Tally()).add(tally)
        if sys.stderr.isatty():
            print(f"\r{number} of {len(asked)}", end="", file=sys.stderr, flush=True)
    return found


def table(rows: dict[str, dict[str, Any]]) -> str:
    """The counts as a table in Markdown."""
    lines = [HEAD, "|---|" + "---:|" * 8]
    for kind, row in rows.items():
        targets, known = row["targets"], row["completeness"]
        shares = [share(known.get(word, 0), targets) for word in ("proved", "agreed", "unknown")]
        error = f"{max(row['position_error'], row['rotation_error']):.0e}"
        cells = (kind, row["arms"], targets, share(row["found"], targets), row["false"], *shares, error)
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines) + "\n"


def share(part: int, whole: int) -> str:
    """A share in percent, with the digits that its size asks for; all and none are said as such."""
    if part in (0, whole):
        return "–" if part == 0 else "all"
    percent = 100.0 * part / whole
    return f"{percent:.2f} %" if min(percent, 100.0 - percent) < 1.0 else f"{percent:.1f} %"


def main() -> int:
    """Print the table; 1 if an answer claims to be complete and is not."""
    parser = argparse.ArgumentParser(
        prog="python tests/bench/evidence",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--targets", type=int, default=1000, help="configurations of each arm (1000)")
    parser.add_argument("--seed", type=int, default=1, help="of the configurations (1)")
    parser.add_argument("--processes", type=int, default=2, help="at a time (2)")
    parser.add_argument("--only", help="kinds whose name contains this text")
    parser.add_argument("--record", action="store_true", help="write the file and the page")
    arguments = parser.parse_args()
    asked = [each for each in questions(arguments.targets, arguments.seed) if (arguments.only or "") in each.kind]
    rows = {kind: asdict(tally) for kind, tally in tallies(asked, arguments.processes).items()}
    print(table(rows))
    if arguments.record:
        record(rows, arguments)
    return int(any(row["false"] for row in rows.values()))


def record(rows: dict[str, dict[str, Any]], arguments: argparse.Namespace) -> None:
    """Keep the run, and put its table into the page."""
    about = {
        "version": kin.__version__,
        "date": datetime.date.today().isoformat(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "targets": arguments.targets,
        "seed": arguments.seed,
    }
    text = json.dumps({"run": about, "rows": rows}, indent=1, ensure_ascii=False)
    RECORD.write_text(text + "\n", encoding="utf-8")
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
    PAGE.write_text(before + BEGIN + table(rows) + END + rest.split(END)[1], encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
