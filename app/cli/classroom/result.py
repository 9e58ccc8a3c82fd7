"""``kinboard result`` checks a result code; ``kinboard results`` writes the attempts of a room as CSV."""

from __future__ import annotations

import codecs
import sys
from argparse import Namespace
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from app.classroom import ClassroomUnavailable, Hub
from app.classroom.courses import SentExercises
from app.classroom.results.check import check_code, facts
from app.classroom.results.store import pages_of, sent_to
from app.classroom.results.table import csv_of
from app.classroom.tokens import read_code
from app.classroom.work import Attempt
from app.cli.pipes.sink import opened_output
from app.cli.terminal import print_json
from app.exercises import Exercises
from app.shared.settings import Settings
from app.shared.store import Store
from kin import InputError, KinematicsError


def run_result(arguments: Namespace) -> int:
    """Print what a code says; returns 1 if this service has not signed it."""
    hub = Hub.of(_settings())
    try:
        checked = check_code(" ".join(arguments.code), hub)
    finally:
        hub.close()
    if arguments.json:
        print_json(facts(checked))
    elif checked.outcome is None:
        print(f"{checked.status}: {checked.message}", file=sys.stderr)
    else:
        outcome = checked.outcome
        print(f"signed      by this service, on {outcome.day}")
        print(f"{outcome.kind:10}  {outcome.title} ({outcome.fingerprint.hex()})")
        print(f"alias       {outcome.alias}")
        print(
            f"score       {outcome.score} %, {outcome.solved} of {outcome.count} solved, {outcome.tries} answers"
        )
    return 0 if checked.outcome is not None else 1


def run_results(arguments: Namespace) -> int:
    """Write the attempts of a room."""
    settings = _settings()
    hub = Hub.of(settings)
    try:
        wanted = read_code(arguments.room)
        room = next((each for each in hub.rooms.all() if each.code == wanted), None) if hub.in_use else None
        if room is None:
            raise InputError("room", arguments.room, "the join code of a room; `kinboard room list` shows them")
        find, own = Store(settings.robots).get, sent_to(hub.database, room.id).own
        titles = SentExercises(Exercises(settings.exercises, find), own, find).titles
        pages = pages_of(hub.database, room.id)
        if arguments.output in (None, "-"):
            for text in csv_of(pages, titles):
                print(text, end="")
        else:
            print(f"{arguments.output}: {_write(arguments.output, pages, titles)} attempts")
    except ClassroomUnavailable as error:
        raise KinematicsError(str(error)) from None
    finally:
        hub.close()
    return 0


def _write(path: str, pages: Iterable[Sequence[Attempt]], titles: Mapping[str, str]) -> int:
    """Write the file; returns how many attempts are in it."""
    count = 0

    def counted() -> Iterator[Sequence[Attempt]]:
        nonlocal count
        for page in pages:
            count += len(page)
            yield page

    with opened_output(path) as file:
        file.write(codecs.BOM_UTF8)  # spreadsheets know the letters then
        file.writelines(text.encode() for text in csv_of(counted(), titles))
    return count


def _settings() -> Settings:
    """From the environment."""
    given: dict[str, Any] = {}
    return Settings(**given)
