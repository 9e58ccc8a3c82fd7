"""Events of the gizmo, as they are posted."""

from __future__ import annotations

from typing import NamedTuple

import viser

from app.viewer.panel import Post


class Pull(NamedTuple):
    """One event of the gizmo, or of a ring attached to it.

    Attributes:
        phase: start, update or end of a drag.
        position, wxyz: pose of the gizmo (m); of a ring, in the gizmo's frame.
        ring: whether it is a ring of its own.
    """

    phase: str
    position: list[float]
    wxyz: list[float]
    ring: bool


def listen(handle: viser.TransformControlsHandle, ring: bool, post: Post) -> None:
    """Post ``"gizmo"`` with a `Pull` whenever the visitor drags it."""

    @handle.on_update
    async def _(event: viser.TransformControlsEvent) -> None:
        if event.client is not None:
            gizmo = event.target
            post("gizmo", Pull(event.phase, gizmo.position.tolist(), gizmo.wxyz.tolist(), ring))
