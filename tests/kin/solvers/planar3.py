"""An example solver for a test: the planar arm with three parallel revolute axes, with the whole contract.

The tool's angle about the axes gives the third axis, the triangle of the axes gives the elbow: two branches.
"""

from __future__ import annotations

import cmath
import math
from itertools import pairwise

import numpy as np

from kin.axes import joint_axes
from kin.fk import fk
from kin.kernels.compile import jit
from kin.solvers.contract import POSE, BatchKernels, Candidates, ClosedForm, Obstacle
from kin.solvers.singular import JointValue, Singularity, elbow_at, off_line, those_within

# Layout of params: first axis (2), lengths and angles of the links with every joint at 0, angle of the tool.
ORIGIN, LENGTH, ANGLE, TOOL = 0, 2, 5, 8


@jit
def one(params, T, value, near, out):
    """out ``(2, 3)`` ← elbow left and right; False if T is not finite."""
    a, b = params[LENGTH], params[LENGTH + 1]
    psi = math.atan2(T[1, 0], T[0, 0]) - params[TOOL]
    last = params[ANGLE + 2] + psi
    x = T[0, 3] - params[ORIGIN] - params[LENGTH + 2] * math.cos(last)
    y = T[1, 3] - params[ORIGIN + 1] - params[LENGTH + 2] * math.sin(last)
    cosine = (x * x + y * y - a * a - b * b) / (2.0 * a * b)
    for row in range(2):
        bend = (1.0 - 2.0 * row) * math.acos(min(max(cosine, -1.0), 1.0))
        t1 = math.atan2(y, x) - math.atan2(b * math.sin(bend), a + b * math.cos(bend))
        out[row, 0] = t1 - params[ANGLE]
        out[row, 1] = bend - (params[ANGLE + 1] - params[ANGLE])
        out[row, 2] = psi - out[row, 0] - out[row, 1]
        for joint in range(3):
            q = out[row, joint]
            q -= 2.0 * math.pi * math.ceil((q - math.pi) / (2.0 * math.pi))
            out[row, joint] = q if abs(cosine) <= 1.0 + 1e-12 else math.nan
    return math.isfinite(x + y + psi)


@jit
def many(params, T, values, near, out):
    """out ``(N, 2, 3)`` ← the branches of each target."""
    for i in range(T.shape[0]):
        one(params, T[i], values[min(i, values.shape[0] - 1)], near, out[i])


def match(robot):
    """The closed form if the arm has three parallel revolute axes along z."""
    if robot.n != 3 or not robot.revolute.all():
        return None
    axes = joint_axes(robot)
    if any(abs(axis.direction[2] - 1.0) > 1e-9 for axis in axes):
        return None
    T = fk(robot, np.zeros(3))
    points = [complex(*axis.point[:2]) for axis in axes] + [complex(*T[:2, 3])]
    links = [after - before for before, after in pairwise(points)]
    if min(map(abs, links[:2])) < 1e-9:
        return None
    return Planar3(points[0], links, math.atan2(T[1, 0], T[0, 0]))


class Planar3(ClosedForm):
    name, title, branches = "planar3", "closed form, planar arm", ("elbow left", "elbow right")
    reason = "all three axes are parallel"

    def __init__(self, origin, links, tool):
        lengths, angles = [abs(link) for link in links], [cmath.phase(link) for link in links]
        self.lengths = tuple(lengths[:2])
        self.elbow = angles[1] - angles[0]
        params = np.array([origin.real, origin.imag, *lengths, *angles, tool])
        self.kernels = BatchKernels(params, one, many)

    def handles(self, task):
        return task == POSE

    def redundancies(self, task):
        return ()

    def solve(self, problem):
        out = np.empty((2, 3))
        self.kernels.one(self.kernels.params, problem.T, math.nan, problem.seed, out)
        obstacle = Obstacle("last axis beyond the links' reach") if np.isnan(out).all() else None
        return Candidates(out, np.empty((2, 0)), (), 0.0, obstacle)

    def branch_of(self, q):
        return int(math.sin(q[1] + self.elbow) < 0.0)

    def singularities(self, q, within=math.inf):
        off = off_line(q[1] + self.elbow)
        met = (JointValue(1, float(q[1]) - off),)
        condition = elbow_at(q[1] + self.elbow)
        return those_within(
            within, Singularity("elbow", condition, "last axis along the arm", abs(off), "rad", met)
        )
