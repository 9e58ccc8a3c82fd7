"""Which points the arm can reach, answered for any point: a map of cells with configurations to start from.

Half a million evenly spread configurations are put into a grid of cubes over the points they reach, a few
configurations per cube kept. Whether a point is reached, and which reachable one is nearest, is then told by
descents (:mod:`kin.workspace.facts.descent`) from those of its cube. A ring of cubes around the occupied ones
belongs to the map too, with the configurations of their neighbours, so that what the spread configurations just
missed is
found.

The limits of it: a descent may stop at an inner barrier, a fold of the arm that another start would have avoided,
and call a point missed that can be reached; with `SEEDS` starts that is rare. A part of the workspace
farther than a cube from everything the spread configurations reach is not seen at all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import jit
from kin.transforms import Array
from kin.workspace.clouds.draw import chosen, points
from kin.workspace.clouds.numbers import streams
from kin.workspace.facts.descent import Room, room, settle
from kin.workspace.region import Region

SPREAD = 1 << 19  # configurations the map is made from
CELLS = 24  # along the longest side
SEEDS = 8  # configurations kept per cube
_LENT = 2  # configurations a cube lends to each neighbour
_THIN = 1e-9  # of the longest side: less is flat
_BLOCK = 1 << 16
_SAME = 1e-6  # squared distances that differ by less than this part are one
_GRAIN = 1e-8  # a descent ends when the next step would shorten the squared distance by less than this part

Rows = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Atlas:
    """The map of a region.

    Attributes:
        region: what it is a map of.
        origin, edge: ``(3,)`` corner of the grid and sides of a cube; 0 along which the workspace is flat.
        table: ``(a, b, c)`` row of each cube in what follows, −1 for one that is not in the map.
        corners: ``(m, 3)`` least corner of each cube.
        seeds: ``(m, SEEDS, n)`` configurations to start from.
        occupied: ``(m,)`` whether a spread configuration reached it, not only a neighbour.
    """

    region: Region
    origin: Array
    edge: Array
    table: Rows
    corners: Array
    seeds: Array
    occupied: NDArray[np.bool_]

    @property
    def size(self) -> float:
        """Side of a cube, m."""
        return float(self.edge.max())

    def rows(self, p: Array) -> Rows:
        """The map's row for points ``(k, 3)``, −1 outside of it."""
        steep = np.asarray(self.edge > 0.0)
        place = np.floor((p - self.origin) / np.where(steep, self.edge, 1.0)).astype(np.int64)
        place[:, ~steep] = 0
        inside = np.asarray(((place >= 0) & (place < self.table.shape)).all(axis=1))
        x, y, z = np.where(inside[:, None], place, 0).T
        return np.where(inside, self.table[x, y, z], -1)

    def nearest(
        self, p: Array, tolerance: float, alike: int = SEEDS, guess: Array | None = None
    ) -> tuple[Array, Array]:
        """For points ``(k, 3)`` a configuration ``(k, n)`` as near as was found, and its distance ``(k,)``.

        Descents begin at the `guess` ``(k, n)`` where it is not NaN, then at the cube's configurations; they end
        once nearer than `tolerance`, or when `alike` of them ended at the same distance. Points outside of the map
        are at infinity, their rows NaN.
        """
        rows = self.rows(p)
        q = np.full((len(p), self.region.robot.n), math.nan) if guess is None else guess.copy()
        distance = np.full(len(p), math.inf)
        probe(
            self.region.robot.model, self.region.lower, self.region.upper, np.ascontiguousarray(p), rows,
            self.seeds, tolerance, alike, q, distance,
        )  # fmt: skip
        q[rows < 0] = math.nan
        return q, distance


@jit
def nearest_from(
    model: Array, low: Array, high: Array, seeds: Array, first: int, f: Array, tolerance: float, alike: int,
    q: Array, best: Array, work: Room,
) -> float:  # fmt: skip
    """best ← the nearest to the point f is about, over descents from the seeds ``(s, n)``; returns its distance.

    Begins with seed `first`; ends once nearer than `tolerance`, or when `alike` descents ended at the same
    distance. q is scratch.
    """
    least = math.inf
    enough = 0.5 * tolerance * tolerance
    ended = 0
    for k in range(seeds.shape[0]):
        i = (first + k) % seeds.shape[0]
        for j in range(q.shape[0]):
            q[j] = seeds[i, j]
        height = settle(model, f, low, high, enough, _GRAIN, q, work)
        same = abs(height - least) <= _SAME * least
        ended = ended + 1 if same else ended
        if height < least:
            ended = ended if same else 1
            least = height
            for j in range(q.shape[0]):
                best[j] = q[j]
        if least <= enough or ended >= alike:
            break
    return math.sqrt(2.0 * max(least, 0.0))


@jit
def to_point(f: Array) -> None:
    """f ← half the squared distance to a point, which is to be put into f[9:12]."""
    for r in range(15):
        f[r] = 1.0 if r == 0 or r == 4 or r == 8 else 0.0


