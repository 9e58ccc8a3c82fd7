"""Extension of Griffe, which reads the docstrings for the reference in docs/python.md.

One entry of a docstring may describe several parameters: ``limits, locked: as in `kin.JointConstraints```.
In the reference each parameter has its own entry. Where the entry names a class or a function, the text is that of
the parameter there. MkDocs warns of an entry whose parameter does not exist.
"""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import griffe

ROOT = Path(__file__).parents[1]
SOURCES = {
    "kin.IKOptions": ("kin/ik/options.py", "IKOptions"),
    "kin.JointConstraints": ("kin/ik/options.py", "JointConstraints"),
    "kin.workspace.capability_grid": ("kin/workspace/capability/blocks.py", "capability_grid"),
    "kin.workspace.sample_workspace": ("kin/workspace/clouds/cloud.py", "sample_workspace"),
    "kin.solve_ik": ("kin/ik/__init__.py", "solve_ik"),
    "kin.solve_path": ("kin/path/__init__.py", "solve_path"),
}
SECTION = re.compile(r"^(Args|Attributes):\n((?:[ ]{4}.*\n|\n(?=[ ]{4}))+)", re.MULTILINE)
ENTRY = re.compile(r"^    (\w+(?:,\s+\w+)*):((?:.*\n)(?:[ ]{8}.*\n|\n)*)", re.MULTILINE)
NAMED = re.compile(r"as in `([\w.]+)`")


class OneByOne(griffe.Extension):
    """Gives each parameter and attribute an entry of its own, and leaves out the docstrings of modules."""

    def on_module(self, *, mod: griffe.Module, **_: object) -> None:
        """The reference shows members; what a module's docstring teaches is on the pages of docs/."""
        mod.docstring = None

    def on_function(self, *, func: griffe.Function, **_: object) -> None:
        """Split the entries of a function's parameters."""
        self._split(func)

    def on_class(self, *, cls: griffe.Class, **_: object) -> None:
        """Split the entries of a class's attributes."""
        self._split(cls)

    @staticmethod
    def _split(described: griffe.Object) -> None:
        if described.docstring is not None:
            described.docstring.value = one_by_one(described.docstring.value)


def one_by_one(docstring: str) -> str:
    """The docstring with one entry for each parameter."""
    return SECTION.sub(lambda found: f"{found[1]}:\n" + "".join(_entries(found[2])), docstring + "\n").rstrip()


def _entries(section: str) -> Iterator[str]:
    for names, text in _described(section):
        for name in names:
            yield f"    {name}: {_text(name, text)}\n"


def _described(section: str) -> Iterator[tuple[list[str], str]]:
    """The names and the text of each entry."""
    for found in ENTRY.finditer(_unwrapped(section)):
        yield re.split(r",\s+", found[1]), " ".join(found[2].split())


def _unwrapped(section: str) -> str:
    """The entries, lists of names that go on in the next line in one line."""
    return re.sub(r",\n {8}(?=[\w, \n]+:)", ", ", section)


def _text(name: str, text: str) -> str:
    """The text of a parameter: that of the same parameter in the class or function that the entry names."""
    for source in NAMED.findall(text):
        source = source if source.startswith("kin.") else f"kin.{source}"
        if (known := _texts(source).get(name)) is not None:
            return known
    return text


@cache
def _texts(source: str) -> dict[str, str]:
    """Texts of the parameters of a class or function, by name."""
    if source not in SOURCES:
        return {}
    file, name = SOURCES[source]
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    docstring = next(
        ast.get_docstring(node)
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == name
    )
    found: dict[str, str] = {}
    for section in SECTION.finditer(textwrap.dedent(docstring or "") + "\n"):
        for names, text in _described(section[2]):
            found |= {each: _text(each, text) for each in names}
    return found
