"""``python tests/bench/generated.py``: C and JavaScript that `kin.generate` writes, beside `kin.solve_ik`.

One arm of each family. The same entry (all postures inside the limits, at their nearest whole turns, each checked
by forward kinematics, sorted by the seed) solves the same targets as C (``--cc``) and as JavaScript (the Node
of Playwright), beside the kernels of the core, for arms without a redundancy parameter or with a given
one, and beside `kin.solve_ik`; times are processor time, least of some passes. Machine code and the stack of the
deepest chain of calls are those of ``gcc -Os``; ``-m32 -msoft-float`` stands for a microcontroller that computes
with floats in software.

A second table has the solutions of C beside those of `kin.solve_ik`, for reachable targets and for hard ones: at
and beside quarter turns, limits and singular poses, and pulled out of reach.
"""

from __future__ import annotations

import argparse
import ctypes
import gzip
import json
import math
import re
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from playwright._impl._driver import compute_driver_executable

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS), str(TESTS / "kin" / "codegen")]

from emitted import ROBOTS, Built, targets  # noqa: E402

import kin  # noqa: E402
from kin.codegen import files  # noqa: E402
from kin.codegen.arm import Arm, arm_of  # noqa: E402
from kin.differential.metric import weights  # noqa: E402
from kin.ik.candidates import Requirement, Rows, measure_and_sort  # noqa: E402
from kin.kernels.compile import direct  # noqa: E402
from kin.solvers import family_of  # noqa: E402
from kin.solvers.contract import POSE  # noqa: E402

TARGETS, HARD, PASSES = 500, 200, 5
SAME = 1e-5  # rad or m, between joint values of one solution
SOFT = "pioneer5"  # the arm that is compiled for a machine without floats


class Figures(NamedTuple):
    """Of one arm: microseconds a target, texts, and bytes."""

    c: float
    js: float
    kernels: float | None
    solve_ik: float
    c_text: bytes
    js_text: bytes
    code: int
    stack: int
    buffer: int

    def row(self) -> list[str]:
        """The cells of a table."""
        times = ["–" if x is None else f"{x:.1f} µs" for x in (self.c, self.js, self.kernels, self.solve_ik)]
        texts = [
            f"{len(x) / 1000:.0f} kB ({len(gzip.compress(x)) / 1000:.0f})" for x in (self.c_text, self.js_text)
        ]
        sizes = [f"{x / 1000:.0f} kB" for x in (self.code, self.stack, self.buffer)]
        return [*times, *texts, *sizes]


class Answers(NamedTuple):
    """Of one arm: the solutions of C beside those of `kin.solve_ik`, and how exact they are.

    Attributes:
        apart: the largest difference of a joint value, rad or m.
        off: how far the tool of a solution is from its target, by `kin.fk`, m.
    """

    solutions: int
    missing: int
    extra: int
    apart: float
    off: float

    def row(self) -> list[str]:
        """The cells of a table."""
        counts = [f"{x:,}".replace(",", " ") for x in (self.solutions, self.missing, self.extra)]
        return [*counts, f"{self.apart:.0e}", f"{self.off:.0e}"]


def compared(built: Built, asked: tuple[Any, Any, Any], given: int | None) -> Answers:
    """The solutions of targets, seeds and configurations beside those of `kin.solve_ik`."""
    robot, counts, worst = built.arm.robot, np.zeros(3, int), np.zeros(2)
    for T, seed, q in zip(*asked, strict=True):
        status, found, *_ = built.ik(T, seed, math.nan if given is None else float(q[given]))
        expected = kin.solve_ik(robot, T, q_seed=seed, redundancy=None if given is None else float(q[given]))
        a, b = np.empty((2, 0, robot.n))
        if status == "solved":
            a = found
        if expected.status is kin.Status.SOLVED:
            b = np.array([each.q for each in expected.solutions])
        off = np.abs(a[:, None] - b).max(axis=2, initial=0.0)
        to_b, to_a = off.min(axis=1, initial=math.inf), off.min(axis=0, initial=math.inf)
        counts += len(a), (to_a > SAME).sum(), (to_b > SAME).sum()
        errors = np.linalg.norm(kin.fk(robot, a)[:, :3, 3] - T[:3, 3], axis=1)
        worst = np.maximum(worst, [to_b[to_b <= SAME].max(initial=0.0), errors.max(initial=0.0)])
    return Answers(*counts.tolist(), *worst.tolist())


def microseconds(run: Callable[[], int], count: int) -> tuple[float, int]:
    """Processor time of one of `count` targets, least of the passes, and what a pass returns."""
    total = run()
    spent = []
    for _ in range(PASSES):
        start = time.process_time()
        run()
        spent.append(time.process_time() - start)
    return 1e6 * min(spent) / count, total


