"""What is found: an arm with its own table, how well it is known, and what did not fit."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kin.calibration.chain import ErrorKind
from kin.calibration.faults import Cause, undone
from kin.robot import Robot
from kin.transforms import Array


@dataclass(frozen=True)
class ExpectedError:
    """Expected error of the tip: its root mean square over the workspace, in metres.

    What a motion of the whole arm with its base would mend does not count, because touching does not see it.

    Attributes:
        before: with the nominal table, if its errors are as large as the tolerances, or as the wider ones that the
            touches ask for.
        after: with the touches.
        bound: what 95 % are expected to stay below, as simulated arms have; no real one has been measured.
        readings: what the noise of readings alone does, which no table mends.
    """

    before: float
    after: float
    bound: float
    readings: float


@dataclass(frozen=True)
class TableError:
    """An error of the table or the tool point.

    Attributes:
        row: name of the row; "" for the tool point and the common scale.
        field: "theta", "d", "a", "alpha" or "beta" (a tilt about y) of the row, "sin" or "cos" of the wave of its
            encoder, "x", "y" or "z" of the tool point, or "scale".
        kind: "zero", "length", "twist", "tip", "scale" or "wave".
        value: rad, m, or a share of all lengths: what comes to the nominal value.
        interval: half of the 95 % interval.
        seen: whether the touches have shown it.
        unseen: why not: "alike" if other errors move the tool point in the same way, so that only their sum is
            seen; "hidden" if the touches hardly depend on it; "" if it was seen.
        in_motor: whether it was put into the offset of a motor.
        text: it in words.
    """

    row: str
    field: str
    kind: ErrorKind
    value: float
    interval: float
    seen: bool
    unseen: str = ""
    in_motor: bool = False
    text: str = dataclasses.field(default="", repr=False)


@dataclass(frozen=True)
class TouchFault:
    """A mistake in the touches.

    Attributes:
        touch: index of the touch, which was left out; None if all touches are meant, for which it was undone.
        cause: the tip was beside the "place"; two readings are exchanged ("swap"); a joint counts backwards
            ("sign"); another "socket" was touched; the "zero" of a joint is far off.
        joints: names of the joints that it is about.
        value: metres beside the socket, or radians that a zero is off; 0 for other causes.
        socket: the one that was probably touched, None for other causes.
        in_motors: whether the motors of the arm found make up for it: another sign, joints exchanged.
        text: it in words.
    """

    touch: int | None
    cause: Cause
    joints: tuple[str, ...] = ()
    value: float = 0.0
    socket: int | None = None
    in_motors: bool = False
    text: str = field(default="", repr=False)


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """What `kin.calibration.calibrate` has found.

    Attributes:
        robot: the arm with its own table. Zeros of joints that have motors are in the offsets of the motors, not
            in the table, and so are signs and exchanged joints that all touches have shown. Its values for what
            the nominal motors gave are those of `corrected`.
        nominal: the arm as it was.
        expected: how far its tip is expected to be off.
        errors: of the table and the tool point, in the order of the rows.
        faults: touches that contradict the others, and mistakes of all touches.
        unseen: what cannot be seen, and why, a sentence each.
        kept: indices of the touches that were used.
        misses: ``(k,)`` distance of each touch from what it touched, with the table found, metres.
        held_out: root mean square distance by which touches miss that the fit did not use, with the nominal table
            and with the one found, metres; NaN if each is alone on its board, and so says nothing of itself.
        noise: how large the noise was, as a multiple of the stated one, 1 or more.
        wider: by what factor the tolerances were taken to be wider than stated, 1 to 3.
        places: ``(b, 4, 4)`` where the boards are.
        zeros: ``(n,)`` what is in the offsets of motors, radians.
        waves: ``(n, 2)`` what comes to a reading q: the first times sin q, the second times cos q; radians.
        advice: what would help; "" if nothing is known that would.
        text: the outcome in words.
    """

    robot: Robot
    nominal: Robot
    expected: ExpectedError
    errors: tuple[TableError, ...]
    faults: tuple[TouchFault, ...]
    unseen: tuple[str, ...]
    kept: NDArray[np.int64]
    misses: Array
    held_out: tuple[float, float]
    noise: float
    wider: float
    places: Array
    zeros: Array
    waves: Array
    advice: str = ""
    text: str = field(default="", repr=False)

    def __repr__(self) -> str:
        """The arm, how far its tip is expected to be off, and what became of the touches."""
        e, used = self.expected, f"{len(self.kept)} of {len(self.misses)} touches"
        mm = f"{1e3 * e.before:.3g} to {1e3 * e.after:.3g} mm, 95 % below {1e3 * e.bound:.3g}"
        return f"Calibration({self.robot.id!r}, {mm}, {used}, {len(self.faults)} faults)"

    def corrected(self, q: ArrayLike) -> Array:
        """Joint values of `robot` for what the nominal arm reads.

        Args:
            q: ``(..., n)`` joint values as they were given to `kin.calibration.calibrate`, radians (metres).

        Returns:
            ``(..., n)`` with the mistakes of all touches undone (signs, exchanged joints), with the zeros that are
            in the motors, and without the waves of encoders.

        Raises:
            InputError: q has another number of joints, or values that are not finite.

        Examples:
            The zero of an elbow is off by 0.02 rad. It is seen from the eight postures that touch one pin:

            >>> import dataclasses, kin, numpy as np
            >>> ur5 = kin.get_robot("ur5")
            >>> arm = dataclasses.replace(ur5, motors=(kin.motors.Motor("elbow", 3),))
            >>> q = kin.ik_branches(ur5, kin.fk(ur5, ur5.q_home))
            >>> readings = q - [0, 0, 0.02, 0, 0, 0]
            >>> pin = kin.calibration.TouchFixture([kin.calibration.TouchBoard.pin()])
            >>> found = kin.calibration.calibrate(arm, readings, [0] * len(q), pin)
            >>> bool(np.abs(found.corrected(readings) - q).max() < 0.001)
            True
        """
        q = self.nominal.check_q(q)
        names = [joint.name for joint in self.nominal.joints]
        for fault in self.faults:
            if fault.touch is None:
                q = undone(q, fault.cause, tuple(names.index(name) for name in fault.joints))
        return np.asarray(q + self.zeros + self.waves[:, 0] * np.sin(q) + self.waves[:, 1] * np.cos(q))


@dataclass(frozen=True, eq=False, repr=False)
class TouchPlan:
    """The postures in which to touch.

    Attributes:
        q: ``(k, n)`` configurations of the nominal arm, in an order in which each is near the one before.
        sockets: ``(k,)`` what is touched: the number of a socket, −1 for the plane.
        places: ``(b, 4, 4)`` where the boards are to lie; some centimetres beside is as good.
        table: height of the table in the world frame, metres.
        expected: how far the tip is expected to be off after these touches.
        advice: what would be better; "" if nothing is known that would.
        text: the outcome in words.
    """

    q: Array
    sockets: NDArray[np.int64]
    places: Array
    table: float
    expected: ExpectedError
    advice: str = ""
    text: str = field(default="", repr=False)

    def __repr__(self) -> str:
        """How many touches, and how far the tip is expected to be off before and after them."""
        e = self.expected
        return f"TouchPlan({len(self.q)} touches, {1e3 * e.before:.3g} to {1e3 * e.after:.3g} mm)"
