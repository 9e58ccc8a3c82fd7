"""Simulated arms with errors in their tables, and what they read when they touch: play, waves and sag included."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import kin
from kin.calibration.chain import Chain
from kin.calibration.fit import Touches
from kin.calibration.fixtures import PLANE, TouchFixture, rigid, rotation
from kin.calibration.model import Model, TableTolerances, TouchNoise

DEG = math.pi / 180.0
LARGEST = TableTolerances(tip=2e-3)  # errors that simulated arms have


@dataclass(frozen=True)
class Machine:
    """How an arm reads and touches.

    Attributes:
        step: of the encoder, radians.
        play: largest error of a reading besides, uniform, radians.
        contact: standard deviation of a contact in each direction, metres.
        wave: amplitude of an error of each encoder that repeats every turn, radians.
        sag: downward bending of the tip at 0.5 m from axis 1, metres.
        hand: how far from the asked posture a person puts the arm, radians.
    """

    step: float
    play: float
    contact: float
    wave: float = 0.0
    sag: float = 0.0
    hand: float = 3.0 * DEG

    @property
    def noise(self) -> TouchNoise:
        return TouchNoise(math.sqrt(self.step**2 / 12.0 + self.play**2 / 3.0), self.contact)


HOBBY = Machine(360.0 / 4096 * DEG, 0.3 * DEG, 0.3e-3)
FINE = Machine(0.0, 0.005 * math.sqrt(3.0) * DEG, 0.1e-3)


def probed(robot_id: str) -> kin.Robot:
    """An arm with a ball beside its last axis: on that axis the last joint would not be seen."""
    return kin.get_robot(robot_id).with_mounted(kin.pose_from_xyz_rpy([0.05, 0.0, 0.10]))


def random_errors(chain: Chain, rng: np.random.Generator, largest: TableTolerances = LARGEST) -> np.ndarray:
    most = np.array([getattr(largest, each.kind) for each in chain.parameters])
    return rng.uniform(-1.0, 1.0, len(most)) * most


def true_sockets(fixture: TouchFixture, poses: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Where the sockets really are: boards put down by hand, made within their error."""
    found = []
    for board, pose in zip(fixture.boards, poses, strict=True):
        local = board.sockets - board.sockets[0]
        grown = 1.0 if len(local) == 1 else 1.0 + rng.normal(0.0, board.print_error) / board.spread
        first = pose[:3, :3] @ board.sockets[0] + pose[:3, 3] + rng.uniform(-0.01, 0.01, 3)
        found.append(first + grown * local @ (rotation(rng.normal(0.0, 3.0 * DEG, 3)) @ pose[:3, :3]).T)
    return np.vstack(found)


def touch(
    chain: Chain,
    errors: np.ndarray,
    machine: Machine,
    asked: Touches,
    fixture: TouchFixture,
    spots: np.ndarray,
    rng: np.random.Generator,
    table: float = 0.0,
) -> Touches:
    """What an arm with these errors reads when it touches, in postures near the asked ones."""
    k, n = asked.q.shape
    q = asked.q + rng.uniform(-machine.hand, machine.hand, (k, n))
    contact = fixture.contacts(asked.at, machine.contact)
    off = rng.normal(size=(k, 3)) * contact[:, None]
    phase = rng.uniform(0.0, 2.0 * math.pi, n)
    normal = rotation(rng.normal(0.0, DEG, 3)) @ [0.0, 0.0, 1.0]
    height = table + rng.uniform(-3e-3, 3e-3)
    on = asked.at == PLANE
    for _ in range(60):
        now = chain.derivatives(q, errors)
        p, J = now.points.copy(), now.by_joint.copy()
        p[:, 2] -= machine.sag * np.hypot(p[:, 0], p[:, 1]) / 0.5
        miss = spots[np.maximum(asked.at, 0)] + off - p
        if on.any():
            miss[on] = (height + off[on, 0] - p[on] @ normal)[:, None] * normal
            J[on] = normal[:, None] * np.einsum("i,kij->kj", normal, J[on])[:, None, :]
        if np.abs(miss).max() < 1e-10:
            break
        JJ = J @ J.transpose(0, 2, 1)
        JJ += 1e-9 * np.eye(3) * np.trace(JJ, axis1=1, axis2=2)[:, None, None]
        dq = np.einsum("kij,ki->kj", J, np.linalg.solve(JJ, miss[:, :, None])[:, :, 0])
        q = q + dq * np.minimum(1.0, 0.3 / np.maximum(np.abs(dq).max(axis=1, keepdims=True), 1e-12))
    good = np.abs(miss).max(axis=1) < 1e-6
    reading = q + machine.wave * np.sin(q + phase) + rng.uniform(-machine.play, machine.play, q.shape)
    if machine.step:
        reading = np.round(reading / machine.step) * machine.step
    return Touches(reading[good], asked.at[good])


def tip_error(true: np.ndarray, found: np.ndarray) -> float:
    """Root mean square distance of tool points after the best motion of the base, metres."""
    R, t = rigid(found, true)
    return float(np.sqrt(np.mean(((true - found @ R.T - t) ** 2).sum(axis=1))))


def model_of(
    robot: kin.Robot, fixture: TouchFixture, machine: Machine, tolerances: TableTolerances | None = None
) -> Model:
    return Model.of(robot, fixture, tolerances or TableTolerances(), machine.noise)
