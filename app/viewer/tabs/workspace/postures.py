"""The folder "Postures": a map of how many postures there are, and its regions in words.

The map is computed coarse first, then finer, by :mod:`app.shared.summaries`, once for all visitors who ask for the
same one. A press on a region makes its middle the target, where the page lists and draws the postures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from markupsafe import Markup

from app.exports.postures import drawing
from app.shared.summaries import PostureRequest
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, choice, flag, memory
from app.viewer.declared.panel import Buttons, Control, Folder, Html, Node, Progress
from app.viewer.declared.work import Work
from app.viewer.views.templates import render
from kin import InputError
from kin.postures import PostureMap
from kin.units import Units, typeset

Plane = Literal["vertical", "horizontal", "joints"]
PLANES: dict[str, Plane] = {
    "Vertical, through the tool": "vertical",
    "Horizontal, through the tool": "horizontal",
    "Two joints": "joints",
}
ABOUT = (
    "Posture map: the number of postures at each place of a plane, with the tool's present orientation; or at the "
    "values of joints 2 and 3 (of an arm with two joints, 1 and 2). Orange lines are singular: two postures merge."
)
PLANE_HINT = "Where the map is. A section keeps the tool's orientation; of two joints, the others stand still"
LIMITS_HINT = "Count only postures inside the joint limits"
MAP_HINT = "Start: compute the map, coarse first. Clear: stop, and remove it."
REGION_HINT = "Makes the middle of this region the target, where the postures are listed"
POLL = 0.2  # s between two looks at a map that is computed
SHOWN = 8  # regions that have a button
SIDE = 250.0  # of the map, in drawing units: with its texts, about as wide as the panel
PERCENT = 100.0


@dataclass(frozen=True)
class PostureSettings(Settings):
    """The settings of a posture map.

    Attributes:
        plane: which plane.
        limits: whether joint limits count.
        request: the map that was started last.
    """

    plane: Plane = choice("Plane", PLANES, "vertical", hint=PLANE_HINT)
    limits: bool = flag("Inside limits", True, hint=LIMITS_HINT)
    request: PostureRequest | None = memory()


class Postures(DeclaredFeature[PostureSettings, Facts[PostureSettings]]):
    """The folder and its map."""

    key = "postures"
    title = "Workspace"
    settings_of, facts_of = PostureSettings, Facts

    def panel(self) -> Sequence[Node]:
        work, units = self.read.work("map"), self.stage.units
        found: PostureMap | None = work.value
        buttons = {"Start": self.event(self.on_start), "Clear": self.event(self.clear)}
        plot, regions = Html(str, key="plot"), list[Node]()
        if isinstance(work.error, InputError):
            plot = Html(_note, (str(work.error),), key="plot")
        elif found is not None:
            plot = Html(_plot, (found, units), key="plot")
            if found.plane.joints is None:
                events = {each.name: self.event(self.on_region, each.name) for each in found.regions[:SHOWN]}
                regions = [Buttons("Go to region", events, REGION_HINT, of=tuple(events), key="regions")] * bool(
                    events
                )
        children = [
            Html(_note, (ABOUT,)),
            Control("plane"),
            Control("limits"),
            Buttons("Posture map", buttons, MAP_HINT),
            Progress(round(PERCENT * work.done / work.total, 1) if work.total else 0.0),
            plot,
            *regions,
        ]
        return [Folder("Postures", children, open=False)]

    def running(self) -> Sequence[Work]:
        if self.settings.request is None:
            return ()
        return [Work("map", self.stage.summaries.postures, (self.settings.request,), poll=POLL)]

    def worked(self, key: str) -> None:
        if not isinstance(self.facts.work(key).error, InputError):
            super().worked(key)

    def on_start(self) -> None:
        """Compute a map for the arm as it is."""
        arm, s = self.stage.now, self.settings
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
        self.change(request=request)

    def clear(self) -> None:
        """Stop, and remove the map."""
        self.change(request=None)

    def started(self) -> None:
        self.clear()

    def on_region(self, name: str) -> None:
        """Make the middle of a region the target."""
        found: PostureMap | None = self.facts.work("map").value
        region = next((each for each in found.regions if each.name == name), None) if found is not None else None
        if found is not None and region is not None:
            self.stage.set_target(found.plane.poses(found.robot, region.place[None])[0])


def _note(text: str) -> str:
    return render("panel/note", text=text)


def _plot(found: PostureMap, units: Units) -> str:
    """The map as a picture, and its regions in words below it."""
    return Markup(drawing(found, SIDE, fluid=True)) + Markup(_note(typeset(found.explain(units))))
