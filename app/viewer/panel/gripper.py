"""The slider that opens and closes the gripper of the arm on show, if its body has fingers."""

from __future__ import annotations

import viser

from app.viewer.panel import Post, assign, listen
from kin import InputError

LAST = 1e6  # below the joints, whose sliders are renewed now and then
HINT = "How far the gripper is open: 0 % closed, 100 % open. No pose depends on it; a connected program hears it."


class GripperSlider:
    """A slider from 0 (closed) to 100 % (open), while there are fingers. Posts ``"gripper"``."""

    def __init__(self, gui: viser.GuiApi, folder: viser.GuiFolderHandle, post: Post) -> None:
        self._gui, self._folder, self._post = gui, folder, post
        self._slider: viser.GuiSliderHandle[float] | None = None

    def offer(self, share: float | None) -> None:
        """Show the slider for fingers that are open to a share; None: there are none."""
        if share is None:
            if self._slider is not None:
                self._slider.remove()
            self._slider = None
            return
        value = round(100.0 * share)
        if self._slider is not None:
            assign(self._slider, value)
            return
        with self._folder:
            self._slider = self._gui.add_slider("Gripper (%)", 0, 100, 1, value, hint=HINT, order=LAST)
        listen(self._slider, self._post, "gripper")


def share_of(value: object) -> float:
    """The share of a slider's value; raises `InputError` for anything that it does not send."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= 100.0:
        raise InputError("gripper", value, "a number from 0 to 100")
    return float(value) / 100.0
