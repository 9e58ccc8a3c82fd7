"""The package ``app`` of the repository becomes ``kinboard`` in the wheel.

Other wheels and other projects have a package ``app`` too. In an installation the service has a name of its own,
so neither hides the other.
"""

from __future__ import annotations

import ast
from pathlib import Path

SOURCE, INSTALLED = "app", "kinboard"


def renamed(text: str) -> str:
    """The text of a module in which every import of ``app`` is one of ``kinboard``.

    Raises:
        ValueError: the module imports ``app`` in a form that cannot be renamed, or refers to it in a string.
    """
    lines = text.encode().splitlines(keepends=True)  # positions in the syntax tree count bytes
    tree = ast.parse(text)
    for line, column in sorted(_places(tree, lines), reverse=True):
        found = lines[line][column:]
        if not found.startswith(SOURCE.encode()):
            raise ValueError(f"line {line + 1}: expected the name {SOURCE}")
        lines[line] = lines[line][:column] + INSTALLED.encode() + found[len(SOURCE) :]
    return b"".join(lines).decode()


def _places(tree: ast.Module, lines: list[bytes]) -> list[tuple[int, int]]:
    places = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and _ours(node.module) and node.level == 0:
            column = lines[node.lineno - 1].index(b"from", node.col_offset) + len("from")
            places.append((node.lineno - 1, lines[node.lineno - 1].index(SOURCE.encode(), column)))
        elif isinstance(node, ast.Import):
            for name in node.names:
                if _ours(name.name):
                    if name.asname is None:
                        raise ValueError(f"line {name.lineno}: write 'import {name.name} as …'")
                    places.append((name.lineno - 1, name.col_offset))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and _module_name(node.value):
            raise ValueError(f"line {node.lineno}: the string {node.value!r} names a module, which is renamed")
    return places


def _ours(module: str | None) -> bool:
    return module is not None and (module == SOURCE or module.startswith(SOURCE + "."))


def _module_name(text: str) -> bool:
    return text.startswith(SOURCE + ".") and all(part.isidentifier() for part in text.split("."))


def write_renamed(source: Path, target: Path) -> None:
    """Write the package in `source` to the folder `target`, renamed."""
    for file in sorted(source.rglob("*")):
        if file.is_dir() or "__pycache__" in file.parts:
            continue
        copy = target / file.relative_to(source)
        copy.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix == ".py":
            try:
                copy.write_text(renamed(file.read_text("utf-8")), "utf-8")
            except ValueError as error:
                raise ValueError(f"{file}: {error}") from None
        else:
            copy.write_bytes(file.read_bytes())
