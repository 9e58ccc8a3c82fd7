"""A simulated arm follows the arm of a page: MuJoCo moves it with a servo at each joint, gravity and a payload.

    pip install -e '.[mujoco]'
    python examples/mujoco_arm.py K7QF-2M4A --payload 2 --plot tracking.svg

What is dragged in the page, or played in its tab *Program*, is commanded; the ghost is where the simulated arm is.
"""

from __future__ import annotations

import sys
import threading
import time
from argparse import Namespace
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Final

import connecting
import numpy as np
from connecting import forced
from numpy.typing import NDArray
from recording import Recording, saved

import kin

try:
    import mujoco
except ImportError:
    raise SystemExit("mujoco_arm.py needs MuJoCo: pip install -e '.[mujoco]' in the folder of Kinboard") from None

NAME: Final = "mujoco_arm.py"
STEP: Final = 0.002  # s of a step of the simulation
CYCLE: Final = 0.01  # s between two looks at the page
LATEST: Final = 0.1  # s that are caught up at most; a machine that was busy for longer leaves time out
SETTLING: Final = 1.0  # s for which a program is still measured after its end
FULL: Final = 0.05, 0.01  # rad, m: at this error a servo gives all its torque (force)
FASTEST: Final = 60.0  # rad/s: natural frequency of a servo that moves its own rotor only
POSES: Final = 200  # random configurations, for the torques of an arm that has no stated ones
PUSH: Final = 10.0  # rad/s² (m/s²) that invented torques can give beside twice the weight
LEAST: Final = 0.05  # of the largest invented torque, which the smallest one has
STEEL: Final = 7850.0  # kg/m³ of the payload, a ball
HASTE: Final = 1.2  # times a joint's largest speed, at which it catches up with a command that has jumped
BEHIND: Final = 0.02  # rad (m) that the servos' own command may be behind the page's
MOVED: Final = 1e-4  # rad (m): an arm that moves less is at rest, and the page hears nothing
DRAWING: Final = 0.25  # s between two drawings in the page
TRAIL, THINNED = 600, 8  # cycles of which the tool's way is drawn, and every how many of them
COMMANDED, MEASURED, HEAVY = "#1971c2", "#e8590c", "#c92a2a"

Array = NDArray[np.float64]


class Simulation:
    """MuJoCo's model of an arm, at rest at its home configuration.

    Args:
        robot: the arm; `kin.robot_to_mjcf` gives it bodies and invented masses.
        payload: kg at the tool point, a ball of steel.
        mass: kg of the whole arm, if it is known; its links keep their shares.

    Attributes:
        effort: largest torques (forces) of the servos ``(n,)``.
        invented: names of the joints whose largest torque is invented, as no robot file states it.
        mass: kg of the arm without its payload.

    Raises:
        InputError: an arm that MuJoCo does not take.
    """

    def __init__(self, robot: kin.Robot, payload: float = 0.0, mass: float | None = None) -> None:
        self.robot = robot
        spec = mujoco.MjSpec.from_string(kin.robot_to_mjcf(robot))
        spec.option.timestep = STEP
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        own = float(spec.compile().body_mass.sum())
        self.mass = mass or own
        for body in spec.bodies:
            body.mass *= self.mass / own
            body.inertia *= self.mass / own
        for geom in spec.geoms:
            geom.density *= self.mass / own
        stated = kin.motion.motion_limits(robot).effort
        self.effort = np.where(np.isnan(stated), _invented(spec.compile(), robot), stated)
        self.invented = [robot.joints[i].name for i in np.flatnonzero(np.isnan(stated))]
        self._speed = kin.motion.motion_limits(robot).velocity
        for i, joint in enumerate(spec.joints):
            stiffness = self.effort[i] / FULL[0 if robot.revolute[i] else 1]
            joint.armature = stiffness / FASTEST**2
            servo = spec.add_actuator(name=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint.name)
            servo.set_to_position(kp=stiffness, dampratio=1.0)
            servo.forcelimited = True
            servo.forcerange = [-self.effort[i], self.effort[i]]
        self.radius = (3.0 * payload / (4.0 * np.pi * STEEL)) ** (1.0 / 3.0)
        if payload:
            tool = spec.site("tool")
            ball = tool.parent.add_body(pos=tool.pos)
            ball.add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[self.radius] * 3, mass=payload, contype=0, conaffinity=0
            )
        self._model = spec.compile()
        self._data, self._still = mujoco.MjData(self._model), mujoco.MjData(self._model)
        self._left = 0.0  # s that are not simulated yet
        self.start(robot.q_home)

    def start(self, q: Array) -> None:
        """Put the arm at a configuration ``(n,)``, at rest."""
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:] = q
        self._asked = np.array(q, dtype=float)
        self._data.ctrl[:] = q
        mujoco.mj_forward(self._model, self._data)

    def advance(self, q: Array, seconds: float) -> None:
        """Simulate a time, in which the servos are asked for ``q``: little faster than the joints may turn.

        Raises:
            KinematicsError: MuJoCo lost the arm: its values grew without bound.
        """
        self._left += seconds
        reach = HASTE * self._speed * STEP
        while self._left >= STEP:
            self._left -= STEP
            self._asked += np.clip(q - self._asked, -reach, reach)
            self._data.ctrl[:] = self._asked
            mujoco.mj_step(self._model, self._data)
        if self._data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
            raise kin.KinematicsError("the simulation has become unstable: a payload or a mass beyond its servos")

    def approaches(self, q: Array) -> bool:
        """Whether the servos are still being led to ``q``, after a jump."""
        return bool((np.abs(q - self._asked) > BEHIND).any())

    @property
    def q(self) -> Array:
        """Where the arm is ``(n,)``, radians (metres)."""
        return np.array(self._data.qpos)

    @property
    def torque(self) -> Array:
        """What the servos give now ``(n,)``, N·m (N)."""
        return np.array(self._data.actuator_force)

    @property
    def tool(self) -> Array:
        """The place of the tool ``(3,)``, m."""
        return np.array(self._data.site("tool").xpos)

    def place(self, joint: int) -> Array:
        """A point on the axis of a joint ``(3,)``, m."""
        return np.array(self._data.xanchor[joint])

    def needed(self, q: Array) -> Array:
        """The torques (forces) that hold the arm and its payload at rest at ``q``, each ``(n,)``."""
        return _weight(self._model, self._still, q)

    def facts(self, payload: float, known: bool) -> str:
        """What is simulated and what of it is invented, in words."""
        kilograms = (
            f"{self.mass:.3g} kg as given, spread over the links as their capsules are"
            if known
            else f"{self.mass:.3g} kg, invented: 1000 kg/m³ in each capsule of the arm (--mass sets the real one)"
        )
        efforts = ", ".join(forced(self.robot, i, float(x)) for i, x in enumerate(self.effort))
        of = "" if not self.invented else f"; invented for {', '.join(self.invented)}"
        return f"The arm has {kilograms}. Largest torques: {efforts}{of}. Payload: {payload:g} kg at the tool."

    def overloaded(self, q: Array) -> list[tuple[int, str]]:
        """Joints that cannot hold the arm at ``q``, each with a sentence."""
        needed = self.needed(q)
        return [
            (
                i,
                f"{self.robot.joints[i].name} needs {forced(self.robot, i, needed[i])} to hold this, and has "
                f"{forced(self.robot, i, self.effort[i])}",
            )
            for i in np.flatnonzero(np.abs(needed) > self.effort).tolist()
        ]


