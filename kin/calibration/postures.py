"""Which postures to ask for: those in which the touches say most about the tip elsewhere.

Candidates are configurations in which the nominal arm touches a socket, without touching itself or the table.
Inverse kinematics gives all postures for random directions of the tool about the axis of the socket, and other
self-motions for random seeds; what directions an arm of five joints has is found by moving random configurations
onto the point. Of these the best set is chosen greedily, then by exchanges. The best is the one with the least
expected error of the tip over the workspace (I-optimal; with test poses: Wu, Klimchik, Pashkevich, Caro and Furet,
Efficiency improvement of measurement pose selection techniques in robot calibration, arXiv 1311.6658).

The tolerances are the prior, so it is defined before there are as many equations as parameters. The first touch of
a board says nothing, as its place is not known: at first all sockets take turns, and the exchanges settle how many
touches each of them gets.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from kin.angles import wrapped
from kin.calibration.chain import Mask
from kin.calibration.fit import Touches
from kin.calibration.fixtures import PLANE, Places, TouchFixture, Whole
from kin.calibration.model import Model, tip_modes
from kin.collision import Obstacle, clearance
from kin.fk import fk, fk_positions, jacobian
from kin.ik import solve_ik
from kin.ik.problem import never_cancel
from kin.robot import IDENTITY, Robot
from kin.transforms import Array

CLEAR = 0.005  # m between links, and between links and the table
_PROBE = 0.07  # m that the capsule of a tool may be thicker than the tool
_CANDIDATES, _FEWEST = 900, 60  # of all sockets, and of each
_TRIES = 400  # targets of each socket
_PROJECTED, _ROUNDS = 400, 24  # random configurations that are moved onto a socket at once, and how often
_NEWTON = 40
_EXCHANGES = 3
_SAMPLED = 4000
_NEAR, _APART, _RAISED = 0.15, 0.35, 0.27  # shares of the reach
_HIGH = 0.05  # m above the table, of sockets that are not printed on paper


@dataclass(frozen=True, eq=False)
class Scene:
    """Where an arm touches.

    Attributes:
        table: height of the table, metres.
        poses: ``(b, 4, 4)`` of the boards in the world frame, as the nominal arm has them.
    """

    robot: Robot
    fixture: TouchFixture
    table: float
    poses: Array

    @property
    def sockets(self) -> Array:
        """Places of all sockets ``(m, 3)``."""
        T = self.poses[self.fixture.owner]
        return np.asarray(np.einsum("mij,mj->mi", T[:, :3, :3], self.fixture.local) + T[:, :3, 3])

    @cached_property
    def _without_tool(self) -> Robot | None:
        """The arm without the bodies of its last link; None if all bodies are assumed, which are no thinner."""
        bodies = tuple(each for each in self.robot.capsules if each.link < len(self.robot.moving_rows))
        return replace(self.robot, capsules=bodies, tool=IDENTITY, nominal=None) if bodies else None

    def free(self, q: Array) -> Mask:
        """Which configurations ``(k, n)`` touch neither themselves nor the table.

        What touches is thinner than the capsule of the last link, which may be in the table.
        """
        clear = free(self.robot, q, self.table - _PROBE)
        if self._without_tool is not None:
            clear[clear] = free(self._without_tool, q[clear], self.table)
        return clear


def free(robot: Robot, q: Array, table: float | None, clear: float = CLEAR) -> Mask:
    """Which configurations ``(k, n)`` touch neither themselves nor a table of this height."""
    if not len(q):
        return np.zeros(0, bool)
    size = 6.0 * max(robot.reach, 0.1) if math.isfinite(robot.reach) else 20.0
    slabs = [] if table is None else [Obstacle("table", xyz=(0.0, 0.0, table), size=(size, size, size))]
    return np.asarray(clearance(robot, q, slabs) > clear)


def workspace_poses(robot: Robot, count: int, table: float | None) -> Array:
    """Random configurations ``(count, n)``, without collisions and above the table as far as there are any."""
    rng = np.random.default_rng(6)
    kept = np.empty((0, robot.n))
    for _ in range(4):
        q = robot.random_q(rng, 3 * count)
        kept = np.vstack([kept, q[free(robot, q, table, 0.0)]])
        if len(kept) >= count:
            return kept[:count]
    return np.vstack([kept, robot.random_q(rng, count)])[:count]


def proposed_poses(robot: Robot, fixture: TouchFixture, table: float) -> Array:
    """Poses of boards ``(b, 4, 4)`` at places where many postures touch.

    Boards stand on the table with their z axis up, far from each other; every third one is raised, because places
    at different heights show more.
    """
    rng = np.random.default_rng(5)
    T = fk(robot, robot.random_q(rng, _SAMPLED))
    down = T[:, 2, 2] < -math.cos(math.radians(60.0))
    tips = T[down if down.sum() > 0.01 * _SAMPLED else slice(None), :3, 3]
    base = robot.T_world_base[:2, 3]
    reach = float(np.quantile(np.linalg.norm(tips[:, :2] - base, axis=1), 0.98))
    forward = fk(robot, robot.q_home)[:2, 3] - base
    yaw0 = math.atan2(forward[1], forward[0]) if np.linalg.norm(forward) > 0.05 * reach else 0.0
    yaws = yaw0 + np.radians([0, 20, -20, 45, -45, 70, -70, 100, -100, 140, -140, 180])
    spots = [(r * reach, yaw) for yaw in yaws for r in (0.45, 0.55, 0.65, 0.75)]
    found: list[Array] = []
    for b, board in enumerate(fixture.boards):
        flat = board.contact is not None
        height = table + (0.0 if flat else _HIGH) + (_RAISED * reach if b % 3 == 2 else 0.0)
        best, most = np.eye(4), -1.0
        for r, yaw in spots:
            c, s = math.cos(yaw), math.sin(yaw)
            pose = np.eye(4)
            pose[:2, :2], pose[:3, 3] = [[c, -s], [s, c]], [base[0] + r * c, base[1] + r * s, height]
            apart = [float(np.linalg.norm(pose[:3, 3] - other[:3, 3])) for other in found]
            if apart and min(apart) < _APART * reach:
                continue
            sockets = board.sockets @ pose[:3, :3].T + pose[:3, 3]
            near = [(np.linalg.norm(tips - each, axis=1) < _NEAR * reach).sum() for each in sockets]
            if min(near) > most:
                best, most = pose, float(min(near))
        found.append(best)
    return np.array(found)


def candidates(scene: Scene, seed: int = 0, cancel: Callable[[], None] = never_cancel) -> Touches:
    """Configurations that touch each socket, and the plane if there is one."""
    count = max(_FEWEST, _CANDIDATES // (len(scene.sockets) + scene.fixture.plane))
    rng = np.random.default_rng(seed)
    q, at = [], []
    for j, spot in enumerate(scene.sockets):
        cancel()
        board = int(scene.fixture.owner[j])
        up, cone = scene.poses[board, :3, 2], scene.fixture.boards[board].cone
        if scene.robot.n < 6 or scene.robot.coupled:
            found = _by_projection(scene, lambda p, spot=spot: spot - p, up, cone, count, rng)  # type: ignore[misc]
        else:
            found = _by_inverse_kinematics(scene, spot, up, cone, count, rng)
        q.append(found)
        at += [j] * len(found)
    if scene.fixture.plane:  # anywhere within reach
        up, cone = np.array([0.0, 0.0, 1.0]), scene.fixture.boards[0].cone
        found = _by_projection(scene, lambda p: (scene.table - p)[:, 2:], up, cone, count, rng)
        q.append(found)
        at += [PLANE] * len(found)
    return Touches(np.vstack(q), np.array(at, np.int64))


def _by_inverse_kinematics(
    scene: Scene, spot: Array, up: Array, cone: float, count: int, rng: np.random.Generator
) -> Array:
    """Every posture for random directions of the tool within the cone, and random rolls."""
    robot = scene.robot
    found: list[Array] = []
    T = np.eye(4)
    T[:3, 3] = spot
    for _ in range(_TRIES):
        T[:3, :3] = _frame(up, cone, rng)
        answer = solve_ik(robot, T, q_seed=robot.random_q(rng) if robot.n > 6 else None)
        if answer.status == "solved":
            found += [solution.q for solution in answer.solutions]
        if len(found) >= 3 * count:
            break
    q = np.array(found).reshape(-1, robot.n)
    q = q[scene.free(q)]
    return np.asarray(q[rng.permutation(len(q))[:count]])


def _by_projection(
    scene: Scene,
    missing: Callable[[Array], Array],
    up: Array,
    cone: float,
    count: int,
    rng: np.random.Generator,
) -> Array:
    """Random configurations, moved by Newton steps until `missing` of their tips is 0, as `_onto` has it."""
    robot, kept = scene.robot, np.empty((0, scene.robot.n))
    for _ in range(_ROUNDS):
        q = _onto(robot, robot.random_q(rng, _PROJECTED), missing)
        T = fk(robot, q)
        good = (np.linalg.norm(missing(T[:, :3, 3]), axis=1) < 1e-8) & robot.in_limits(q)
        q = q[good & (-(T[:, :3, 2] @ up) > math.cos(cone))]
        kept = np.vstack([kept, q[scene.free(q)]])
        if len(kept) >= count:
            break
    return kept[:count]


def _onto(robot: Robot, q: Array, missing: Callable[[Array], Array]) -> Array:
    """Configurations moved by the shortest Newton steps until `missing` of their tips ``(k, c)`` is 0."""
    for _ in range(_NEWTON):
        miss = missing(fk_positions(robot, q))
        if np.abs(miss).max() < 1e-11:
            break
        J = jacobian(robot, q)[:, 3 - miss.shape[1] : 3]
        JJ = J @ J.transpose(0, 2, 1) + 1e-10 * np.eye(miss.shape[1])
        dq = np.einsum("kij,ki->kj", J, np.linalg.solve(JJ, miss[:, :, None])[:, :, 0])
        q = q + dq * np.minimum(1.0, 0.5 / np.maximum(np.abs(dq).max(axis=1, keepdims=True), 1e-12))
    return np.where(robot.whole_turns, wrapped(q), q)


def _frame(up: Array, cone: float, rng: np.random.Generator) -> Array:
    """A random orientation ``(3, 3)`` whose z axis points against `up`, within the cone."""
    c, phi = rng.uniform(math.cos(cone), 1.0), rng.uniform(0.0, 2.0 * math.pi)
    side = np.cross(up, np.eye(3)[int(np.abs(up).argmin())])
    side /= np.linalg.norm(side)
    z = -(c * up + math.sqrt(1.0 - c * c) * (math.cos(phi) * side + math.sin(phi) * np.cross(up, side)))
    x = np.cross(z, rng.normal(size=3))
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


@dataclass(frozen=True, eq=False)
class Pieces:
    """What each candidate would say.

    Attributes:
        G: ``(k, 3, u)`` whitened derivatives by all unknowns, in units of their tolerances.
        L: ``(3t, u)`` how the unknowns move the tip at the test poses, metres over the root of their number.
    """

    G: Array
    L: Array

    @classmethod
    def of(cls, model: Model, touches: Touches, poses: Array, test: Array) -> Pieces:
        """Of these touches, with boards at these poses ``(b, 4, 4)``."""
        now = model.chain.derivatives(touches.q, np.zeros(model.count))
        start = Places.near(model.fixture, now.points, touches.at)
        A, D = Places(
            model.fixture, poses[:, :3, :3], poses[:, :3, 3], start.grown, start.normal, start.height
        ).derivatives(now.points, touches.at)
        sigma = model.prior
        used = sigma > 0.0
        J = np.concatenate([A @ now.by_parameter, D], axis=2)[:, :, used] * sigma[used]
        L = np.zeros((3 * len(test), int(used.sum())))
        arm = used[: model.count]
        L[:, : int(arm.sum())] = (tip_modes(model.chain, test) * model.sigma)[:, arm]
        return cls(model.whitening(now.by_joint, A, touches.at) @ J, L / math.sqrt(len(test)))

    def covariance(self, chosen: list[int]) -> Array:
        """Of the unknowns in units of their tolerances, with these touches."""
        J = self.G[chosen].reshape(-1, self.G.shape[2])
        return np.asarray(np.linalg.inv(J.T @ J + np.eye(J.shape[1])))


def choose(
    parts: Pieces,
    at: Whole,
    count: int,
    start: tuple[int, ...] = (),
    cancel: Callable[[], None] = never_cancel,
) -> list[int]:
    """The best `count` candidates: one after the other, then each in turn exchanged for a better one.

    Args:
        at: ``(k,)`` what each candidate touches.
        start: candidates that were touched already; they are kept and come first.
    """
    turns = np.unique(at)
    C = parts.L.T @ parts.L
    chosen = list(start)
    P = parts.covariance(chosen)
    while len(chosen) < len(start) + count:
        cancel()
        turn = at == turns[len(chosen) % len(turns)]
        turn[chosen] = False
        k = _best(parts.G, P, C, np.flatnonzero(~turn).tolist() if turn.any() else chosen)
        P = _with(P, parts.G[k])
        chosen.append(k)
    for _ in range(_EXCHANGES):
        before = list(chosen)
        for i in range(len(start), len(chosen)):
            cancel()
            without = _with(P, parts.G[chosen[i]], -1.0)
            chosen[i] = _best(parts.G, without, C, chosen[:i] + chosen[i + 1 :])
            P = _with(without, parts.G[chosen[i]])
        if chosen == before:
            break
    return chosen


def _with(P: Array, g: Array, sign: float = 1.0) -> Array:
    """The covariance with one touch more (or less)."""
    S = np.eye(3) * sign + g @ P @ g.T
    return np.asarray(P - P @ g.T @ np.linalg.solve(S, g @ P))


def _best(G: Array, P: Array, C: Array, taken: list[int]) -> int:
    """The candidate that lowers the expected error of the tip most."""
    GP = G @ P
    S = np.eye(3) + GP @ G.transpose(0, 2, 1)
    gain = (np.linalg.solve(S, GP @ C) * GP).sum(axis=(1, 2))
    gain[taken] = -np.inf
    return int(gain.argmax())


def in_order(robot: Robot, q: Array) -> list[int]:
    """The order of postures in which each is near the one before, from the home configuration on."""
    left, here, order = list(range(len(q))), robot.q_home, []
    while left:
        nearest = min(left, key=lambda k: float(np.abs(q[k] - here).max()))
        left.remove(nearest)
        order.append(nearest)
        here = q[nearest]
    return order
