"""Which posture takes the target: the branch asked for, and what is free while the tool stays."""

from __future__ import annotations

import viser

import kin
from app.viewer.feature import Stage
from app.viewer.panel import Post
from app.viewer.panel.posture import BranchChoice, FreeSliders
from app.viewer.selfmotion import self_motion
from kin import Redundancy
from kin.transforms import Array


class Posture:
    """The posture of the arm on show, in a folder of the panel.

    Attributes:
        branch: the branch asked for, as `kin.solve_ik` takes it.
    """

    def __init__(self, stage: Stage, folder: viser.GuiFolderHandle, post: Post) -> None:
        self._stage = stage
        self._folder = folder
        self._post = post
        self._held: str | None = None
        self._free = FreeSliders(stage.client.gui, folder, post)
        self._choice: BranchChoice
        self._answered: tuple[tuple[object, ...], tuple[Redundancy, ...]] | None = None
        self.branch: str | None = None

    def use(self) -> None:
        """Show the choices of another arm."""
        self.branch = None
        with self._folder:
            self._choice = BranchChoice(self._stage.client.gui, self._stage.robot, self._post)
        self.show()

    def remove(self) -> None:
        """Take the choices of an arm out of the panel."""
        self._choice.remove()
        self._free.remove()

    def show(self) -> None:
        """The branch the arm is on, and what is free there."""
        free = self._free_now()
        robot = self._stage.robot
        if kin.branch_names(robot):
            self._choice.show(kin.branch_of(robot, self._stage.goal))
        self._free.show(free, robot, self._stage.units, self._held)
        self._held = None

    def answered(self, result: kin.IKResult) -> None:
        """Learn from the answer the arm is heading for what is free there."""
        best = result.best
        # Other tasks leave a turn about the target's own axis free, which is not the tool's until it has arrived.
        if self._stage.task == "pose" and result.status == "solved" and best is not None:
            self._answered = self._question(), best.redundancy
        else:
            self._answered = None

    def read(self, value: object) -> None:
        """Ask for what the visitor chose; raises `kin.InputError` for what is not on the list."""
        self.branch = self._choice.read(value)

    def choose(self, branch: str | None) -> None:
        """Ask for a branch, told as `kin.solve_ik` takes it."""
        self._choice.choose(branch)
        self.branch = branch

    def let_go(self) -> None:
        """A joint moved by hand may leave the branch that was chosen: from then on none is."""
        # Asked only where one was chosen: an arm without a closed form has no branches to name.
        if self.branch not in (None, "seed") and self.branch != kin.branch_of(self._stage.robot, self._stage.goal):
            self.choose(None)

    def move(self, name: str, value: object) -> tuple[Array | None, kin.IKResult]:
        """Set what is free while the tool stays: where to go ``(n,)``, if anywhere, and the answer to tell.

        Where the limits end, the arm stops and the answer says why.
        """
        wanted = self._free.read(name, value)
        result = self._self_motion(name, wanted)
        told = result
        if result.status != "solved":
            ranges = [r.intervals for r in self._free_now() if r.name == name]
            inside = [min(max(wanted, low), high) for low, high in (ranges[0] if ranges else ())]
            if not inside:
                return None, told
            result = self._self_motion(name, min(inside, key=lambda v: abs(v - wanted)))
        if not result.solutions:
            return None, told
        self._held = name
        return result.solutions[0].q, told

    def _self_motion(self, name: str, value: float) -> kin.IKResult:
        """The tool where it is with a free value set."""
        stage, q = self._stage, self._stage.goal
        return self_motion(stage.robot, kin.fk(stage.robot, q), stage.task, q, stage.locked, name, value)

    def _free_now(self) -> tuple[Redundancy, ...]:
        """What is free where the arm is heading, on the branch it is on."""
        stage, q = self._stage, self._stage.goal
        if self._answered is not None and self._answered[0] == self._question():
            return self._answered[1]
        seed = "seed" if kin.branch_names(stage.robot) else None
        return kin.solve_ik(
            stage.robot, kin.fk(stage.robot, q), task=stage.task, q_seed=q, locked=stage.locked, branch=seed,
            max_solutions=1,
        ).redundancy  # fmt: skip

    def _question(self) -> tuple[object, ...]:
        stage = self._stage
        return stage.robot.id, stage.task, stage.goal.tobytes(), stage.locked