def in_c(
    arm: Arm, name: str, folder: Path, cc: Sequence[str], T: Any, seeds: Any, values: Any
) -> tuple[Callable[[], int], Built]:
    """The C file in this process: all targets, and each function."""
    call = f"{name}_ik_at(T + 16 * i, values[i]," if arm.alone.stepped else f"{name}_ik(T + 16 * i,"
    buffer = f"static {name}_scratch scratch;" if arm.buffer("solve") else ""
    last = ", &scratch" if buffer else ""
    (folder / "many.c").write_text(f"""#define {name.upper()}_IMPLEMENTATION
#include "{name}.c"
{buffer}
int many(const double *T, const double *seeds, const double *values, int n) {{
  {name}_solution found[{arm.rows}];
  int count, total = 0;
  (void)values;
  for (int i = 0; i < n; i++) {{ {call} seeds + {arm.robot.n} * i, found, &count{last}); total += count; }}
  return total;
}}
""")
    compile_in(folder, cc, "-shared", "-fPIC", "many.c", "-o", "many.so", "-lm")
    library = ctypes.CDLL(str(folder / "many.so"))
    pointers = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (T, seeds, values)]
    return lambda: int(library.many(*pointers, len(T))), Built(arm, name, library)


def in_kernels(arm: Arm, T: Any, seeds: Any, values: Any) -> Callable[[], int]:
    """The compiled kernels in this process, called without checks."""
    robot, params, k = arm.robot, arm.form.kernels.params, arm.rows
    one, sort = direct(arm.form.kernels.one), direct(measure_and_sort)
    q, truths, order = np.empty((k, robot.n)), np.empty((2, k), bool), np.empty(k, np.int64)
    rows = Rows(q, np.empty((k, 5)), truths[0], truths[1], order)
    limits = robot.lower, robot.upper, arm.constants["held"], weights(robot)
    requirement = Requirement(robot.model, np.zeros(7), *limits, POSE, True)

    def run() -> int:
        total = 0
        for pose, seed, value in zip(T, seeds, values.tolist(), strict=True):
            one(params, pose, value, seed, q)
            total += max(sort(requirement, pose, seed, seed, rows), 0)
        return total

    return run


def in_javascript(arm: Arm, name: str, folder: Path, T: Any, seeds: Any, values: Any) -> tuple[float, int]:
    """Microseconds a target of the script in Node, and the solutions of a pass."""
    asked = {"T": T.tolist(), "seeds": seeds.tolist(), "values": np.nan_to_num(values).tolist()}
    (folder / "asked.json").write_text(json.dumps(asked))
    call = "arm.ik_at(T[i], values[i], seeds[i])" if arm.alone.stepped else "arm.ik(T[i], seeds[i])"
    run = f"""
const arm = require("./{name}.js"), {{ T, seeds, values }} = require("./asked.json");
let least = Infinity, total = 0;
for (let pass = 0; pass < {2 * PASSES}; pass++) {{
  const start = process.cpuUsage().user;
  total = 0;
  for (let i = 0; i < T.length; i++) total += {call}.solutions.length;
  least = Math.min(least, process.cpuUsage().user - start);
}}
console.log(JSON.stringify([least / T.length, total]));
"""
    command = [compute_driver_executable()[0], "-e", run]
    done = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout
    spent, total = json.loads(done)
    return float(spent), int(total)


def compile_in(folder: Path, cc: Sequence[str], *arguments: str) -> None:
    """Run a compiler in a folder."""
    subprocess.run([*cc, "-std=c99", "-w", *arguments], cwd=folder, check=True)


def size(folder: Path, file: str) -> int:
    """Bytes of machine code and constants of an object file."""
    done = subprocess.run(["size", file], cwd=folder, check=True, capture_output=True, text=True)
    return int(done.stdout.splitlines()[1].split()[0])


def stack(graph: str, entry: str) -> int:
    """Bytes of stack of the deepest chain of calls from a function, in a graph of ``-fcallgraph-info=su``."""
    own = {
        title: int(found[1]) if (found := re.search(r"(\d+) bytes", label)) else 0
        for title, label in re.findall(r'node: { title: "([^"]*)" label: "([^"]*)"', graph)
    }
    calls: dict[str, set[str]] = {}
    for caller, callee in re.findall(r'edge: { sourcename: "([^"]*)" targetname: "([^"]*)"', graph):
        calls.setdefault(caller, set()).add(callee)

    @cache
    def deepest(name: str) -> int:
        return own.get(name, 0) + max(map(deepest, calls.get(name, ())), default=0)

    return deepest(entry)


