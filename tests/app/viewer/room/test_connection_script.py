"""What a student's page asks the service, and when it says that there is no connection: its scripts, in Node."""

from __future__ import annotations

import json
import subprocess
from itertools import pairwise
from pathlib import Path
from typing import Any

import playwright
import pytest

NODE = Path(playwright.__file__).parent / "driver" / "node"
STATIC = Path(__file__).parents[4] / "static"
ASKED = '["ask"]'
LOST = "No connection. What you typed and opened is kept."
STEADY = [["heard"], ["wait", 100]] * 600  # a minute of a lesson in which the arm moves


def said(*steps: list[Any]) -> list[tuple[float, str]]:
    """What the page asks and says, with the times in ms."""
    command = [str(NODE), str(Path(__file__).with_name("connection.js")), str(STATIC)]
    run = subprocess.run(command, input=json.dumps(steps), capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 0, run.stderr
    assert not run.stderr
    return [(at, what) for at, what in json.loads(run.stdout)]


def test_a_page_that_hears_of_the_service_does_not_ask_for_it() -> None:
    assert said(*STEADY) == []
    answered = [["sent"], ["wait", 50], ["heard"], ["wait", 950]] * 60  # the visitor acts once a second
    assert len(said(["heard"], *answered)) <= 6, "only where a look falls between an act and its answer"


def test_a_page_at_rest_asks_only_where_the_service_gives_no_sign() -> None:
    assert said(*[["heard"], ["wait", 2000]] * 30) == []
    asked = [at for at, what in said(["heard"], ["wait", 60_000]) if what == ASKED]
    pauses = [after - before for before, after in pairwise(asked)]
    assert 5000 <= min(pauses) <= max(pauses) < 5800
    assert said(["heard"], ["hide"], ["wait", 60_000]) == []


@pytest.mark.parametrize(
    ("act", "within"),
    [(["sent"], 2300), (["closed"], 2300), (["event", "offline"], 0), (["wait", 0], 7300)],
    ids=["acts", "closed", "offline", "rests"],
)
def test_a_lost_connection_is_said(act: list[Any], within: float) -> None:
    shown = said(["wait", 1000], ["heard"], ["cut"], act, ["wait", 9000])
    lost = min(at for at, what in shown if what == LOST)
    assert lost - 1000 <= within
    asked = [at for at, what in shown if what == ASKED and at > 1000]
    assert len(asked) >= 2 or act == ["closed"], "it goes on asking, or tries to connect"
    assert shown[-1][1] != "", "and goes on saying so"


def test_a_connection_that_is_back_is_seen() -> None:
    lost = [["heard"], ["cut"], ["sent"], ["wait", 3000], ["mend"]]
    assert [what for _, what in said(*lost, ["wait", 2500]) if what != ASKED] == [LOST, ""]
    assert said(*lost, ["heard"])[-1] == (3000, ""), "what comes from the service shows it at once"
