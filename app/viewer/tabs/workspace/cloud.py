"""The clouds in a visitor's scene, as a stream of values: what of them is drawn, and the nodes that draw it.

A computed part of a cloud becomes a node; nodes never grow, because that would send their points again. One part
is sent at a time, so that frames of a moving arm come in between. A cut cloud has a node for each slab instead,
below one frame per slab, which hides and shows it. There, several parts share a node; otherwise four million
points would need two thousand nodes.

New colours go to the nodes that are there. A new cut needs new ones beside the old ones, which are removed when
the new ones are complete. Parts are requested again for either, from the cache of :mod:`app.shared.clouds`.
"""

from __future__ import annotations

import time
from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.shared.clouds import Cloud, Clouds
from app.viewer.declared.scene import Node
from app.viewer.declared.work import Wait
from app.viewer.scene.camera import Sphere, round_points
from app.viewer.tabs.workspace.colours import By, Bytes, Colour, measures, paint, quantity, scale_of
from app.viewer.tabs.workspace.cut import Cut
from app.viewer.tabs.workspace.send_window import SendWindow
from kin.workspace import WorkspaceChunk

AHEAD = 2  # parts requested in advance: one is computed while another is drawn
TOGETHER = 1 << 19  # points of a cut cloud whose parts share nodes
POINTS, NODES = 1 << 16, 12  # per step
FINE = 2.0  # m: farther out, half precision is off by a millimetre or more
REPORT = 0.2  # s between two reports of progress
REST = 0.25  # s to wait for something that wakes the worker by itself
MOVING_INTERVAL = 0.12  # s between two steps while the arm moves

_NUMBERS = count(1)
Props = Mapping[str, Any]
Shown = Callable[[Cut | None], NDArray[np.bool_] | None]


@dataclass(frozen=True)
class Look:
    """How a cloud is drawn: coloured quantity, colour map or single colour, and cut."""

    by: By
    map: str
    colour: Colour
    cut: Cut | None = None


class Wanted(NamedTuple):
    """A cloud and how it is to be drawn."""

    cloud: Cloud
    look: Look


@dataclass(frozen=True, eq=False)
class Block:
    """Parts first, …, stop − 1 as nodes, one for each slab with points: the properties of those that are sent."""

    first: int
    stop: int
    slabs: Mapping[int, Props] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Sheet:
    """The nodes of a cloud with one cut, below a node of this key, which is never used again."""

    cut: Cut | None
    blocks: Mapping[int, Block] = field(default_factory=dict)  # by their first parts
    key: str = field(default_factory=lambda: f"cloud-{next(_NUMBERS)}")

    @property
    def stop(self) -> int:
        """The number of parts that have nodes."""
        return max((block.stop for block in self.blocks.values()), default=0)

    def block(self, cloud: Cloud, first: int, limit: int) -> Block:
        """The block that begins with this part; those of cut clouds get longer, so that the first appear soon."""
        if first in self.blocks:
            return self.blocks[first]
        edges, stop = cloud.edges, first + 1
        if self.cut is not None:
            stop = bisect_left(edges, edges[first] + min(max(edges[first], 1), TOGETHER))
        return Block(first, min(stop, limit))

    def having(self, block: Block) -> Sheet:
        """The sheet with this block, in place of the one with the same parts."""
        return replace(self, blocks={**self.blocks, block.first: block})

    def node(self, slabs: NDArray[np.bool_] | None, size: float) -> Node:
        """The sheet with points of this diameter (m), of which these slabs ``(count,)`` are visible; None: all."""
        total = 1 if self.cut is None else self.cut.count
        visible = [True] * total if slabs is None else slabs.tolist()
        frames = [
            Node("frame", str(k), {"show_axes": False, "visible": visible[k]}, children=self._points(k, size))
            for k in range(total)
        ]
        return Node("frame", self.key, {"show_axes": False}, children=frames, keep=False, once=True)

    def _points(self, slab: int, size: float) -> list[Node]:
        blocks = [block for block in self.blocks.values() if slab in block.slabs]
        of = {str(block.first): {**block.slabs[slab], "point_size": 0.5 * size} for block in blocks}  # its radius
        return [Node("point_cloud", key, props) for key, props in of.items()]


