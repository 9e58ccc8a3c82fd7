"""The text that a compiled kernel depends on."""

from __future__ import annotations

import hashlib
import os
import re
from functools import cache
from pathlib import Path

_ROOT = str(Path(__file__).parents[2])
# At the top level, or under a condition there.
_IMPORT = re.compile(r"^(?: {4})?from (kin[\w.]*) import (?:\(([^)]*)\)|([^(\n]*))", re.MULTILINE)
# How kernels are called: what is compiled does not depend on it.
_APART = {str(Path(_ROOT, "kin", "kernels", f"{name}.py")) for name in ("ahead", "compile", "plain")}


@cache
def fingerprint(file: str) -> str:
    """Hash of the text of a Python file and of all modules of the core that it imports, directly or not."""
    found, waiting = {file}, [file]
    while waiting:
        new = _read(waiting.pop())[1] - found
        found |= new
        waiting += new
    return hashlib.blake2b(b"".join(sorted(_read(each)[0] for each in found)), digest_size=16).hexdigest()


@cache
def _read(file: str) -> tuple[bytes, frozenset[str]]:
    """Hash of the text of a file, and the files of the core that it imports, also under a condition."""
    text = Path(file).read_text(encoding="utf-8")
    imports = set()
    for module, several, one in _IMPORT.findall(text):
        place = file_of(module)
        names = [name.split()[0] for name in (several or one).split(",") if name.split()]
        imports |= {place, *(file_of(f"{module}.{name}") for name in names)} - {None, *_APART}
    return hashlib.blake2b(text.encode(), digest_size=16).digest(), frozenset(map(str, imports))


@cache
def file_of(module: str) -> str | None:
    """The file of a module or package of the core; None for another name. Plain strings: `Path` takes longer."""
    place = os.path.join(_ROOT, *module.split("."))  # noqa: PTH118
    return next((file for file in (f"{place}.py", f"{place}/__init__.py") if os.path.isfile(file)), None)  # noqa: PTH113
