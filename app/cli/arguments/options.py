"""The options of inverse kinematics as flags, made of what `kin.IKOptions` declares."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable, Mapping
from typing import Any

from app.cli.arguments.values import count, named
from app.shared.options import Option, declared

UNITS_NOTE = "degrees and millimetres, or radians and metres with --rad; 90deg, pi/2 and 0.4m have their own unit"
IN_UNITS = {
    "in radians (metres)": f"in {UNITS_NOTE}",
    "in radians": "in degrees (--rad: radians)",
    "in metres": "in millimetres (--rad: metres)",
}
METAVARS = {"m": "X", "rad": "A"}
# Flags whose names are older than those of the options.
FLAGS = {"limits": "--limit", "locked": "--lock"}
# How options are typed that are no choice, switch or number with a unit.
_TYPED: Mapping[str, Mapping[str, Any]] = {
    "mask": {"nargs": "+", "choices": ("x", "y", "z", "rx", "ry", "rz"), "metavar": "COORDINATE"},
    "limits": {"type": named, "action": "append", "metavar": "JOINT=LOWER:UPPER"},
    "locked": {"type": named, "action": "append", "metavar": "JOINT=VALUE"},
    "branch": {"action": "append", "metavar": "NAME"},
    "redundancy": {"type": named, "action": "append", "metavar": "[NAME=]VALUE"},
    "max_solutions": {"type": count, "metavar": "N"},
    "obstacles": {"metavar": "FILE"},
}
# What replaces the sentences after the first one, which are about the form of the value in Python.
_FORMS = {
    "limits": "joints are counted from 1",
    "locked": "joints are counted from 1",
    "obstacles": "a TOML file of [[obstacles]], in metres and radians",
    "max_solutions": "default 1, with --all all of them",
}


def flag_of(name: str) -> str:
    """The flag of an option."""
    return FLAGS.get(name, "--" + name.replace("_", "-"))


def add_options(parser: argparse.ArgumentParser, names: Iterable[str], **defaults: object) -> None:
    """Add the flags of these options; values are kept under the names of the options.

    `defaults` are those that are not the option's own.
    """
    for option in map(declared().__getitem__, names):
        default = defaults.get(option.name, option.default)
        about: dict[str, Any] = {"dest": option.name, "default": default, **_typed(option)}
        parser.add_argument(flag_of(option.name), help=_help(option, default, about.get("action")), **about)


def _typed(option: Option) -> Mapping[str, Any]:
    """How the option is typed, as keywords of `add_argument`."""
    if option.choices:
        return {"choices": option.choices}
    if option.unit:
        return {"metavar": METAVARS[option.unit]}
    if option.switch:
        return {"action": "store_true"}
    return _TYPED[option.name]


def _help(option: Option, default: object, action: str | None) -> str:
    """The text of the option with the units of the command line, and with flags for the names of options."""
    text = option.text.partition(". ")[0] if option.name in _FORMS else option.text
    text = re.sub("|".join(map(re.escape, IN_UNITS)), lambda found: IN_UNITS[found[0]], text)
    text = re.sub(r"`(\w+)`", lambda found: flag_of(found[1]), text)
    parts = [text, _FORMS.get(option.name, ""), "may be repeated" if action == "append" else ""]
    chosen = f" (default {default})" if option.choices and default else ""
    return "; ".join(filter(None, parts)) + chosen
