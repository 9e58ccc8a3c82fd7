"""What a program draws in the scene of its page, by names of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kin import InputError
from kin.transforms import Array, wxyz_from_rotation

ORANGE = "#e8590c"


class Drawing:
    """Draws; one of the same name is replaced. Metres, in the world frame; colours as in CSS, ``#rrggbb``.

    Each method raises `kin.KinematicsError` for what the page refuses, such as too many points.

    Attributes:
        shown: the drawings by name, as the page takes them.
    """

    def __init__(self, send: Callable[..., None]) -> None:
        self._send = send
        self.shown: dict[str, dict[str, Any]] = {}

    def points(self, name: str, points: ArrayLike, size: float = 0.01, color: str = ORANGE) -> None:
        """Points ``(k, 3)`` of this diameter (m)."""
        rows = _rows(points, 1)
        self._show(name, {"kind": "points", "points": rows, "size": float(size), "color": color})

    def line(self, name: str, points: ArrayLike, width: float = 3.0, color: str = ORANGE) -> None:
        """A line through points ``(k, 3)``, of this width in pixels."""
        rows = _rows(points, 2)
        self._show(name, {"kind": "line", "points": rows, "width": float(width), "color": color})

    def frame(self, name: str, T: ArrayLike, length: float = 0.1) -> None:
        """The axes of a pose ``(4, 4)``, of this length (m)."""
        pose = np.asarray(T, dtype=float)
        if pose.shape != (4, 4) or not np.isfinite(pose).all():
            raise InputError("T", T, "a pose (4, 4) of finite numbers")
        wxyz = wxyz_from_rotation(pose[:3, :3]).tolist()
        self._show(
            name, {"kind": "frame", "position": pose[:3, 3].tolist(), "wxyz": wxyz, "length": float(length)}
        )

    def label(self, name: str, position: ArrayLike, text: str) -> None:
        """A text at a point ``(3,)``."""
        (place,) = _rows(np.asarray(position, dtype=float)[None], 1)
        self._show(name, {"kind": "label", "position": place, "text": str(text)})

    def remove(self, name: str) -> None:
        """Remove the drawing of this name, if there is one."""
        self._send(draw={name: None})
        self.shown.pop(name, None)

    def clear(self) -> None:
        """Remove all drawings."""
        self._send(clear=True)
        self.shown.clear()

    def _show(self, name: str, drawn: dict[str, Any]) -> None:
        self._send(draw={name: drawn})
        self.shown[name] = drawn


def _rows(points: ArrayLike, least: int) -> list[list[float]]:
    found: Array = np.asarray(points, dtype=float)
    if found.ndim != 2 or found.shape[1:] != (3,) or len(found) < least or not np.isfinite(found).all():
        raise InputError("points", points, f"at least {least} points (k, 3) of finite numbers")
    return [[float(x) for x in row] for row in found.round(6)]
