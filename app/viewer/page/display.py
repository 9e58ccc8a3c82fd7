"""How a page shows things: its units, its colours, and the frame of its poses."""

from __future__ import annotations

from collections.abc import Callable

from app.viewer.frames import Frames
from kin.units import DEFAULT_UNITS, Units


class Display:
    """The display settings of one page. The session sets them; see `app.viewer.session.looks.Looks`.

    Args:
        reframed: called when there are other frames.

    Attributes:
        units: of angles and lengths.
        dark: whether the page is dark.
        frames: the workpieces, and the frame in which poses are shown.
    """

    def __init__(self, reframed: Callable[[], None]) -> None:
        self._reframed = reframed
        self.units: Units = DEFAULT_UNITS
        self.dark = False
        self.frames = Frames()

    def use_frames(self, frames: Frames) -> None:
        """Take these frames, and show poses in the chosen one."""
        self.frames = frames
        self._reframed()
