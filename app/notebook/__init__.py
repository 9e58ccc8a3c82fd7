"""An arm in the output of a notebook's cell: what `kin.show` returns, and the service that draws it.

The kernel starts the service as a process of its own (:mod:`app.notebook.child`) and moves arms by lines of JSON
in that process's standard input. Nobody else can write there, and the process ends when it is closed, however the
kernel ends. A page belongs to an arm by a random key in its address.
"""

from __future__ import annotations

import html
import os
import threading
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import kin
from app.classroom.tokens import new_code
from app.live.client import Page
from app.notebook.process import ServiceProcess
from app.viewer.session.state import encode, with_arm
from kin import InputError, KinematicsError, Robot
from kin.named import robot_of
from kin.transforms import Array

RATE = 30.0  # configurations of a path that are sent a second
LONGEST_NAME = 60  # characters of what is driven
LONGEST = 3600.0  # s that a path may take
HUB = "JUPYTERHUB_SERVICE_PREFIX"

_service: ServiceProcess | None = None
_lock = threading.Lock()


def running() -> ServiceProcess:
    """The service of this process, started when it is first asked for, and again if it has ended."""
    global _service
    with _lock:
        if _service is None or not _service.alive:
            _service = ServiceProcess()
        return _service


class ArmView:
    """An arm on show. Notebooks show it as a frame."""

    def __init__(
        self,
        robot: Robot,
        q: Array,
        size: tuple[int | str, int],
        panel: bool,
        address: str,
        drives: str | None = None,
    ) -> None:
        self.robot = robot
        self._q = q
        self._size = size
        self._service = running()
        self._key = new_code() + new_code()
        self._page: Page | None = None
        self._drives = _named(drives)
        self._state = _state_of(robot, q)
        mode = "panel" if panel else "1"
        base = address.replace("{port}", str(self._service.port))
        self._send([q], 0.0)
        self._address = f"{base.rstrip('/')}/viewer/?embed={mode}&shown={self._key}"

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"{self._address}#s={self._state}"

    @property
    def page(self) -> Page:
        """The page in the frame that was shown last: what `kin.connect` returns, with target, result, events.

        Raises `KinematicsError` while no frame is open.
        """
        if self._page is None or not self._page.connected:
            self._page = Page(
                f"http://127.0.0.1:{self._service.port}", self._key, "The notebook", drives=self._drives
            )
        return self._page

    @property
    def q(self) -> Array:
        """The configuration ``(n,)`` on show: what was assigned last, or done in the frame since."""
        if (page := self._open_page()) is not None and page.robot.n == self.robot.n:
            self._q = page.q
        return self._q.copy()

    @q.setter
    def q(self, value: ArrayLike) -> None:
        self._q = _configuration(self.robot, value)
        self._state = _state_of(self.robot, self._q)
        self._send([self._q], 0.0)
        if (page := self._open_page()) is not None and page.robot.n == self.robot.n:
            page.q = self._q

    @property
    def drives(self) -> str | None:
        """What the notebook moves with the arm, named in the red border of the frame; None: nothing.

        A frame that is opened later has the border once the notebook reads or moves the arm in it.
        """
        return self._drives

    @drives.setter
    def drives(self, name: str | None) -> None:
        self._drives = _named(name)
        if (page := self._open_page()) is not None:
            page.drives = self._drives

    def _open_page(self) -> Page | None:
        try:
            return self.page
        except KinematicsError:
            return None  # no frame is open

    def play(self, path: ArrayLike, seconds: float = 4.0) -> None:
        """Move through the configurations `path` ``(k, n)`` in this time, on all pages that show the arm."""
        steps = _path(self.robot, path)
        if not 0.0 < seconds <= LONGEST:
            raise InputError("seconds", seconds, f"more than 0 and at most {LONGEST:g}")
        count = max(2, int(np.ceil(seconds * RATE)))
        at = np.linspace(0.0, len(steps) - 1.0, count)
        smooth = np.stack([np.interp(at, np.arange(len(steps)), column) for column in steps.T], axis=1)
        self._q = smooth[-1]
        self._state = _state_of(self.robot, smooth[0])
        self._send(list(smooth), seconds)

    def _send(self, steps: list[Array], seconds: float) -> None:
        self._service.send({"key": self._key, "path": [step.tolist() for step in steps], "seconds": seconds})

    def _repr_html_(self) -> str:
        width, height = (html.escape(str(value)) for value in self._size)
        return (
            f'<iframe src="{html.escape(self.url)}" width="{width}" height="{height}" style="border: 0" '
            f'title="{html.escape(self.robot.name)}" allow="fullscreen; clipboard-write"></iframe>'
        )


def show(
    robot: Robot | str,
    q: ArrayLike | None,
    path: Any,
    seconds: float,
    panel: bool,
    width: int | str,
    height: int,
    address: str | None,
    drives: str | None = None,
) -> ArmView:
    """As `kin.show`."""
    robot = robot_of(robot)
    steps = None if path is None else _path(robot, path)
    start = _configuration(robot, robot.q_home if q is None else q) if steps is None else steps[0]
    if address is None:
        prefix = os.environ.get(HUB)
        address = f"{prefix}proxy/{{port}}/" if prefix else "http://localhost:{port}/"
    view = ArmView(robot, start, (width, height), panel, address, drives)
    if steps is not None:
        view.play(steps, seconds)
    return view


def _named(name: str | None) -> str | None:
    """The name of what is driven, as a page takes it; raises `InputError`."""
    shown = name is None or (isinstance(name, str) and any(c.isprintable() and not c.isspace() for c in name))
    if not shown or len(name or "") > LONGEST_NAME:
        raise InputError("drives", name, f"a name of at most {LONGEST_NAME} characters that can be read, or None")
    return name


def _configuration(robot: Robot, value: ArrayLike) -> Array:
    q = robot.check_q(value)
    if not robot.in_limits(q, slack=1e-6):
        raise InputError("q", np.asarray(value).tolist(), "a configuration within the limits of the joints")
    return robot.clip(q)


def _path(robot: Robot, value: Any) -> Array:
    steps = [_configuration(robot, step) for step in value]
    if len(steps) < 2:
        raise InputError("path", f"{len(steps)} configurations", "at least 2")
    return np.stack(steps)


def _state_of(robot: Robot, q: Array) -> str:
    return encode(with_arm(robot, q, kin.builtin_robots().values()))
