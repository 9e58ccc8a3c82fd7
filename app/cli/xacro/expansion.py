"""The process that expands xacro: it opens no file outside of one folder, no connection, and starts nothing.

xacro evaluates expressions of Python. What they may do is bounded by an audit hook, which no code of the same
process can remove, and by limits of memory and time.
"""

from __future__ import annotations

import json
import os
import site
import sys
import sysconfig
from pathlib import Path
from typing import Any

MEMORY = 1024 * 1024 * 1024  # bytes
SECONDS = 30  # of processor time
DEEPEST = 6  # folders below the given one in which packages are looked for
FORBIDDEN = ("socket", "subprocess", "os.", "shutil", "ctypes", "webbrowser", "urllib", "ftplib", "smtplib", "pty")
ALLOWED = ("os.listdir", "os.scandir")


def main() -> None:
    """Expand the file that standard input names, and print the URDF."""
    request = json.loads(sys.stdin.buffer.read())
    file, folder = Path(request["file"]), Path(request["folder"])
    _limit()
    from xacrodoc import XacroDoc, packages

    packages.update_package_cache(_packages(folder))
    os.chdir(file.parent)
    _confine(folder)
    try:
        document = XacroDoc.from_file(file, walk_up=False, subargs=request["values"], resolve_packages=False)
        print(document.to_urdf_string())
    except Exception as error:  # noqa: BLE001 - the files and their expressions raise anything
        print(f"{type(error).__name__}: {error}".replace("\n", " "), file=sys.stderr)
        sys.exit(1)


def _packages(folder: Path) -> dict[str, str]:
    """The packages below a folder, by the name of their own folder."""
    found: dict[str, str] = {}
    for parent, folders, files in os.walk(folder):
        depth = len(Path(parent).relative_to(folder).parts)
        folders[:] = sorted(name for name in folders if not name.startswith(".") and depth < DEEPEST)
        if "package.xml" in files:
            found.setdefault(Path(parent).name, parent)
    return found


def _limit() -> None:
    if sys.platform == "win32":
        return
    import resource

    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
    if sys.platform == "linux":
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))


def _confine(folder: Path) -> None:
    """From now on only files of the folder, and of Python itself, can be read."""
    places = {sysconfig.get_path("stdlib"), sysconfig.get_path("platstdlib"), *site.getsitepackages(), *sys.path}
    installed = [os.path.realpath(place) for place in places if place]
    inside = os.path.realpath(folder)

    def check(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, mode, flags = (*arguments, None, 0)[:3]
            if isinstance(path, int):
                return
            real = os.path.realpath(os.fsdecode(path))
            writes = (mode and set(str(mode)) & set("wax+")) or (flags or 0) & (os.O_WRONLY | os.O_RDWR)
            code = real.endswith((".py", ".pyc", ".so")) and any(_below(real, place) for place in installed)
            if writes or not (_below(real, inside) or code):
                raise PermissionError(f"{path} is not in the folder {inside}")
        elif event.startswith(FORBIDDEN) and event not in ALLOWED:
            raise PermissionError(f"{event} is not allowed in xacro")

    sys.addaudithook(check)


def _below(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip(os.sep) + os.sep)
