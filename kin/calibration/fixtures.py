"""What is touched: sockets of boards whose places are not known, or known roughly, and perhaps a plane.

A board is rigid and its sockets are at known places *of the board*. A pin is a board with one socket; the
distances of several sockets show the scale of an arm, as well as the board is made. Where a board lies is found by
the fit, so touches say nothing about the arm's base unless the board is at a marked place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kin.errors import InputError, finite_number
from kin.transforms import Array, as_transform, finite_array

Whole = NDArray[np.int64]
PLANE = -1  # what is touched, where it is the plane and no socket
PAPER = {"A5": (0.148, 0.210), "A4": (0.210, 0.297), "A3": (0.297, 0.420)}  # m
_CROSSES = (0.38, 0.40)  # half the distances of the crosses of a sheet, as shares of its sides
MOST_SOCKETS, MOST_BOARDS = 64, 16
_MARKED = (1e-3, math.radians(0.5))  # how well a board lies at a marked place: m, rad
_ANYWHERE = (1.0, 3.0)  # nothing is known about where a board is: m, rad
_FLAT = 0.05  # m: touches of a plane spread at least as far, as if they did
_BY_EYE = 0.5e-3


@dataclass(frozen=True, eq=False)
class TouchBoard:
    """Sockets at known places of one rigid board.

    Attributes:
        sockets: ``(m, 3)`` in the frame of the board, whose z axis points out of the sockets, metres.
        cone: largest angle between the z axis of the tool and that axis at which a socket can be touched, radians.
        print_error: standard deviation of the distances on the board, metres.
        contact: standard deviation of a contact in each direction, metres; None for what the arm's noise states.

    Raises:
        InputError: no sockets, too many of them, two at one place, or numbers that are not positive.
    """

    sockets: Array
    cone: float = math.radians(70.0)
    print_error: float = 0.1e-3
    contact: float | None = None

    def __post_init__(self) -> None:
        """Check the fields; sockets become an array."""
        sockets = finite_array("sockets", self.sockets, (None, 3))
        if sockets.ndim != 2 or not 1 <= len(sockets) <= MOST_SOCKETS:
            raise InputError("sockets", f"shape {sockets.shape}", f"(m, 3) with m from 1 to {MOST_SOCKETS}")
        apart = np.linalg.norm(sockets[:, None] - sockets[None], axis=2) + np.eye(len(sockets))
        if apart.min() < 1e-3:
            i, j = np.unravel_index(int(apart.argmin()), apart.shape)
            raise InputError(f"sockets[{max(i, j)}]", sockets[max(i, j)].tolist(), "1 mm or more from the others")
        object.__setattr__(self, "sockets", sockets)
        for key, most in (("cone", 0.5 * math.pi), ("print_error", 0.1), ("contact", 0.1)):
            value = getattr(self, key)
            if value is None and key == "contact":
                continue
            if not 0.0 < finite_number(key, value) <= most:
                raise InputError(key, value, f"a number above 0, at most {most:.4g}")

    @classmethod
    def pin(cls) -> TouchBoard:
        """One socket, or the point of a pin.

        Returns:
            A board whose frame is in the socket.

        Examples:
            >>> import kin
            >>> kin.calibration.TouchBoard.pin().sockets
            array([[0., 0., 0.]])
        """
        return cls(np.zeros((1, 3)))

    @classmethod
    def bar(cls, length: float = 0.15) -> TouchBoard:
        """Two sockets.

        Args:
            length: their distance in metres. With 50 mm and a print error of 0.1 mm, the scale of an arm is known
                to 0.3 % only.

        Returns:
            A board with its frame in the middle and the sockets on the y axis.

        Raises:
            InputError: a length that is not from 10 mm to 2 m.

        Examples:
            >>> import kin
            >>> kin.calibration.TouchBoard.bar(0.2).sockets
            array([[ 0. , -0.1,  0. ],
                   [ 0. ,  0.1,  0. ]])
        """
        if not 0.01 <= finite_number("length", length) <= 2.0:
            raise InputError("length", length, "metres from 0.01 to 2")
        return cls(np.array([[0.0, -0.5 * length, 0.0], [0.0, 0.5 * length, 0.0]]))

    @classmethod
    def sheet(cls, paper: str = "A4") -> TouchBoard:
        """Six crosses on a sheet of paper, in the order in which they are printed.

        The frame is in the middle of the sheet; its y axis is along the long side. Crosses are met by eye, to
        0.5 mm, and a print is as good as 0.3 mm.

        Args:
            paper: "A5", "A4" or "A3".

        Returns:
            A board whose sockets are the crosses.

        Raises:
            InputError: another paper.

        Examples:
            >>> import kin
            >>> board = kin.calibration.TouchBoard.sheet("A5")
            >>> board.sockets.shape, board.contact
            ((6, 3), 0.0005)
        """
        if paper not in PAPER:
            raise InputError("paper", paper, "one of " + ", ".join(PAPER))
        half_x, half_y = (share * side for share, side in zip(_CROSSES, PAPER[paper], strict=True))
        places = [(x, y, 0.0) for y in (-half_y, 0.0, half_y) for x in (-half_x, half_x)]
        return cls(np.array(places), print_error=0.3e-3, contact=_BY_EYE)

    @property
    def spread(self) -> float:
        """Distance of the farthest socket from the middle of all, metres."""
        return float(np.linalg.norm(self.sockets - self.sockets.mean(axis=0), axis=1).max())


@dataclass(frozen=True, eq=False)
class TouchFixture:
    """All that is touched. Sockets are numbered through, from 0, in the order of the boards; −1 is the plane.

    Attributes:
        boards: which may be the same board several times, at different places.
        plane: whether touches of a plane, such as the table, are among the touches.
        at_base: poses of the boards in the world frame ``(4, 4)``, if they lie at marked places (to 1 mm and
            0.5°), as a sheet with an edge against the base does; then the base is seen as well. None for boards
            anywhere.

    Raises:
        InputError: no board, too many of them, or other than one pose for each.
    """

    boards: Sequence[TouchBoard]
    plane: bool = False
    at_base: Sequence[ArrayLike] | None = None

    def __post_init__(self) -> None:
        """Check the fields; lists become tuples."""
        boards = (self.boards,) if isinstance(self.boards, TouchBoard) else tuple(self.boards)
        if not 1 <= len(boards) <= MOST_BOARDS or not all(isinstance(each, TouchBoard) for each in boards):
            raise InputError("boards", self.boards, f"1 to {MOST_BOARDS} TouchBoard")
        object.__setattr__(self, "boards", boards)
        if self.at_base is not None:
            poses = tuple(as_transform(T, f"at_base[{i}]") for i, T in enumerate(self.at_base))
            if len(poses) != len(boards):
                raise InputError("at_base", f"{len(poses)} poses", f"one for each of {len(boards)} boards")
            object.__setattr__(self, "at_base", poses)

    @cached_property
    def local(self) -> Array:
        """All sockets ``(m, 3)``, each in the frame of its board."""
        return np.vstack([board.sockets for board in self.boards])

    @cached_property
    def owner(self) -> Whole:
        """The board of each socket ``(m,)``."""
        return np.repeat(np.arange(len(self.boards)), [len(board.sockets) for board in self.boards])

    @property
    def size(self) -> int:
        """Number of unknowns: seven of each board (place, turn, scale), three of the plane."""
        return 7 * len(self.boards) + 3 * self.plane

    def contacts(self, at: Whole, usual: float) -> Array:
        """Standard deviation of each contact, in each direction.

        Args:
            at: ``(k,)`` what was touched: the number of a socket of the fixture from 0, or −1 for its plane.
            usual: standard deviation of a contact in metres, for the plane and for boards that state none or a
                smaller one.

        Returns:
            ``(k,)`` metres.

        Examples:
            >>> import kin, numpy as np
            >>> fixture = kin.calibration.TouchFixture([kin.calibration.TouchBoard.sheet()], plane=True)
            >>> fixture.contacts(np.array([0, 5, -1]), 0.0001)
            array([0.0005, 0.0005, 0.0001])
        """
        own = [usual if board.contact is None else max(board.contact, usual) for board in self.boards]
        return np.where(at == PLANE, usual, np.array(own)[self.owner[np.maximum(at, 0)]])

    def sigma(self) -> Array:
        """Standard deviations of the unknowns before anything is touched.

        Returns:
            ``(size,)`` of each board its place (three, metres), its turn (three, radians) and its scale (a share);
            at the end of the plane two angles (radians) and its height (metres). 0 for what does not count: a
            board with one socket has neither turn nor scale.

        Examples:
            >>> import kin
            >>> kin.calibration.TouchFixture([kin.calibration.TouchBoard.bar(0.2)]).sigma().tolist()
            [1.0, 1.0, 1.0, 3.0, 3.0, 3.0, 0.001]
        """
        s = np.zeros(self.size)
        shift, turn = _ANYWHERE if self.at_base is None else _MARKED
        for b, board in enumerate(self.boards):
            s[7 * b : 7 * b + 3] = shift
            if len(board.sockets) > 1:
                s[7 * b + 3 : 7 * b + 6] = turn
                s[7 * b + 6] = board.print_error / board.spread
        if self.plane:
            s[-3:] = (_ANYWHERE[1], _ANYWHERE[1], _ANYWHERE[0])
        return s

    def check_sockets(self, sockets: ArrayLike, count: int, field: str = "sockets") -> Whole:
        """Numbers of what was touched, if the fixture has them.

        Args:
            sockets: ``(count,)`` the number of a socket of the fixture from 0, or −1 for its plane.
            count: how many touches there are.
            field: what messages call them.

        Returns:
            ``(count,)`` the same as whole numbers.

        Raises:
            InputError: another shape; naming the touch, a socket or a plane that the fixture does not have.

        Examples:
            >>> import kin
            >>> bar = kin.calibration.TouchFixture([kin.calibration.TouchBoard.bar()])
            >>> bar.check_sockets([0, 1, 1], 3)
            array([0, 1, 1])
            >>> bar.check_sockets([0, 2, 1], 3)
            Traceback (most recent call last):
            kin.errors.InputError: sockets[1]: got 2.0, expected a socket of the fixture, 0 to 1
        """
        given = finite_array(field, sockets, (None,))
        if given.shape != (count,):
            raise InputError(field, f"shape {given.shape}", f"one for each of {count} touches")
        for k, each in enumerate(given.tolist()):
            if not each.is_integer() or not (0 <= each < len(self.local) or (self.plane and each == PLANE)):
                valid = f"a socket of the fixture, 0 to {len(self.local) - 1}"
                raise InputError(f"{field}[{k}]", each, valid + (", or −1 for its plane" if self.plane else ""))
        return given.astype(np.int64)


@dataclass(frozen=True, eq=False)
class Places:
    """Where boards and plane are.

    Attributes:
        R, t: ``(b, 3, 3)``, ``(b, 3)`` of the boards.
        grown: ``(b,)`` by which share each is larger than stated.
        normal, height: of the plane.
    """

    fixture: TouchFixture
    R: Array
    t: Array
    grown: Array
    normal: Array
    height: float

    @classmethod
    def near(cls, fixture: TouchFixture, p: Array, at: Whole) -> Places:
        """Places that suit tool points ``(k, 3)`` which touch sockets `at`: where fits start."""
        count = len(fixture.boards)
        R, t = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
        for b in range(count):
            touched = [j for j in np.flatnonzero(fixture.owner == b).tolist() if (at == j).any()]
            if fixture.at_base is not None:
                T = np.asarray(fixture.at_base[b])
                R[b], t[b] = T[:3, :3], T[:3, 3]
            elif touched:
                seen = np.array([np.median(p[at == j], axis=0) for j in touched])
                R[b], t[b] = rigid(fixture.local[touched], seen)
        normal, height = np.array([0.0, 0.0, 1.0]), 0.0
        if fixture.plane and (at == PLANE).any():
            on = p[at == PLANE]
            away = on - on.mean(axis=0)
            # Few touches, or touches on one line, do not say where the plane points.
            flat = _FLAT**2 * len(on) * np.diag([1.0, 1.0, 0.0])
            normal = np.linalg.eigh(away.T @ away + flat)[1][:, 0]
            normal = normal * math.copysign(1.0, normal[2])
            height = float(normal @ on.mean(axis=0))
        return cls(fixture, R, t, np.zeros(count), normal, height)

    def moved(self, x: Array) -> Places:
        """The places after small changes of the unknowns."""
        u = x[: 7 * len(self.t)].reshape(-1, 7)
        R = np.array([rotation(w) @ old for w, old in zip(u[:, 3:6], self.R, strict=True)])
        normal, height = self.normal, self.height
        if self.fixture.plane:
            e1, e2 = self._across()
            normal = normal + x[-3] * e1 + x[-2] * e2
            normal, height = normal / np.linalg.norm(normal), height + float(x[-1])
        return Places(self.fixture, R, self.t + u[:, :3], self.grown + u[:, 6], normal, height)

    def targets(self, at: Whole) -> Array:
        """Where the sockets are ``(k, 3)``."""
        b = self.fixture.owner[at]
        arm = np.einsum("kij,kj->ki", self.R[b], self.fixture.local[at])
        return np.asarray(self.t[b] + (1.0 + self.grown[b])[:, None] * arm)

    def misses(self, p: Array, at: Whole) -> Array:
        """How far tool points miss what they touch ``(k, 3)``; of the plane, the first number is the distance."""
        r = p - self.targets(np.maximum(at, 0))
        on = at == PLANE
        if on.any():
            r[on] = 0.0
            r[on, 0] = p[on] @ self.normal - self.height
        return r

    def derivatives(self, p: Array, at: Whole) -> tuple[Array, Array]:
        """How tool points ``(k, 3, 3)`` and unknowns ``(k, 3, f)`` move what `misses` returns."""
        k = len(at)
        A, D = np.tile(np.eye(3), (k, 1, 1)), np.zeros((k, 3, self.fixture.size))
        on = np.flatnonzero(at == PLANE)
        here = np.flatnonzero(at != PLANE)
        b = self.fixture.owner[at[here]]
        s = np.einsum("kij,kj->ki", self.R[b], self.fixture.local[at[here]])
        arm = s * (1.0 + self.grown[b])[:, None]
        places = np.zeros((len(here), 3, 7))
        places[:, :, :3] = -np.eye(3)
        places[:, [2, 0, 1], [4, 5, 3]] = arm[:, [0, 1, 2]]
        places[:, [1, 2, 0], [5, 3, 4]] = -arm[:, [0, 1, 2]]
        places[:, :, 6] = -s
        D[here[:, None, None], np.arange(3)[:, None], (7 * b)[:, None, None] + np.arange(7)] = places
        if len(on):
            e1, e2 = self._across()
            A[on] = 0.0
            A[on, 0] = self.normal
            D[on, 0, -3], D[on, 0, -2], D[on, 0, -1] = p[on] @ e1, p[on] @ e2, -1.0
        return A, D

    def _across(self) -> tuple[Array, Array]:
        """Two directions in the plane."""
        e1 = np.cross(self.normal, np.eye(3)[int(np.abs(self.normal).argmin())])
        e1 = e1 / np.linalg.norm(e1)
        return e1, np.cross(self.normal, e1)


def rotation(w: Array) -> Array:
    """The rotation ``(3, 3)`` by a rotation vector."""
    angle = float(np.linalg.norm(w))
    K = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
    if angle < 1e-9:
        return np.asarray(np.eye(3) + K)
    return np.asarray(np.eye(3) + math.sin(angle) / angle * K + (1.0 - math.cos(angle)) / angle**2 * K @ K)


def rigid(a: Array, b: Array) -> tuple[Array, Array]:
    """The rotation and translation that bring points a ``(k, 3)`` as near as possible to b (Kabsch)."""
    ma, mb = a.mean(axis=0), b.mean(axis=0)
    U, _, Vt = np.linalg.svd((a - ma).T @ (b - mb))
    R = Vt.T @ np.diag([1.0, 1.0, math.copysign(1.0, float(np.linalg.det(Vt.T @ U.T)))]) @ U.T
    if len(a) == 1:
        R = np.eye(3)
    return R, mb - R @ ma
