"""What is known of the tab: which clouds are to be drawn and how, what of them is drawn, and the section."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from app.exports.svg import Plot
from app.shared.clouds import Cloud
from app.viewer.declared.facts import Facts
from app.viewer.tabs.workspace import axes, colours
from app.viewer.tabs.workspace.cloud import REST, Drawn, Look, Sheet, Stream, Wanted
from app.viewer.tabs.workspace.cut import Cut
from app.viewer.tabs.workspace.settings import WorkspaceSettings
from app.viewer.tabs.workspace.views import State
from kin import Robot, get_robot
from kin.ik.options import FREE, Locks
from kin.transforms import Array


@dataclass(frozen=True, eq=False)
class WorkspaceFacts(Facts[WorkspaceSettings]):
    """See the module.

    Attributes:
        find: gets a robot by its id.
    """

    find: Callable[[str], Robot] = get_robot

    @cached_property
    def other(self) -> Robot | None:
        """The robot to compare with."""
        name = self.settings.compare
        return None if name is None else self.find(name)

    @cached_property
    def requested(self) -> Cloud:
        """The cloud that settings and locks describe."""
        s = self.settings
        return Cloud(self.robot, s.n, s.seed, s.strategy, constraints=self.arm.options.constraints)

    @cached_property
    def old(self) -> bool:
        """Whether the cloud is not the one that is requested now."""
        return self.settings.cloud is not None and self.settings.cloud != self.requested

    @cached_property
    def wanted(self) -> tuple[Wanted, ...]:
        """The clouds in the scene; an old one is grey."""
        s, own = self.settings, self.settings.cloud
        if own is None:
            return ()
        by: colours.By = "one" if self.old or self.other is not None else s.by
        clouds = [(own, colours.OWN)]
        if self.other is not None:
            clouds.append((replace(own, robot=self.other, constraints=FREE), colours.OTHER))
        return tuple(
            Wanted(cloud, Look(by, s.map, colours.OLD if self.old else colour, s.cut)) for cloud, colour in clouds
        )

    @cached_property
    def slabs(self) -> NDArray[np.bool_] | None:
        """The slabs ``(count,)`` on the visible side of the cut."""
        s = self.settings
        return None if s.cut is None else s.cut.shown(s.at, s.keep)

    def shown(self, cut: Cut | None) -> NDArray[np.bool_] | None:
        """The visible slabs ``(count,)`` of the cut, or of one before it; None: all."""
        if cut == self.settings.cut:
            return self.slabs
        return next((slabs for before, slabs in self.settings.seen if before == cut), None)

    @property
    def corners(self) -> Array | None:
        """The points ``(n, 3)`` at the ends of the axes with numbers; None: they are not shown."""
        return axes.corners_of(self.robot) if self.settings.axes else None

    # What is drawn

    @property
    def stream(self) -> Stream:
        """What is drawn."""
        found: Stream | None = self.work("cloud").value
        return found or Stream((), busy=False)

    @property
    def clouds(self) -> Sequence[Drawn]:
        """The clouds, as far as they are drawn."""
        return self.stream.clouds

    @property
    def sheets(self) -> Sequence[Sheet]:
        """The nodes of the clouds."""
        return [sheet for one in self.clouds for sheet in one.sheets]

    @property
    def visible(self) -> Sequence[NDArray[np.bool_] | None]:
        """The visible slabs of each sheet."""
        return [self.shown(sheet.cut) for sheet in self.sheets]

    @property
    def total(self) -> int:
        """The number of points of all clouds."""
        return sum(one.cloud.n for one in self.wanted)

    @property
    def unfinished(self) -> bool:
        """Whether points are missing."""
        return sum(one.points for one in self.clouds) < self.total

    @property
    def busy(self) -> bool:
        """Whether points or colours are being sent, or computed."""
        return self.stream.busy and not self.work("cloud").finished

    @property
    def state(self) -> State:
        """How far the clouds are."""
        s, stream = self.settings, self.stream
        if s.cloud is None:
            return "ready"
        if self.unfinished and s.flow == "running":
            return "preparing" if not stream.points and stream.elapsed > REST else "running"
        if self.busy:
            return "recolouring"
        return s.flow if self.unfinished and s.flow != "running" else "done"

    @property
    def percent(self) -> float:
        """The share of points that are drawn, in per cent."""
        return round(100.0 * self.stream.points / self.total, 1) if self.total else 0.0

    @property
    def speed(self) -> float:
        """Points per second, as of the last report."""
        return self.stream.points / self.stream.elapsed if self.stream.elapsed > 0.0 else 0.0

    @property
    def locked(self) -> Locks | None:
        """The locked joints of the cloud, or of the next one."""
        cloud = self.settings.cloud or self.requested
        return cloud.constraints.locks(cloud.robot)

    # The section

    @property
    def frame(self) -> Plot | None:
        """The axes of its plot; None: there is none yet, or nothing to plot."""
        found: Plot | None = self.work("frame").value
        return found

    @property
    def image(self) -> str:
        """The cloud in the plot."""
        density, image = self.work("image").value or (None, "")
        return image if density is self.work("density").value else ""
