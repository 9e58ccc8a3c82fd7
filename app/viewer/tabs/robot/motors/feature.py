"""*Motors* in the tab *Robot*: a table, the fields of one motor, LeRobot's calibration, and *Match motors*."""

from __future__ import annotations

import json
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import kin
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, choice, memory, number, text
from app.viewer.declared.panel import Button, Buttons, Control, Folder, Html, Node
from app.viewer.declared.work import Sweep
from app.viewer.feature import save_file, sent_text
from app.viewer.panel.status import Notice
from app.viewer.tabs.robot import edits
from app.viewer.tabs.robot.edits import EditError
from app.viewer.tabs.robot.motors import views
from app.viewer.tabs.robot.motors.run import COUNT, Run, begun, readings_of
from kin import InputError, Robot
from kin.motor import LARGEST_ID
from kin.motors import Motor
from kin.motors.joints import moving_motors

FIELDS = ("id", "sign", "offset", "unit", "lead")
LEAD = 0.01  # m in a turn of the motor of a slide, until it is stated
LOOK_AGAIN = 0.5  # s
LARGEST = 15_000  # bytes of a calibration: it comes in one message of the page
SAVED = "LeRobot reads it from its folder of calibrations, under the name of the arm."
READ_HINT = "Numbers with spaces or commas between them, as a script prints them"


def _listed(robot: Robot) -> dict[str, int]:
    """The motors of an arm by what a list calls them."""
    return {f"{motor.id} · {motor.joint or motor.name}": i for i, motor in enumerate(robot.motors)} or {"none": 0}


@dataclass(frozen=True)
class MotorSettings(Settings):
    """What is typed: the motors themselves are the arm's, and in its link.

    Attributes:
        run: of *Match motors*.
        streams: whether a connected program sends readings for it.
    """

    chosen: int = choice("Motor", _listed, 0, link=False, renew=False)
    id: int = number("Number on the bus", 1, (0, LARGEST_ID), whole=True, link=False)
    sign: int = choice("Counts", {"as the joint": 1, "backwards": -1}, 1, link=False)
    offset: float = number("Zero at", 0.0, (-999_999.0, 999_999.0), digits=3, coarse=0, link=False)
    unit: str = choice("Reads", {words: unit for unit, words in views.UNITS.items()}, "deg", link=False)
    lead: float = number("A turn moves it", LEAD, (1e-6, 100.0), "length", link=False)
    readings: str = text("Readings", hint=READ_HINT, longest=2000, link=False)
    calibration: str = text(
        "LeRobot's calibration", hint="The text of its JSON file, pasted", longest=100_000, link=False
    )
    run: Run | None = memory(renew=False)
    streams: bool = memory(False)


@dataclass(frozen=True, eq=False)
class MotorFacts(Facts[MotorSettings]):
    """The arm, and the run of *Match motors*."""

    @property
    def motor(self) -> Motor | None:
        """The one whose fields are shown."""
        motors = self.robot.motors
        return motors[min(self.settings.chosen, len(motors) - 1)] if motors else None


