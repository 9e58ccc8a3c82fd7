"""A rosbridge with an arm behind it, for tests: what clients of rosbridge v2.0 publish and subscribe to.

Written after section 3.2 of ROSBRIDGE_PROTOCOL.md of RobotWebTools/rosbridge_suite: messages are JSON objects with
`op`. A publication on a topic of another type, or with fields that its message has not, is answered by a `status`
of level error, and goes nowhere.
"""

from __future__ import annotations

import json
import threading
import time
from typing import Any

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

PERIOD = 0.02  # s between two joint states
FIELDS = {"positions", "velocities", "accelerations", "effort", "time_from_start"}


class Rosbridge:
    """Publishes `/joint_states` to those who subscribe, and moves its arm as `JointTrajectory` messages say.

    Attributes:
        q: where the arm is, by joint.
        silent: publish nothing.
        received: all trajectories, each with the time at which it came.
        errors: what was answered with a status of level error.
        fastest: the largest speed of a joint so far, rad/s.
    """

    def __init__(self, q: dict[str, float], topic: str) -> None:
        self.q = dict(q)
        self.extra: list[tuple[str, Any]] = []
        self.silent = self.stuck = False
        self.received: list[tuple[float, dict[str, Any]]] = []
        self.errors: list[str] = []
        self.fastest = 0.0
        self._topic = topic
        self._goal: tuple[dict[str, float], float] | None = None  # positions, and when they are to be reached
        self._clients: dict[ServerConnection, str] = {}
        self._types: dict[str, str] = {}
        self._over = threading.Event()
        self._server = serve(self._hear, "127.0.0.1", 0)
        self.address = f"ws://127.0.0.1:{self._server.socket.getsockname()[1]}"
        self._threads = [threading.Thread(target=f) for f in (self._server.serve_forever, self._run)]
        for thread in self._threads:
            thread.start()

    def __enter__(self) -> Rosbridge:
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._server.shutdown()
        for client in list(self._clients):
            client.close()
        for thread in self._threads:
            thread.join()

    def _hear(self, client: ServerConnection) -> None:
        try:
            for text in client:
                self._do(client, json.loads(text))
        except ConnectionClosed:
            pass
        finally:
            self._clients.pop(client, None)

    def _do(self, client: ServerConnection, message: dict[str, Any]) -> None:
        match message:
            case {"op": "advertise", "topic": str(topic), "type": str(kind)}:
                if self._types.setdefault(topic, kind) != kind:
                    self._refuse(client, message, f"{topic} has the type {self._types[topic]}")
            case {"op": "subscribe", "topic": str(topic)}:
                if message.get("type", "sensor_msgs/msg/JointState") != "sensor_msgs/msg/JointState":
                    self._refuse(client, message, f"{topic} has the type sensor_msgs/msg/JointState")
                elif topic == "/joint_states":
                    self._clients[client] = topic
            case {"op": "unsubscribe"}:
                self._clients.pop(client, None)
            case {"op": "publish", "topic": self._topic, "msg": dict(body)}:
                if self._types.get(self._topic) != "trajectory_msgs/msg/JointTrajectory":
                    self._refuse(client, message, f"Cannot infer topic type for topic {self._topic}")
                else:
                    self._move(client, message, body)
            case {"op": "unadvertise"}:
                pass
            case _:
                self._refuse(client, message, f"Unknown operation: {message.get('op')}")

    def _refuse(self, client: ServerConnection, message: dict[str, Any], why: str) -> None:
        self.errors.append(why)
        client.send(json.dumps({"op": "status", "level": "error", "msg": why, "id": message.get("id")}))

    def _move(self, client: ServerConnection, message: dict[str, Any], body: dict[str, Any]) -> None:
        """What a joint trajectory controller does: it takes all of its joints, and a point in the future."""
        names, points = body.get("joint_names", []), body.get("points", [])
        if set(body) - {"header", "joint_names", "points"} or any(set(point) - FIELDS for point in points):
            return self._refuse(client, message, "Message type trajectory_msgs/JointTrajectory has no such field")
        if set(names) != set(self.q) or len(points) != 1 or len(points[0]["positions"]) != len(names):
            return self._refuse(
                client, message, "Joints on incoming trajectory don't match the controller joints."
            )
        duration = points[0]["time_from_start"]
        seconds = duration["sec"] + 1e-9 * duration["nanosec"]
        if not seconds > 0.0 or body["header"]["stamp"] != {"sec": 0, "nanosec": 0}:
            return self._refuse(client, message, "Received trajectory ends in the past")
        self.received.append((time.monotonic(), body))
        self._goal = dict(zip(names, points[0]["positions"], strict=True)), time.monotonic() + seconds
        return None

    def _run(self) -> None:
        """Move linearly to the newest goal, and publish where the arm is."""
        before = time.monotonic()
        while not self._over.wait(PERIOD):
            now = time.monotonic()
            elapsed, before = now - before, now
            if self._goal is not None and not self.stuck:
                goal, until = self._goal
                share = min(1.0, elapsed / max(until - now + elapsed, 1e-9))
                for name, place in goal.items():
                    step = share * (place - self.q[name])
                    self.fastest = max(self.fastest, abs(step) / max(elapsed, 1e-9))
                    self.q[name] += step
            if not self.silent:
                self._publish()

    def _publish(self) -> None:
        """All joints in an order of their own, with others in between."""
        joints = [*self.extra, *sorted(self.q.items())]
        seconds = time.time()
        stamp = {"sec": int(seconds), "nanosec": int(seconds % 1.0 * 1e9)}
        message = {
            "header": {"stamp": stamp, "frame_id": ""},
            "name": [name for name, _ in joints],
            "position": [place for _, place in joints],
            "velocity": [None] * len(joints),  # NaN, as rosbridge writes it
            "effort": [],
        }
        for client, topic in list(self._clients.items()):
            try:
                client.send(json.dumps({"op": "publish", "topic": topic, "msg": message}))
            except ConnectionClosed:
                self._clients.pop(client, None)

    def configuration(self, names: list[str]) -> np.ndarray:
        """Where these joints are ``(n,)``."""
        return np.array([self.q[name] for name in names])
