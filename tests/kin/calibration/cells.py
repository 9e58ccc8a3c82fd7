"""Arms and fixtures of the figures in docs/calibrate.md, and one simulated calibration of each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import kin
from kin.calibration.fit import Touches
from kin.calibration.fixtures import TouchBoard, TouchFixture
from kin.calibration.model import Model, TableTolerances
from kin.calibration.postures import workspace_poses
from tests.kin.calibration.simulated import (
    FINE,
    HOBBY,
    Machine,
    probed,
    random_errors,
    tip_error,
    touch,
    true_sockets,
)

QUARTER = 0.5 * math.pi


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm of the figures.

    Attributes:
        table: height of the table, metres.
        spots: three places of a pin or bar.
        yaw: of bars about z, 0 where they are along y.
    """

    robot: kin.Robot
    machine: Machine
    table: float
    spots: tuple[tuple[float, float, float], ...]
    yaw: float = 0.0


def arms() -> dict[str, Arm]:
    return {
        "so101": Arm(
            kin.get_robot("so101"), HOBBY, 0.0, ((0.22, 0.0, 0.05), (0.12, 0.2, 0.05), (0.2, -0.1, 0.16))
        ),
        "pioneer5": Arm(
            kin.get_robot("pioneer5"),
            HOBBY,
            -0.24,
            ((0.0, 0.22, -0.19), (0.2, 0.15, -0.19), (-0.1, 0.25, -0.1)),
            QUARTER,
        ),
        "ur5e": Arm(probed("ur5e"), FINE, 0.0, ((0.45, 0.1, 0.1), (-0.3, 0.45, 0.1), (0.3, -0.4, 0.4))),
        "puma560": Arm(probed("puma560"), FINE, 0.3, ((0.5, 0.15, 0.42), (-0.1, 0.6, 0.42), (0.4, -0.35, 0.8))),
        "panda": Arm(probed("panda"), FINE, 0.0, ((0.45, 0.0, 0.1), (0.1, 0.5, 0.1), (0.3, -0.35, 0.5))),
    }


def fixture_of(arm: Arm, what: str) -> tuple[TouchFixture, list[np.ndarray]]:
    """A fixture and where it lies."""
    small = arm.robot.reach < 0.7
    places = [kin.pose_from_xyz_rpy(spot, [0.0, 0.0, arm.yaw]) for spot in arm.spots]
    if what == "sheet":
        paper = ("A5" if arm.yaw else "A4") if small else "A3"  # pioneer5 does not reach all crosses of A4
        x, y, _ = arm.spots[0]
        flat = kin.pose_from_xyz_rpy([x, y - (0.04 if arm.yaw else 0.0), arm.table], [0.0, 0.0, arm.yaw])
        return TouchFixture([TouchBoard.sheet(paper)]), [flat]
    board = TouchBoard.pin() if "pin" in what else TouchBoard.bar(0.05 if "50 mm" in what else 0.15)
    if len(board.sockets) == 2:  # from the place on, as far as the arm reaches
        places = [place @ kin.pose_from_xyz_rpy([0.0, board.spread, 0.0]) for place in places]
    count = 3 if "3 places" in what else 1
    return TouchFixture([board] * count, plane="plane" in what), places[:count]


@dataclass(frozen=True, eq=False)
class Cell:
    """An arm, what it touches, and how often."""

    name: str
    what: str
    count: int = 20

    @cached_property
    def arm(self) -> Arm:
        return arms()[self.name]

    @cached_property
    def plan(self) -> kin.calibration.TouchPlan:
        fixture, places = fixture_of(self.arm, self.what)
        return kin.calibration.touch_postures(
            self.arm.robot,
            fixture,
            self.count,
            places=places,
            table=self.arm.table,
            tolerances=TableTolerances(),
            noise=self.arm.machine.noise,
        )

    @cached_property
    def test(self) -> np.ndarray:
        return workspace_poses(self.arm.robot, 500, self.arm.table)

    def model(self, tolerances: TableTolerances) -> Model:
        return Model.of(self.arm.robot, fixture_of(self.arm, self.what)[0], tolerances, self.arm.machine.noise)

    def touches(self, seed: int, machine: Machine | None = None) -> tuple[Model, np.ndarray, Touches]:
        """The model, true errors, and what a simulated arm reads."""
        rng = np.random.default_rng([seed, 77])
        model = self.model(TableTolerances())
        errors = random_errors(model.chain, rng)
        spots = true_sockets(model.fixture, self.plan.places, rng)
        asked = Touches(self.plan.q, self.plan.sockets)
        return (
            model,
            errors,
            touch(
                model.chain, errors, machine or self.arm.machine, asked, model.fixture, spots, rng, self.arm.table
            ),
        )

    def off(self, model: Model, errors: np.ndarray, delta: np.ndarray) -> float:
        """Error of the tip over the workspace, metres."""
        return tip_error(model.chain.points(self.test, errors), model.chain.points(self.test, delta))


CELLS = [
    *(Cell("so101", what) for what in ("pin", "bar", "pin + plane", "sheet", "bar 50 mm, 3 places")),
    *(Cell("pioneer5", what) for what in ("pin", "bar", "pin + plane", "sheet")),
    *(Cell("ur5e", what) for what in ("pin", "bar", "pin + plane", "sheet")),
    *(Cell("puma560", what) for what in ("pin", "bar", "pin + plane", "pin, 3 places")),
    *(Cell("panda", what) for what in ("pin", "bar", "pin + plane")),
]