def _weight(model: Any, data: Any, q: Array) -> Array:
    data.qpos[:] = q
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    return np.array(data.qfrc_bias)


def _invented(model: Any, robot: kin.Robot) -> Array:
    """Torques (forces) ``(n,)`` with which an arm of these masses holds and moves itself, to two digits."""
    data, unit, row = mujoco.MjData(model), np.eye(robot.n), np.zeros(robot.n)
    weight, inertia = np.zeros(robot.n), np.zeros(robot.n)
    for q in robot.random_q(np.random.default_rng(0), POSES):
        weight = np.maximum(weight, np.abs(_weight(model, data, q)))
        for i in range(robot.n):
            mujoco.mj_mulM(model, data, row, unit[i])
            inertia[i] = max(inertia[i], row[i])
    found = 2.0 * weight + PUSH * inertia
    return np.array([float(f"{x:.2g}") for x in np.maximum(found, LEAST * found.max())])


class Display(threading.Thread):
    """Draws in the page, which takes its time to answer: the ways of both tools, the payload, the load.

    Attributes:
        state: what is drawn next: the simulation, the commanded configuration, both tools' points.
    """

    def __init__(self, page: Any, payload: float) -> None:
        super().__init__(daemon=True)
        self._page, self._payload = page, payload
        self._drawn: dict[str, tuple[bytes, str]] = {}
        self._over = threading.Event()
        self.state: tuple[Simulation, Array, list[Array], list[Array]] | None = None

    def run(self) -> None:
        """Draw until the end."""
        while not self._over.wait(DRAWING):
            if self.state is None or not self._page.connected:
                continue
            try:
                self._draw(*self.state)
            except kin.KinematicsError as error:
                if self._page.connected:
                    print(f"The page has not drawn this: {error}", file=sys.stderr)

    def _draw(self, arm: Simulation, q: Array, commanded: list[Array], measured: list[Array]) -> None:
        draw, ends = self._page.draw, np.round(measured, 3)
        ways = ("commanded tool", np.round(commanded, 3), COMMANDED), ("simulated tool", ends, MEASURED)
        for name, points, color in ways:
            self._once(name, points, lambda: draw.line(name, points, color=color))  # noqa: B023 - called at once
        if self._payload:
            size = 2.0 * arm.radius
            self._once("payload", ends[-1], lambda: draw.points("payload", ends[-1:], size=size, color=HEAVY))
        heavy = arm.overloaded(q)
        joint = heavy[0][0] if heavy else int(np.argmax(np.abs(arm.torque) / arm.effort))
        load, most = (forced(arm.robot, joint, float(x[joint])) for x in (arm.torque, arm.effort))
        words = f"Too heavy: {heavy[0][1]}" if heavy else f"{arm.robot.joints[joint].name}: {load} of {most}"
        place = np.round(arm.place(joint), 3)
        self._once("load", place, lambda: draw.label("load", place, words), words)

    def _once(self, name: str, points: Array, draw: Callable[[], None], words: str = "") -> None:
        """Draw what has changed."""
        if self._drawn.get(name) != (points.tobytes(), words):
            draw()
            self._drawn[name] = points.tobytes(), words

    def end(self) -> None:
        """Stop drawing."""
        self._over.set()
        self.join(2.0)


