"""xacro files → URDF, by the extra ``kinboard[xacro]``, in a process of its own (`app.cli.xacro.expansion`)."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from kin import InputError, RobotFileError

PATIENCE = 60.0  # seconds
PACKAGE = "package.xml"  # the file at the top of a ROS package
START = (  # the interpreter's own first place would be the folder that it is started in
    f"import sys; sys.path[:] = sys.argv[1:]; from {__package__}.expansion import main; main()"
)
HOW = "`pip install 'kinboard[xacro]'`, or a URDF that `xacro FILE.xacro > FILE.urdf` writes"


def is_xacro(path: Path) -> bool:
    """Whether a file has to be expanded, by its name."""
    return path.suffix == ".xacro"


def expanded(path: Path, arguments: Sequence[str] = (), folder: str | None = None) -> str:
    """The URDF of a xacro file.

    Args:
        arguments: ``NAME:=VALUE``.
        folder: where the file, what it includes and its packages are; nothing outside is opened. By default the
            folder that the file's package is in or, without a package, the file's own.

    Raises:
        kin.KinematicsError: naming what is wrong; among others, the extra is not installed.
    """
    if importlib.util.find_spec("xacrodoc") is None:
        raise RobotFileError(str(path), "file", "xacro", HOW)
    values = dict(_value(argument) for argument in arguments)
    file = path.resolve()
    root = _folder_of(file) if folder is None else Path(folder).resolve()
    if not root.is_dir() or not file.is_relative_to(root):
        raise InputError("--folder", folder, f"a folder with {path.name} in it")
    request = json.dumps({"file": str(file), "folder": str(root), "values": values})
    command = [sys.executable, "-I", "-W", "ignore", "-X", "utf8", "-c", START, *_places(root)]
    environment = {name: os.environ[name] for name in ("SYSTEMROOT",) if name in os.environ}
    try:
        done = subprocess.run(
            command, input=request.encode(), capture_output=True, timeout=PATIENCE, env=environment, check=False
        )
    except subprocess.TimeoutExpired:
        raise RobotFileError(str(path), "file", f"more than {PATIENCE:g} s of work", "a smaller file") from None
    if done.returncode != 0:
        raise _refusal(str(path), done.stderr.decode("utf-8", "replace"))
    return done.stdout.decode("utf-8", "replace")


def _places(folder: Path) -> list[str]:
    """Where the process imports from: nowhere in the folder, unless Python or this package is installed there."""
    own = Path(__file__).resolve().parents[len(__package__.split("."))]
    installed = (Path(sys.prefix).resolve(), Path(sys.base_prefix).resolve())
    places = [place for place in map(Path, sys.path) if place.is_absolute()]
    real = {place: place.resolve() for place in places}
    return [
        str(place)
        for place in places
        if not real[place].is_relative_to(folder)
        or real[place] == own
        or any(real[place].is_relative_to(prefix) for prefix in installed)
    ]


def _refusal(file: str, said: str) -> RobotFileError:
    """What the process says of a file; its last line is JSON, unless a limit ended it."""
    lines = said.strip().splitlines()
    try:
        report = json.loads(lines[-1]) if lines else {}
    except ValueError:
        report = {}
    if not report:
        return RobotFileError(file, "file", "too much work, or memory", "xacro that can be expanded")
    return RobotFileError(file, report["where"], report["value"], report["expected"])


def _value(argument: str) -> tuple[str, str]:
    name, sign, value = argument.partition(":=")
    if not sign or not name:
        raise InputError("--arg", argument, "NAME:=VALUE")
    return name, value


def _folder_of(file: Path) -> Path:
    """The folder of packages that a file is in."""
    package = next((parent for parent in file.parents if (parent / PACKAGE).is_file()), None)
    return file.parent if package is None else package.parent
