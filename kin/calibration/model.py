"""What is assumed before anything is touched: how wrong a table, a reading and a contact may be.

The tolerances are the prior of the fit: each error is taken to be Gaussian, with the standard deviation of one
that is uniform within its tolerance. So the fit is defined with few touches, what no touch sees keeps its nominal
value, and of errors that move the tool point alike each gets its share.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from kin.calibration.chain import Chain, Mask
from kin.calibration.fixtures import TouchFixture, Whole
from kin.errors import InputError, finite_number
from kin.ik.problem import never_cancel
from kin.robot import Robot
from kin.transforms import Array, finite_array

_FINE = (math.radians(0.005), 0.1e-3)  # of an industrial arm: a reading, a contact in a socket
_HOBBY_PLAY, _HOBBY_CONTACT = math.radians(0.3), 0.3e-3  # of an arm of hobby servos
_PRINTED = 0.005
_LEAST = 1e-6  # radians and metres: finer than any encoder or socket, and squares of it still differ from 0
_MOST = {
    "zero": math.radians(30.0),
    "length": 0.1,
    "twist": math.radians(30.0),
    "tip": 0.5,
    "scale": 0.1,
    "wave": 0.2,
}


def fewest(robot: Robot) -> int:
    """How many touches it takes to say something of a table: of what fewer say, most is where the fixture lies."""
    return robot.n + 1


def suited(robot: Robot) -> tuple[float, str]:
    """The length of a bar in metres, and the paper of a sheet, that suit the size of an arm."""
    return (0.05, "A4") if robot.reach < 0.7 else (0.15, "A3")


@dataclass(frozen=True)
class TableTolerances:
    """Largest errors that are expected of a table. The fit takes them to be up to three times as large.

    Attributes:
        zero: of a joint's zero, radians.
        length: of a length d or a, metres.
        twist: of a twist α and a tilt β, radians.
        tip: of the tool point, metres in each direction.
        scale: share by which all lengths may be larger or smaller; 0 for an arm that is not printed.
        wave: of an encoder's error that repeats every turn, radians; 0 if there is none.
        keep_family: whether what is zero in the table stays zero, and twists stay as they are. The arm keeps its
            closed form then, and more of its errors.

    Raises:
        InputError: a tolerance below a millionth or too large; scale and wave may be 0.
    """

    zero: float = math.radians(2.0)
    length: float = 1e-3
    twist: float = math.radians(0.3)
    tip: float = 5e-3
    scale: float = 0.0
    wave: float = 0.0
    keep_family: bool = False

    def __post_init__(self) -> None:
        """Check the fields."""
        for key, most in _MOST.items():
            value = finite_number(key, getattr(self, key))
            none = key in ("scale", "wave")
            if not _LEAST <= value <= most and not (none and value == 0.0):
                raise InputError(key, value, f"{'0 or ' if none else ''}{_LEAST} to {most:.4g}")

    @classmethod
    def of(cls, robot: Robot) -> TableTolerances:
        """What is assumed where nothing is stated: the lengths of an arm of servos are printed.

        Args:
            robot: the arm; one with motors is taken to be printed.

        Returns:
            The tolerances that are the defaults here; of an arm with motors, a scale of 0.5 % besides.

        Examples:
            >>> import kin
            >>> [kin.calibration.TableTolerances.of(kin.get_robot(name)).scale for name in ("ur5e", "so101")]
            [0.0, 0.005]
        """
        return cls(scale=_PRINTED if robot.motors else 0.0)


@dataclass(frozen=True, eq=False)
class TouchNoise:
    """What a reading and a contact are off by at random, as standard deviations.

    Attributes:
        joint: of a reading, one number or ``(n,)``, radians (metres for slides). Play counts, and bending.
        contact: of a contact in a socket, in each direction, metres.

    Raises:
        InputError: a number below a millionth, finer than any encoder or socket, or one that is too large.
    """

    joint: ArrayLike = _FINE[0]
    contact: float = _FINE[1]

    def __post_init__(self) -> None:
        """Check the fields."""
        joint = np.asarray(self.joint, dtype=np.float64)
        if not (np.isfinite(joint).all() and (joint >= _LEAST).all() and (joint < 0.5).all()):
            raise InputError("joint", self.joint, f"at least {_LEAST}, below 0.5 (radians or metres)")
        if not _LEAST <= finite_number("contact", self.contact) <= 0.1:
            raise InputError("contact", self.contact, f"{_LEAST} to 0.1 m")

    @classmethod
    def of(cls, robot: Robot) -> TouchNoise:
        """What is assumed where nothing is stated: of an arm with motors, the noise of hobby servos.

        Args:
            robot: the arm.

        Returns:
            Of an arm with motors, ±0.3° of play and the ticks of each motor, with contacts to 0.3 mm. Of others,
            readings to 0.005° (slides to 0.09 mm) and contacts to 0.1 mm.

        Examples:
            >>> import kin, numpy as np
            >>> noise = kin.calibration.TouchNoise.of(kin.get_robot("so101"))
            >>> np.degrees(noise.joint).round(3), noise.contact
            (array([0.175, 0.175, 0.175, 0.175, 0.175]), 0.0003)
        """
        if not robot.motors:
            return cls()
        ticks = {motor.joint: motor.ticks for motor in robot.motors}
        step = np.array([2.0 * math.pi / ticks.get(joint.name, 4096) for joint in robot.joints])
        return cls(np.sqrt(step**2 / 12.0 + _HOBBY_PLAY**2 / 3.0), _HOBBY_CONTACT)

    def joints(self, robot: Robot) -> Array:
        """Standard deviations of the readings of all joints.

        Args:
            robot: the arm.

        Returns:
            ``(n,)`` radians (metres for slides).

        Raises:
            InputError: `joint` has another number of values than the arm has joints.

        Examples:
            >>> import kin
            >>> kin.calibration.TouchNoise(joint=0.001).joints(kin.get_robot("scara"))
            array([0.001, 0.001, 0.001, 0.001])
        """
        joint = np.asarray(self.joint, dtype=np.float64)
        return np.full(robot.n, float(joint)) if joint.ndim == 0 else finite_array("joint", joint, (robot.n,))


@dataclass(frozen=True, eq=False)
class Model:
    """An arm whose table is not trusted.

    Attributes:
        sigma: ``(p,)`` standard deviations of the parameters before anything is touched, 0 for those that stay.
        noise: as it was stated.
        louder: by what it is multiplied: touches that contradict each other may ask for more than can be stated.
        cancel: called with every step of a fit; raises to cancel it.
    """

    chain: Chain
    fixture: TouchFixture
    sigma: Array
    noise: TouchNoise
    louder: float = 1.0
    cancel: Callable[[], None] = never_cancel

    @classmethod
    def of(
        cls,
        robot: Robot,
        fixture: TouchFixture,
        tolerances: TableTolerances | None = None,
        noise: TouchNoise | None = None,
        cancel: Callable[[], None] = never_cancel,
    ) -> Model:
        """The model of an arm; what is not given is assumed.

        Raises:
            InputError: no fixture; waves of an arm with rows that follow joints: these have no encoders.
        """
        if not isinstance(fixture, TouchFixture):
            raise InputError("fixture", fixture, "a TouchFixture")
        tolerances = TableTolerances.of(robot) if tolerances is None else tolerances
        if tolerances.wave > 0.0 and robot.coupled:
            raise InputError("wave", tolerances.wave, "0 for an arm with rows that follow joints")
        noise = TouchNoise.of(robot) if noise is None else noise
        noise.joints(robot)
        chain = Chain(robot, tolerances.wave > 0.0, tolerances.scale > 0.0)
        sigma = [getattr(tolerances, each.kind) / math.sqrt(3.0) for each in chain.parameters]
        if tolerances.keep_family:
            kept = [
                each.kind == "twist" or (each.kind in ("length", "tip") and abs(each.nominal) < 1e-9)
                for each in chain.parameters
            ]
            sigma = np.where(kept, 0.0, sigma).tolist()
        return cls(chain, fixture, np.array(sigma), noise, cancel=cancel)

    @property
    def robot(self) -> Robot:
        """The arm with its nominal table."""
        return self.chain.robot

    @property
    def count(self) -> int:
        """Number of parameters of the arm."""
        return len(self.sigma)

    @property
    def readable(self) -> tuple[Array, Array]:
        """The least and the largest readings ``(n,)`` that make sense: a zero may be off beyond a limit."""
        robot = self.robot
        first = [self.chain.first[i] + (not t) for i, t in zip(robot.joint_rows, robot.revolute, strict=True)]
        slack = 3.0 * self.sigma[first] + 4.0 * self.noise.joints(robot)
        return robot.lower - slack, robot.upper + slack

    @property
    def of_table(self) -> Mask:
        """Which parameters are errors of the table: not the tool point, which nobody knows well ``(p,)``."""
        return np.asarray(self.chain.kinds != "tip")

    @property
    def prior(self) -> Array:
        """Standard deviations of all unknowns, those of the fixture last."""
        return np.concatenate([self.sigma, self.fixture.sigma()])

    def wider(self, noise: float, tolerance: float) -> Model:
        """The model with a larger noise, and a table with larger errors."""
        sigma = np.where(self.of_table, self.sigma * tolerance, self.sigma)
        return replace(self, sigma=sigma, louder=self.louder * noise)

    def whitening(self, by_joint: Array, A: Array, at: Whole) -> Array:
        """W ``(k, 3, 3)`` with W S Wᵀ = 1, where S is the covariance of each touch's miss."""
        through = A @ by_joint * (self.louder * self.noise.joints(self.robot))
        contact = self.fixture.contacts(at, self.louder * self.noise.contact)
        S = through @ through.transpose(0, 2, 1) + (contact**2)[:, None, None] * A @ A.transpose(0, 2, 1)
        flat = at < 0  # a plane gives one equation
        S[flat, 1, 1] = S[flat, 2, 2] = 1.0
        return np.asarray(np.linalg.inv(np.linalg.cholesky(S)))


def tip_modes(chain: Chain, q: Array) -> Array:
    """How parameters move the tip at configurations ``(3k, p)``, less what a motion of the base does as well."""
    found = chain.derivatives(q, np.zeros(len(chain.parameters)))
    L = found.by_parameter.reshape(3 * len(q), -1)
    turns = np.cross(np.eye(3)[None], found.points[:, None, :])
    shifts = np.broadcast_to(np.eye(3), (len(q), 3, 3))
    B = np.concatenate([shifts, turns.transpose(0, 2, 1)], axis=2).reshape(-1, 6)
    Q, _ = np.linalg.qr(B)
    return np.asarray(L - Q @ (Q.T @ L))