class Motors(DeclaredFeature[MotorSettings, MotorFacts]):
    """See the module."""

    key = "motors"
    title = "Motors"
    settings_of, facts_of = MotorSettings, MotorFacts
    messages = frozenset({"upload"})
    undo: ClassVar[dict[str, str]] = {"on_use": "Motors matched", "on_add": "Motors", "on_remove": "Motors"}

    def started(self) -> None:
        run = self.settings.run
        if run is not None and not run.of(self.stage.arm.now.robot):
            self.change(run=None)

    def running(self) -> Sequence[Sweep]:
        return [] if self.settings.run is None else [Sweep(self._look, LOOK_AGAIN)]

    def _look(self, seconds: float) -> None:
        """Look whether a program sends readings."""
        if (streams := self._streamed() is not None) != self.settings.streams:
            self.change(streams=streams)

    def _streamed(self) -> tuple[float, ...] | None:
        """The readings of the motors that a connected program sends, if there are as many as the run has."""
        run, line = self.settings.run, self.stage.door.line
        if run is None or line is None or line.readings is None:
            return None
        found = tuple(line.readings)
        return found if len(found) == len(moving_motors(run.robot)) else None

    @property
    def _run(self) -> Run:
        """The run that its controls are about."""
        assert self.settings.run is not None
        return self.settings.run

    # What is shown

    def panel(self) -> Sequence[Node]:
        return [Folder("Motors", self.unless_asked("table", *self._nodes()), open=False)]

    def _nodes(self) -> list[Node]:
        f, robot = self.read, self.read.robot
        if f.settings.run is not None:
            return self._run_nodes(f.settings.run)
        add = Button(
            "Add motors", self.event(self.on_add), "One of each joint, in degrees, with the numbers 1, 2, …"
        )
        calibration = Control("calibration")
        if f.motor is None:
            return [Html(views.nothing, (robot,), key="none"), add, calibration]
        names = FIELDS if f.motor.lead is not None else FIELDS[:-1]
        fields = [Control(name, value=getattr(f.motor, name), of=(robot.id, f.motor.id)) for name in names]
        acts = {"Match motors": self.event(self.on_match), "Remove motors": self.event(self.on_remove)}
        save = Button("Save LeRobot's file", self.event(self.on_save), "The calibration of these motors, as JSON")
        return [
            Html(views.table, (robot.motors, f.motor.id), key="table"),
            Control("chosen", value=robot.motors.index(f.motor), of=robot.id),
            *fields,
            Buttons("All motors", acts, "Shows three poses, and finds signs and zeros from what is read in them"),
            calibration,
            *([save] if any(motor.range for motor in robot.motors) else []),
        ]

    def _run_nodes(self, run: Run) -> list[Node]:
        if run.match is not None:
            acts = {
                "Use": self.event(self.on_use),
                "Back": self.event(self.on_to, COUNT - 1),
                "Close": self.event(self.on_stop),
            }
            useful = any(finding.status == "matched" for finding in run.match.findings)
            offered = tuple(name for name in acts if useful or name != "Use")
            hint = "Writes the signs and zeros of the matched motors into the arm"
            return [Html(views.result, (run,), key="result"), Buttons("Result", acts, hint, offered, key="ready")]
        two = sum(values is not None for values in run.readings[: run.at]) >= 2
        acts = {
            "Back": self.event(self.on_to, run.at - 1),
            "Find signs and zeros" if run.is_last else "Next pose": self.event(self.on_next),
            "Read program": self.event(self.on_read),
            "Find from two": self.event(self.on_solve),
            "Stop": self.event(self.on_stop),
        }
        absent = {"Back": run.at == 0, "Find from two": not two, "Read program": not self.settings.streams}
        offered = tuple(name for name in acts if not absent.get(name))
        return [
            Html(views.pose, (run, self.stage.display.units), key="pose"),
            Control("readings", of=run.at),
            Buttons("Poses", acts, offered=offered, of=run.at, key="poses"),
        ]

    # Events

    def heard(self, key: Hashable, value: object) -> None:
        if key != ("upload",):
            super().heard(key, value)
        self._open(value)

    def step_name(self, key: Hashable) -> str:
        return "Calibration" if key == ("upload",) else super().step_name(key)

    def _open(self, value: object) -> None:
        """Use a file with LeRobot's calibration that the page sends."""
        try:
            name, text = sent_text(value, LARGEST)
            self._use(
                kin.motors.motors_from_lerobot(self.stage.arm.now.robot, text), f"The calibration {name} is used"
            )
        except InputError as error:
            self.stage.status.show(Notice("error", "The file was not used", str(error)))

    def changed(self, path: str) -> None:
        self.invalidate()
        motor = self.facts.motor
        if path == "calibration" and self.settings.calibration.strip():
            typed = self.settings.calibration
            self.change(calibration="")
            self.rewrite()
            self._use(kin.motors.motors_from_lerobot(self.stage.arm.now.robot, typed), "The calibration is used")
        elif path in FIELDS and motor is not None:
            self.rewrite()  # a field whose text was refused shows what counts
            changed = replace(motor, **{path: getattr(self.settings, path)})
            if changed != motor:
                self._use([changed if each.id == motor.id else each for each in self.stage.arm.now.robot.motors])

    def on_add(self) -> None:
        """A motor of each joint."""
        joints = self.stage.arm.now.robot.joints
        leads = [LEAD if joint.kind == "prismatic" else None for joint in joints]
        self._use(
            [
                Motor(joint.name, i + 1, lead=lead)
                for i, (joint, lead) in enumerate(zip(joints, leads, strict=True))
            ]
        )

    def on_remove(self) -> None:
        """The arm without motors."""
        self._use([])

    def on_match(self) -> None:
        """Show the first pose."""
        run = begun(self.stage.arm.now.robot, self.stage.arm.now.obstacles)
        self.stage.camera.fit((), run.points)
        self._show_pose(run)

    def on_next(self) -> None:
        """Take the readings of this pose, and show the next one, or what they say after the last."""
        run = self._run.read(readings_of(self.settings.readings, self._run.robot))
        if run.is_last:
            self.change(run=run.solved())
        else:
            self._show_pose(run.to(run.at + 1))

    def on_read(self) -> None:
        """Take the newest readings of a connected program."""
        if (found := self._streamed()) is not None:
            self._write_readings(found)

    def on_solve(self) -> None:
        """Find signs and zeros from the poses that are read."""
        self.change(run=self._run.solved())

    def on_to(self, at: int) -> None:
        """Show another pose."""
        self._show_pose(self._run.to(at))

    def on_use(self) -> None:
        """Write what has been found into the arm."""
        assert self._run.match is not None
        motors = self._run.match.motors
        self.on_stop()
        self._use(motors, "Signs and zeros are in the arm")

    def on_stop(self) -> None:
        """End the run."""
        self.change(run=None)
        self.stage.camera.fit(())

    def on_save(self) -> None:
        """Save LeRobot's calibration."""
        data = json.dumps(kin.motors.motors_to_lerobot(self.stage.arm.now.robot), indent=4)
        save_file(self.stage, "calibration.json", data, SAVED)

    def _show_pose(self, run: Run) -> None:
        """Move the arm to the pose of the run; what was read in it before is in the field."""
        self.change(run=run)
        self._write_readings(run.readings[run.at])
        words = "Put your arm as this one, then type what its motors read. Tab Robot."
        self.stage.arm.move_to(run.poses[run.at], Notice("hand", f"Pose {run.at + 1} of {COUNT}", words))

    def _write_readings(self, values: Sequence[float] | None) -> None:
        """Write readings into the field."""
        self.change(readings=" ".join(f"{value:.10g}" for value in values or ()))
        self.rewrite()

    def _use(self, motors: Sequence[Motor], done: str = "") -> None:
        """The arm with these motors becomes the visitor's own; raises `InputError`."""
        robot, own = self.stage.arm.now.robot, self.stage.robots.own
        try:
            made = edits.with_motors(robot, own if own is not None and own.robot == robot else None, motors)
        except EditError as error:
            raise InputError("motors", "this", error.message) from None
        self.stage.robots.edit(made)
        if done:
            self.stage.status.show(Notice("hand", done, "The arm is your own. Save TOML keeps it in a file."))
