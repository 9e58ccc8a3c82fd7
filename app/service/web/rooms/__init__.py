"""Pages of classrooms: open a room, join one, show its code, end it."""

from app.service.web.rooms.routes import room_routes
from app.service.web.rooms.sweeping import sweeping

__all__ = ["room_routes", "sweeping"]
