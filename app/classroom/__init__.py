"""The classroom: rooms of a teacher and students in a database, courses, results. It knows no viser, no FastAPI.

`Hub` is what a process has of it (see :mod:`app.classroom.hub`). Importing this package does not import
SQLAlchemy: a service in which nobody opens a room starts as if there were none.
"""

from app.classroom.attendance import Attendance
from app.classroom.hub import Hub
from app.classroom.tokens import COOKIE
from app.classroom.views import (
    ClassroomUnavailable,
    Confirmed,
    NewAttempt,
    Poll,
    RefusedError,
    RoomView,
    SeatView,
    Shown,
    Task,
    Ticket,
    UnknownRoomError,
)

__all__ = [
    "COOKIE",
    "Attendance",
    "ClassroomUnavailable",
    "Confirmed",
    "Hub",
    "NewAttempt",
    "Poll",
    "RefusedError",
    "RoomView",
    "SeatView",
    "Shown",
    "Task",
    "Ticket",
    "UnknownRoomError",
]
