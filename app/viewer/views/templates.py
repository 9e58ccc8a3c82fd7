"""Renders the HTML of the panel from the files in ``templates/``.

Values are escaped unless they are `Markup`, such as formulas. Styles are CSS classes from ``static/viewer.css``,
which the viewer proxy adds to viser's page. Only computed values (positions, widths, colours of data) are inline
styles.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup, escape

_ENVIRONMENT = Environment(
    loader=FileSystemLoader([Path(__file__).parent / "templates", Path(__file__).parents[1] / "lessons"]),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    auto_reload=False,
)
_COMPONENT = re.compile(r"\b([a-z])_([xyz])\b")


def components(text: str) -> Markup:
    """A text with its components of vectors, such as w_y, as a letter and its index."""
    return Markup(_COMPONENT.sub(r"<i>\1</i><sub>\2</sub>", str(escape(text))))


_ENVIRONMENT.filters["components"] = components


def render(name: str, /, **values: object) -> str:
    """The template ``templates/<name>.html`` with these values.

    The result is a plain string, which viser can send. Wrap it in `Markup` to use it as a value of another
    template.
    """
    return _template(name).render(values)


def part(name: str, macro: str, /, **values: object) -> str:
    """A macro of a template with these values, as `render`: a lesson has one file ``lessons/<key>/panel.html``."""
    return "".join([getattr(_template(name).module, macro)(**values)])


@cache
def _template(name: str) -> Template:
    return _ENVIRONMENT.get_template(f"{name}.html")
