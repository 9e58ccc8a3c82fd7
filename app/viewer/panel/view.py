"""What is drawn and how: frames, labels, axes, page colours, camera."""

from __future__ import annotations

from dataclasses import dataclass

import viser

from app.viewer.panel import Post, listen, listen_click

BRAND = (0, 114, 178)
BRAND_ON_DARK = (86, 180, 233)


@dataclass
class ViewState:
    """The visitor's choices; they outlive a change of robot."""

    frames: bool = False
    labels: bool = True
    axes: bool = True
    dark: bool = False


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
