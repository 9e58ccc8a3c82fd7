"""*Step out*: the ways out of a singularity in the status card, a ghost of where one leads, and the motion.

It is offered where the arm rests at a singularity; the lesson "Velocity" offers it near one, too. What is pressed
in the card is sent by ``static/lesson.js``.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from app.exports.worksheet.sheet import indexed
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, memory
from app.viewer.declared.panel import same
from app.viewer.declared.scene import Color, Node
from app.viewer.declared.work import Sweep, Work
from app.viewer.drive import FRAME, Drive, locked
from app.viewer.panel.posture import short
from app.viewer.panel.status import Notice
from app.viewer.skeleton import ghost
from app.viewer.views.templates import render
from kin import Obstacle, Robot
from kin.escape import Exit, Exits
from kin.escape.results import tool_motion
from kin.singularity import singularities_at
from kin.tolerances import TOLERANCES
from kin.transforms import Array
from kin.units import Units, typeset

FINDING = ("feature", "step-out", ("find", 0))  # what another feature posts to look for the ways out
COLOR: Color = (0, 158, 115)
OPACITY = 0.45
REST = 0.2  # s for which the arm rests before it is looked at
STEP_HINT = (
    "Looks for the shortest motion out of this singularity, and draws where it leads before you drive there"
)
FIND = ("find", "Step out", STEP_HINT)
DRIVE = ("drive", "Drive there", "Moves the arm to the pale one")
NEXT = ("next", "Next way", "Several postures can be reached; draws where the next way leads")
STAY = ("stay", "Stay here", "Leaves the arm where it is")
DRIVEN = Notice("reached", "Stepping out", "The arm moves, the tool does not.")
STAYED = Notice("hand", "Stopped on the way out", "The arm stays where it is.")
CHANGED = Notice("limits", "Stopped on the way out", "What the arm avoids has changed. Press Step out again.")


@dataclass(frozen=True)
class ExitSettings(Settings):
    """See the module.

    Attributes:
        leaving: the configuration ``(n,)`` for which the ways out are shown.
        exit: which of them is drawn.
        drive: the one that is driven frame by frame.
    """

    leaving: Array | None = memory()
    exit: int = memory(0)
    drive: Drive | None = memory()


class ExitFacts(Facts[ExitSettings]):
    """The ways out, and what the card says of them."""

    @cached_property
    def leaving(self) -> Array | None:
        """The configuration ``(n,)`` whose ways out are shown; None: none are, or the arm was moved since."""
        wanted, drive = self.settings.leaving, self.settings.drive
        if wanted is None:
            return None
        return wanted if np.array_equal(wanted if drive is None else drive.here, self.arm.goal) else None

    @cached_property
    def sought(self) -> tuple[Robot, Array, tuple[Obstacle, ...]] | None:
        """The arm, its configuration and the obstacles for which ways out are shown; None: none are."""
        return None if self.leaving is None else (self.arm.robot, self.leaving, self.arm.obstacles)

    @cached_property
    def exits(self) -> Exits | None:
        """The ways out; None: none are shown, or they are still searched.

        Those that were found for other obstacles do not count: the search for the present ones has not begun yet.
        """
        result = self.work("exits")
        found: Exits | None = result.value
        return found if self.sought is not None and same(result.args, self.sought) else None

    @property
    def exit(self) -> Exit | None:
        """The one that is drawn before it is driven."""
        found = self.exits
        if found is None or not found.exits or self.settings.drive is not None:
            return None
        return found.exits[self.settings.exit % len(found.exits)]

    @cached_property
    def offer(self) -> str:
        """What the status card says of it, and its buttons."""
        found, shown = self.exits, self.exit
        if self.leaving is None:
            return _card("At a singularity.", FIND) if self.work("singular").value else ""
        if self.settings.drive is not None:
            return _card("", STAY)
        if found is None:
            return _card("The ways out are searched …", STAY)
        if shown is None:
            return _card(indexed(typeset(found.explain(self.units))), STAY)
        which = f"{found.exits.index(shown) + 1} of {len(found.exits)}" if len(found.exits) > 1 else "out"
        posture = f"{short(shown.posture)}; " if shown.posture else ""
        tool = tool_motion(found.robot, shown, self.units)
        buttons = (DRIVE, NEXT, STAY) if len(found.exits) > 1 else (DRIVE, STAY)
        joints = f"Moves {found.moves(shown, self.units)}."
        return _card(typeset(f"Way {which}: {posture}{tool}."), *buttons, more=indexed(typeset(joints)))


class StepOut(DeclaredFeature[ExitSettings, ExitFacts]):
    """See the module."""

    key = "step-out"
    title = "Step out"
    messages = frozenset({"find", "drive", "next", "stay"})
    settings_of, facts_of = ExitSettings, ExitFacts
    pace = 0.1

    @property
    def offer(self) -> str:
        return "" if self.hides("singularities") else self.read.offer

    def scene(self) -> Sequence[Node]:
        shown = None if self.hides("singularities") else self.facts.exit
        return [] if shown is None else [ghost("exit", self.facts.robot, shown.q[-1], COLOR, OPACITY)]

    def running(self) -> Sequence[Work | Sweep]:
        f, arm = self.facts, self.facts.arm
        found: list[Work | Sweep] = [Work("singular", is_singular, (arm.robot, arm.goal), rest=REST)]
        if f.sought is not None:
            found.append(Work("exits", self.stage.services.summaries.exits, f.sought))
        if f.settings.drive is not None:
            found.append(Sweep(self._go_on_driving, FRAME))
        return found

    def heard(self, key: Hashable, value: object) -> None:
        match key:
            case ("find", int()):
                self.on_find()
            case ("drive", int()):
                self._drive()
            case ("next", int()):
                self.change(exit=self.settings.exit + 1)
            case ("stay", int()):
                self._stay()
            case _:
                super().heard(key, value)

    def on_find(self) -> None:
        """Look for the ways out of where the arm is."""
        self.change(leaving=self.stage.arm.now.goal, exit=0, drive=None)

    def _stay(self) -> None:
        """Leave the arm where it is."""
        if self.settings.drive is not None:
            self.stage.status.show(STAYED)
        self.change(leaving=None, drive=None)

    def _drive(self) -> None:
        """Drive the way out that is drawn; frame by frame if the tool is to stay where it is between waypoints."""
        shown, found, stage = self.facts.exit, self.facts.exits, self.stage
        if shown is None or found is None:
            return
        if (held := locked(stage.arm.now, shown.q)) is not None:
            stage.status.show(held)
        elif shown.keeps_tool:
            self.change(drive=Drive(shown.q))
            self.invalidate()
            self._go_on_driving(FRAME)  # in the press, which is a step that can be undone
        else:
            self.change(leaving=None)
            stage.arm.move_to(shown.q[-1], left(found, shown, stage.display.units))

    def _go_on_driving(self, seconds: float) -> None:
        """A frame of the way out; another motion of the arm ends it."""
        drive, found = self.settings.drive, self.facts.exits
        here = drive is not None and np.array_equal(drive.here, self.stage.arm.now.goal)
        ways = () if found is None or drive is None else found.exits
        way = next((each for each in ways if drive is not None and np.array_equal(each.q, drive.q)), None)
        if drive is None or found is None or way is None or not here:
            self.change(drive=None, leaving=None)
            if here:
                self.stage.status.show(CHANGED)
            return
        if (held := locked(self.stage.arm.now, drive.q[drive.passed :])) is not None:
            self.change(drive=None, leaving=None)
            self.stage.status.show(held)
            return
        drive = drive.after(seconds)
        self.change(drive=drive)
        notice = left(found, way, self.stage.display.units) if drive.arrived else DRIVEN
        self.stage.arm.move_to(drive.here, notice, at_once=True)
        if drive.arrived:
            self.change(drive=None, leaving=None)


def is_singular(robot: Robot, q: Array) -> bool:
    """Whether a configuration ``(n,)`` costs the arm a motion."""
    return any(each.kind != "algorithmic" for each in singularities_at(robot, q, TOLERANCES.at_singularity))


def left(found: Exits, shown: Exit, units: Units) -> Notice:
    """The message at the end of a way out."""
    said = tool_motion(found.robot, shown, units)
    posture = f"; posture {short(shown.posture)}" if shown.posture else ""
    return Notice("reached", "Out of the singularity", f"{said[0].upper()}{said[1:]}{posture}.")


def _card(words: str, *buttons: tuple[str, str, str], more: str = "") -> str:
    """Words, more for which a phone has no room, and buttons: what each sends, its text, its hint."""
    return render("panel/offer", feature="step-out", label="Step out", words=words, more=more, buttons=buttons)
