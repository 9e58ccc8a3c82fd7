"""`show`: an arm in the output of a notebook's cell.

The core draws nothing. The service, which is installed with it, does: it is looked up by name when `show` is
called, so that nothing here depends on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from numpy.typing import ArrayLike

from kin.errors import KinematicsError
from kin.robot import Robot

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

    Returns:
        The arm on show: assign its ``q`` to move it, call its ``play(path, seconds)``; ``url`` is the address of
        the page.

    Raises:
        KinematicsError: for an invalid argument, or if the service is not installed or does not start.
    """
    for package in _PACKAGES:
        if find_spec(package) is not None and find_spec(f"{package}.notebook") is not None:
            service = import_module(f"{package}.notebook")
            return service.show(robot, q, path, seconds, panel, width, height, address)
    raise KinematicsError("kin.show needs the service of Kinboard: pip install kinboard")
