"""Metrics of the service in the Prometheus format, served at ``/metrics``."""

from __future__ import annotations

from typing import Final

from prometheus_client import Counter, Gauge, Histogram, generate_latest
from prometheus_client.registry import REGISTRY

CONTENT_TYPE: Final = "text/plain; version=0.0.4; charset=utf-8"
# Seconds, from an answer of forward kinematics to the time limits of the settings.
_SECONDS: Final = (
    *(1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0),
    *(20.0, 30.0, 60.0, 120.0, 600.0, 3600.0),
)

REQUESTS = Counter("kinboard_requests", "Requests by method, route and status.", ("method", "route", "status"))
REQUEST_SECONDS = Histogram(
    "kinboard_request_seconds",
    "Time from the request to the last byte of the response.",
    ("route",),
    buckets=_SECONDS,
)
SOLVE_SECONDS = Histogram(
    "kinboard_solve_seconds", "Time of inverse kinematics for one request or drag.", ("door",), buckets=_SECONDS
)
VISITORS = Gauge("kinboard_visitors", "Open tabs of the viewer.")
CONNECTIONS = Gauge("kinboard_connections", "Open connections.")
REFUSED = Counter(
    "kinboard_refused_connections", "Connections that were refused or ended, and requests not read.", ("why",)
)
PLACES = Gauge("kinboard_places", "Places in use: of requests that compute, streams, viewer.", ("kind",))
PENDING = Gauge(
    "kinboard_pending", "Requests that wait for a place, and computations that wait or run.", ("kind",)
)
HELD_BYTES = Gauge("kinboard_held_bytes", "Bytes of unread answers and of caches.", ("kind",))
RESIDENT = Gauge("kinboard_resident_bytes", "Memory of the service.")
DROPPED = Counter("kinboard_dropped_messages", "Messages of visitors that were not passed on to viser.", ("why",))
STREAMED = Counter("kinboard_stream_bytes", "Bytes sent in streamed responses.", ("stream",))


def exposition() -> bytes:
    """All metrics."""
    return generate_latest(REGISTRY)
