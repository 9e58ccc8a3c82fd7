"""The options of inverse kinematics as `kin.IKOptions` declares them, for REST and the command line.

The core is imported when they are asked for: it takes half a second, which other commands do not need.
"""

from __future__ import annotations

import inspect
import re
from dataclasses import fields
from functools import cache
from textwrap import dedent
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints


class Option(NamedTuple):
    """One option, or a limit or lock of `kin.JointConstraints`.

    Attributes:
        name: the keyword of `kin.solve_ik`.
        text: what it does, as the docstring of its class says it; a clause, or several sentences.
        default: its value if it is left out.
        choices: its values, if it is one of a few words.
        switch: whether it is true or false.
        unit: of a number, "m" or "rad"; empty for everything else.
    """

    name: str
    text: str
    default: object = None
    choices: tuple[str, ...] = ()
    switch: bool = False
    unit: str = ""

    @property
    def sentence(self) -> str:
        """The text as a sentence; a choice that it begins with is a code and stays as it is."""
        first = self.text[0] if self.text.partition(":")[0] in self.choices else self.text[0].upper()
        return f"{first}{self.text[1:]}."


@cache
def declared() -> dict[str, Option]:
    """The options by name, in the order of the keywords of `kin.solve_ik`."""
    from kin.ik.options import IKOptions, JointConstraints

    rows: dict[str, Option] = {}
    for name, option in _options(IKOptions).items():
        rows |= _options(JointConstraints) if name == "constraints" else {name: option}
    return rows


def _options(cls: type[Any]) -> dict[str, Option]:
    texts, hints = _texts(inspect.getdoc(cls) or ""), get_type_hints(cls, include_extras=True)
    rows = {}
    for each in fields(cls):
        name, hint = each.name, hints[each.name]
        default = each.default if isinstance(each.default, str | int) else None
        choices = get_args(hint) if get_origin(hint) is Literal else ()
        unit = hint.__metadata__[0].unit if get_origin(hint) is Annotated else ""
        rows[name] = Option(name, texts[name], default, choices, hint is bool, unit)
    return rows


def _texts(docstring: str) -> dict[str, str]:
    """The entries of the section *Attributes* of a docstring, each on one line and without its full stop."""
    section = re.search(r"^Attributes:\n((?: {4}.*\n?|\n(?= ))*)", docstring, re.M)
    assert section is not None
    entries = re.findall(r"^(\w+): (.*(?:\n .*)*)", dedent(section[1]), re.M)
    return {name: " ".join(text.split()).removesuffix(".") for name, text in entries}
