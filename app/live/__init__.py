"""Programs that are connected to a page: the codes of pages, and the line between a page and its program.

`Lines` are those of the service. A page opens a `Line` and shows its code; :mod:`app.api.live` lets the program
with this code talk to the page, and :mod:`app.viewer.live` lets the page answer. Neither knows the other.
"""

from app.live.line import (
    EVENTS,
    RESERVED,
    VALUES,
    BusyLineError,
    Line,
    Lines,
    Listener,
    Program,
    expect,
    invite,
    reserved,
)

__all__ = [
    "EVENTS",
    "RESERVED",
    "VALUES",
    "BusyLineError",
    "Line",
    "Lines",
    "Listener",
    "Program",
    "expect",
    "invite",
    "reserved",
]