@jit
def probe(
    model: Array, low: Array, high: Array, p: Array, rows: Rows, seeds: Array, tolerance: float, alike: int,
    q: Array, distance: Array,
) -> None:  # fmt: skip
    """q ``(k, n)``, distance ``(k,)`` ← the nearest to each point ``(k, 3)``, untouched where its row is −1.

    What q holds before is tried first where it is not NaN; with `alike` 1 it is the only start.
    """
    n = q.shape[1]
    work = room(n)
    trial, f = np.empty(n), np.empty(15)
    guess = np.empty((1, n))
    to_point(f)
    for i in range(p.shape[0]):
        if rows[i] < 0:
            continue
        f[9], f[10], f[11] = p[i, 0], p[i, 1], p[i, 2]
        near = math.inf
        if not math.isnan(q[i, 0]):
            for j in range(n):
                guess[0, j] = q[i, j]
            near = nearest_from(model, low, high, guess, 0, f, tolerance, alike, trial, q[i], work)
        if near > tolerance and (alike > 1 or near == math.inf):
            for j in range(n):
                guess[0, j] = q[i, j]
            distance[i] = nearest_from(model, low, high, seeds[rows[i]], 0, f, tolerance, alike, trial, q[i], work)
            if distance[i] <= near:
                continue
            for j in range(n):
                q[i, j] = guess[0, j]
        distance[i] = near


@lru_cache(maxsize=8)
def atlas(region: Region) -> Atlas:
    """The map of a region; made in about a second and kept."""
    key, step = streams(0, region.free, quasi=True)
    cloud = np.empty((SPREAD, 3), dtype=np.float32)
    for start in range(0, SPREAD, _BLOCK):
        points(
            region.robot.model, key, step, True, region.lower, region.upper, start, cloud[start : start + _BLOCK]
        )
    low, high = cloud.min(axis=0).astype(np.float64), cloud.max(axis=0).astype(np.float64)
    side = float((high - low).max()) / CELLS
    steep = high - low > max(_THIN, 1e-6) * side * CELLS
    edge = np.where(steep, side, 0.0)
    # A ring of empty cubes around, so that every cube has neighbours.
    origin = np.where(steep, low - side, 0.5 * (low + high))
    shape = np.where(steep, np.ceil((high - low) / max(side, 1e-300)) + 2, 1).astype(np.int64)
    place = np.floor((cloud - origin) / np.where(steep, side, 1.0)).astype(np.int64)
    place[:, ~steep] = 0
    place = np.minimum(place, shape - 1)
    flat = np.ravel_multi_index(tuple(place.T), tuple(shape))
    order = np.argsort(flat, kind="stable")
    cells, starts, counts = np.unique(flat[order], return_index=True, return_counts=True)
    # The first SEEDS of each cube, −1 where it has fewer.
    nth = starts[:, None] + np.arange(SEEDS)
    own = np.where(np.arange(SEEDS) < counts[:, None], order[np.minimum(nth, SPREAD - 1)], -1)
    held = np.full((*shape, SEEDS), -1, dtype=np.int64)
    held.reshape(-1, SEEDS)[cells] = own
    picked, inside = _with_neighbours(held)
    table = np.full(tuple(shape), -1, dtype=np.int64)
    table[inside] = np.arange(int(inside.sum()))
    index = picked.reshape(-1).astype(np.uint64)
    q = np.empty((len(index), region.robot.n))
    chosen(key, step, True, region.lower, region.upper, index, q)
    return Atlas(
        region=region,
        origin=origin,
        edge=edge,
        table=table,
        corners=np.ascontiguousarray(origin + np.argwhere(inside) * edge),
        seeds=q.reshape(-1, SEEDS, region.robot.n),
        occupied=held[inside][:, 0] >= 0,
    )


def _with_neighbours(held: Rows) -> tuple[Rows, NDArray[np.bool_]]:
    """Seeds ``(m, SEEDS)`` of every cube that is occupied or next to one, its own first, and which these are."""
    padded = np.pad(held[..., :_LENT], ((1, 1), (1, 1), (1, 1), (0, 0)), constant_values=-1)
    a, b, c = held.shape[:3]
    shifts = sorted(np.ndindex(3, 3, 3), key=lambda s: sum(abs(i - 1) for i in s))
    lent = [padded[i : i + a, j : j + b, k : k + c] for i, j, k in shifts[1:]]
    choice = np.concatenate([held, *lent], axis=-1)
    inside = np.asarray((choice >= 0).any(axis=-1))
    choice = choice[inside]
    # Those that exist, in order; repeated from the first on where there are too few.
    order = np.argsort(choice < 0, axis=1, kind="stable")
    choice = np.take_along_axis(choice, order, axis=1)
    count = (choice >= 0).sum(axis=1, keepdims=True)
    return np.take_along_axis(choice, np.arange(SEEDS) % count, axis=1), inside
