"""The folder "Posture" of the panel: the requested branch, and sliders for the redundancy parameters."""

from __future__ import annotations

from dataclasses import replace

import viser

import kin
from app.viewer.feature import Stage
from app.viewer.panel import Post
from app.viewer.panel.posture import BranchChoice, RedundancySliders, short
from app.viewer.panel.status import Notice
from app.viewer.self_motion import self_motion
from kin import IKResult
from kin.ik import IKSolution, Redundancy, solve
from kin.ik.messages.values import listed, need, ranges
from kin.transforms import Array
from kin.typed import EntryError
from kin.units import typeset


class PosturePanel:
    """The posture controls of the selected robot, in a folder of the panel."""

    def __init__(self, stage: Stage, folder: viser.GuiFolderHandle, post: Post) -> None:
        self._stage = stage
        self._folder = folder
        self._post = post
        self._dragged: str | None = None
        self._asked = False  # an open question asks for the posture
        self._sliders = RedundancySliders(stage.client.gui, folder, post, stage.fence)
        self._choice: BranchChoice
        self._result: tuple[tuple[object, ...], IKSolution] | None = None

    def use_robot(self) -> None:
        """Show the choices of another robot."""
        with self._folder:
            self._choice = BranchChoice(self._stage.client.gui, self._stage.arm.now.robot, self._post)
        self.show()

    def remove(self) -> None:
        """Remove the choices of a robot from the panel."""
        self._choice.remove()
        self._sliders.remove()

    def show(self) -> None:
        """Show the arm's branch, and the redundancy parameters there."""
        robot = self._stage.arm.now.robot
        parameters = self._parameters()
        self._asked = "postures" in self._stage.activity.withheld
        self._choice.withhold(self._asked)
        if kin.branch_names(robot) and not self._asked:
            self._choice.show(kin.branch_of(robot, self._stage.arm.now.goal))
        self._sliders.show(parameters, robot, self._stage.display.units, self._dragged)
        self._dragged = None

    def use_activity(self) -> None:
        """Something else is open or withheld."""
        if self._asked != ("postures" in self._stage.activity.withheld):
            self.show()

    def use_result(self, result: IKResult) -> None:
        """Take the redundancy parameters from the result whose solution the arm is heading for."""
        best = result.best
        # In other tasks the parameter may be a turn about the target's axis, which is not the tool's axis until
        # the arm has arrived.
        if self._stage.arm.now.task == "pose" and result.status == "solved" and best is not None:
            self._result = self._request(), best
        else:
            self._result = None

    def read(self, value: object) -> str | None:
        """The chosen branch, as `kin.solve_ik` takes it; raises `kin.InputError` for an unknown one."""
        return self._choice.read(value)

    def not_here(self, branch: str) -> Notice:
        """Why the arm cannot take a posture with the tool where it is."""
        stage = self._stage
        robot, q, options = stage.arm.now.robot, stage.arm.now.goal, replace(stage.arm.now.options, branch=branch)
        if robot.n < 6 and options.task == "pose":  # its postures are those of point and approach direction
            options = replace(options, task="approach")
        T = kin.fk(robot, q)
        result = solve(robot, T[:3, 3] if options.task == "position" else T, options, q)
        why = "No joint values give this posture with the tool where it is."
        if result.violations:
            needs = listed([need(violation, stage.display.units) for violation in result.violations])
            why = f"It needs {needs}."
        elif result.status == "solved":
            why = "With it the tool would have another roll."
        return Notice("advice", f"Not possible here: {short(branch)}", f"{why} The arm stays where it is.")

    def choose(self, branch: str | None) -> None:
        """Select a branch, given as `kin.solve_ik` takes it."""
        self._choice.choose(branch)

    def name_of(self, uuid: object) -> str | None:
        """The redundancy parameter whose slider has this id; None if there is none."""
        return self._sliders.name_of(uuid)

    def read_text(self, name: str, text: str) -> float:
        """A typed value of a redundancy parameter, in screen units; raises `EntryError` for an invalid one."""
        shown = self._sliders.read_text(name, text)
        units = self._stage.display.units
        value = units.angles.read(shown)
        found = next((r for r in self._parameters() if r.name == name), None)
        slack = 0.5 * units.angles.read(units.angles.step(1))  # the ends are shown rounded
        if found is None or any(low - slack <= value <= high + slack for low, high in found.intervals):
            return shown
        title = f"{self._sliders.label_of(name)} was not changed"
        valid = f"{units.angles.text(value)} is outside the feasible range"
        raise EntryError(title, f"{valid}. Feasible here: {typeset(ranges(found.intervals, units))}.")

    def move(self, name: str, value: object, held: bool = True) -> tuple[Array | None, IKResult]:
        """Set a redundancy parameter while the tool stays.

        Args:
            name: of the parameter.
            value: in screen units.
            held: whether the visitor holds its slider, which is not moved then.

        Returns:
            The configuration ``(n,)`` to move to, None if there is none, and the result to report. Outside the
            feasible range the arm moves to the end of the range, and the result gives the reason.
        """
        requested = self._sliders.read(name, value)
        result = reported = self._self_motion(name, requested)
        if result.status != "solved":
            ranges = [r.intervals for r in self._parameters() if r.name == name]
            feasible = [min(max(requested, low), high) for low, high in (ranges[0] if ranges else ())]
            if not feasible:
                return None, reported
            result = self._self_motion(name, min(feasible, key=lambda v: abs(v - requested)))
        if not result.solutions:
            return None, reported
        self._dragged = name if held else None
        return result.solutions[0].q, reported

    def _self_motion(self, name: str, value: float) -> IKResult:
        """Solve for the tool's present pose with a redundancy parameter set."""
        arm = self._stage.arm.now
        return self_motion(arm.robot, arm.T_goal, arm.options, arm.goal, name, value)

    def _parameters(self) -> tuple[Redundancy, ...]:
        """The redundancy parameters at the goal, on the branch of the goal."""
        arm = self._stage.arm.now
        if self._result is not None and self._result[0] == self._request():
            return self._result[1].redundancy
        seed = "seed" if kin.branch_names(arm.robot) else None
        options = replace(arm.options, branch=seed, max_solutions=1)
        found = solve(arm.robot, arm.T_goal, options, arm.goal)
        return found.solutions[0].redundancy if found.solutions else found.redundancy

    def _request(self) -> tuple[object, ...]:
        arm = self._stage.arm.now
        return arm.robot.id, arm.task, arm.goal.tobytes(), arm.options.constraints
