"""Options of the display: units, frames, labels, axes, page colours, camera."""

from __future__ import annotations

from dataclasses import dataclass, replace

import viser

from app.viewer.panel import Post, assign, listen, listen_click
from kin import InputError
from kin.units import LENGTHS, Length, Units

BRAND = (0, 114, 178)
BRAND_ON_DARK = (86, 180, 233)


@dataclass
class ViewState:
    """The visitor's choices; they are kept when another robot is selected."""

    frames: bool = False
    labels: bool = True
    axes: bool = True
    dark: bool = False


class UnitChoice:
    """Posts ``"radians"`` and ``"lengths"``."""

    def __init__(self, gui: viser.GuiApi, units: Units, post: Post) -> None:
        radians = gui.add_checkbox("Radians", not units.degrees, hint="Angles in radians instead of degrees")
        listen(radians, post, "radians")
        self._length: Length = units.length
        self._lengths = gui.add_dropdown(
            "Lengths", LENGTHS, initial_value=units.length, hint="Unit of all lengths"
        )
        listen(self._lengths, post, "lengths")

    def with_length(self, units: Units, value: object) -> Units:
        """The units with the chosen unit of length; raises `InputError` for an unknown one."""
        if value not in LENGTHS:
            assign(self._lengths, self._length)
            raise InputError("lengths", value, "one of " + ", ".join(LENGTHS))
        self._length = value
        return replace(units, length=self._length)


class ViewOptions:
    """Check boxes that post ``("view", name)`` and a button that posts ``"camera"``."""

    def __init__(self, gui: viser.GuiApi, state: ViewState, post: Post) -> None:
        for name, text, hint in (
            ("frames", "Link frames", "The frame of every DH row: x red, y green, z blue"),
            ("labels", "Frame labels", "The name of each frame, at the tip of its z axis"),
            ("axes", "Joint axes", "The axis of each joint; its arrow shows the positive direction"),
            ("dark", "Dark page", "Dark instead of light colours"),
        ):
            listen(gui.add_checkbox(text, getattr(state, name), hint=hint), post, ("view", name))
        group = gui.add_button_group("Camera", ("Reset view",))
        listen_click(group, post, {"Reset view": "camera"})


def configure_theme(gui: viser.GuiApi, dark: bool) -> None:
    """Set the page's colours, and hide viser's share button: it would open a public tunnel to the service."""
    gui.configure_theme(
        dark_mode=dark,
        brand_color=BRAND_ON_DARK if dark else BRAND,
        show_logo=False,
        show_share_button=False,
    )
