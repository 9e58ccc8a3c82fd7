"""The options of inverse kinematics as `kin.IKOptions` declares them, for REST and the command line.

They are read from the source of :mod:`kin.ik.options`, which is not imported: help and usage errors of the command
line appear at once, and importing the core takes half a second.
"""

from __future__ import annotations

import ast
import re
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

SOURCES = ("differential/task.py", "ik/options.py")  # of the tasks, and of everything else


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
    found = find_spec("kin")  # of the package alone, which does not run it
    assert found is not None
    assert found.submodule_search_locations
    folder = Path(found.submodule_search_locations[0])
    task, module = (ast.parse((folder / path).read_text(encoding="utf-8")) for path in SOURCES)
    words = {name: _words(value) for each in (task, module) for name, value in _assignments(each)}
    classes = {node.name: node for node in module.body if isinstance(node, ast.ClassDef)}
    limits, options = (_fields(classes[name], words) for name in ("JointConstraints", "IKOptions"))
    rows: dict[str, Option] = {}
    for name, option in options.items():
        rows |= limits if name == "constraints" else {name: option}
    return rows


def _assignments(module: ast.Module) -> list[tuple[str, ast.expr]]:
    return [
        (node.targets[0].id, node.value)
        for node in module.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
    ]


def _words(value: ast.expr) -> tuple[str, ...]:
    """The words of a `Literal`; none for anything else."""
    if isinstance(value, ast.Subscript) and ast.unparse(value.value) == "Literal":
        found = ast.literal_eval(value.slice)
        return found if isinstance(found, tuple) else (found,)
    return ()


def _fields(node: ast.ClassDef, words: dict[str, tuple[str, ...]]) -> dict[str, Option]:
    texts = _texts(ast.get_docstring(node) or "")
    rows = {}
    for each in node.body:
        if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name):
            name, kind = each.target.id, ast.unparse(each.annotation)
            unit = re.search(r"Range\(.*'(\w+)'\)", kind)
            default = each.value.value if isinstance(each.value, ast.Constant) else None
            of = "" if unit is None else unit[1]
            rows[name] = Option(name, texts[name], default, words.get(kind, ()), kind == "bool", of)
    return rows


def _texts(docstring: str) -> dict[str, str]:
    """The entries of the section *Attributes* of a docstring, each on one line and without its full stop."""
    section = re.search(r"^Attributes:\n((?: {4}.*\n?|\n(?= ))*)", docstring, re.M)
    assert section is not None
    entries = re.findall(r"^(\w+): (.*(?:\n .*)*)", dedent(section[1]), re.M)
    return {name: " ".join(text.split()).removesuffix(".") for name, text in entries}
