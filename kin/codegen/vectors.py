"""Test vectors: a C file with a `main` that checks the generated one on the machine that will run it."""

from __future__ import annotations

import math
from string import Template

import numpy as np

from kin.codegen.arm import Arm
from kin.fk import fk
from kin.ik import solve_ik
from kin.transforms import Array

COUNT = 50
_TEXT = Template("""\
// Checks ${name}.c: ${count} poses inside the limits, and the configurations that Kinboard finds of them.
//   cc -std=c99 -O2 ${name}_test.c -lm && ./a.out
#define ${NAME}_IMPLEMENTATION
#include "${name}.c"
#include <stdio.h>
static const double asked[${count}][${width}] = {${asked}}; // pose, seed, value of the redundancy parameter
static const int counts[${count}] = {${counts}};
static const double expected[${total}][${n}] = {${expected}};
${buffer}int main(void) {
  int wrong = 0, at = 0;
  for (int i = 0; i < ${count}; i++) {
    ${name}_solution found[${NAME}_MOST];
    int count = 0;
    const double *T = asked[i], *seed = asked[i] + 16;
    int status = ${name}_${call};
    bool right = status == ${NAME}_SOLVED && count == counts[i];
    for (int k = 0; right && k < count; k++)
      for (int j = 0; j < ${n}; j++) right = right && fabs(found[k].q[j] - expected[at + k][j]) < 1e-6;
    if (!right) printf("pose %d: status %d, %d configurations, not the %d\\n", i, status, count, counts[i]);
    wrong += !right;
    at += counts[i];
  }
  printf("%d of ${count} poses are right\\n", ${count} - wrong);
  return wrong != 0;
}
""")


def array_of(rows: Array) -> str:
    """Rows of numbers as an initialiser."""
    return ", ".join("{" + ", ".join(map(repr, row)) + "}" for row in rows.tolist())


def c_test(arm: Arm, name: str) -> str:
    """The file, for the C file of an arm that is named as by `kin.generate`."""
    robot, joint = arm.robot, -1
    low, high = np.maximum(robot.lower, -math.pi), np.minimum(robot.upper, math.pi)
    q, seeds = np.random.default_rng(59).uniform(low, high, (2, COUNT, robot.n))
    values = np.zeros(COUNT)
    if arm.alone.stepped and arm.parameter is not None:
        joint = arm.parameter.joint
        values = q[:, joint]
    T, found = fk(robot, q), []
    for pose, seed, value in zip(T, seeds, values.tolist(), strict=True):
        found.append(solve_ik(robot, pose, q_seed=seed, redundancy=value if joint >= 0 else None).solutions)
    return _TEXT.substitute(
        name=name,
        NAME=name.upper(),
        count=COUNT,
        width=17 + robot.n,
        n=robot.n,
        total=sum(map(len, found)),
        asked=array_of(np.column_stack([T.reshape(COUNT, 16), seeds, values])),
        counts=", ".join(str(len(each)) for each in found),
        expected=array_of(np.array([solution.q for each in found for solution in each])),
        buffer=f"static {name}_scratch buffer, *scratch = &buffer;\n" if arm.buffer("solve") else "",
        call=("ik(T, " if joint < 0 else f"ik_at(T, seed[{robot.n}], ")
        + ("seed, found, &count, scratch)" if arm.buffer("solve") else "seed, found, &count)"),
    )
