"""What is shown and how: units, frames, labels, axes, page colours, camera."""

from __future__ import annotations

from dataclasses import dataclass

import viser

from app.viewer.panel import Post, assign, listen, listen_click
from kin import InputError
from kin.units import LENGTHS, Length, Units

BRAND = (0, 114, 178)
BRAND_ON_DARK = (86, 180, 233)


@dataclass
class ViewState:
    """The visitor's choices; they outlive a change of robot."""

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
            "Lengths", LENGTHS, initial_value=units.length, hint="Unit of all lengths, shown and typed"
        )
        listen(self._lengths, post, "lengths")

    def read_length(self, value: object) -> Length:
        """A choice of the dropdown; raises `InputError` for one that is not on its list."""
        if value not in LENGTHS:
            assign(self._lengths, self._length)
            raise InputError("lengths", value, "one of " + ", ".join(LENGTHS))
        self._length = value
        return self._length


class ViewOptions:
    """Check boxes that post ``("view", name)`` and a button that posts ``"camera"``."""

    def __init__(self, gui: viser.GuiApi, state: ViewState, post: Post) -> None:
        for name, text, hint in (
            ("frames", "Link frames", "Frame of every DH row: x red, y green, z blue"),
            ("labels", "Frame labels", "Name of each frame at the tip of its z axis"),
            ("axes", "Joint axes", "The line each joint turns about or slides along; the arrow is positive"),
            ("dark", "Dark page", "Dark or light colours"),
        ):
            listen(gui.add_checkbox(text, getattr(state, name), hint=hint), post, ("view", name))
        group = gui.add_button_group("Camera", ("Reset view",))
        listen_click(group, post, {"Reset view": "camera"})


def configure_theme(gui: viser.GuiApi, dark: bool) -> None:
    """The page's colours. No share button: it would open a public tunnel to a private demo."""
    gui.configure_theme(
        dark_mode=dark,
        brand_color=BRAND_ON_DARK if dark else BRAND,
        show_logo=False,
        show_share_button=False,
    )
