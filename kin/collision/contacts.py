"""What an arm touches: itself, or obstacles around it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from kin.collision.bodies import Bodies, bodies_of
from kin.collision.kernels import distances_of_pairs
from kin.collision.obstacles import SHAPES, Obstacle
from kin.collision.solids import COLUMNS, distances_to_each, least_clearances
from kin.robot import Robot
from kin.transforms import Array

_AXIS = 1e-9  # m


@dataclass(frozen=True, slots=True)
class Contact:
    """The smallest distance of an arm to itself and to obstacles, and what it is between.

    Attributes:
        distance: m; negative where the bodies overlap. How far a link is inside a box or a cylinder is counted up
            to the axis of its capsule.
        link: k for the link that joint k moves; of two links, the one farther from the base.
        other: the other link, 0 for the base; None if the other is an obstacle.
        obstacle: which of the obstacles; None if the other is a link.
        name: of the obstacle, or its shape.
        axis_inside: whether the axis of the link's capsule is inside the obstacle, which hides how deep it is.
    """

    distance: float
    link: int
    other: int | None
    obstacle: int | None = None
    name: str = ""
    axis_inside: bool = False

    @property
    def text(self) -> str:
        """The two in a clause: ``"link 6 touches link 2"``, ``"link 4 touches the table"``."""
        if self.other is None:
            return f"link {self.link} touches {'the ' * (self.name in SHAPES)}{self.name}"
        return f"link {self.link} touches {f'link {self.other}' if self.other else 'the base'}"


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What the configurations of an arm are checked against: arrays for the kernels."""

    robot: Robot
    bodies: Bodies
    pairs: NDArray[np.int64]
    obstacles: tuple[Obstacle, ...]
    solids: Array

    def distances(self, q: Array) -> tuple[Array, NDArray[np.int64]]:
        """The least distance at configurations ``(k, n)``, and a number that says between what, for `contact`."""
        q, body, out, which = np.ascontiguousarray(q), self.bodies, np.empty(len(q)), np.empty(len(q), np.int64)
        least_clearances(
            self.robot.model, body.rows, body.shape, self.pairs, self.solids, body.moving, q, out, which
        )
        return out, which

    def contact(self, distance: float, which: int) -> Contact | None:
        """What a distance is between; None if there is nothing to be apart from."""
        if which < 0:
            return None
        links, count = self.bodies.capsules, len(self.pairs)
        if which < count:
            first, second = self.pairs[which].tolist()
            return Contact(distance, links[second].link, links[first].link)
        row, k = divmod(which - count, len(self.obstacles))
        link, obstacle = links[self.bodies.moving[row]], self.obstacles[k]
        inside = obstacle.shape != "sphere" and distance <= -link.radius + _AXIS
        return Contact(distance, link.link, None, k, obstacle.label, inside)

    def nearest(self, q: Array) -> Contact | None:
        """The least distance at one configuration ``(n,)``."""
        out, which = self.distances(q[None])
        return self.contact(float(out[0]), int(which[0]))

    def touching(self, q: Array) -> Contact | None:
        """The deepest contact at one configuration ``(n,)``; None if nothing touches."""
        found = self.nearest(q)
        return None if found is None or found.distance >= 0.0 else found

    def touches(self, q: Array) -> tuple[Contact, ...]:
        """All that touches at one configuration ``(n,)``, the deepest first.

        Each pair of links, and each link with an obstacle, comes once: with its deepest capsules.
        """
        body, q = self.bodies, q.copy()
        apart = np.empty((len(body.moving), len(self.obstacles)))
        distances_to_each(self.robot.model, body.rows, body.shape, self.solids, body.moving, q, apart)
        between = distances_of_pairs(self.robot.model, body.rows, body.shape, self.pairs, q[None])[0]
        every = np.concatenate([between, apart.ravel()])
        found: dict[tuple[int, int | None, int | None], Contact] = {}
        for which in np.argsort(every, kind="stable").tolist():
            if every[which] >= 0.0:
                break
            contact = self.contact(float(every[which]), which)
            assert contact is not None
            found.setdefault((contact.link, contact.other, contact.obstacle), contact)
        return tuple(found.values())


@lru_cache(maxsize=256)
def surroundings(robot: Robot, obstacles: tuple[Obstacle, ...] = (), links: bool = True) -> Surroundings:
    """What an arm may touch: its own links, if `links`, and obstacles."""
    body = bodies_of(robot)
    rows = [each.row for each in obstacles]
    solids = np.array(rows).reshape(-1, COLUMNS)
    return Surroundings(robot, body, body.pairs if links else body.pairs[:0], obstacles, solids)
