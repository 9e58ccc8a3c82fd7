"""The text of generated files, kept in ``tests/data/generated``: what each construct becomes, and what users read.

After a change that is meant, ``pytest tests/kin/codegen/test_golden.py --snapshot-update`` writes the files anew.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from constructs import RIGHT

import kin
from kin.codegen import c, js
from kin.codegen.rooms import Rooms
from kin.codegen.types import FLOAT, ArrayOf
from kin.codegen.typing import Program

FOLDER = Path(__file__).parents[2] / "data" / "generated"


def constructs(language: str) -> str:
    """The kernels that are right in every language."""
    program, rooms = Program(), Rooms({})
    for kernel in RIGHT:
        rooms.enter(program.add(kernel, FLOAT, FLOAT, ArrayOf(FLOAT, 1)), (None, None, (4,)))
    text, runtime = (c.unit(program, rooms), c.RUNTIME) if language == "c" else (js.unit(program), js.RUNTIME)
    return text.removeprefix(runtime.replace("$SIZE", str(js.SIZE)))


def interface(robot: str, language: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """A file without its kernels and the numbers that they read."""
    for module in (c, js):
        monkeypatch.setattr(module, "unit", lambda *_: "")
    text = kin.generate(robot, language, closest=False)
    text = re.sub(r"^(static const double|const \w+ = vector\().*\n", "", text, flags=re.MULTILINE)
    text = re.sub(r"((?:numbers|wholes)\[|_scratch of )\d+", r"\g<1>0", text)
    return re.sub(r"Kinboard \S+\n// Kernels \w+;", "Kinboard 0.\n// Kernels 0;", text)


@pytest.mark.parametrize("name", ["constructs.c", "constructs.js", "iiwa14.c", "iiwa14.js", "iiwa14.d.ts"])
def test_the_text_is_as_it_was(name, request, monkeypatch):
    stem, _, language = name.partition(".")
    text = constructs(language) if stem == "constructs" else interface(stem, language, monkeypatch)
    file = FOLDER / f"{name}.txt"
    if request.config.getoption("--snapshot-update"):
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")
    assert text == file.read_text(encoding="utf-8")
