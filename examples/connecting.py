"""What the programs of this folder share: the options for a page, and plain words for what can go wrong."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any

import kin

ADDRESS = "http://localhost:8000"


def parser(description: str) -> argparse.ArgumentParser:
    """A parser with the options that lead to a page."""
    found = argparse.ArgumentParser(description=description)
    found.add_argument("code", help="of the page: tab Program, Connect a program")
    found.add_argument("--address", default=ADDRESS, help=f"of Kinboard, as in the browser (default: {ADDRESS})")
    found.add_argument(
        "--token",
        default=os.environ.get("KINBOARD_TOKEN"),
        help="access token of the service, if it needs one (default: KINBOARD_TOKEN)",
    )
    found.add_argument("--seconds", type=positive, help="end after this time (default: at Ctrl+C)")
    return found


def positive(text: str) -> float:
    """A number above 0, for an option."""
    return _number(text, 0.0, "a number above 0", open_end=True)


def at_least_zero(text: str) -> float:
    """A number that is 0 or more, for an option."""
    return _number(text, 0.0, "a number that is 0 or more")


def _number(text: str, least: float, expected: str, open_end: bool = False) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not least <= value < float("inf") or (open_end and value == least):
        raise argparse.ArgumentTypeError(f"got {text!r}, expected {expected}")
    return value


def main(
    found: argparse.ArgumentParser,
    work: Callable[[Any, argparse.Namespace], None],
    name: str,
    words: Sequence[str] | None,
    rate: float = 60.0,
) -> int:
    """Connect to the page that the command line names and do the work; returns the exit code.

    Ctrl+C is a normal end. What goes wrong is one line on the error output.
    """
    options = found.parse_args(words)
    try:
        with kin.connect(options.address, options.code, name=name, token=options.token, rate=rate) as page:
            print(f"Connected to the page with {page.robot.name}. Ctrl+C ends.", flush=True)
            work(page, options)
    except KeyboardInterrupt:
        print("Ended.")
    except (kin.KinematicsError, OSError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        if str(error).startswith("no connection"):
            print("Is Kinboard running there? --address names another place.", file=sys.stderr)
        return 1
    return 0


def forced(robot: kin.Robot, joint: int, value: float) -> str:
    """The size of a joint's torque or force in words."""
    size = f"{abs(value):.0f}" if abs(value) >= 100.0 else f"{abs(value):.3g}"
    return f"{size} {'N m' if robot.revolute[joint] else 'N'}"
