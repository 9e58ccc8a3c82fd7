"""What is typed for a question and not sent: when it is there again, by the page's script in Node."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import playwright

NODE = Path(playwright.__file__).parent / "driver" / "node"
STATIC = Path(__file__).parents[4] / "static"
ASK = {"lesson": "Equations", "arm": "ur5", "question": "2", "prompt": "How far?"}
OTHER = {"lesson": "Velocity", "arm": "ur5", "question": "1", "prompt": "How fast?"}
EXERCISE = {"of": "two-elbows 7"}


Case = list[list[Any]]


def typed(*cases: Case) -> list[str]:
    """What stands in the field in the end of each case."""
    command = [str(NODE), str(Path(__file__).with_name("drafts.js")), str(STATIC)]
    run = subprocess.run(command, input=json.dumps(cases), capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 0, run.stderr
    found: list[str] = json.loads(run.stdout)
    return found


def test_what_was_not_sent_is_there_again() -> None:
    begun: Case = [["ask", ASK], ["type", "7"]]
    assert typed([*begun, ["reload"]], [*begun, ["ask", OTHER]], [*begun, ["ask", OTHER], ["ask", ASK]]) == [
        "7",
        "",
        "7",
    ]
    assert typed([*begun, ["ask", {**ASK, "value": "6"}]]) == ["6"], "the service says otherwise"


def test_the_same_question_about_another_arm_has_a_draft_of_its_own() -> None:
    panda = {**ASK, "arm": "panda"}
    begun: Case = [["ask", ASK], ["type", "7"], ["ask", panda]]
    back: Case = [*begun, ["type", "8"], ["ask", ASK]]
    assert typed(begun, back, [*back, ["press", "restart"], ["ask", panda]]) == ["", "7", "8"]


def test_what_the_service_has_is_no_draft_of_another_question_with_the_same_words() -> None:
    sent: Case = [["ask", ASK], ["type", "7"], ["press", "fields"]]
    assert typed([*sent, ["answered"], ["ask", ASK]], [*sent, ["answered"], ["reload"]]) == ["", ""]


def test_what_the_service_does_not_have_stays() -> None:
    sent: Case = [["ask", ASK], ["type", "7"], ["press", "fields"]]
    silent, lost = [*sent, ["ask", ASK]], [*sent, ["answered", "There is no connection."], ["reload"]]
    since = [*sent, ["type", "78"], ["answered"], ["reload"]]
    assert typed(silent, lost, since) == ["7", "7", "78"]


def test_an_answer_that_was_not_read_stays() -> None:
    sent: Case = [["ask", {**ASK, "invalid": True}], ["type", "7,"], ["press", "fields"], ["answered"]]
    assert typed([*sent, ["ask", ASK]]) == ["7,"]


def test_an_exercise_keeps_what_was_sent() -> None:
    assert typed([["ask", EXERCISE], ["type", "7"], ["press", "fields"], ["answered"], ["reload"]]) == ["7"]


def test_a_lesson_that_starts_again_forgets_its_own_drafts_alone() -> None:
    several: Case = [["ask", OTHER], ["type", "5"], ["ask", EXERCISE], ["type", "6"], ["ask", ASK], ["type", "7"]]
    again = [*several, ["press", "restart"]]
    assert typed(*([*again, ["ask", one]] for one in (ASK, OTHER, EXERCISE))) == ["", "5", "6"]
