"""The lesson "Numeric IK": iterations from a start to a target, watched one by one.

The arm on show is the start, so dragging it moves the start; "Target here" makes its pose the target. The iterates
appear as ghosts, with error and step length as a chart. For arms with two joints in a plane, a picture shows which
solution each start leads to; other arms get the picture of the built-in one.

Iterations and pictures are computed in slices of some milliseconds, whenever the worker is idle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import kin
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Buttons, Control, Folder, Html, Node
from app.viewer.declared.scene import Lazy
from app.viewer.declared.work import Sweep, Work
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.numeric import basins, views
from app.viewer.lessons.numeric.drawing import scene
from app.viewer.lessons.numeric.facts import NumericFacts
from app.viewer.lessons.numeric.questions import facts
from app.viewer.lessons.numeric.settings import NumericSettings
from app.viewer.panel.status import Notice
from app.viewer.scene.meshes import body

INTERVAL = 0.08  # s between two starts of a moving arm
PACE = 0.35  # s between two iterates that are played
MOVES = ("First", "Back", "Next", "Run")
TARGET_HINT = "Makes the present pose of the tool, or a target that is missed, the target of the iterations"
MOVE_HINT = "Shows the iterates one by one; Run plays them"
TAKE_HINT = "Moves the arm to the iterate on show; the start stays"


class NumericLesson(DeclaredFeature[NumericSettings, NumericFacts], Lesson):
    """See the module."""

    key = "numeric"
    title = "Numeric IK"
    about = "Newton, transpose and damping from a start that you drag: iterates, failures, basins."
    asked_of = staticmethod(facts)
    settings_of, facts_of = NumericSettings, NumericFacts
    undo: ClassVar[dict[str, str]] = {"on_take": "Iterate"}

    def started(self) -> None:
        self._figure = FigureNodes(body(self.stage.arm.now.robot).size)

    def remove(self) -> None:
        super().remove()
        self.stage.camera.fit(())

    # What is shown

    def panel(self) -> Sequence[Node]:
        f, s, done, units = self.read, self.settings, self.read.iterated, self.stage.display.units
        outcome, course = [], []
        if done is not None:
            words = done.problem, done.run, done.solutions, units
            outcome = [Html(views.outcome_html, words, key="outcome")]
            course = [
                Html(views.chart_html, (done.problem, done.runs, units), key="chart"),
                Html(views.table_html, (done.problem, done.run, f.number, units), key="table"),
            ]
        moves = Buttons("Iterate", {name: self.event(self.on_move, name) for name in MOVES}, MOVE_HINT)
        take = Buttons("Arm", {"To this iterate": self.event(self.on_take)}, TAKE_HINT)
        return [
            *self.unless_asked("iterates", *outcome, moves),
            Control("method"),
            *self.unless_asked("method", Html(views.method_html, (s.method, f.problem), key="formula")),
            Control("damping", visible=s.method == "damped"),
            Control("gain", visible=s.method == "transpose"),
            Control("longest"),
            Control("limits"),
            Control("match"),
            Buttons("Aim", {"Target here": self.event(self.on_target)}, TARGET_HINT),
            Control("follow", value=s.start is None),
            *([] if self.hides("iterates") else [take]),
            Folder("Error and step", self.unless_asked("iterates", Control("compare"), *course)),
            Folder("Basins", self.unless_asked("basins", Control("picture"), *self._basins())),
        ]

    def _basins(self) -> list[Node]:
        f, units = self.read, self.stage.display.units
        if f.basins is None:
            return [Html(views.waiting_html, (self.settings.picture,), key="waiting")]
        nodes: list[Node] = [Html(views.basins_html, (f.basins, f.pictured.robot.name, units), key="picture")]
        if f.is_mine:
            # A layer of its own: the picture is not sent again while the arm moves.
            nodes.append(Html(views.mark_html, (f.basins, f.start), key="mark"))
        return [*nodes, Html(views.key_html, (f.basins, f.is_mine, units), key="legend")]

    def scene(self) -> Sequence[Lazy]:
        f = self.read
        iterated = None if self.hides("iterates") else f.iterated
        problem = f.problem if iterated is None else iterated.problem
        return [Lazy("iterates", scene, (problem, iterated, f.number, self._figure))]

    # Events

    def changed(self, path: str) -> None:
        if path == "follow":
            self.change(start=None if self.settings.follow else tuple(self.facts.start.tolist()))

    def on_target(self) -> None:
        """Aim at the present target, or at where the tool is."""
        self.change(target=tuple(self.stage.arm.now.aim.ravel().tolist()))

    def on_move(self, name: str) -> None:
        """Show another iterate, or play them."""
        f, at = self.facts, self.settings.at
        if f.iterated is None:  # still being computed
            self.change(plays=name == "Run", at=0 if name in ("First", "Run") else at)
            return
        last, plays = f.iterated.run.count, False
        if name == "Run":
            plays = not self.settings.plays
            at = 0 if plays and f.number == last else f.number
        elif name == "Next":
            at = min(f.number + 1, last)
            plays = self.settings.plays and at < last
        else:
            at = 0 if name == "First" else max(0, f.number - 1)
        self.change(plays=plays, at=at)

    def on_take(self) -> None:
        """Move the arm to the iterate on show."""
        f = self.facts
        if f.iterated is None:
            return
        q = basins.within(f.robot, f.iterated.run.q[f.number])
        if q is None:
            title = f"Iterate {f.number} is outside the limits"
            self.stage.status.show(Notice("limits", title, "The arm stays where it is."))
            return
        self.change(start=tuple(f.iterated.run.q[0].tolist()))
        self.stage.arm.move_to(q, Notice("hand", f"Iterate {f.number}", "The start stays where it was."))

    # Iterating

    def running(self) -> Sequence[Work | Sweep]:
        f, s = self.facts, self.settings
        asked = f.problem, f.options, s.compare, f.start
        works: list[Work | Sweep] = [Work("iterates", lambda *_: f.iterate(), asked, pace=INTERVAL, keep=True)]
        if s.picture:
            works.append(Work("basins", basins.search, (f.pictured, f.options)))
        if s.plays and f.iterated is not None:
            works.append(Sweep(self._play, PACE))
        return works

    def _play(self, seconds: float) -> None:
        self.on_move("Next")

    def worked(self, key: str) -> None:
        super().worked(key)
        s, found = self.settings, self.facts.iterated
        if found is None:
            return
        if s.at is not None:
            self.change(at=min(s.at, found.run.count))
        if not s.fits:  # the view does not follow the iterates
            self.change(fits=True)
            frames = kin.link_frames(found.problem.robot, found.run.q)
            self.stage.camera.fit((), frames[..., :3, 3].reshape(-1, 3))
