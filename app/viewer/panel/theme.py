"""The colours of the page."""

from __future__ import annotations

import viser

BRAND = (0, 114, 178)
BRAND_ON_DARK = (86, 180, 233)


def configure_theme(gui: viser.GuiApi, dark: bool) -> None:
    """Set the page's colours, and hide viser's share button: it would open a public tunnel to the service."""
    gui.configure_theme(
        dark_mode=dark,
        brand_color=BRAND_ON_DARK if dark else BRAND,
        show_logo=False,
        show_share_button=False,
    )
