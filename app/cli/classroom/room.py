"""``kinboard room``: open, list and end rooms in the database of the service, whether or not it runs."""

from __future__ import annotations

import json
import sys
import time
from argparse import Namespace
from typing import Any

from app.classroom import ClassroomUnavailable, Hub, RefusedError
from app.classroom.rooms import OpenRoom
from app.classroom.tokens import read_code, show_code
from app.shared.settings import Settings
from kin.files.numbers import number_of


def run(arguments: Namespace) -> int:
    """Returns 2 for what is refused, 1 if the database cannot be used."""
    flags: dict[str, Any] = {}  # all settings come from the environment
    hub = Hub.of(Settings(**flags))
    try:
        match arguments.action:
            case "open":
                _show([hub.rooms.open(arguments.title, 3600.0 * number_of(arguments.hours))], arguments)
            case "list":
                _show(hub.rooms.all() if hub.in_use else [], arguments)
            case _:
                return _end(hub, arguments.code)
    except RefusedError as error:
        print(f"kinboard: {error}", file=sys.stderr)
        return 2
    except ClassroomUnavailable as error:
        print(f"kinboard: {error}", file=sys.stderr)
        return 1
    finally:
        hub.close()
    return 0


def _show(rooms: list[OpenRoom], arguments: Namespace) -> None:
    root = arguments.url.rstrip("/")
    items = [
        {
            "title": room.title,
            "code": show_code(room.code),
            "students": room.students,
            "ends": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(room.ends)),
            "join": f"{root}/room?code={room.code}",
            "teach": f"{root}/room/teach/{room.token}",
        }
        for room in rooms
    ]
    if arguments.json:
        print(json.dumps(items[0] if arguments.action == "open" else items, indent=2, ensure_ascii=False))
        return
    if not items:
        print("There is no room.")
    for item in items:
        print(f"{item['title']}  ({item['students']} students, erased at {item['ends']})")
        for name, words in (("code", "join code"), ("join", "for students"), ("teach", "for the teacher alone")):
            print(f"  {words:22}{item[name]}")


def _end(hub: Hub, code: str) -> int:
    wanted = read_code(code)
    rooms = hub.rooms.all() if hub.in_use else []
    room = next((room for room in rooms if room.code == wanted), None)
    if room is None:
        print(f"kinboard: no room has the code {code!r}; `kinboard room list` shows them", file=sys.stderr)
        return 2
    hub.rooms.end(room.id)
    print(f"{room.title}: {hub.rooms.said_of_ended()}")
    return 0
