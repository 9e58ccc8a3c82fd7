"""The landing page: what Kinboard is, a viewer, a card for each robot, and a form to try REST."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from app.shared.settings import static_folder
from app.shared.solver_names import solver_names
from app.shared.store import Store
from kin import Robot, __version__, builtin_robots
from kin.files import classic_robots


class Card(NamedTuple):
    """What the page says of a robot.

    Attributes:
        link: the viewer with this robot.
        about: the first sentence of its description.
        has_picture: whether there is one in ``static/robots``; robots of the operator have none.
        later: whether it is one of the library, which is shown on request.
    """

    robot: Robot
    link: str
    facts: tuple[str, ...]
    about: str
    has_picture: bool
    later: bool


def landing_page(store: Store) -> Callable[[Request], Response]:
    """Answers with the page. It is made when it is first asked for, in a thread."""

    @cache
    def text() -> str:
        from jinja2 import Environment, StrictUndefined  # the start need not wait for it

        page = (static_folder() / "index.html").read_text(encoding="utf-8")
        template = Environment(autoescape=True, undefined=StrictUndefined).from_string(page)
        return template.render(version=__version__, cards=[_card(robot) for robot in store.robots])

    return lambda _: HTMLResponse(text(), headers={"cache-control": "no-cache"})


def _card(robot: Robot) -> Card:
    # The state that restores a view: see app/viewer/session/state.py.
    state = json.dumps({"v": 1, "robot": robot.id}, separators=(",", ":")).encode()
    facts = [f"{robot.n} joints", f"{robot.convention} DH"]
    postures = len(solver_names(robot).branches)
    if robot.n > 6:  # with a joint to spare, each posture is a continuum
        facts.append("redundant")
    elif postures:
        facts.append(f"{postures} postures")
    return Card(
        robot,
        "viewer/#s=" + base64.b64encode(state).decode().rstrip("="),
        tuple(facts),
        re.split(r"(?<=\.) ", robot.description)[0],
        (static_folder() / "robots" / f"{robot.id}.webp").is_file(),
        robot.id in builtin_robots().keys() - classic_robots().keys(),
    )
