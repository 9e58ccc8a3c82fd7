"""An arm of ROS 2 beside the arm of a page, through rosbridge: `/joint_states` in, `JointTrajectory` out.

    pip install -e '.[ros2]'
    ros2 launch rosbridge_server rosbridge_websocket_launch.xml
    python examples/ros2_arm.py K7QF-2M4A --joints shoulder_pan_joint,shoulder_lift_joint,elbow_joint,…

The ghost of the page is where the arm says it is. With `--drive` it follows the page.
"""

from __future__ import annotations

import logging
import math
import sys
import threading
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from typing import Any, Final
from urllib.parse import urlsplit

import connecting
import numpy as np
from numpy.typing import NDArray

import kin
from kin.notebook import driving

try:
    import roslibpy
except ImportError:
    raise SystemExit("ros2_arm.py needs roslibpy: pip install -e '.[ros2]' in the folder of Kinboard") from None

NAME: Final = "ros2_arm.py"
BRIDGE, STATES, TRAJECTORY = (
    "ws://localhost:9090",
    "/joint_states",
    "/joint_trajectory_controller/joint_trajectory",
)
CYCLE: Final = 0.05  # s between two trajectories
HORIZON: Final = 0.1  # s that a trajectory takes: an arm that hears no other stops there
OPENING: Final = 5.0  # s for the connection to rosbridge
WAITING: Final = 3.0  # s until silence, or missing joints, are reported

Array = NDArray[np.float64]


class Arm:
    """The arm of ROS behind a rosbridge.

    Args:
        address: of rosbridge, such as ``ws://localhost:9090``.
        states, trajectory: the topics.

    Raises:
        KinematicsError: nobody is there.
    """

    def __init__(self, address: str, states: str, trajectory: str) -> None:
        parts = urlsplit(address)
        if parts.scheme not in ("ws", "wss") or not parts.hostname:
            raise kin.KinematicsError(f"--rosbridge: got {address!r}, expected an address such as {BRIDGE}")
        self._lock = threading.Lock()
        self._places: dict[str, tuple[float, float]] = {}  # by joint: when, and where
        self._ros = roslibpy.Ros(parts.hostname, parts.port or 9090, parts.scheme == "wss", transport="asyncio")
        try:
            self._ros.run(OPENING)
        except roslibpy.core.RosTimeoutError:
            self.close()
            raise kin.KinematicsError(
                f"no rosbridge at {address}: is it running? "
                "ros2 launch rosbridge_server rosbridge_websocket_launch.xml"
            ) from None
        self._states = roslibpy.Topic(self._ros, states, "sensor_msgs/msg/JointState", queue_length=1)
        self._states.subscribe(self._take)
        self._trajectory = roslibpy.Topic(self._ros, trajectory, "trajectory_msgs/msg/JointTrajectory")

    @property
    def connected(self) -> bool:
        """Whether rosbridge is there."""
        return bool(self._ros.is_connected)

    def _take(self, message: dict[str, Any]) -> None:
        """Take a `JointState`; it may have some of the joints, and rosbridge writes null for NaN."""
        now = time.monotonic()
        with self._lock:
            for name, place in zip(message.get("name") or (), message.get("position") or (), strict=False):
                if isinstance(place, int | float) and math.isfinite(place):
                    self._places[str(name)] = now, float(place)

    @property
    def names(self) -> list[str]:
        """The joints that were heard of."""
        with self._lock:
            return sorted(self._places)

    def places(self, names: Sequence[str]) -> tuple[Array, float] | None:
        """Where these joints are ``(n,)``, and when the oldest of them was said; None: one was never heard of."""
        with self._lock:
            found = [self._places.get(name) for name in names]
        known = [each for each in found if each is not None]
        if len(known) < len(names):
            return None
        return np.array([place for _, place in known]), min(when for when, _ in known)

    def move(self, names: Sequence[str], q: Array) -> None:
        """Publish a trajectory of one point, which is reached after `HORIZON`."""
        duration = {"sec": 0, "nanosec": round(HORIZON * 1e9)}
        message = {
            "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},  # at once
            "joint_names": list(names),
            "points": [
                {
                    "positions": [float(x) for x in q],
                    "velocities": [],
                    "accelerations": [],
                    "effort": [],
                    "time_from_start": duration,
                }
            ],
        }
        if self.connected:  # roslibpy would keep it until it has come back
            self._trajectory.publish(roslibpy.Message(message))

    def close(self) -> None:
        """End the connection, and the attempts to have one."""
        self._ros.factory.set_max_retries(0)
        self._ros.close()