def footprint(name: str, folder: Path, entry: str, *options: str) -> tuple[int, int]:
    """Bytes of machine code and of stack of the C file with ``-Os``."""
    define = f"-D{name.upper()}_IMPLEMENTATION"
    compile_in(
        folder, ("gcc", "-Os", "-fcallgraph-info=su"), define, *options, "-c", f"{name}.c", "-o", f"{name}.o"
    )
    return size(folder, f"{name}.o"), stack((folder / f"{name}.ci").read_text(), entry)


def without_floats(folder: Path) -> tuple[int, int]:
    """The footprint of an arm on a 32-bit machine that computes with floats in software."""
    (folder / "gnu").mkdir()
    (folder / "gnu" / "stubs-32.h").touch()  # all that is missing where only the 64-bit library is installed
    (folder / f"{SOFT}.c").write_text(kin.generate(SOFT, closest=False))
    headers = "-I.", "-isystem", "/usr/include/x86_64-linux-gnu"
    return footprint(SOFT, folder, f"{SOFT}_ik", "-m32", "-msoft-float", *headers)


def measured(robot: kin.Robot, folder: Path, cc: Sequence[str]) -> tuple[Figures, list[Answers]]:
    """The figures of an arm, and the answers to reachable and to hard targets.

    Raises:
        SystemExit: C or JavaScript finds another number of solutions.
    """
    arm, name = arm_of(robot), files.name_for(robot, None)
    T, seeds, q = targets(robot, TARGETS, 0)
    given = arm.parameter.joint if arm.alone.stepped and arm.parameter else None
    values = np.full(len(q), math.nan) if given is None else q[:, given].copy()
    texts = {"c": files.c_file(arm, name).encode(), "js": files.js_file(arm, name, "js").encode()}
    for language, text in texts.items():
        (folder / f"{name}.{language}").write_bytes(text)
    many, built = in_c(arm, name, folder, cc, T, seeds, values)
    in_c_, found = microseconds(many, len(T))
    in_js, also = in_javascript(arm, name, folder, T, seeds, values)
    if found != also:
        sys.exit(f"{robot.id}: {found} solutions in C, {also} in JavaScript")

    def ask() -> int:
        return sum(
            len(kin.solve_ik(robot, pose, q_seed=seed, redundancy=None if given is None else value).solutions)
            for pose, seed, value in zip(T, seeds, values.tolist(), strict=True)
        )

    code, deep = footprint(name, folder, f"{name}_ik" + "_at" * arm.alone.stepped)
    alone = arm.parameter is None or given is not None
    kernels = microseconds(in_kernels(arm, T, seeds, values), len(T))[0] if alone else None
    solving, buffer = microseconds(ask, len(T))[0], 8 * arm.buffer("solve")
    figures = Figures(in_c_, in_js, kernels, solving, texts["c"], texts["js"], code, deep, buffer)
    return figures, [compared(built, asked, given) for asked in ((T, seeds, q), targets(robot, 0, HARD))]


def one_of_each() -> list[kin.Robot]:
    """The first arm of each family, of built-in ones first."""
    found: dict[str, kin.Robot] = {}
    for robot in ROBOTS.values():
        found.setdefault(family_of(robot), robot)
    return list(found.values())


def main() -> None:
    """Print the tables."""
    options = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    options.add_argument("robots", nargs="*", help="ids of arms; by default one of each family")
    options.add_argument("--cc", default="gcc -O2", help="compiler and options of the C that is timed")
    given = options.parse_args()
    chosen = [ROBOTS[each] for each in given.robots] or one_of_each()
    cells = "arm, family", "C", "JavaScript", "kernels", "`solve_ik`", "text of C", "of JavaScript", "code"
    print("|", *(f"{each} |" for each in (*cells, "stack", "buffer")))
    print(10 * "|---" + "|")
    answers: list[str] = []
    for robot in chosen:
        with tempfile.TemporaryDirectory() as folder:
            figures, found = measured(robot, Path(folder), shlex.split(given.cc))
        print(" | ".join([f"| {robot.id}, `{family_of(robot)}`", *figures.row()]) + " |", flush=True)
        answers.append(" | ".join([f"| {robot.id}", *found[0].row(), *found[1].row()]) + " |")
    print(f"\n{TARGETS} reachable targets, and {HARD} hard ones:\n")
    print("| arm |" + 2 * " solutions | missing | extra | \\|Δq\\| | FK |")
    print(10 * "|---" + "|---|", *answers, sep="\n")
    with tempfile.TemporaryDirectory() as folder:
        code, deep = without_floats(Path(folder))
    sizes = f"{code / 1000:.0f} kB of code, {deep / 1000:.0f} kB of stack"
    print(f"\n{SOFT} without `nearest`, gcc -Os -m32 -msoft-float: {sizes}")


if __name__ == "__main__":
    main()