def work(page: Any, options: Namespace) -> None:
    """Simulate the arm of the page until its connection ends."""
    display = Display(page, options.payload)
    display.start()
    try:
        simulate(page, options, display)
    finally:
        display.end()


def simulate(page: Any, options: Namespace, display: Display) -> None:
    """The loop: what the page commands goes to the servos, where the arm is goes to the page."""
    arm: Simulation | None = None
    sent: Array | None = None
    programs = Programs(options)
    ways: tuple[deque[Array], deque[Array]] = (deque(maxlen=TRAIL), deque(maxlen=TRAIL))
    heavy = ""
    began = before = time.monotonic()
    try:
        while options.seconds is None or before - began < options.seconds:
            time.sleep(max(0.0, before + CYCLE - time.monotonic()))
            now = time.monotonic()
            elapsed, before = min(now - before, LATEST), now
            robot, q = page.robot, page.q
            if arm is None or arm.robot != robot:
                programs.end()
                arm, sent = Simulation(robot, options.payload, options.mass), None
                print(arm.facts(options.payload, options.mass is not None), flush=True)
                if len(q) == robot.n:
                    arm.start(q)
            if len(q) != robot.n:
                continue  # that of another arm, which the page has just left
            arm.advance(q, elapsed)
            if sent is None or np.abs(arm.q - sent).max() > MOVED:
                try:
                    page.measured = sent = arm.q
                except kin.InputError:
                    if page.robot == robot:
                        raise
                    continue  # the page has just changed to another arm
            programs.add(now, bool(page.program.get("playing")), arm, q)
            ways[0].append(kin.fk(robot, q)[:3, 3])
            ways[1].append(arm.tool)
            display.state = (
                arm,
                q,
                [*list(ways[0])[::THINNED], ways[0][-1]],
                [*list(ways[1])[::THINNED], ways[1][-1]],
            )
            heavy = say_load(arm, q, heavy)
    finally:
        programs.end()


def say_load(arm: Simulation, q: Array, before: str) -> str:
    """Print when the load becomes too heavy and when it no longer is; returns what is too heavy now."""
    heavy = "; ".join(words for _, words in arm.overloaded(q))
    if heavy and not before:
        print(f"Too heavy: {heavy}.", flush=True)
    elif before and not heavy:
        print("The servos can hold this again.", flush=True)
    return heavy


class Programs:
    """Measures each program that the page plays, until the arm has settled.

    A page jumps to the beginning of a program; what is measured begins when the arm has followed there.
    """

    def __init__(self, options: Namespace) -> None:
        self._options = options
        self._recording: Recording | None = None
        self._number, self._until, self._begun = 0, 0.0, False

    def add(self, now: float, playing: bool, arm: Simulation, q: Array) -> None:
        """Add a sample, if a program is measured."""
        if playing:
            self._until = now + SETTLING
            if self._recording is None:
                self._number += 1
                self._recording = Recording(arm.robot, arm.effort)
                self._begun = False
        if self._recording is not None:
            self._begun = self._begun or not arm.approaches(q)
            if self._begun:
                self._recording.add(now, q, arm.q, arm.torque)
            if now > self._until:
                self.end()

    def end(self) -> None:
        """Say how well the program was followed, and save what is asked for."""
        recording, self._recording = self._recording, None
        if recording is None:
            return
        if not len(recording):
            print(f"Program {self._number} was over before the arm had come to its first waypoint.", flush=True)
            return
        print(f"Program {self._number}: {recording.summary()}", flush=True)
        if files := saved(recording, (self._options.plot, self._options.csv)):
            print(f"Saved: {', '.join(files)}", flush=True)


def main(words: Sequence[str] | None = None) -> int:
    """Run the program; returns its exit code."""
    parser = connecting.parser(
        "Simulate the arm of a page in MuJoCo, with position servos, gravity and a payload."
    )
    parser.add_argument(
        "--payload", type=connecting.at_least_zero, default=0.0, help="kg at the tool point (default: 0)"
    )
    parser.add_argument(
        "--mass", type=connecting.positive, help="kg of the whole arm, in place of an invented one"
    )
    parser.add_argument("--plot", metavar="FILE.svg", help="errors and torques of the last program, as a plot")
    parser.add_argument("--csv", metavar="FILE.csv", help="all values of the last program, as a table")
    return connecting.main(parser, work, NAME, words)


if __name__ == "__main__":
    sys.exit(main())
