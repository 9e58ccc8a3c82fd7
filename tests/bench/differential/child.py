"""One process with one source tree: it answers questions, or compares the answers of two trees."""

from __future__ import annotations

import json
import pickle
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import kin
from differential.answers import Answer, ask
from differential.compare import compare
from differential.questions import Question
from differential.report import Tally, show
from differential.robots import all_robots, shares


def main(tree: str, task: str, *arguments: str) -> int:
    """Do what is described below; the process must have the core of `tree`."""
    used = Path(kin.__file__).parents[1].resolve()
    if used != Path(tree).resolve():
        raise SystemExit(f"this process has the core of {used}, not of {tree}")
    warnings.simplefilter("ignore")
    if task == "answers":
        write_answers(Path(arguments[0]), json.loads(arguments[1]))
        return 0
    old, new, *shown = arguments
    return compare_answers(Path(old), Path(new), bool(shown))


def write_answers(out: Path, asked: dict[str, Any]) -> None:
    """Write pickles of (arm, numbers, answers), one arm after the other.

    Args:
        out: the file.
        asked: ``count`` of questions and ``only``, names of arms; or ``numbers`` of questions to each of these.
    """
    with out.open("wb") as file:
        for robot, count in shares(asked["count"], asked["only"]):
            numbers = asked["numbers"] or range(count)
            pickle.dump((robot.id, list(numbers), [ask(Question.of(robot, i)) for i in numbers]), file)
            print(".", end="", file=sys.stderr, flush=True)


def read_answers(file: Path) -> Iterator[tuple[str, list[int], list[Answer]]]:
    """What `write_answers` has written."""
    with file.open("rb") as opened:
        while opened.peek(1):
            yield pickle.load(opened)


def compare_answers(old: Path, new: Path, shown: bool = False) -> int:
    """Print the verdicts; 1 if a status differs. If they are to be `shown`, print the answers first."""
    robots, tallies = all_robots(), []
    for (name, numbers, before), (_, _, after) in zip(read_answers(old), read_answers(new), strict=True):
        tally = Tally(name)
        for number, one, other in zip(numbers, before, after, strict=True):
            tally.add(compare(robots[name], number, one, other))
            if shown:
                print(f"{Question.of(robots[name], number)}\nold: {one}\nnew: {other}\n")
        tallies.append(tally)
    return show(tallies)
