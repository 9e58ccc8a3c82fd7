"""*Calibrate by touching* in the tab *Robot*: what is touched, one posture after another, and the arm found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

import kin
from app.exports.touch import as_own, report, sheet_svg
from app.shared.computations import Subscription
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, choice, flag, kept, memory, number, text
from app.viewer.declared.panel import Button, Buttons, Control, Folder, Html, Node
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.scene import bars, label
from app.viewer.declared.work import Sweep, Work
from app.viewer.feature import save_file
from app.viewer.lessons.figure_shapes import BLUE, PURPLE, VERMILION
from app.viewer.own_arm import own_arm
from app.viewer.panel.status import Notice
from app.viewer.skeleton import ghost
from app.viewer.tabs.robot.calibrate import views
from app.viewer.tabs.robot.calibrate.run import (
    BOARDS,
    COUNT,
    LENGTHS,
    MORE,
    MOST,
    Found,
    Run,
    Touch,
    Touched,
    doubt,
    from_json,
    planned,
    read_joints,
    readable,
    solved,
    to_json,
)
from app.viewer.views.templates import render
from kin import KinematicsError, Robot
from kin.calibration.fixtures import PAPER
from kin.calibration.model import fewest, suited

LOOK_AGAIN = 0.2  # s between two looks at the connected arm, and at what is computed
REST = 0.3  # s after the last touch until a fit begins
OPACITY, CROSS, THIN, THICK = 0.6, 0.012, 0.001, 0.003
KINDS = {"crosses of a printed sheet": "sheet", "two sockets of a bar": "bar", "one pin": "pin"}
KIND_HINT = "A sheet suits small arms of five joints, a bar or a pin those of six and seven"
PLACES_HINT = "Several places show more; each is touched several times"
COUNT_HINT = "One more than the arm has joints, or more: fewer say nothing of its table"
JOINTS_HINT = "Numbers with spaces between them, from the base to the tool, in the units of the page"


@dataclass(frozen=True)
class CalibrateSettings(Settings):
    """What is touched, and the run. Links have it, so that neither a reload nor undo loses what was typed.

    Attributes:
        joints: the text that is typed for the posture on show.
        run: None until there are postures.
        wanted: how many postures are being chosen; 0: none.
        measured: joint values of the connected arm, None while there is none.
    """

    kind: str = choice("Touch", KINDS, "sheet", hint=KIND_HINT)
    paper: str = choice("Paper", {name: name for name in PAPER}, lambda robot: suited(robot)[1])
    length: float = number("Distance of the sockets", lambda robot: suited(robot)[0], LENGTHS, "length")
    places: int = number("Places", 1, (1, BOARDS), whole=True, hint=PLACES_HINT)
    plane: bool = flag("Touch the table too", hint="Anywhere, beside the fixture")
    count: int = number(
        "Touches",
        lambda robot: max(COUNT, fewest(robot)),
        (1, MOST),
        whole=True,
        within=lambda robot: (fewest(robot), MOST),
        hint=COUNT_HINT,
    )
    joints: str = text("Joint values", hint=JOINTS_HINT, longest=400)
    run: Run | None = kept(None, to_json=to_json, from_json=from_json, renew=False)
    wanted: int = memory(0)
    measured: tuple[float, ...] | None = memory()

    @property
    def what(self) -> Touched:
        """What is touched."""
        return Touched(self.kind, self.paper, self.length, self.places, self.plane)


@dataclass(frozen=True, eq=False)
class CalibrateFacts(Facts[CalibrateSettings]):
    """The arm and its run."""

    @property
    def found(self) -> Found | None:
        """What the touches have shown, or fewer of them while a fit is under way."""
        found: Found | None = self.work("fit").value
        return found

    @property
    def ready(self) -> Found | None:
        """What all of the present touches have shown; None: it is not known yet."""
        run, found = self.settings.run, self.found
        return found if run is not None and found is not None and found.touches == run.touches else None


class Calibrate(DeclaredFeature[CalibrateSettings, CalibrateFacts]):
    """See the module."""

    key = "calibrate"
    title = "Calibrate by touching"
    settings_of, facts_of = CalibrateSettings, CalibrateFacts
    undo: ClassVar[dict[str, str]] = {
        "on_plan": "Postures to touch in",
        "on_read": "Touch",
        "on_take": "Touch",
        "on_forget": "Touch left out",
        "on_use": "Calibrated arm",
        "on_stop": "Calibration ended",
    }

    def started(self) -> None:
        run = self.settings.run
        if run is not None and (same := run.of(self.stage.arm.now.robot)) is not None:
            self.change(run=same)
        else:
            self.change(run=None, joints="")

    def running(self) -> Sequence[Work | Sweep]:
        s, robot = self.settings, self.stage.arm.now.robot
        found: list[Work | Sweep] = []
        if s.wanted:
            what = s.what if s.run is None else s.run.what
            found.append(Work("plan", self._plan, (robot, what, s.wanted, s.run), poll=LOOK_AGAIN))
        if s.run is not None:
            found.append(Sweep(self._look, LOOK_AGAIN))
            if len(touches := s.run.touches) >= fewest(robot):
                args = robot, s.run.what, touches
                found.append(Work("fit", self._fit, args, rest=REST, poll=LOOK_AGAIN, keep=True))
        return found

    def _plan(self, robot: Robot, what: Touched, count: int, run: Run | None) -> Subscription[Run]:
        made = None if run is None else (run.q.tobytes(), run.touches)
        return self.stage.services.summaries.once(
            (robot, what, count, made), lambda cancel: planned(robot, what, count, run, cancel)
        )

    def _fit(self, robot: Robot, what: Touched, touches: tuple[Touch, ...]) -> Subscription[Found]:
        return self.stage.services.summaries.once(
            (robot, what, touches), lambda cancel: solved(robot, what, touches, cancel)
        )

    def _look(self, seconds: float) -> None:
        """Look where the connected arm is."""
        line, robot = self.stage.door.line, self.stage.arm.now.robot
        given = None if line is None else line.measured
        measured = None
        if given is not None and len(given) == robot.n:
            measured = tuple(np.round(given, 6).tolist())
        if measured != self.settings.measured:
            self.change(measured=measured)

    def worked(self, key: str) -> None:
        result, run = self.facts.work(key), self.settings.run
        if isinstance(result.error, KinematicsError):
            if key == "plan":
                self.change(wanted=0)
                self.stage.status.show(Notice("error", "No postures were found", str(result.error)))
        elif result.error is not None:
            super().worked(key)
        elif key == "plan" and result.finished:
            made: Run = result.value
            if run is None:
                self.change(wanted=0)
                self._show(made)
                self.stage.camera.fit((), made.spots)
            else:  # something may be being typed for the posture on show
                self.change(wanted=0, run=replace(made, at=run.at, course=run.course))
        elif key == "fit" and run is not None and self.facts.found is not None:
            self.change(run=run.found(self.facts.found))

    # What is shown

    def panel(self) -> Sequence[Node]:
        shown = self._nodes() if self.read.settings.run is None else self._run_nodes(self.read.settings.run)
        return [Folder("Calibrate by touching", self.unless_asked("table", *shown), open=False)]

    def _nodes(self) -> list[Node]:
        s = self.settings
        size = {"sheet": [Control("paper")], "bar": [Control("length")]}.get(s.kind, [])
        about = Html(views.about, (self.read.robot,), key="about")
        if s.wanted:
            cancel = Button("Cancel", self.event(self.on_cancel), key="cancel")
            return [about, Html(render, ("calibrate/busy",), key="busy"), cancel]
        acts = {"Propose": self.event(self.on_plan), "Save sheet": self.event(self.on_print)}
        offered = tuple(name for name in acts if s.kind == "sheet" or name != "Save sheet")
        hint = "Where to touch, and what it is expected to bring; the sheet to print, as SVG"
        fields = [Control("kind"), *size, *map(Control, ("places", "plane", "count"))]
        return [about, *fields, Buttons("Postures", acts, hint, offered, key="begin")]

    def _run_nodes(self, run: Run) -> list[Node]:
        f, s = self.read, self.read.settings
        acts = {
            "Back": self.event(self.on_to, run.at - 1),
            "Take": self.event(self.on_take),
            "Read": self.event(self.on_read),
            "Leave out": self.event(self.on_forget),
            "Next": self.event(self.on_to, run.at + 1),
        }
        absent = {
            "Back": run.at == 0,
            "Read": s.measured is None,
            "Leave out": run.read[run.at] is None,
            "Next": run.at == len(run.q) - 1,
        }
        offered = tuple(name for name in acts if not absent.get(name))
        nodes: list[Node] = [
            Html(views.places, (run, f.units), key="places"),
            Html(views.posture, (f.robot, run, s.measured, f.units), key="posture"),
            Control("joints", of=run.at),
            Buttons("Touch", acts, offered=offered, of=run.at, key="touch"),
            Html(views.touches, (run, f.found, fewest(f.robot)), key="touches"),
        ]
        if (error := f.work("fit").error) is not None:
            nodes.append(Html(views.failed, (str(error),), key="failed"))
        elif f.found is not None:
            nodes.append(Html(views.result, (f.found, f.units), key="result"))
        ends = {
            "Use this arm": self.event(self.on_use),
            "Save report": self.event(self.on_report),
            f"{MORE} more": self.event(self.on_more),
            "Stop": self.event(self.on_stop),
        }
        room = len(run.q) + MORE <= MOST and not s.wanted
        kept = {"Use this arm": f.ready is not None, "Save report": f.ready is not None, f"{MORE} more": room}
        offered = tuple(name for name in ends if kept.get(name, True))
        hint = "The arm of the page gets the table that was found; undo takes it back"
        return [*nodes, Buttons("Result", ends, hint, offered, key="result buttons")]

    def scene(self) -> Sequence[SceneNode]:
        s, robot = self.settings, self.stage.arm.now.robot
        if (run := s.run) is None or self.hides("table"):
            return []
        q, asked, spots = run.q[run.at], run.sockets[run.at], run.spots
        at = kin.fk(robot, q)[:3, 3] if asked < 0 else spots[asked]
        arms = CROSS * np.array([[[-1, 0, 0], [1, 0, 0]], [[0, -1, 0], [0, 1, 0]]])
        turned = np.einsum("mij,akj->maki", run.places[run.what.fixture.owner][:, :3, :3], arms)
        crosses = (turned + spots[:, None, None]).reshape(-1, 2, 3)
        above = np.multiply.outer((4.0, 5.0), (0.0, 0.0, CROSS)) + at
        return [
            ghost("asked", robot, q, PURPLE, OPACITY),
            bars("crosses", crosses, BLUE, THIN),
            bars("here", np.array([[at, above[0]]]), VERMILION, THICK),
            label("what", run.what.name(asked), above[1]),
        ]

    # Events

    @property
    def _run(self) -> Run:
        """The run that its controls are about."""
        assert self.settings.run is not None
        return self.settings.run

    def on_plan(self) -> None:
        """Choose postures."""
        self.change(wanted=self.settings.count)

    def on_more(self) -> None:
        """Choose further postures, which say most beside what was touched already."""
        self.change(wanted=MORE)

    def on_cancel(self) -> None:
        """Choose none after all."""
        self.change(wanted=0)

    def on_print(self) -> None:
        """Save the sheet."""
        paper = self.settings.paper
        words = f"Print it on {paper} at 100 %, and measure the line on it."
        save_file(self.stage, f"touch-sheet-{paper}.svg", sheet_svg(paper), words)

    def on_take(self) -> None:
        """Take what is typed; raises `InputError`: it cannot be read, and stays."""
        # On a press alone: the field sends every letter, and 6 is on the way to 6.5. A press comes after all that
        # was typed before it, and what the field of another posture sends later is void (`PanelView`).
        run, stage = self._run, self.stage
        self._show(
            run.with_read(read_joints(self.settings.joints, stage.arm.now.robot, run.what, stage.display.units))
        )

    def on_read(self) -> None:
        """Take where the connected arm is; raises `InputError`: no such arm can be there."""
        if (q := self.settings.measured) is not None:
            run, stage = self._run, self.stage
            self._show(
                run.with_read(readable(q, stage.arm.now.robot, run.what, stage.display.units, radians=True))
            )

    def on_forget(self) -> None:
        """Forget what was read in this posture."""
        self._show(self._run.with_read(None))

    def on_to(self, at: int) -> None:
        """Show a posture; what is typed for the one before is taken. Raises `InputError`: it cannot be read."""
        if self.settings.joints.strip() and self.settings.joints != self._written(self._run):
            self.on_take()
            self._question(self._run)
        self._show(self._run.to(at))

    def _question(self, run: Run) -> None:
        """Say so if what was read in the posture on show is far from it: the next one takes its place."""
        read = run.read[run.at]
        if read is not None and (words := doubt(run.robot, run.q[run.at], read)):
            self.stage.status.show(Notice("advice", f"Posture {run.at + 1} is in doubt", words))

    def on_report(self) -> None:
        """Save what was found as one page."""
        if (found := self.facts.ready) is not None:
            page = report(found.calibration, [each.socket for each in found.touches])
            save_file(self.stage, "calibration.html", page, "Every touch, and every error of the table.")

    def on_use(self) -> None:
        """Make the arm that was found that of the page; raises `KinematicsError`: it is too long for a link."""
        if (found := self.facts.ready) is None:
            return
        nominal = self.stage.arm.now.robot
        made = own_arm(kin.robot_to_dict(as_own(found.calibration.robot)), nominal.id)
        self.on_stop()
        self.stage.robots.edit(made)
        words = "The arm is your own. Save TOML keeps it in a file, and undo brings the nominal one back."
        self.stage.status.show(Notice("hand", f"{nominal.name} is calibrated", words))

    def on_stop(self) -> None:
        """End the run; undo brings it back."""
        self.change(run=None, joints="", wanted=0)
        self.stage.camera.fit(())

    def _show(self, run: Run) -> None:
        """Show the posture of a run, and what was read in it."""
        self.change(run=run, joints=self._written(run))
        self.rewrite()

    def _written(self, run: Run) -> str:
        """What was read in the posture on show, as it is typed."""
        scales = [self.stage.display.units.of(bool(turns)).scale for turns in self.stage.arm.now.robot.revolute]
        read = zip(run.read[run.at] or (), scales, strict=False)
        return " ".join(f"{value * scale:.8g}" for value, scale in read)

    def on_style(self) -> None:
        if (run := self.settings.run) is not None and run.read[run.at] is not None:
            self._show(run)  # in other units
        super().on_style()

    # Links

    def state(self) -> dict[str, object]:
        fresh = self.settings_of.fresh(self.stage.arm.now.robot).state()
        return {key: value for key, value in self.settings.state().items() if value != fresh[key]}

    def restore(self, state: dict[str, object]) -> None:
        fresh = self.settings_of.fresh(self.stage.arm.now.robot).state()
        super().restore({**fresh, **state})
