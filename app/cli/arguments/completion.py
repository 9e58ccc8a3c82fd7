"""``kinboard completion``: what shells complete, made by shtab of the parsers of the commands.

The scripts hold all words, so a shell need not start Kinboard when a key is pressed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import Any

import shtab

from kin import builtin_robots


def script(shell: str, parser: argparse.ArgumentParser, commands: Iterable[argparse.ArgumentParser]) -> str:
    """The script for a shell, of the parser of all commands and those of each."""
    completed = {"FILE": shtab.FILE, "DIR": shtab.DIRECTORY, "FOLDER": shtab.DIRECTORY}
    completed |= dict.fromkeys(("ROBOT", "REFERENCE", "OTHER"), _robot(" ".join(sorted(builtin_robots()))))
    for each in (parser, *commands):
        for action in each._actions:
            if action.metavar in completed and not action.choices:
                action.complete = completed[action.metavar]  # type: ignore[attr-defined]  # read by shtab
    return shtab.complete(parser, shell)


def _robot(ids: str) -> dict[str, Any]:
    """How the shells complete an argument that is an id or a file."""
    return {
        "bash": "_kinboard_robot_or_file",
        "zsh": "_kinboard_robot",
        "fish": f"{ids} {shtab.FILE['fish']}",
        "preamble": {
            "bash": f'_kinboard_robot_or_file() {{ compgen -W "{ids}" -- "$1"; compgen -f -- "$1"; }}',
            "zsh": f"_kinboard_robot() {{ compadd {ids}; _files }}",
        },
    }
