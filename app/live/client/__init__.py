"""The other end of the line, for Python: what `kin.connect` returns."""

from app.live.client.connection import RefusedError
from app.live.client.page import Event, Page

__all__ = ["Event", "Page", "RefusedError"]