@dataclass(frozen=True, eq=False)
class Drawn:
    """What is drawn of a cloud.

    Attributes:
        look: the present one, which the first `done` parts have.
        sheet: the nodes with the cut of this look.
        old: those before the cut was changed, until the new ones are complete.
        parts: how many are in the scene.
        extent: a sphere around the first part.
        sent: the points that came with the last step.
    """

    cloud: Cloud
    look: Look
    sheet: Sheet
    old: Sheet | None = None
    parts: int = 0
    done: int = 0
    extent: Sphere | None = None
    sent: int = 0

    @property
    def points(self) -> int:
        """The number of points in the scene."""
        return self.cloud.edges[self.parts]

    @property
    def measured(self) -> Cloud:
        """The cloud with what its colours need: parts of it are in the cache."""
        return replace(self.cloud, measures=measures(self.look.by))

    @property
    def sheets(self) -> Sequence[Sheet]:
        """All that is in the scene."""
        return [self.sheet] if self.old is None else [self.old, self.sheet]

    def limit(self, running: bool) -> int:
        """The number of parts to draw: while it is paused, those that are in the scene, for their look."""
        return self.cloud.parts if running else max(self.parts, self.sheet.stop)

    def having(self, block: Block, whole: bool, sent: int) -> Drawn:
        """The cloud with a block that is as it is to be, or with a part of it."""
        one = replace(self, sheet=self.sheet.having(block), sent=sent)
        if not whole:
            return one
        parts = max(self.parts, block.stop)
        return replace(one, done=block.stop, parts=parts, old=None if block.stop >= parts else self.old)


@dataclass(frozen=True, eq=False)
class Stream:
    """What is drawn of the clouds.

    Attributes:
        clouds: that of the robot, and that of another one.
        busy: whether something of it is to be sent.
        seconds: how long points have been coming.
        points, elapsed: how many there were at the last report of progress, and `seconds` then.
    """

    clouds: tuple[Drawn, ...]
    busy: bool = True
    seconds: float = 0.0
    points: int = 0
    elapsed: float = 0.0


def stream(
    clouds: Clouds,
    window: SendWindow,
    wake: Callable[[], None],
    wanted: Sequence[Wanted],
    running: bool,
    before: Stream | None,
) -> Iterator[Stream | Wait]:
    """Draw clouds, that which is behind first; a step is one node or a few.

    Args:
        window: limits what is on its way.
        wake: called from any thread when a part has been computed.
        wanted: the clouds; what is drawn of them already stays.
        running: whether more points are to come; otherwise those that are there get their look.
        before: what is drawn.
    """
    there = () if before is None else before.clouds
    drawn = [begun(one, there[k] if k < len(there) else None) for k, one in enumerate(wanted)]
    same = before is not None and there[0].cloud == wanted[0].cloud
    now = Stream(tuple(drawn), seconds=before.seconds if before is not None and same else 0.0)
    steps = [draw(clouds, one, one.limit(running), wake) for one in drawn]
    clock, sent, reported, moved = time.perf_counter(), 0.0, 0.0, False
    while True:
        passed, clock = time.perf_counter() - clock, time.perf_counter()
        more = running and any(one.parts < one.cloud.parts for one in now.clouds)
        busy = any(one.done < one.limit(running) for one in drawn)
        now = replace(now, clouds=tuple(drawn), busy=busy, seconds=now.seconds + passed * more)
        if due := not busy or clock - reported >= REPORT:
            reported, points = clock, sum(one.points for one in drawn)
            now = replace(now, points=points, elapsed=now.seconds)
        if moved or due:
            yield now
        if not busy:
            return
        pace = MOVING_INTERVAL if window.arm_moves else 0.0
        may_send = window.is_open and time.perf_counter() - sent >= pace
        if moved := may_send and _step(drawn, steps, running):
            sent = time.perf_counter()
            window.sent(sum(one.sent for one in drawn))
        else:
            yield Wait(REST if may_send else MOVING_INTERVAL)


def _step(drawn: list[Drawn], steps: Sequence[Iterator[Drawn | None]], running: bool) -> bool:
    """Go on with the cloud that has the fewest points, if its next part is computed; else with the other one."""
    behind = [k for k, one in enumerate(drawn) if one.done < one.limit(running)]
    for k in sorted(behind, key=lambda k: drawn[k].points):
        if (found := next(steps[k])) is not None:
            drawn[:] = [found if i == k else replace(one, sent=0) for i, one in enumerate(drawn)]
            return True
    return False


def begun(wanted: Wanted, before: Drawn | None) -> Drawn:
    """What is drawn of a cloud when it gets another look, or when it is new."""
    cloud, look = wanted
    if before is None or before.cloud != cloud:
        return Drawn(cloud, look, Sheet(look.cut))
    if before.look == look:
        return before
    if before.look.cut == look.cut:
        return replace(before, look=look, done=0)
    old = before.old or (before.sheet if before.sheet.blocks else None)  # not an unfinished one
    return replace(before, look=look, done=0, sheet=Sheet(look.cut), old=old)


