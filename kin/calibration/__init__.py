"""The table of an arm as it is, from touches: an arm's own zeros, lengths and twists without a measuring device.

An arm touches one fixed point, several sockets of one board, or a plane, from many postures. From the joint
readings alone its table is estimated. `touch_postures` says in which postures to touch, `calibrate` what the
touches have shown. Both say how far the tip is expected to be off; that was
measured on simulated arms only (``docs/calibrate.md``).

>>> import kin, numpy as np
>>> arm, fixture = kin.get_robot("puma560"), kin.calibration.TouchFixture([kin.calibration.TouchBoard.bar(0.15)])
>>> plan = kin.calibration.touch_postures(arm, fixture, count=12)
>>> found = kin.calibration.calibrate(arm, plan.q, plan.sockets, fixture)
>>> found.faults, found.expected.after < 0.1 * found.expected.before
((), True)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from kin.calibration.chain import Mask, Parameter
from kin.calibration.faults import Checked, Fault, checked
from kin.calibration.fit import Fit, Touches, freedom_of, solve, spread
from kin.calibration.fixtures import PLANE, TouchBoard, TouchFixture
from kin.calibration.model import Model, TableTolerances, TouchNoise, fewest, suited, tip_modes
from kin.calibration.postures import (
    Pieces,
    Scene,
    candidates,
    choose,
    in_order,
    proposed_poses,
    workspace_poses,
)
from kin.calibration.results import Calibration, ExpectedError, TableError, TouchFault, TouchPlan
from kin.calibration.words import error_text, expected_text, fault_text, millimetres, outcome
from kin.errors import InputError, finite_number, whole_number
from kin.ik.problem import never_cancel
from kin.motor import Motor
from kin.named import robot_of
from kin.robot import NominalTable, Robot
from kin.transforms import Array, as_transform, finite_array

__all__ = [
    "Calibration",
    "ExpectedError",
    "TableError",
    "TableTolerances",
    "TouchBoard",
    "TouchFault",
    "TouchFixture",
    "TouchNoise",
    "TouchPlan",
    "calibrate",
    "touch_postures",
]

MOST_TOUCHES = 1000
_INTERVAL = 1.96  # standard deviations of a Gaussian, for 95 %
_POSES = 200  # of the workspace, for the expected error of the tip
_ONE_POSTURE = math.radians(5.0)
_POOR, _FLOOR = 0.35, 1.5  # shares of the error before, and of that of readings: above both, another fixture helps
_CLEARLY_BETTER = 0.75


def calibrate(
    robot: Robot | str,
    q: ArrayLike,
    sockets: ArrayLike,
    fixture: TouchFixture,
    *,
    tolerances: TableTolerances | None = None,
    noise: TouchNoise | None = None,
    cancel: Callable[[], None] = never_cancel,
) -> Calibration:
    """The table of an arm as it is, from what its joints read in touches.

    Args:
        robot: the arm with its nominal table, or the id of a built-in one. Its tool point is what touches.
        q: ``(k, n)`` what the joints read, radians (metres), more touches than joints.
        sockets: ``(k,)`` what was touched: the number of a socket of the fixture from 0, or −1 for its plane.
        fixture: what is touched.
        tolerances: largest errors that are expected; by default those of `kin.calibration.TableTolerances.of`.
        noise: of readings and contacts; by default that of `kin.calibration.TouchNoise.of`.
        cancel: called now and then; raises to cancel the computation.

    Returns:
        The arm with its own table, how well it is known, and which touches contradict the others.

    Raises:
        InputError: arrays of another shape, values outside the limits, a socket that the fixture does not have,
            too few touches, or all in one posture. Contradictions are no error.

    Examples:
        >>> import kin
        >>> arm, fixture = kin.get_robot("ur5e"), kin.calibration.TouchFixture([kin.calibration.TouchBoard.pin()])
        >>> plan = kin.calibration.touch_postures(arm, fixture, count=10)
        >>> kin.calibration.calibrate(arm, plan.q, plan.sockets, fixture).noise
        1.0
    """
    robot = robot_of(robot)
    model = Model.of(robot, fixture, tolerances, noise, cancel)
    touches = _checked_touches(model, q, sockets)
    found = checked(model, touches)
    result = _result(model, found)
    advice = _advice(model, result.expected, len(found.kept)) if found.fit.noise < 2.0 else ""
    result = replace(result, advice=advice)
    return replace(result, text=outcome(result, len(touches)))


def touch_postures(
    robot: Robot | str,
    fixture: TouchFixture,
    count: int = 20,
    *,
    places: Sequence[ArrayLike] | None = None,
    table: float | None = None,
    done: tuple[ArrayLike, ArrayLike] | None = None,
    tolerances: TableTolerances | None = None,
    noise: TouchNoise | None = None,
    seed: int = 0,
    cancel: Callable[[], None] = never_cancel,
) -> TouchPlan:
    """The postures in which touches say most about the tip elsewhere, and what they are expected to bring.

    Args:
        robot: the arm with its nominal table, or the id of a built-in one. The z axis of its tool points into a
            socket, within the cone of the board.
        fixture: what is touched.
        count: how many touches.
        places: roughly where the boards lie, a pose ``(4, 4)`` of each in the world frame with z out of the
            sockets. By default where many postures touch, in front of the arm.
        table: height of the table in the world frame, metres; by default the arm's floor, or that of its base.
        done: ``(q, sockets)`` of touches made already, q in radians (metres); `count` further ones are proposed.
        tolerances, noise: as in `kin.calibration.calibrate`.
        seed: of the random candidates.
        cancel: called now and then; raises to cancel the computation.

    Returns:
        Configurations free of collisions with the arm itself and the table.

    Raises:
        InputError: not one place for each board, a socket out of reach, or touches that `calibrate` refuses.

    Examples:
        >>> import kin
        >>> bar = kin.calibration.TouchFixture([kin.calibration.TouchBoard.bar(0.15)])
        >>> plan = kin.calibration.touch_postures("ur5e", bar, count=12)
        >>> plan.q.shape, plan.expected.after < 0.2 * plan.expected.before
        ((12, 6), True)
    """
    robot = robot_of(robot)
    count = whole_number("count", count, 1, MOST_TOUCHES)
    model = Model.of(robot, fixture, tolerances, noise, cancel)
    height = _table_of(robot) if table is None else finite_number("table", table)
    poses = _poses(robot, fixture, places, height)
    scene = Scene(robot, fixture, height, poses)
    offered = candidates(scene, whole_number("seed", seed, 0, 2**31), cancel)
    _check_offered(scene, offered, places)
    before = _made(model, done)
    whole = Touches(np.vstack([before.q, offered.q]), np.concatenate([before.at, offered.at]))
    test = workspace_poses(robot, _POSES, height)
    parts = Pieces.of(model, whole, poses, test)
    chosen = choose(parts, whole.at, min(count, len(offered)), tuple(range(len(before))), cancel)
    expected = _predicted(model, parts, chosen, test)
    new = np.array(chosen[len(before) :])
    new = new[in_order(robot, whole.q[new])]
    advice = _advice(model, expected, len(chosen))
    text = " ".join(filter(None, [expected_text(expected, len(chosen)), advice]))
    return TouchPlan(whole.q[new], whole.at[new], poses, height, expected, advice, text)


def _made(model: Model, done: tuple[ArrayLike, ArrayLike] | None) -> Touches:
    """The touches that were made already."""
    if done is None:
        return Touches(np.empty((0, model.robot.n)), np.empty(0, np.int64))
    return _readings(model, done[0], done[1], ("done[0]", "done[1]"))


def _table_of(robot: Robot) -> float:
    """The height of the table where none is given."""
    return float(robot.T_world_base[2, 3]) if robot.floor is None else robot.floor


def _poses(robot: Robot, fixture: TouchFixture, places: Sequence[ArrayLike] | None, table: float) -> Array:
    """Where the boards are to lie ``(b, 4, 4)``."""
    given = fixture.at_base if places is None else places
    if given is None:
        return proposed_poses(robot, fixture, table)
    poses = [as_transform(T, f"places[{i}]") for i, T in enumerate(given)]
    if len(poses) != len(fixture.boards):
        raise InputError("places", f"{len(poses)} poses", f"one for each of {len(fixture.boards)} boards")
    return np.array(poses)


def _check_offered(scene: Scene, offered: Touches, places: Sequence[ArrayLike] | None) -> None:
    """Whether the arm can touch every socket; `places` are those that were given."""
    field = "table" if places is None and scene.fixture.at_base is None else "places"
    wanted = [*range(len(scene.sockets)), *([PLANE] if scene.fixture.plane else [])]
    for j in wanted:
        if not (offered.at == j).any():
            what = "the plane" if j == PLANE else f"socket {j} at {np.round(scene.sockets[j], 3).tolist()} m"
            expected = (
                f"places, and a height of the table (here {scene.table:.4g} m), at which the arm can touch it "
                "without collisions, tool z axis down"
            )
            raise InputError(field, what, expected)


def _predicted(model: Model, parts: Pieces, chosen: list[int], test: Array) -> ExpectedError:
    """What these touches are expected to bring, if noise and tolerances are as stated."""
    values, vectors = np.linalg.eigh(parts.covariance(chosen))
    root = parts.L @ (vectors * np.sqrt(np.maximum(values, 0.0))) * math.sqrt(len(test))
    after, bound = spread(root, freedom_of(model, len(chosen)), len(test))
    before = float(np.sqrt((parts.L**2).sum()))
    return ExpectedError(before, after, bound, _of_readings(model, test))


def _of_readings(model: Model, test: Array) -> float:
    """How far the noise of readings moves the tip, metres."""
    J = model.chain.derivatives(test, np.zeros(model.count)).by_joint * model.noise.joints(model.robot)
    return float(np.sqrt((J**2).sum() / len(test)))


def _checked_touches(model: Model, q: ArrayLike, sockets: ArrayLike) -> Touches:
    """The touches, if they are enough for a fit.

    Raises:
        InputError: naming the touch, the value and what is valid.
    """
    touches, n = _readings(model, q, sockets, ("q", "sockets")), model.robot.n
    if len(touches) < fewest(model.robot):
        why = f"each gives three numbers, and about {4 * n - 3} numbers of the table can be seen"
        raise InputError("q", len(touches), f"{fewest(model.robot)} to {MOST_TOUCHES} touches: {why}")
    if float(np.ptp(touches.q, axis=0).max()) < _ONE_POSTURE:
        raise InputError("q", "all in one posture", "postures that differ by 5° in some joint or more")
    return touches


def _readings(model: Model, q: ArrayLike, sockets: ArrayLike, names: tuple[str, str]) -> Touches:
    """Touches, if each makes sense: within the limits of the joints, and of a socket of the fixture.

    Raises:
        InputError: naming the touch by the names of the two arguments, the value and what is valid.
    """
    robot = model.robot
    values = finite_array(names[0], q, (None, robot.n))
    if values.ndim != 2 or len(values) > MOST_TOUCHES:
        raise InputError(names[0], f"shape {values.shape}", f"at most {MOST_TOUCHES} touches: (k, {robot.n})")
    at = model.fixture.check_sockets(sockets, len(values), names[1])
    turning, (least, most) = robot.revolute, model.readable
    outside = (values < least) | (values > most)
    if outside.any():
        k, i = map(int, np.argwhere(outside)[0])
        low, high = float(robot.lower[i]), float(robot.upper[i])
        expected = f"{robot.joints[i].name} within its limits, {low:.4g} to {high:.4g}"
        if turning[i] and (np.abs(values[:, turning]) > 2.0 * math.pi).any():
            expected += "; are these degrees? Joint values are radians"
        raise InputError(f"{names[0]}[{k}][{i}]", float(values[k, i]), expected)
    return Touches(values, at)


def _in_motors(robot: Robot) -> Mask:
    """The joints ``(n,)`` whose zeros go into the offsets of their motors."""
    moved = {motor.joint for motor in robot.motors}
    return np.array([joint.name in moved for joint in robot.joints]) & robot.revolute & ~robot.leads


def _result(model: Model, found: Checked) -> Calibration:
    """What was found, without its words."""
    robot, fit = model.robot, found.fit
    in_motors = _in_motors(robot)
    zeros = np.where(in_motors, model.chain.zeros(fit.delta), 0.0)
    made = model.chain.robot_with(fit.delta, in_motors)
    nominal = robot.nominal or NominalTable(robot.rows, robot.tool)
    faults = tuple(_fault(robot, each, found, in_motors) for each in found.faults)
    made = replace(made, motors=_mended(robot, zeros, faults), nominal=nominal)
    test = workspace_poses(robot, _POSES, robot.floor)
    all_misses = fit.places.misses(model.chain.points(found.touches.q, fit.delta), found.touches.at)
    T = np.tile(np.eye(4), (len(model.fixture.boards), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = fit.places.R, fit.places.t
    waves = np.zeros((robot.n, 2))
    if model.chain.waves:
        waves = np.stack(
            [model.chain.wave(np.full(robot.n, angle), fit.delta) for angle in (0.5 * math.pi, 0.0)], axis=1
        )
    untouched = solve(replace(model, sigma=np.zeros(model.count)), fit.touches)
    return Calibration(
        robot=made,
        nominal=robot,
        expected=expected_error(model, fit, test),
        errors=_errors(model, fit, in_motors),
        faults=faults,
        unseen=_unseen(model),
        kept=found.kept,
        misses=np.linalg.norm(all_misses, axis=1),
        held_out=(_root_mean(untouched), _root_mean(fit)),
        noise=fit.noise,
        wider=fit.wider,
        places=T,
        zeros=zeros,
        waves=waves,
    )


def _mended(robot: Robot, zeros: Array, faults: Sequence[TouchFault]) -> tuple[Motor, ...]:
    """The motors whose readings mean the true joint values: with signs, and joints, that all touches have shown to
    be others, and with these zeros ``(n,)`` in their offsets: a joint value grows by its zero."""
    of = dict(zip((joint.name for joint in robot.joints), zeros.tolist(), strict=True))
    joints, backwards = {name: name for name in of}, set[str]()
    for fault in faults:
        if fault.in_motors and fault.cause == "swap":
            joints |= dict(zip(fault.joints, fault.joints[::-1], strict=True))
        elif fault.in_motors:  # a sign
            backwards |= {*fault.joints}
    found = []
    for motor in robot.motors:
        joint = joints.get(motor.joint, motor.joint)
        sign = -motor.sign if joint in backwards else motor.sign
        offset = motor.offset - sign * motor.scale * of.get(joint, 0.0)
        if motor.unit == "ticks" and motor.begins_again:
            offset %= motor.ticks
        found.append(replace(motor, joint=joint, sign=sign, offset=offset))
    return tuple(found)


def _root_mean(fit: Fit) -> float:
    """Root mean square distance by which touches would miss if the fit had not used them, metres.

    A touch that is alone on its board says nothing of itself.
    """
    board = np.where(fit.touches.at == PLANE, PLANE, fit.model.fixture.owner[np.maximum(fit.touches.at, 0)])
    together = np.array([(board == each).sum() > (3 if each == PLANE else 1) for each in board.tolist()])
    return float(np.sqrt(np.mean(fit.held_out[together] ** 2))) if together.any() else math.nan


def expected_error(model: Model, fit: Fit, test: Array) -> ExpectedError:
    """Expected error of the tip over configurations ``(t, n)`` of the workspace, with a fit."""
    L = tip_modes(model.chain, test)
    values, vectors = np.linalg.eigh(fit.covariance)
    after, bound = spread(L @ (vectors * np.sqrt(np.maximum(values, 0.0))), fit.freedom, len(test))
    sigma = np.where(model.of_table, fit.wider * model.sigma, model.sigma)  # as the touches show them
    before = float(np.sqrt(((L * sigma) ** 2).sum() / len(test)))
    return ExpectedError(before, after, bound, fit.noise * _of_readings(model, test))


def _errors(model: Model, fit: Fit, in_motors: Mask) -> tuple[TableError, ...]:
    """The errors of the table with their intervals, and whether they were seen."""
    moved = {joint.name for joint, inside in zip(model.robot.joints, in_motors, strict=True) if inside}
    free = np.flatnonzero(model.sigma > 0.0)
    alone = np.zeros(model.count)
    alone[free] = np.sqrt(1.0 / np.diag(np.linalg.inv(fit.covariance[np.ix_(free, free)])))
    found = []
    for i in free.tolist():
        each: Parameter = model.chain.parameters[i]
        seen = bool(fit.seen[i])
        alike = alone[i] < 0.5 * fit.model.sigma[i]
        made = TableError(
            each.row, each.field, each.kind, float(fit.delta[i]), _INTERVAL * float(fit.sd[i]), seen,
            "" if seen else "alike" if alike else "hidden",
            each.kind == "zero" and each.row in moved,
        )  # fmt: skip
        found.append(replace(made, text=error_text(made)))
    return tuple(found)


def _fault(robot: Robot, fault: Fault, found: Checked, in_motors: Mask) -> TouchFault:
    names = tuple(robot.joints[i].name for i in fault.joints)
    mended = fault.touch is None and fault.cause in ("sign", "swap") and bool(in_motors[list(fault.joints)].all())
    made = TouchFault(fault.touch, fault.cause, names, fault.value, fault.socket, mended)
    socket = 0 if fault.touch is None else int(found.touches.at[fault.touch])
    return replace(made, text=fault_text(made, socket))


def _unseen(model: Model) -> tuple[str, ...]:
    """What no touch of this fixture shows."""
    found = []
    if model.fixture.at_base is None:
        found.append("Not seen: where the base stands, because nothing says where the fixture lies.")
    found.append("Not seen: the orientation of the tool, because only its point touches.")
    if not any(len(board.sockets) > 1 for board in model.fixture.boards):
        found.append("Not seen: the scale of all lengths, because no distance is known.")
    return tuple(found)


def _advice(model: Model, expected: ExpectedError, count: int) -> str:
    """The fixture that would show more, if this one does not show what matters; "" if it does, or none would."""
    if (
        expected.after < max(_POOR * expected.before, _FLOOR * expected.readings)
        or model.fixture.at_base is not None
    ):
        return ""
    robot = model.robot
    length, sheet = suited(robot)
    bar = TouchBoard.bar(length)
    others = {
        f"a bar of two sockets at three places, one of them raised ({millimetres(2 * bar.spread)})": TouchFixture(
            [bar] * 3
        ),
        f"a printed sheet ({sheet})": TouchFixture([TouchBoard.sheet(sheet)]),
    }
    test = workspace_poses(robot, _POSES, robot.floor)
    height, best, least = _table_of(robot), "", _CLEARLY_BETTER * expected.after
    for name, fixture in others.items():
        if _same(fixture, model.fixture):
            continue
        other = replace(model, fixture=fixture)
        scene = Scene(robot, fixture, height, proposed_poses(robot, fixture, height))
        offered = candidates(scene, cancel=model.cancel)
        if len(np.unique(offered.at)) < len(scene.sockets):  # it cannot touch all of this one
            continue
        parts = Pieces.of(other, offered, scene.poses, test)
        chosen = choose(parts, offered.at, max(count, 1), cancel=model.cancel)
        after = _predicted(other, parts, chosen, test).after
        if after < least:
            best, least = name, after
    if not best:
        return ""
    return (
        f"This fixture does not show what matters for {robot.n} joints: {best}, touched as often, would bring "
        f"{millimetres(least)}."
    )


def _same(a: TouchFixture, b: TouchFixture) -> bool:
    """Whether two fixtures show the same."""
    return a.plane == b.plane and np.array_equal(a.local, b.local) and np.array_equal(a.owner, b.owner)
