"""The lesson "Postures": all ways to reach a target, and the reason if there is none.

All branches of the target appear in the scene as numbered ghosts; the list gives the distance of each from the
joint limits, and its manipulability. A click on a ghost, or on its number, moves the arm there. If the target is
missed, the reason and possible remedies are shown. For an arm of five joints, the possible approach directions are
drawn.

On an arm that shows it, the student drives the tool round a loop that ends in another posture without a
singularity.

The list is updated at most ten times a second; remedies are searched only when nothing is moving.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from typing import ClassVar

import kin
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Button, Buttons, Control, Folder, Html, Node
from app.viewer.declared.scene import Lazy
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Work
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Outline, Question
from app.viewer.lessons.guide.progress import Progress
from app.viewer.lessons.postures import loop, remedies
from app.viewer.lessons.postures.directions import Cone, cone_html, has_cone
from app.viewer.lessons.postures.facts import PosturesFacts
from app.viewer.lessons.postures.questions import outline
from app.viewer.lessons.postures.remedies import Remedy, Request
from app.viewer.lessons.postures.settings import PosturesSettings
from app.viewer.panel.posture import short
from app.viewer.panel.status import Notice
from app.viewer.postures.ghosts import ghosts
from app.viewer.postures.survey import html
from app.viewer.views.templates import render
from kin import IKResult
from kin.transforms import Array
from kin.units import Units

CONE_INTERVAL = 0.2
POLL = 0.2  # s between two looks at a map that is computed
QUIET = 0.25  # seconds without a new result before remedies are searched
HIDDEN = "\N{WHITE CIRCLE}"
MOVE_HINT = "Moves the arm to this posture. A click on its ghost does the same."
GHOST_HINT = f"Shows or hides the ghost of one posture: {HIDDEN} marks a hidden one"
UNNAMED = "The postures of this arm have no names: the list shows only the closest one."


class Postures(DeclaredFeature[PosturesSettings, PosturesFacts], Lesson):
    """See the module."""

    key = "postures"
    title = "Postures"
    about = "All ways to reach a target, and the reason if there is none."
    outline = staticmethod(outline)
    settings_of, facts_of = PosturesSettings, PosturesFacts
    undo: ClassVar[dict[str, str]] = {"on_go": "Posture", "on_remedy": "Remedy", "on_way_point": "Way point"}
    pace = 0.1

    # What is shown

    def panel(self) -> Sequence[Node]:
        f, robot = self.read, self.read.robot
        numbers = tuple(str(i + 1) for i in range(len(f.names)))
        fixes = [
            Button(fix.label, self.event(self.on_remedy, i), fix.hint or None, key=str(i), of=(f.result, f.units))
            for i, fix in enumerate(f.offers)
        ]
        go = {number: self.event(self.on_go, i) for i, number in enumerate(numbers)}
        nodes: list[Node] = [
            Html(remedies.html, (f.result, f.arm.branch, f.units)),
            Folder(None, fixes),
            *self.unless_asked(
                "postures",
                Buttons("Go", go, MOVE_HINT, of=robot.id),
                Html(html, (robot, f.postures, f.present, f.seen, f.units), key="list"),
                Control("ghosts"),
                self._toggles(numbers),
            ),
        ]
        if has_cone(robot):
            nodes.append(Control("cone"))
            if f.cone is not None:
                nodes.append(Html(cone_html, (f.cone.patch.share,), key="share"))
        if not kin.branch_names(robot) and not self.hides("postures"):
            nodes.append(Html(_note, key="unnamed"))
        if f.round:
            nodes.append(self._round())
        return nodes

    def _round(self) -> Folder:
        """The drive, its way points, and the map with it."""
        f, drive = self.read, self.settings.drive
        found = f.work("map").value
        go = {str(i + 1): self.event(self.on_way_point, i) for i in range(loop.POINTS)}
        plot = () if found is None else (Html(loop.map_html, (found, drive, f.units), key="map"),)
        words = Html(loop.drive_html, (f.robot, drive, f.units), key="drive")
        return Folder("The way round", [words, Buttons("Way point", go, loop.WAY_HINT, of=f.robot.id), *plot])

    def _toggles(self, numbers: tuple[str, ...]) -> Buttons:
        """A button for each ghost, which are marked while it is hidden."""
        f = self.read
        events = {number: self.event(self.on_ghost, i, False) for i, number in enumerate(numbers)}
        events |= {f"{HIDDEN}{number}": self.event(self.on_ghost, i, True) for i, number in enumerate(numbers)}
        offered = tuple(
            f"{HIDDEN}{number}" if name in self.settings.hidden else number
            for name, number in zip(f.names, numbers, strict=True)
        )
        return Buttons("Show", events, GHOST_HINT, offered, of=f.robot.id)

    def scene(self) -> Sequence[Lazy]:
        f, nodes = self.read, list[Lazy]()
        if not self.hides("postures"):
            nodes.append(Lazy("ghosts", self._ghosts, (f.robot, f.postures, f.seen - {f.present})))
        if f.cone is not None:
            nodes.append(Lazy("cone", Cone.nodes, (f.cone,)))
        if (drive := self.settings.drive) is not None and len(drive.corners) > 1:
            nodes.append(Lazy("drive", loop.path_nodes, (f.robot, drive)))
        return nodes

    def _ghosts(self, *args: object) -> list[SceneNode]:
        f = self.read
        return ghosts(f.robot, f.postures, f.seen - {f.present}, lambda i: self.event(self.on_go, i))

    # Events

    def on_go(self, index: int) -> None:
        """Move the arm to a posture, or say why it cannot go there."""
        postures = self.read.postures
        if index >= len(postures):
            return  # a late click: those of another arm
        posture = postures[index]
        name = short(posture.name)
        if posture.available and posture.q is not None:
            words = f"Posture {index + 1}: {name}"
            self.stage.arm.move_to(posture.q, Notice("hand", words, "The tool stays where it was."))
        else:
            self.stage.status.show(Notice("limits", f"Not available: {name}", f"{posture.words.capitalize()}."))

    def on_way_point(self, index: int) -> None:
        """Move the arm to a point of the way round."""
        points = loop.loop_of(self.read.robot)
        assert points is not None
        words = "The joints go straight there from where they are."
        self.stage.arm.move_to(points[index], Notice("hand", f"Way point {index + 1}", words))

    def on_ghost(self, index: int, show: bool) -> None:
        """Show or hide the ghost of a posture."""
        name = self.read.names[index]
        hidden = self.settings.hidden
        self.change(hidden=hidden - {name} if show else hidden | {name})

    def on_remedy(self, number: int) -> None:
        """Do what would help."""
        remedy = self.read.offers[number]
        match remedy.kind:
            case "branch":
                self.stage.arm.allow_any_branch()
            case "unlock":
                self.stage.arm.change_lock(remedy.joint, False)
            case "relax":
                assert remedy.task is not None
                self.stage.arm.set_task(remedy.task)
            case "turn" | "move":
                assert remedy.q is not None
                title = "Target turned" if remedy.kind == "turn" else "Target moved"
                self.stage.arm.move_to(remedy.q, Notice("hand", title, "The tool can reach it there."))

    def on_result(self, result: IKResult) -> None:
        self.change(result=result)
        self.catch_up()

    def started(self) -> None:
        now = self.stage.arm.now
        self.change(drive=loop.driven(now.robot, None, now.q) if self.settings.round else None)

    def on_arm_changed(self, changed: Set[str]) -> None:
        if self.settings.round and not self._outdated:
            before = self.settings.drive
            drive = loop.driven(self.stage.arm.now.robot, before, self.stage.arm.now.q)
            if drive is not before:
                self.change(drive=drive)
        super().on_arm_changed(changed)

    def on_steps(self, progress: Progress) -> Outline | None:
        at, steps = progress.at, progress.outline.steps
        asked = at < len(steps) and isinstance(steps[at].question, loop.Round)
        if asked != self.settings.round:
            self.change(round=asked)
            self.started()
            self.schedule()
        return super().on_steps(progress)

    def driven(self, question: Question) -> object:
        if not isinstance(question, loop.Round):
            return super().driven(question)
        now = self.stage.arm.now
        drive = loop.driven(now.robot, self.settings.drive, now.goal)
        return (now.goal[None] if drive is None else drive.corners).round(6).tolist()

    # Long work

    def running(self) -> Sequence[Work]:
        f, works = self.facts, list[Work]()
        if self.settings.cone and has_cone(f.robot):
            works.append(Work("cone", self._cone, (f.arm.aim,), pace=CONE_INTERVAL, keep=True))
        if f.result is not None and f.result.status != "solved":
            works.append(Work("remedies", self._remedies, (f.result, f.units), rest=QUIET))
        if f.round:
            works.append(Work("map", self.stage.services.summaries.postures, (loop.request(f.robot),), poll=POLL))
        return works

    def _cone(self, T: Array) -> Cone:
        """The directions at the target."""
        last = self.facts.cone
        if last is None:
            return Cone.of(self.facts.robot, T)
        return last if last.is_near(T) else last.at(T)

    def _remedies(self, result: IKResult, units: Units) -> Iterator[tuple[Remedy, ...]]:
        """Try one thing after another that may help."""
        f, found = self.facts, tuple[Remedy, ...]()
        for remedy in remedies.remedies(Request(f.robot, f.arm.aim, f.arm.options, f.arm.goal, result), units):
            found = found if remedy is None else (*found, remedy)
            yield found


def _note() -> str:
    return render("panel/note", text=UNNAMED)
