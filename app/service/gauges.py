"""Gauges of what the process holds and has to do, for ``/metrics``."""

from __future__ import annotations

from typing import Any

from app.service.compute.pool import Pool
from app.service.web.viewer_proxy import ViewerBridge
from app.shared.memory.process import resident_bytes
from app.shared.metrics import HELD_BYTES, PENDING, PLACES, RESIDENT


def update_gauges(state: Any, bridge: ViewerBridge, pool: Pool | None) -> None:
    """Set the gauges to the present values; `state` is that of the application."""
    PLACES.labels("requests").set(state.compute.used)
    PLACES.labels("streams").set(state.streams.open)
    PLACES.labels("viewer").set(bridge.slots.taken)
    PENDING.labels("requests").set(state.compute.waiting)
    PENDING.labels("summaries").set(state.summaries.pending)
    PENDING.labels("maps").set(state.maps.pending)
    PENDING.labels("clouds").set(state.clouds.pending)
    HELD_BYTES.labels("answers").set(state.compute.memory.held)
    HELD_BYTES.labels("clouds").set(state.clouds.bytes)
    HELD_BYTES.labels("maps").set(state.maps.bytes)
    RESIDENT.set(resident_bytes() + (0 if pool is None else pool.resident))
