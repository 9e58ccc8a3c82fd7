"""Generated C beside the kernels of the core: the same bits."""

from __future__ import annotations

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
from arms import ONE_OF_EACH_SOLVER, one_of_each_family
from emitted import ROBOTS, STRICT, answer, exact, targets

from kin import builtin_robots, fk, solve_ik
from kin.codegen import files
from kin.codegen.arm import arm_of
from kin.codegen.families import alone, without_limits
from kin.kernels.compile import PLAIN
from kin.solvers import closed_form_of
from kin.solvers.contract import POSE

QUICK = ("irb120", "pioneer5")
ALL = [pytest.param(robot_id, marks=() if robot_id in QUICK else pytest.mark.full) for robot_id in ROBOTS]
HAS_FMA = Path("/proc/cpuinfo").exists() and " fma " in Path("/proc/cpuinfo").read_text()


@pytest.mark.skipif(not HAS_FMA, reason="kernels use fused operations only where the processor has them")
@pytest.mark.skipif(PLAIN, reason="kernels are not compiled")
@pytest.mark.parametrize("robot_id", ALL)
def test_c_computes_the_bits_of_the_compiled_kernels(robot_id, tmp_path):
    robot = ROBOTS[robot_id]
    random, hard, level = (60, 48, "-O0") if robot_id in QUICK else (1000, 300, "-O2")
    built = exact(robot, tmp_path, level)
    solved = 0
    for T, seed, q in zip(*targets(robot, random, hard), strict=True):
        value = float(q[built.arm.parameter.joint]) if built.arm.alone.stepped else math.nan
        count, rows = answer(built.arm, T, seed, value)
        status, found, stats, branches = built.ik(T, seed, value)
        assert (status == "solved") == (count != 0)
        if count > 0:
            order = rows.order[:count]
            assert branches == order.tolist()
            assert np.array_equal(found, rows.q[order])
            assert np.array_equal(stats, rows.stats[order, :4])
            solved += 1
    assert solved > random // 2


ADAPTERS = [
    pytest.param(robot_id, marks=() if robot_id in ("rrp", "palletiser", "made-up-turned3") else pytest.mark.full)
    for robot_id in ROBOTS
]


@pytest.mark.parametrize("robot_id", ADAPTERS)
def test_an_adapter_finds_what_the_solver_finds(robot_id):
    robot = ROBOTS[robot_id]
    form = closed_form_of(robot)
    found = alone(robot, form)
    limits, arcs, kernels = (robot.lower, robot.upper), np.empty((256, 3)), form.kernels
    for T, seed, goal in zip(*targets(robot, 20, 0), strict=True):
        value = float(goal[form.redundancies(POSE)[0].joint]) if found.stepped else math.nan
        q, expected = np.empty((2, len(form.branches), robot.n))
        found.rows(found.inner, found.params, T, value, seed, limits, arcs, q)
        kernels.one(kernels.params, T, value, seed, expected)
        assert np.isfinite(q).any()
        if found.stepped or not form.redundancies(POSE):
            q, expected = (rows[~np.isnan(rows[:, 0])] for rows in (q, expected))
            off = q[:, None] - expected
            off = np.where(robot.revolute, (off + math.pi) % (2.0 * math.pi) - math.pi, off)
            assert len(q) == len(expected)
            assert np.abs(off).max(axis=2).min(axis=0).max() < 1e-7


def test_targets_close_by_lead_to_what_the_elimination_misses():
    robot = builtin_robots()["crx10ia"]  # at home several solutions share the angle that is eliminated for
    found, seed, counts = alone(robot, closed_form_of(robot)), robot.q_home, []
    limits, arcs, elimination = (robot.lower, robot.upper), np.empty((256, 3)), found.inner
    for each in (elimination, found):
        q = np.empty((16, 6))
        each.rows(each.inner, found.params, fk(robot, seed), math.nan, seed, limits, arcs, q)
        counts.append(int((~np.isnan(q[:, 0])).sum()))
    assert np.abs(fk(robot, q[: counts[1]]) - fk(robot, seed)).max() < 1e-9
    expected = np.array([solution.q for solution in solve_ik(robot, fk(robot, seed), q_seed=seed).solutions])
    assert counts[0] < len(expected) <= counts[1]
    off = (q[: counts[1], None] - expected + math.pi) % (2.0 * math.pi) - math.pi
    assert np.abs(off).max(axis=2).min(axis=0).max() < 1e-7


def test_copies_of_a_multiple_solution_are_one():
    robot = builtin_robots()["gofa"]  # at home, moved almost onto axis 1: rounding splits the roots
    found, T, close = alone(robot, closed_form_of(robot)), fk(robot, robot.q_home), []
    T[:2, 3] *= 1e-9
    limits, arcs = (robot.lower, robot.upper), np.empty((256, 3))
    for each in (found.inner, found):
        q = np.empty((16, 6))
        each.rows(each.inner, found.params, T, math.nan, robot.q_home, limits, arcs, q)
        q = q[~np.isnan(q[:, 0])]
        apart = np.abs((q[:, None] - q + math.pi) % (2.0 * math.pi) - math.pi).max(axis=2)
        close.append(int(((apart > 1e-7) & (apart < 1e-3)).sum()))
    assert close[0] > close[1] == 0
    assert len(np.unique(q, axis=0)) > 4


@pytest.mark.full
@pytest.mark.parametrize("robot_id", ALL)
def test_c_is_also_strict_cpp_and_clean_under_sanitizers(robot_id, tmp_path):
    robot = ROBOTS[robot_id]
    arm, name = arm_of(robot), files.name_for(robot, None)
    text = files.c_file(arm, name)
    T, seeds, _ = targets(robot, 20, 100)
    (tmp_path / f"{name}.c").write_text(text)
    numbers = ", ".join(repr(float(x)) for i in range(len(T)) for x in (*T[i].ravel(), *seeds[i]))
    main = f"""#define {name.upper()}_IMPLEMENTATION
#include "{name}.c"
#include <stdio.h>
static const double data[{len(T)}][{16 + robot.n}] = {{{numbers}}};
int main(void) {{
  {name}_solution found[{arm.rows}];
  static {name}_scratch scratch;
  int count, total = 0;
  for (int i = 0; i < {len(T)}; i++) {{
    {name}_ik(data[i], data[i] + 16, found, &count{", &scratch" * (arm.buffer("solve") > 0)});
    total += count;
    if (i % 20 == 0) {name}_nearest(data[i], data[i] + 16, i % 40 == 0, found, &scratch);
  }}
  printf("%d\\n", total);
  return 0;
}}
"""
    (tmp_path / "main.cpp").write_text(main)
    checks = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    command = ["g++", "-std=c++11", "-O0", *STRICT, *checks, "main.cpp", "-o", "main", "-lm"]
    subprocess.run(command, check=True, cwd=tmp_path)
    done = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True)
    assert int(done.stdout) > 0
    assert done.stderr == ""


def test_a_family_without_limits_has_nothing_that_they_would_decide():
    for robot in one_of_each_family():
        form = closed_form_of(robot)
        found = alone(robot, form)
        if found.rows is without_limits:
            assert found.stepped or not form.redundancies(POSE)


@pytest.mark.full
def test_an_arm_of_each_solver_is_tested_with_the_full_set():
    chosen = {(type(closed_form_of(robot := ROBOTS[robot_id])), robot.n) for robot_id in ONE_OF_EACH_SOLVER}
    assert chosen == {(type(closed_form_of(robot)), robot.n) for robot in builtin_robots().values()}