def joints_of(robot: kin.Robot, options: Namespace) -> list[str]:
    """The names in ROS of the joints of the page's arm; raises `kin.KinematicsError`."""
    names = [joint.name for joint in robot.joints] if options.joints is None else options.joints
    if len(names) != robot.n or len(set(names)) != robot.n:
        raise kin.KinematicsError(
            f"--joints: got {', '.join(names)}, expected {robot.n} different names, for the joints "
            f"{', '.join(joint.name for joint in robot.joints)} of {robot.name}"
        )
    return names


def add_options(parser: ArgumentParser) -> None:
    """Add the options of driving."""
    parser.add_argument(
        "--drive", action="store_true", help="move the arm as the page does; without it, it is only read"
    )
    parser.add_argument(
        "--speed",
        type=connecting.positive,
        default=driving.SLOW,
        help=f"with --drive: deg/s of a joint, at most (default: {driving.SLOW:g}); "
        f"joints that slide: {driving.SLOW_SLIDE:g} m/s",
    )
    parser.add_argument("--yes", action="store_true", help="do not ask before the arm is moved")


def confirm(what: str, options: Namespace) -> None:
    """Ask whether the arm may move; raises `driving.StoppedError` for any answer but yes."""
    print(f"{what} will follow the page, at up to {options.speed:g} deg/s. Keep its power switch within reach.")
    if options.yes:
        return
    try:
        answer = input("Type yes to let it move: ")
    except EOFError:
        answer = ""
    if answer.strip().lower() != "yes":
        raise driving.StoppedError("not confirmed: the arm was not moved")


def work(page: Any, options: Namespace) -> None:
    """Show where the arm is, and let it follow, until the connection to the page ends."""
    arm = Arm(options.rosbridge, options.joint_states, options.trajectory)
    guide: driving.Guide | None = None
    try:
        robot = page.robot
        names = joints_of(robot, options)
        began, shown, noted, confirmed = time.monotonic(), 0.0, False, False
        while options.seconds is None or time.monotonic() - began < options.seconds:
            if page.robot != robot:
                raise kin.KinematicsError(f"the page shows {page.robot.name} now: start again for this arm")
            found = arm.places(names)
            if found is None:
                if time.monotonic() - began > WAITING and not noted:
                    noted = wait_or_raise(arm, names, options)
            else:
                q, heard = found
                if heard > shown:
                    page.measured, shown = q, heard
                if options.drive and not confirmed:
                    confirm(f"The arm behind {options.rosbridge}", options)
                    confirmed = True
                    continue  # what was heard before the question is old
                if options.drive:
                    if guide is None:
                        guide = driving.Guide(page, f"ROS 2 arm at {options.rosbridge}", options.speed, q)
                        print("The arm follows the page.", flush=True)
                    before = guide.asked
                    if not np.array_equal(guide.step(q, heard), before):
                        arm.move(names, guide.asked)
            time.sleep(CYCLE)
    finally:
        if guide is not None:
            guide.end()
        arm.close()


def wait_or_raise(arm: Arm, names: Sequence[str], options: Namespace) -> bool:
    """Say that nothing is heard; raises `kin.KinematicsError` if only other joints are."""
    if heard := arm.names:
        missing = ", ".join(name for name in names if name not in heard)
        raise kin.KinematicsError(
            f"{options.joint_states} says nothing of {missing}; it has {', '.join(heard)}. "
            "--joints names those of the page's arm, in its order"
        )
    print(f"Nothing on {options.joint_states} yet.", flush=True)
    return True


def main(words: Sequence[str] | None = None) -> int:
    """Run the program; returns its exit code."""
    parser = connecting.parser(
        "Show where an arm of ROS 2 is, through rosbridge; with --drive it follows the page."
    )
    parser.add_argument("--rosbridge", default=BRIDGE, help=f"its address (default: {BRIDGE})")
    parser.add_argument(
        "--joints",
        type=lambda text: text.split(","),
        metavar="NAME,…",
        help="names in ROS of the joints of the page's arm, in its order (default: its own names)",
    )
    parser.add_argument("--joint-states", default=STATES, help=f"topic with JointState (default: {STATES})")
    parser.add_argument(
        "--trajectory", default=TRAJECTORY, help=f"topic for JointTrajectory (default: {TRAJECTORY})"
    )
    add_options(parser)
    logging.getLogger("roslibpy").setLevel(logging.CRITICAL)  # its attempts to come back
    return connecting.main(parser, work, NAME, words)


if __name__ == "__main__":
    sys.exit(main())