def draw(clouds: Clouds, drawn: Drawn, limit: int, wake: Callable[[], None]) -> Iterator[Drawn | None]:
    """Draw the parts up to a limit: an item for each step, None while the next part is being computed."""
    chunks = _chunks(clouds, drawn.measured, drawn.done, limit, wake)
    while drawn.done < limit:
        block = drawn.sheet.block(drawn.cloud, drawn.done, limit)
        painted: list[_Painted] = []
        for _ in range(block.first, block.stop):
            while (chunk := next(chunks)) is None:
                yield None
            painted.append(_painted(drawn, chunk))
            if drawn.extent is None:
                drawn = replace(drawn, extent=round_points(chunk.points))
            if len(painted) < block.stop - block.first:
                yield replace(drawn, sent=0)
        for further, whole, sent in _nodes(block, painted, drawn.look):
            drawn = drawn.having(further, whole, sent)
            yield drawn


def _chunks(
    clouds: Clouds, cloud: Cloud, start: int, stop: int, wake: Callable[[], None]
) -> Iterator[WorkspaceChunk | None]:
    """Parts of a cloud, requested in advance; None while the next one is being computed."""

    def requested(i: int) -> Any:
        future = clouds.part(cloud, i)
        if not future.done():
            future.add_done_callback(lambda _: wake())
        return future

    ahead = deque(requested(i) for i in range(start, min(start + AHEAD, stop)))
    for i in range(start, stop):
        while not ahead[0].done():
            yield None
        chunk = ahead.popleft().result()
        if i + AHEAD < stop:
            ahead.append(requested(i + AHEAD))
        yield chunk


class _Painted(NamedTuple):
    """The points of a part; their colours, None for a single one; and their slabs, None without a cut."""

    points: NDArray[np.float32]
    colours: Bytes | None
    slabs: Bytes | None


def _painted(drawn: Drawn, chunk: WorkspaceChunk) -> _Painted:
    look, robot, points = drawn.look, drawn.cloud.robot, chunk.points
    colours = None
    if look.by != "one":
        colours = paint(quantity(robot, look.by, chunk), scale_of(robot, look.by), look.map)
    return _Painted(points, colours, None if look.cut is None else look.cut.slabs(points))


def _nodes(block: Block, painted: Sequence[_Painted], look: Look) -> Iterator[tuple[Block, bool, int]]:
    """The block with more and more of its nodes in this look, whether it is whole, and the points that came."""
    points, colours, slabs = (
        None if parts[0] is None else parts[0] if len(parts) == 1 else np.concatenate(parts)
        for parts in zip(*painted, strict=True)
    )
    assert points is not None
    groups: list[tuple[int, Any]] = [(0, slice(None))]
    if slabs is not None:
        order = np.argsort(slabs, kind="stable")
        edges = [0, *np.cumsum(np.bincount(slabs)).tolist()]
        groups = [(k, order[a:b]) for k, (a, b) in enumerate(pairwise(edges)) if b > a]
    made, sent, fresh = dict(block.slabs), 0, 0
    for slab, which in groups:
        props = made.get(slab) or _geometry(points[which], shared=slabs is None)
        # Each node has colours of its own: viser writes later ones into the same array.
        own = np.array(look.colour if colours is None else colours[which], np.uint8)
        made[slab] = {**props, "colors": own}
        sent, fresh = sent + len(props["points"]), fresh + 1
        if slab == groups[-1][0] or sent >= POINTS or fresh >= NODES:
            yield replace(block, slabs=dict(made)), slab == groups[-1][0], sent
            sent = fresh = 0


def _geometry(points: NDArray[np.float32], shared: bool) -> dict[str, Any]:
    precision = "float16" if np.abs(points).max() < FINE else "float32"
    return {
        # As in the cache, as long as it has them; of a cut, which has its own, only what the browser gets.
        "points": points if shared else points.astype(precision),
        "precision": precision,
        "point_shape": "circle",
        "point_shading": "flat",
    }


def nodes(sheets: Sequence[Sheet], visible: Sequence[NDArray[np.bool_] | None], size: float) -> list[Node]:
    """Sheets and the visible slabs ``(count,)`` of each, None for all, with points of this diameter (m)."""
    return [sheet.node(slabs, size) for sheet, slabs in zip(sheets, visible, strict=True)]
