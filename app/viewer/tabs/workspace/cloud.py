"""The cloud of the selected robot and, for comparison, of another one: start, pause, progress, colours, legend.

The worker paints and sends one part of a cloud at a time, so a dragged arm never waits for more than one. The
parts themselves are computed by :mod:`app.shared.clouds`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.shared.clouds import Cloud
from app.viewer.feature import Stage
from app.viewer.scene.camera import Sphere
from app.viewer.scene.motion import FRAME
from app.viewer.tabs.workspace import colours, views
from app.viewer.tabs.workspace.cloud_nodes import CloudNodes, Look
from app.viewer.tabs.workspace.cut import Cut
from app.viewer.tabs.workspace.roots import new_root
from app.viewer.tabs.workspace.said import Said
from app.viewer.tabs.workspace.send_window import SendWindow
from app.viewer.tabs.workspace.settings import WorkspaceSettings
from kin import Robot
from kin.ik.options import FREE

REPORT = 0.2  # s between two reports of progress
REST = 0.25  # s between two ticks while waiting for something that wakes the worker by itself
MOVING_INTERVAL = 0.12  # s between two parts while the arm moves


class CloudView:
    """The clouds in one visitor's scene. Not thread-safe: the visitor's worker calls it.

    Args:
        wake: called from any thread when there may be something to do.

    Attributes:
        settings: the settings of the tab; the tab updates them.
        nodes: the clouds in the scene: none; or the robot's own, and possibly that of the other robot.
    """

    def __init__(
        self,
        stage: Stage,
        said: Said,
        settings: WorkspaceSettings,
        window: SendWindow,
        wake: Callable[[], None],
    ) -> None:
        self.settings = settings
        self.nodes: list[CloudNodes] = []
        self._stage = stage
        self._said = said
        self._window = window
        self._wake = wake
        self._running = self._stopped = self._grey = False
        self._cut: Cut | None = None
        self._slabs: NDArray[np.bool_] | None = None
        # When the clock for the speed was started last, and its time before that.
        self._started = self._elapsed = 0.0
        self._reported = self._sent = 0.0

    # Start, pause, clear

    def start(self) -> bool:
        """Sample a new cloud, or continue a paused one if only its look was changed; whether it is a new one."""
        cloud = self._requested
        if self.nodes and not self._running and self.unfinished and self._is_shown(cloud):
            self._run(True)
            return False
        self.clear()
        self._set_clock(True)
        self.nodes = [self._add(cloud, 0)]
        if self.other is not None:
            self.nodes.append(self._add(replace(cloud, robot=self.other, constraints=FREE), 1))
        self.report()
        return True

    def pause(self) -> None:
        """Stop for now."""
        if self._running and self.unfinished:
            self._run(False)

    def resume(self) -> None:
        """Continue after a pause."""
        if self.nodes and not self._running and self.unfinished:
            self._run(True)

    def stop(self) -> None:
        """End sampling; the points stay."""
        self.pause()
        self._stopped = bool(self.nodes)
        self.report()

    def clear(self) -> None:
        """Stop and remove everything."""
        for nodes in self.nodes:
            nodes.remove()
        self.nodes = []
        self._running = self._stopped = self._grey = False
        self._elapsed = 0.0
        self.show_legend()
        self.report()

    @property
    def other(self) -> Robot | None:
        """The robot to compare with."""
        return None if self.settings.compare is None else self._stage.services.store.get(self.settings.compare)

    @property
    def busy(self) -> bool:
        """Whether parts are being drawn or computed."""
        return any(nodes.busy for nodes in self.nodes)

    @property
    def unfinished(self) -> bool:
        """Whether parts are missing."""
        return self.busy or any(nodes.parts < nodes.cloud.parts for nodes in self.nodes)

    @property
    def extents(self) -> list[Sphere]:
        """Spheres around the clouds."""
        return [nodes.extent for nodes in self.nodes if nodes.extent is not None]

    @property
    def _requested(self) -> Cloud:
        """The cloud that settings and locks describe."""
        return Cloud(
            self._stage.arm.now.robot,
            self.settings.n,
            self.settings.seed,
            self.settings.strategy,
            constraints=self._stage.arm.now.options.constraints,
        )

    def _is_shown(self, cloud: Cloud) -> bool:
        """Whether this cloud is in the scene, regardless of its measures."""
        return replace(self.nodes[0].cloud, measures=cloud.measures) == cloud

    def _add(self, cloud: Cloud, which: int) -> CloudNodes:
        nodes = CloudNodes(
            self._stage.client.scene,
            self._stage.services.clouds,
            cloud,
            self._look(which),
            self.settings.size,
            new_root(),
            self._wake,
        )
        nodes.show(self._slabs)
        nodes.resume(self._running)
        return nodes

    def _run(self, running: bool) -> None:
        self._stopped = False
        self._set_clock(running)
        for nodes in self.nodes:
            nodes.resume(running)
        self.report()

    def _set_clock(self, running: bool) -> None:
        """Start or stop the clock for the speed."""
        now = time.perf_counter()
        if self._running:
            self._elapsed += now - self._started
        self._started, self._running = now, running

    # Progress

    def advance(self, now: float) -> None:
        """Send one part of the cloud that is behind."""
        if not self.nodes:
            return
        ready = [nodes for nodes in self.nodes if nodes.ready]
        if ready and self._may_send(now):
            self._sent = now
            try:
                self._window.sent(min(ready, key=lambda nodes: nodes.points).step())
            except Exception:
                self._set_clock(False)
                for nodes in self.nodes:
                    nodes.running = False
                self.report()
                raise
            if not self._said.legend:
                self.show_legend()
        if not self.busy:
            if self._running:
                self._set_clock(False)
            self.report()
        elif now - self._reported >= REPORT:
            self.report()

    def next_tick(self, now: float) -> float | None:
        """Seconds until `advance` should be called again."""
        if not self.nodes or not (self._running or self.busy):
            return None
        if not any(nodes.ready for nodes in self.nodes):
            return REST
        return FRAME if self._may_send(now) else min(REST, MOVING_INTERVAL)

    def _may_send(self, now: float) -> bool:
        return self._window.is_open and (not self._window.arm_moves or now - self._sent >= MOVING_INTERVAL)

    def report(self) -> None:
        """Update progress bar and line."""
        now = time.perf_counter()
        self._reported = now
        drawn = sum(nodes.points for nodes in self.nodes)
        total = sum(nodes.cloud.n for nodes in self.nodes)
        elapsed = self._elapsed + (now - self._started if self._running else 0.0)
        state: views.State = "ready"
        if self.nodes:
            more = drawn < total
            state = "running" if self._running and more else "done"
            if more and state == "done":
                state = "stopped" if self._stopped else "paused"
            if state == "running" and not drawn and elapsed > REST:
                state = "preparing"
            if self.busy and not self._running:
                state = "recolouring"
        speed = drawn / elapsed if elapsed > 0.0 else 0.0
        cloud = self.nodes[0].cloud if self.nodes else None
        constraints = self._stage.arm.now.options.constraints if cloud is None else cloud.constraints
        locked = constraints.locks(self._stage.arm.now.robot if cloud is None else cloud.robot)
        old = bool(self.nodes) and not self._is_shown(self._requested)
        line = views.progress(state, drawn, total or self.settings.n, speed, locked, old)
        percent = round(100.0 * drawn / total, 1) if total else 0.0
        self._said.line = line
        if old != self._grey:
            self._grey = old
            self.recolour()
        self._said.buttons, self._said.percent = views.buttons(state, old), percent

    # Look

    def recolour(self) -> None:
        """Draw in the colours of the settings."""
        for which, nodes in enumerate(self.nodes):
            nodes.relook(self._look(which))
        self.show(self._slabs)
        self.show_legend()

    def resize(self) -> None:
        """Draw points of the size in the settings."""
        for nodes in self.nodes:
            nodes.resize(self.settings.size)

    def set_cut(self, cut: Cut | None, slabs: NDArray[np.bool_] | None) -> None:
        """Cut in another direction, or not at all, and show only these slabs ``(count,)``."""
        self._cut, self._slabs = cut, slabs
        self.recolour()

    def show(self, slabs: NDArray[np.bool_] | None) -> None:
        """Show only these slabs ``(count,)`` of the cut."""
        self._slabs = slabs
        for nodes in self.nodes:
            nodes.show(slabs)

    def compare(self) -> None:
        """Draw the cloud of the robot to compare with, or none."""
        for nodes in self.nodes[1:]:
            nodes.remove()
        del self.nodes[1:]
        other = self.other
        if self.nodes and other is not None:
            own = self.nodes[0].cloud
            if self.nodes[0].parts == own.parts and not self._running:
                self._set_clock(True)
            self.nodes.append(self._add(replace(own, robot=other, measures=(), constraints=FREE), 1))

    def show_legend(self) -> None:
        """Update the legend. It is empty without points, because it needs sampled data, and for an old cloud."""
        if self._grey or not any(nodes.parts for nodes in self.nodes):
            self._said.legend = ""
            return
        robot, other = self._stage.arm.now.robot, self.other
        if other is not None:
            content = colours.names_legend([(colours.OWN, robot.name), (colours.OTHER, other.name)])
        elif self.settings.by == "one":
            content = colours.names_legend([(colours.OWN, robot.name)])
        else:
            scale = colours.scale_of(robot, self.settings.by)
            content = colours.legend(scale, self.settings.map, self._stage.display.units)
        self._said.legend = content

    def _look(self, which: int) -> Look:
        if self._grey:
            return Look("one", self.settings.map, colours.OLD, self._cut)
        by: colours.By = "one" if self.other is not None else self.settings.by
        return Look(by, self.settings.map, (colours.OWN, colours.OTHER)[which], self._cut)
