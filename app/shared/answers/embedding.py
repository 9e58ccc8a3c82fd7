"""The code by which another page shows the viewer: an HTML frame."""

from __future__ import annotations

import html

WIDTH, HEIGHT = 800, 500  # pixels
# How the viewer looks in a frame, by the value of ``?embed=``.
MODES = {"1": "scene alone", "panel": "scene and joints"}


def frame(address: str, width: int = WIDTH, height: int = HEIGHT) -> str:
    """An HTML frame that shows the page at this address."""
    return (
        f'<iframe src="{html.escape(address)}" width="{width}" height="{height}" title="Robot arm in Kinboard" '
        'style="border: 0; max-width: 100%" loading="lazy" allow="fullscreen; clipboard-write"></iframe>'
    )
