"""The folder "Postures": its controls, the map, and the postures of a place in it.

The map is computed coarse first, then finer, by :mod:`app.shared.summaries`, once for all visitors who ask for the
same one. A click in it, or a button of one of its regions, makes that place the target, and lists its postures.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from functools import partial

import numpy as np

from app.shared.computations import Subscription
from app.shared.summaries import PostureRequest
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Button, Buttons, Control, Folder, Html, Node, Progress
from app.viewer.declared.scene import Lazy
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Sweep, Work
from app.viewer.drive import FRAME, Drive, locked
from app.viewer.panel.posture import short
from app.viewer.panel.status import Notice
from app.viewer.postures import survey
from app.viewer.postures.ghosts import ghosts
from app.viewer.scene.camera import Sphere
from app.viewer.tabs.workspace.postures import views
from app.viewer.tabs.workspace.postures.settings import PostureSettings
from kin import InputError, JointConstraints, Robot
from kin.angles import apart
from kin.postures import Cuspidality, PostureMap
from kin.transforms import Array
from kin.units import typeset

ABOUT = (
    "Posture map: the number of postures at each place of a plane, with the tool's present orientation; or at the "
    "values of joints 2 and 3 (of an arm with two joints, 1 and 2). Two postures merge at orange lines, which are "
    "singular. A click shows the postures of a place."
)
MAP_HINT = "Start: compute the map, coarse first. Clear: stop, and remove it."
REGION_HINT = "Moves the arm to the middle of this region, and shows the postures there, as a click does"
POSTURE_HINT = "Moves the arm to this posture. A click on its pale arm does the same."
JUDGE_HINT = "Whether the arm can change its posture without a singularity, by a proof or a loop of the tool"
LOOP_HINT = "Drives the arm round the loop: the tool comes back to its start, the arm in another posture"
START = Notice("hand", "To the start of the loop", "From there the tool goes round and comes back.")
POLL = 0.2  # s between two looks at a map that is computed
SHOWN = 8  # regions that have a button
PERCENT = 100.0
SAME = 1e-4  # rad, m


class MapFacts(Facts[PostureSettings]):
    """What the folder knows of its map, and of the arm."""

    @property
    def map(self) -> PostureMap | None:
        """The map, or a coarser one."""
        found: PostureMap | None = self.work("map").value
        return found

    @property
    def verdict(self) -> Cuspidality | None:
        """Whether the arm is cuspidal, if that is asked and known."""
        found: Cuspidality | None = self.work("cuspidal").value
        return found

    @property
    def drivable(self) -> Cuspidality | None:
        """The same if there is a loop that the page can drive."""
        found = self.verdict
        return found if found is not None and found.loop is not None and found.in_limits else None

    @property
    def present(self) -> str:
        """The posture in the list that the arm has, or is moving to; "" if it has none of these."""
        turns, goal = self.robot.revolute, self.arm.goal
        near = (p.name for p in self.settings.postures if p.q is not None and apart(p.q, goal, turns) < SAME)
        return next(near, "")

    @property
    def shown(self) -> frozenset[str]:
        """The postures with a ghost; the arm itself is where its own would be."""
        return frozenset(p.name for p in self.settings.postures) - {self.present}


class Postures(DeclaredFeature[PostureSettings, MapFacts]):
    """The folder and its map."""

    key = "postures"
    title = "Workspace"
    settings_of, facts_of = PostureSettings, MapFacts
    pace = 0.1

    def panel(self) -> Sequence[Node]:
        work = self.read.work("map")
        buttons = {"Start": self.event(self.on_start), "Clear": self.event(self.clear)}
        children = [
            Html(views.note, (ABOUT,)),
            Control("plane"),
            Control("limits"),
            Control("drawn"),
            Buttons("Posture map", buttons, MAP_HINT),
            Progress(round(PERCENT * work.done / work.total, 1) if work.total else 0.0),
            *self._map(),
            *self._verdict(),
        ]
        return [Folder("Postures", children, open=False)]

    def _map(self) -> Sequence[Node]:
        """The map, its regions in words and as buttons, and the postures of the place that was chosen."""
        f, s, found = self.read, self.settings, self.read.map
        if isinstance(error := f.work("map").error, InputError):
            return [Html(views.note, (str(error),), key="map")]
        if found is None:
            return []
        nodes: list[Node] = [Html(views.map_html, (found, f.units), key="map")]
        if s.place is not None:
            nodes.append(Html(views.mark_html, (found, s.place), key="mark"))
        nodes.append(Html(views.note, (typeset(found.explain(f.units)),), key="words"))
        regions = {each.name: self.event(self.on_region, each.name) for each in found.regions[:SHOWN]}
        if regions:
            nodes.append(Buttons("Go to region", regions, REGION_HINT, of=tuple(regions), key="regions"))
        if s.place is None:
            return nodes
        go = {str(i + 1): self.event(self.on_posture, i) for i in range(len(s.postures))}
        if not go:
            return [*nodes, Html(views.note, ("No posture at the place chosen.",), key="list")]
        rows = f.robot, s.postures, f.present, f.shown, f.units
        buttons = Buttons("Go to posture", go, POSTURE_HINT, of=tuple(go), key="go")
        return [*nodes, *self.unless_asked("postures", buttons, Html(survey.html, rows, key="list"))]

    def _verdict(self) -> Sequence[Node]:
        """Whether the arm is cuspidal, and the button that shows it."""
        f, work = self.read, self.read.work("cuspidal")
        nodes: list[Node] = [Button("Cuspidal or not", self.event(self.on_judge), JUDGE_HINT, key="judge")]
        if f.settings.judged is None:
            return nodes
        words = "Looking for a proof or a loop …" if work.error is None else str(work.error)
        if f.verdict is not None:
            words = views.verdict_words(f.verdict)
        nodes.append(Html(views.note, (words,), key="verdict"))
        if f.drivable is not None and f.settings.loop is None:
            nodes.append(Button("Play the loop", self.event(self.on_loop), LOOP_HINT, key="loop"))
        elif f.settings.loop is not None:
            nodes.append(Button("Stop the loop", self.event(self.on_stop), key="stop"))
        return nodes

    def scene(self) -> Sequence[Lazy]:
        f, nodes = self.facts, list[Lazy]()
        drawn = f.map if f.settings.drawn else None
        if drawn is not None and drawn.plane.joints is None:
            nodes.append(Lazy("section", views.section_nodes, (drawn, self.stage.display.dark)))
        if drawn is not None and f.settings.postures and not self.hides("postures"):
            nodes.append(Lazy("ghosts", self._ghosts, (f.robot, f.settings.postures, f.shown)))
        if f.drivable is not None and f.settings.drawn:
            nodes.append(Lazy("loop", views.loop_nodes, (f.drivable,)))
        return nodes

    def extents(self) -> Sequence[Sphere]:
        found = self.facts.map
        if found is None or found.plane.origin is None or not self.settings.drawn:
            return ()
        return [(found.plane.origin, found.plane.window[0][1])]

    def _ghosts(self, *args: object) -> list[SceneNode]:
        f = self.facts
        return ghosts(f.robot, f.settings.postures, f.shown, lambda i: self.event(self.on_posture, i))

    def running(self) -> Sequence[Work | Sweep]:
        s, works = self.settings, list[Work | Sweep]()
        if s.request is not None:
            works.append(Work("map", self.stage.services.summaries.postures, (s.request,), poll=POLL))
        if s.judged is not None:
            works.append(Work("cuspidal", self._judge, (self.facts.robot, s.judged)))
        if s.loop is not None:
            works.append(Sweep(self._play, FRAME))
        return works

    def worked(self, key: str) -> None:
        if not isinstance(self.facts.work(key).error, InputError):
            super().worked(key)

    def on_start(self) -> None:
        """Compute a map for the arm as it is."""
        arm, s = self.stage.arm.now, self.settings
        T = tuple(map(tuple, arm.T_tool.tolist()))
        joints = None if s.plane != "joints" else (1, 2) if arm.robot.n > 2 else (0, 1)
        request = PostureRequest(
            robot=arm.robot,
            constraints=arm.options.constraints,
            respect_limits=s.limits,
            target=None if joints is not None else T,
            normal=(0.0, 0.0, 1.0) if s.plane == "horizontal" else None,
            joints=joints,
            q=None if joints is None else tuple(arm.q.tolist()),
        )
        self.change(request=request, place=None, postures=())

    def clear(self) -> None:
        """Stop, and remove the map."""
        self.change(request=None, place=None, postures=())

    def started(self) -> None:
        self.clear()
        self.change(judged=None, loop=None)

    def heard(self, key: Hashable, value: object) -> None:
        match value:  # of a click in the map
            case [int() | float() as x, int() | float() as y] if 0.0 <= x <= 1.0 and 0.0 <= y <= 1.0:
                if (found := self.facts.map) is not None:
                    self._go_to(found, views.at_shares(found, x, y))
            case _:
                raise InputError("map", value, "shares of the width and the height of the map")

    def on_region(self, name: str) -> None:
        """Go to the middle of a region."""
        found = self.facts.map
        places = [] if found is None else [each.place for each in found.regions if each.name == name]
        if found is not None and places:
            x, y = places[0].tolist()
            self._go_to(found, (x, y))

    def _go_to(self, found: PostureMap, place: tuple[float, float]) -> None:
        """Move the arm to a place of the map, and list the postures there."""
        assert self.settings.request is not None
        there = views.postures_at(found, self.settings.request, place, self.stage.arm.now.goal)
        self.change(place=place, postures=there)
        if found.plane.joints is None:
            self.stage.arm.set_target(found.plane.poses(found.robot, np.array([place]))[0])
        else:
            q = found.plane.configurations(np.array([place]))[0]
            self._move(q, Notice("hand", "Moved to a place in the map", "Two joints have its values."))

    def _move(self, q: Array, notice: Notice) -> None:
        """Move the arm to a configuration ``(n,)``, or say which joint is locked."""
        if (held := locked(self.stage.arm.now, q)) is not None:
            self.stage.status.show(held)
        else:
            self.stage.arm.move_to(q, notice)

    def on_posture(self, index: int) -> None:
        """Move the arm to a posture of the list, or say why it cannot go there."""
        if index >= len(self.settings.postures):
            return  # a late click: those of another place
        posture = self.settings.postures[index]
        if posture.available and posture.q is not None:
            words = f"Posture {index + 1}: {short(posture.name)}"
            self._move(posture.q, Notice("hand", words, "The tool is at the place in the map."))
        else:
            words = f"Not available: {short(posture.name)}"
            self.stage.status.show(Notice("limits", words, "It is outside the limits."))

    def _judge(self, robot: Robot, constraints: JointConstraints) -> Subscription[Cuspidality]:
        compute = partial(views.judge, robot, constraints)
        return self.stage.services.summaries.once(("cuspidal", robot, constraints), compute)

    def on_judge(self) -> None:
        """Find out whether the arm is cuspidal, with its present limits and locks."""
        self.change(judged=self.stage.arm.now.options.constraints, loop=None)

    def on_loop(self) -> None:
        """Move to the start of the loop, and go round it."""
        found = self.facts.drivable
        if found is None or found.loop is None:
            return
        if (held := locked(self.stage.arm.now, found.loop)) is not None:
            self.stage.status.show(held)
        else:
            self.change(loop=Drive.straight(found.loop))
            self.stage.arm.move_to(found.loop[0], START)
            self.invalidate()
            self._play(FRAME)  # if it is there already: the press is a step that can be undone

    def on_stop(self) -> None:
        """Leave the arm where it is on the loop."""
        self.change(loop=None)

    def _play(self, seconds: float) -> None:
        """A frame on the loop; another motion of the arm ends it."""
        arm, drive, found = self.stage.arm.now, self.settings.loop, self.facts.drivable
        if drive is None or found is None or not np.array_equal(drive.here, arm.goal):
            self.change(loop=None)
        elif (held := locked(arm, drive.q[drive.passed :])) is not None:
            self.change(loop=None)
            self.stage.status.show(held)
        elif np.array_equal(arm.q, arm.goal):  # it has come to the start
            drive = drive.after(seconds)
            self.change(loop=None if drive.arrived else drive)
            notice = views.came_back(found, self.stage.display.units) if drive.arrived else views.under_way(found)
            self.stage.arm.move_to(drive.here, notice, at_once=True)
