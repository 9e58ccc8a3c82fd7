"""Gauges of what the process holds and has to do, for ``/metrics``."""

from __future__ import annotations

from typing import Any

from app.service.compute.pool import Pool
from app.service.web.viewer_proxy import ViewerBridge
from app.shared.memory.process import resident_bytes
from app.shared.metrics import HELD_BYTES, PENDING, PLACES, RESIDENT


def show_in_gauges(state: Any, bridge: ViewerBridge, pool: Pool | None) -> None:
    """Have the gauges read the values of this application, whose `state` it is, whenever they are asked for."""
    PLACES.labels("requests").set_function(lambda: state.compute.used)
    PLACES.labels("streams").set_function(lambda: state.streams.open)
    PLACES.labels("viewer").set_function(lambda: bridge.slots.taken)
    PENDING.labels("requests").set_function(lambda: state.compute.waiting)
    PENDING.labels("summaries").set_function(lambda: state.summaries.pending)
    PENDING.labels("maps").set_function(lambda: state.maps.pending)
    PENDING.labels("clouds").set_function(lambda: state.clouds.pending)
    HELD_BYTES.labels("answers").set_function(lambda: state.compute.memory.held)
    HELD_BYTES.labels("clouds").set_function(lambda: state.clouds.bytes)
    HELD_BYTES.labels("maps").set_function(lambda: state.maps.bytes)
    RESIDENT.set_function(lambda: resident_bytes() + (0 if pool is None else pool.resident))
