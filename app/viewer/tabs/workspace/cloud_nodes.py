"""One cloud in the scene, part by part.

A computed part becomes a node of the scene; nodes never grow, because that would send their points again. One part
is sent at a time, so that frames of the moving arm come in between. A cut cloud has a node for each slab instead,
below one frame per slab, which hides and shows it. There, several parts share a node; otherwise four million
points would need two thousand nodes.

New colours are assigned to the existing nodes. A new cut creates new nodes next to the old ones, which are removed
when the new ones are complete. No points are kept for either: parts are requested again, from the cache.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace

import numpy as np
import viser
from numpy.typing import NDArray

from app.shared.clouds import Cloud, Clouds
from app.viewer.scene.camera import Sphere, round_points
from app.viewer.tabs.workspace.colours import By, Bytes, Colour, measures, paint, quantity, scale_of
from app.viewer.tabs.workspace.cut import Cut
from kin.workspace import WorkspaceChunk

AHEAD = 2  # parts requested in advance: one is computed while another is drawn
TOGETHER = 1 << 19  # points of a cut cloud whose parts share nodes
POINTS, NODES = 1 << 16, 12  # per step
FINE = 2.0  # m: farther out, half precision is off by a millimetre or more


@dataclass(frozen=True)
class Look:
    """How a cloud is drawn: coloured quantity, colour map or single colour, and cut."""

    by: By
    map: str
    colour: Colour
    cut: Cut | None = None


@dataclass
class _Block:
    """Parts first, …, stop − 1 as nodes, one for each slab with points."""

    first: int
    stop: int
    nodes: dict[int, viser.PointCloudHandle] = field(default_factory=dict)


@dataclass
class _Batch:
    """The coloured points of a block that is being sent, sorted by slab."""

    block: _Block
    points: NDArray[np.float32]
    colours: Bytes | Colour
    order: NDArray[np.intp] | None
    edges: list[int]
    next: int = 0


class CloudNodes:
    """One cloud in one visitor's scene. Not thread-safe: the visitor's worker calls it.

    Args:
        root: prefix of all node names, never used before in this scene.
        wake: called from any thread when there may be something to do.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        clouds: Clouds,
        cloud: Cloud,
        look: Look,
        size: float,
        root: str,
        wake: Callable[[], None],
    ) -> None:
        self.cloud = replace(cloud, measures=measures(look.by))
        self.look = look
        self.running = True
        self.parts = 0  # in the scene, some possibly in their old look
        self.extent: Sphere | None = None  # of the first part
        self._scene = scene
        self._clouds = clouds
        self._size = size
        self._root = root
        self._wake = wake
        self._roots = 0
        self._top: viser.FrameHandle | None = None
        self._slabs: list[viser.FrameHandle] = []
        self._old: viser.FrameHandle | None = None
        self._blocks: dict[int, _Block] = {}
        self._shown: NDArray[np.bool_] | None = None
        self._begin()

    @property
    def points(self) -> int:
        """The number of points in the scene."""
        return self.cloud.edges[self.parts]

    @property
    def busy(self) -> bool:
        """Whether there is something to send, now or soon."""
        return self._batch is not None or (self._next < self._limit and not self._failed)

    @property
    def ready(self) -> bool:
        """Whether `step` would do something."""
        return self._batch is not None or self._came

    def step(self) -> int:
        """Send some points, and request the next part; returns the number of points sent.

        Raises the exception of a failed part; `resume` or `relook` try again.
        """
        if self._batch is None and self._came:
            try:
                chunk = self._asked[0].result()
            except Exception:
                self._asked.clear()
                self._failed = True
                raise
            self._asked.popleft()
            self._take(chunk)
        sent = self._send() if self._batch is not None else 0
        self._ask()  # more, now that one has been taken
        return sent

    def relook(self, look: Look) -> None:
        """Draw the cloud with another look, starting now."""
        if look == self.look:
            return
        cut = look.cut != self.look.cut
        self.look = look
        self.cloud = replace(self.cloud, measures=measures(look.by))
        self._begin(anew=cut)

    def resume(self, running: bool) -> None:
        """Continue or pause. A paused cloud stays in the scene, and a change of colours is still completed."""
        self.running = running
        self._failed = False
        self._ask()

    def resize(self, size: float) -> None:
        """Draw points of another size (m)."""
        self._size = size
        for block in self._blocks.values():
            for node in block.nodes.values():
                node.point_size = 0.5 * size

    def show(self, slabs: NDArray[np.bool_] | None) -> None:
        """Show these slabs only ``(count,)``."""
        self._shown = slabs
        if slabs is not None and len(slabs) == len(self._slabs):
            for node, visible in zip(self._slabs, slabs.tolist(), strict=True):
                if node.visible != visible:
                    node.visible = visible

    def visible_points(self) -> Callable[[NDArray[np.float32]], NDArray[np.bool_] | None]:
        """A function from points ``(k, 3)`` to which of them ``(k,)`` the present cut shows, None for all."""
        cut, shown = self.look.cut, self._shown
        return lambda points: None if cut is None or shown is None else shown[cut.slabs(points)]

    def remove(self) -> None:
        """Remove the cloud from the scene."""
        self._asked.clear()
        for frame in (self._top, self._old):
            if frame is not None:
                frame.remove()
        self._top = self._old = None

    @property
    def _came(self) -> bool:
        """Whether the next part is computed, and needed."""
        return self._next < self._limit and bool(self._asked) and self._asked[0].done()

    @property
    def _limit(self) -> int:
        """The number of parts needed."""
        return self.cloud.parts if self.running else self.parts

    def _begin(self, anew: bool = True) -> None:
        """Start again from the first part, in new nodes or in the existing ones."""
        self._next = 0
        self._failed = False
        self._asked: deque[Future[WorkspaceChunk]] = deque()
        self._painted: list[tuple[NDArray[np.float32], Bytes | Colour, Bytes | None]] = []
        self._batch: _Batch | None = None
        if anew:
            self._frames()
        self._ask()

    def _frames(self) -> None:
        """Create new parent frames; the old ones stay in the scene until the new nodes are complete."""
        if self._old is not None and self._top is not None:
            self._top.remove()  # an unfinished cut: the nodes it was to replace still exist
        elif self._blocks:
            self._old = self._top
        elif self._top is not None:
            self._top.remove()
        self._blocks = {}
        self._roots += 1
        root = f"{self._root}-{self._roots}"
        self._top = self._scene.add_frame(root, show_axes=False)
        count = self.look.cut.count if self.look.cut else 1
        fits = self._shown is not None and len(self._shown) == count
        shown = self._shown if self._shown is not None and fits else np.ones(count, bool)
        self._slabs = [
            self._scene.add_frame(f"{root}/{k}", show_axes=False, visible=bool(shown[k])) for k in range(count)
        ]

    def _ask(self) -> None:
        """Request parts in advance."""
        while len(self._asked) < AHEAD and self._next + len(self._asked) < self._limit:
            future = self._clouds.part(self.cloud, self._next + len(self._asked))
            self._asked.append(future)
            if not future.done():
                future.add_done_callback(lambda _: self._wake())

    def _take(self, chunk: WorkspaceChunk) -> None:
        """Colour the next part; with its last part, a block is ready to be sent."""
        look, robot = self.look, self.cloud.robot
        if self.extent is None:
            self.extent = round_points(chunk.points)
        colours: Bytes | Colour = look.colour
        if look.by != "one":
            colours = paint(quantity(robot, look.by, chunk), scale_of(robot, look.by), look.map)
        self._painted.append((chunk.points, colours, look.cut.slabs(chunk.points) if look.cut else None))
        self._next += 1
        first = self._next - len(self._painted)
        block = self._blocks.get(first) or _Block(first, self._stop(first))
        if self._next >= min(block.stop, self._limit):
            block.stop = self._next
            self._blocks[first] = block
            self._batch = self._sorted(block)
            self._painted = []

    def _stop(self, first: int) -> int:
        """The end of the block that starts here: those of cut clouds get longer, so that the first appear soon."""
        if self.look.cut is None:
            return first + 1
        edges = self.cloud.edges
        return min(bisect_left(edges, edges[first] + min(max(edges[first], 1), TOGETHER)), self.cloud.parts)

    def _sorted(self, block: _Block) -> _Batch:
        points = _joined([p for p, _, _ in self._painted])
        colours = self.look.colour
        if self.look.by != "one":
            colours = _joined([c for _, c, _ in self._painted])  # type: ignore[misc, assignment]
        if self.look.cut is None:
            return _Batch(block, points, colours, None, [0, len(points)])
        slabs = _joined([s for _, _, s in self._painted if s is not None])
        edges = np.concatenate([[0], np.cumsum(np.bincount(slabs, minlength=self.look.cut.count))])
        return _Batch(block, points, colours, np.argsort(slabs, kind="stable"), edges.tolist())

    def _send(self) -> int:
        """Send some nodes of the batch, or their new colours."""
        batch = self._batch
        assert batch is not None
        sent = nodes = 0
        while batch.next + 1 < len(batch.edges) and (not sent or (sent < POINTS and nodes < NODES)):
            start, stop = batch.edges[batch.next], batch.edges[batch.next + 1]
            if stop > start:
                self._node(batch, slice(start, stop) if batch.order is None else batch.order[start:stop])
                sent, nodes = sent + stop - start, nodes + 1
            batch.next += 1
        if batch.next + 1 == len(batch.edges):
            self._batch = None
            self.parts = max(self.parts, batch.block.stop)
            if self._old is not None and batch.block.stop >= self.parts:
                self._old.remove()
                self._old = None
        return sent

    def _node(self, batch: _Batch, which: slice | NDArray[np.intp]) -> None:
        colours = batch.colours[which] if isinstance(batch.colours, np.ndarray) else batch.colours
        slab = batch.next
        node = batch.block.nodes.get(slab)
        if node is not None:
            node.colors = np.array(colours, dtype=np.uint8)
            return
        points = batch.points[which]
        batch.block.nodes[slab] = self._scene.add_point_cloud(
            f"{self._slabs[slab].name}/{batch.block.first}",
            points,
            colours,
            point_size=0.5 * self._size,  # viser takes a radius
            point_shape="circle",
            point_shading="flat",
            precision="float16" if np.abs(points).max() < FINE else "float32",
        )


def _joined(arrays: list[NDArray]) -> NDArray:  # type: ignore[type-arg]
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
