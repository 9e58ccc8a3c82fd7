"""The text that a compiled kernel depends on, and where this user's compiled kernels are kept."""

from __future__ import annotations

import hashlib
import os
import re
import stat
import sys
from functools import cache
from pathlib import Path

_ROOT = str(Path(__file__).parents[2])
# At the top level, or under a condition there: `compile` imports what numba needs under one.
_IMPORT = re.compile(r"^(?: {4})?from (kin[\w.]*) import (?:\(([^)]*)\)|([^(\n]*))", re.MULTILINE)
# How kernels are kept and loaded: what is compiled does not depend on it.
_APART = {str(Path(__file__).parent / f"{name}.py") for name in ("ahead", "cache", "sources")}


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


def shared_with(folder: Path, strangers: int, owners: frozenset[int] = frozenset()) -> str:
    """Who besides this user may change a folder, as its owner and mode; empty: nobody.

    Code from a folder that others may change is not executed. A link counts as a folder of others.

    Args:
        strangers: what nobody else may, as bits of a mode.
        owners: to whom the folder may belong besides this user.
    """
    found = folder.lstat()
    if sys.platform == "win32":  # there, the user's cache folder is private by its access list
        return ""
    private = stat.S_ISDIR(found.st_mode) and not found.st_mode & strangers
    if private and found.st_uid in {os.geteuid(), *owners}:
        return ""
    return f"owner {found.st_uid}, {stat.filemode(found.st_mode)}"


def user_folder() -> Path:
    """The user's cache folder for Kinboard, that of `platformdirs`, which the core does without."""
    if named := os.environ.get("KINBOARD_CACHE"):
        return Path(named)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "kinboard" / "Cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "kinboard"
    return Path(os.environ.get("XDG_CACHE_HOME", "").strip() or Path.home() / ".cache") / "kinboard"
