"""The page's scripts in Node: the tab that a command opens, and files that are chosen."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import playwright

NODE = Path(playwright.__file__).parent / "driver" / "node"
STATIC = Path(__file__).parents[4] / "static"


def ran(script: str, *steps: list[Any]) -> dict[str, Any]:
    """What a script has sent, and what address and storage have in the end."""
    command = [str(NODE), str(Path(__file__).with_name("scripts.js")), str(STATIC / script)]
    run = subprocess.run(command, input=json.dumps(steps), capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 0, run.stderr
    found: dict[str, Any] = json.loads(run.stdout)
    return found


def test_the_tab_that_a_command_opens_is_that_of_the_page_after_a_reload() -> None:
    found = ran("viewer.js", ["notice", "tab", "Learn"], ["notice", "tab", "Nowhere"])
    assert found["address"] == "/viewer#tab=Learn"
    assert found["kept"]["kinboard-tab"] == "Learn"


def test_of_a_file_that_is_too_large_the_name_alone_is_sent() -> None:
    found = ran("lesson.js", ["file", 3, 3], ["file", 4, 3])
    assert [value for _, _, value in found["sent"]] == [["a.toml", "xxx"], ["a.toml", None]]
