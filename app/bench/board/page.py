"""The page of a run: one file without any other, or the scoreboard of the service."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from app.bench.board import views
from app.bench.board.picture import NARROW, STYLE, WIDE, picture

_TEMPLATES = Path(__file__).parent / "templates"


def recorded() -> views.Document:
    """The run that is shipped with Kinboard."""
    found = json.loads(resources.files(__package__).joinpath("recorded.json").read_text("utf-8"))
    assert isinstance(found, dict)
    return found


def page(document: views.Document, served: bool = False) -> str:
    """HTML of a run; `served`: with links to other pages of the service, else a file that needs no other."""
    found = views.sections(document)
    return (
        _environment()
        .get_template("board.html")
        .render(
            sections=found,
            summary=views.summary(found),
            facts=views.facts(document),
            busy=views.busy(document),
            machine=document["machine"],
            wide=Markup(picture(found, WIDE)),
            narrow=Markup(picture(found, NARROW)),
            style=Markup((_TEMPLATES / "board.css").read_text("utf-8") + STYLE),
            served=served,
        )
    )


@cache
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
