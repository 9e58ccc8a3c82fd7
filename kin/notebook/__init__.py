"""`show`: an arm in a notebook; `connect`: a page that is open in a browser; `save_page`: an arm as a web page.

The core draws nothing and knows no network. The service, which is installed with it, does: it is looked up by name
when one of these is called, so that nothing here depends on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from kin.errors import KinematicsError
from kin.robot import Robot

if TYPE_CHECKING:
    from kin.collision import Obstacle
    from kin.motion import Motion

# The service's name in an installation, and in a checkout.
_PACKAGES = ("kinboard", "app")


def show(
    robot: Robot | str,
    q: ArrayLike | None = None,
    *,
    path: ArrayLike | Sequence[ArrayLike] | None = None,
    seconds: float = 4.0,
    panel: bool = True,
    width: int | str = "100%",
    height: int = 480,
    address: str | None = None,
    drives: str | None = None,
) -> Any:
    """Show an arm in a notebook (Jupyter), in a frame in which it can be moved.

    The first call starts the service as a process of its own on a free port of this machine; it ends with the
    notebook's kernel.

    Args:
        robot: the arm, or the id of a built-in one.
        q: configuration ``(n,)``, radians (metres); None: the arm's home configuration.
        path: configurations ``(k, n)``, radians (metres), through which the arm moves once the page is open.
        seconds: that the path takes.
        panel: whether there is a small panel with the joints beside the scene.
        width, height: of the frame, in pixels or as CSS has it.
        address: where the browser finds the service, with ``{port}``; needed where the notebook runs on another
            machine than the browser.
        drives: what this notebook moves with the arm, as for `connect`: the frame has a red border with this name
            from the first time that the notebook reads or moves the arm in it, until ``arm.drives = None``.

    Returns:
        The arm on show: assign its ``q`` to move it, or read it after a drag; call its ``play(path, seconds)``;
        ``page`` is its page as `connect` returns it, ``url`` the address.

    Raises:
        KinematicsError: for an invalid argument, or if the service is not installed or does not start.
    """
    return _service("notebook", "show").show(robot, q, path, seconds, panel, width, height, address, drives)


def connect(
    address: str,
    code: str,
    *,
    name: str | None = None,
    token: str | None = None,
    rate: float = 30.0,
    drives: str | None = None,
) -> Any:
    """Connect this program to a page of the viewer: move its arm, and hear what is done there.

    Args:
        address: of the service, as in the browser: ``"http://localhost:8000"``.
        code: of the page: in its tab *Program*, *Connect a program* shows it.
        name: of this program, which the page shows; None: the name of its file.
        token: the service's access token, if it needs one.
        rate: how often a second the page reports what it shows, at most (0.1 to 60).
        drives: what this program moves, such as ``"SO-101 at /dev/ttyACM0"``: the page has a red frame with this
            name as long as the program is connected, or until ``page.drives = None``. None: it moves nothing.

    Returns:
        The page. Assign ``q``, ``target``, ``measured`` or ``robot``, read ``q``, ``target``, ``result``,
        ``contacts``; ``play(motion)``, ``draw.line(name, points)``, ``events()``, ``close()``, from any thread.

    Raises:
        KinematicsError: there is no service or no such page, another program is connected, or the service is not
            installed here.
    """
    return _service("live.client", "connect").Page(address, code, name, token, rate, drives)


def save_page(
    robot: Robot | str,
    path: str | PathLike[str],
    q: ArrayLike | None = None,
    *,
    target: ArrayLike | None = None,
    motion: Motion | None = None,
    link: str = "",
    obstacles: Sequence[Obstacle] = (),
) -> Path:
    """Write an arm as one web page that needs no server and no internet: a file of at most 2 MB.

    The page has a slider for each joint, the pose of the tool, the DH table and its frames, a target to drag, the
    postures that meet it, and with a motion a program to play. It solves by itself if `generate` can write the
    arm's solver; else it has the postures of `target`.

    Args:
        robot: the arm, or the id of a built-in one.
        path: of the file, such as ``"ur5.html"``; a file that is there is replaced.
        q: configuration ``(n,)`` that the page opens with, radians (metres); None: the arm's home configuration.
        target: pose of the tool ``(4, 4)`` that the page opens with, metres; None: the one at `q`.
        motion: of the same arm, from `plan_motion`.
        link: address of the full page, which the file names; "": none.
        obstacles: bodies around the arm in the world frame, which the page draws; the postures of `target` keep
            clear of them, others do not.

    Returns:
        The path of the file.

    Raises:
        KinematicsError: an argument is invalid, nothing of the motion can be driven, or the service is missing.
        OSError: the file cannot be written.
    """
    return Path(
        _service("viewer.takehome", "save_page").save_page(robot, path, q, target, motion, link, obstacles)
    )


def _service(module: str, function: str) -> Any:
    """A module of the service, which is installed beside the core or not."""
    for package in _PACKAGES:
        if find_spec(package) is not None and find_spec(f"{package}.{module.partition('.')[0]}") is not None:
            name = import_module(package).__name__  # in a checkout, kinboard is another name of app
            return import_module(f"{name}.{module}")
    raise KinematicsError(f"kin.{function} needs the service of Kinboard: pip install kinboard")
