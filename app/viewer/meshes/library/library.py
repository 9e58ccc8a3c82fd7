"""Detailed bodies of built-in arms, from installed packages of robot descriptions.

A file ``<robot id>.toml`` in this folder names the package, the folder of its meshes, and the joint values
``pose`` (degrees) in which the meshes are placed. Each of its ``parts`` names a mesh, the joint that carries it
(0: it stands still), its place ``xyz`` (metres) and ``rpy`` (degrees) in coordinates of the base, and a colour if
the mesh has none.
"""

from __future__ import annotations

import logging
import math
import threading
import time
import tomllib
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path

import numpy as np

from app.shared.memory.answers import Reservation
from app.viewer.meshes.archive import MeshError
from app.viewer.meshes.links import drawing_of, shapes_of, size_of
from app.viewer.meshes.reader import Meshes, MeshReader
from app.viewer.scene.bodies.drawing import Drawing
from app.viewer.scene.chain import link_poses
from kin import Robot, builtin_robots
from kin.axes import inverse
from kin.files.urdf.visuals import MeshFile, Visual
from kin.frames import matrix_of

log = logging.getLogger(__name__)

FOLDER = Path(__file__).parent
PAUSE = 60.0  # seconds


@dataclass(frozen=True)
class Detailed:
    """The detailed body of an arm.

    Attributes:
        folder: of the meshes, in an installed package.
        visuals: the meshes where they are with all joints at zero.
    """

    folder: Path
    visuals: tuple[Visual, ...]


def detailed(robot: Robot) -> Detailed | None:
    """The detailed body of a built-in arm, if there is one and its package is installed."""
    return body_of_builtin(robot.id) if builtin_robots().get(robot.id) == robot else None


@cache  # each page that opens asks for all built-in arms
def body_of_builtin(robot_id: str) -> Detailed | None:
    """The detailed body of the built-in arm of this name, if there is one and its package is installed."""
    robot, path = builtin_robots()[robot_id], FOLDER / f"{robot_id}.toml"
    if not path.is_file():
        return None
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    try:
        found = metadata.distribution(data["package"]).locate_file(data["folder"])
    except metadata.PackageNotFoundError:
        return None
    folder = Path(str(found))
    pose = np.radians(np.array(data["pose"], dtype=float))
    at_pose, at_zero = link_poses(robot, np.array([pose, np.zeros(robot.n)]))
    visuals = []
    for part in data["parts"]:
        k = part["joint"]
        rpy = [math.radians(angle) for angle in part.get("rpy", (0, 0, 0))]
        T = robot.T_world_base @ np.array(matrix_of(part.get("xyz", (0, 0, 0)), rpy))
        shape = MeshFile(part["mesh"], (part.get("scale", 1.0),) * 3)
        visuals.append(Visual("", k, at_zero[k] @ inverse(at_pose[k]) @ T, shape, _rgb(part.get("color"))))
    if not all((folder / name).is_file() for name in shapes_of(robot, visuals).files):
        log.warning("%s has not the meshes of %s that were expected", data["package"], robot.name)
        return None
    return Detailed(folder, tuple(visuals))


def _rgb(text: str | None) -> tuple[float, float, float] | None:
    if text is None:
        return None
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


class Library:
    """The detailed bodies of one service process, read when they are first wanted. Any thread may use it.

    A body that cannot be read is not tried again for `PAUSE` seconds.
    """

    def __init__(self, reader: MeshReader) -> None:
        self._reader = reader
        self._refused: dict[str, tuple[float, str]] = {}  # when, and why
        self._lock = threading.Lock()
        self._found: dict[str, tuple[Drawing, Reservation]] = {}
        self._wanted: dict[str, list[Callable[[str], None]]] = {}

    def offered(self, robots: Sequence[Robot]) -> list[Robot]:
        """Those of these robots that have a detailed body."""
        return [robot for robot in robots if detailed(robot) is not None]

    def get(self, robot: Robot, loaded: Callable[[str], None]) -> Drawing | None:
        """The detailed body of a robot; None if it has none, or not yet.

        Args:
            loaded: called from any thread: with "" when the body is there, or with why it cannot be read.
        """
        source = detailed(robot)
        if source is None:
            return None
        with self._lock:
            if robot.id in self._found:
                return self._found[robot.id][0]
            when, why = self._refused.get(robot.id, (-math.inf, ""))
            paused = time.monotonic() < when + PAUSE
            first = robot.id not in self._wanted
            if not paused:
                self._wanted.setdefault(robot.id, []).append(loaded)
        if paused:
            loaded(why)
        elif first:
            future = self._reader.read_package(shapes_of(robot, source.visuals), source.folder)
            future.add_done_callback(lambda done: self._keep(robot, done))
        return None

    def _keep(self, robot: Robot, done: Future[Meshes]) -> None:
        try:
            meshes = done.result()
            body = drawing_of(meshes.links)
            meshes.room.resize(size_of(body))
        except Exception as error:  # noqa: BLE001 - our own drawing is shown instead
            self._give_up(robot, error)
            return
        with self._lock:
            self._found[robot.id] = body, meshes.room
            waiting = self._wanted.pop(robot.id)
        for loaded in waiting:
            loaded("")

    def _give_up(self, robot: Robot, error: Exception) -> None:
        log.warning("the detailed body of %s could not be read: %s", robot.name, error)
        why = "The service's log has the reason."
        if isinstance(error, MeshError):
            why = f"{error.field}: {error.value}."
        with self._lock:
            self._refused[robot.id] = time.monotonic(), why
            waiting = self._wanted.pop(robot.id, [])
        for loaded in waiting:
            loaded(why)
