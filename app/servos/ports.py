"""Serial ports: which there are, which of them is the adapter of an arm, and why one cannot be opened."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterable
from typing import Any, Final

from serial.tools.list_ports import comports

import kin

SIMULATED: Final = "sim"  # the name of the simulated bus, before a colon and its faults


def is_simulated(port: str) -> bool:
    """Whether a port is the simulated bus."""
    return port.partition(":")[0] == SIMULATED


class BusError(kin.KinematicsError):
    """A servo does not answer, or the port is gone."""


class PortGoneError(BusError):
    """The port is gone, and all servos with it."""


def described(ports: Iterable[Any]) -> str:
    """Ports and what they are, one a line."""
    return "\n".join(f"  {port.device}: {port.description}" for port in ports)


def find_port(ports: Callable[[], Iterable[Any]] = comports) -> str:
    """The only serial port on USB; raises `BusError` if there is none, or more than one."""
    found = sorted((port for port in ports() if port.vid is not None), key=lambda port: str(port.device))
    if len(found) == 1:
        print(f"Serial port {found[0].device}: {found[0].description}.", flush=True)
        return str(found[0].device)
    if found:
        raise BusError(
            f"more than one serial port is on USB; say which with --port:\n{described(found)}\n"
            "If you do not know: take the arm's plug out, and see which one is missing"
        )
    raise BusError(
        "there is no serial port on USB: plug the arm's adapter in (some cables only charge), or try "
        f"without an arm: --port {SIMULATED}"
    )


def port_problem(port: str, error: Exception) -> str:
    """Why a port cannot be opened, and what to do about it."""
    number = getattr(error, "errno", None)
    if (
        number in (errno.EBUSY, errno.EAGAIN)
        or "exclusively lock" in str(error)
        or "Access is denied" in str(error)
    ):
        return f"{port} is in use by another program: close it (LeRobot, a serial monitor, another Kinboard)"
    if number in (errno.EACCES, errno.EPERM):
        return f"no permission to use {port}: sudo usermod -aG dialout $USER, then log in again"
    if number == errno.ENOENT or "could not open" in str(error):
        return f"there is no port {port}. Ports of this machine:\n{described(comports()) or '  none'}"
    return f"{port} cannot be opened: {error}"
