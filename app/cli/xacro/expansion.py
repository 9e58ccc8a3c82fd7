"""The process that expands xacro: it opens no file outside of one folder, no connection, and starts nothing.

xacro evaluates expressions of Python. Three things bound them. Their names are checked
(`app.cli.xacro.expressions`). Once all modules are imported, an audit hook, which no code can remove,
refuses further imports, files outside of the folder, writing, connections and processes. Memory, time, the
size of files and, unless run by root, the number of processes are limited. The environment is empty, and no
code is imported from the folder.

This is no sandbox of the operating system. An error in Python, in its XML or YAML parser or in these checks would
give the file the rights of the user: expand files of strangers as another user or in a container.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

from app.shared.threads.confined import limit_this_process

MEMORY = 1024 * 1024 * 1024  # bytes
SECONDS = 30  # of processor time
DEEPEST = 6  # folders below the given one in which packages are looked for
LONGEST = 300  # characters of a cause
FORBIDDEN = (
    *(
        "socket",
        "subprocess",
        "os.",
        "shutil",
        "ctypes",
        "webbrowser",
        "urllib",
        "ftplib",
        "smtplib",
        "pty",
        "glob",
    ),
    *("object.__getattr__", "object.__setattr__", "object.__delattr__", "code.__new__", "function.__new__"),
    *("sys._", "sys.set", "gc.", "marshal.", "pickle.", "mmap.", "fcntl.", "signal.", "builtins.input"),
)
LISTED = ("os.listdir", "os.scandir", "glob.glob", "glob.glob/2")  # of which the folder is checked
TRIAL = """<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="n" default="1"/>
<xacro:macro name="m" params="p:=1"><link name="${p}$(arg n)"/></xacro:macro><xacro:m/></robot>"""


def main() -> None:
    """Expand the file that standard input names, and print the URDF."""
    request = json.loads(sys.stdin.buffer.read())
    file, folder = Path(request["file"]), Path(request["folder"])
    limit_this_process(MEMORY, SECONDS, alone=True)
    import encodings.ascii
    import encodings.cp1252
    import encodings.latin_1
    import encodings.utf_8_sig
    import encodings.utf_16
    import encodings.utf_32  # noqa: F401 - what the XML of the folder may be written in

    import xacro
    import yaml
    from xacrodoc import XacroDoc

    from app.cli.xacro import expressions

    XacroDoc.from_string(TRIAL).to_urdf_string()  # imports what xacro imports late
    yaml.safe_load("a: [1, 2001-01-01]")
    expressions.bound(file, folder, _packages(folder))
    os.environ.clear()
    _confine(os.path.realpath(folder), expressions.RefusedError)
    try:
        document = XacroDoc.from_file(file, walk_up=False, subargs=request["values"], resolve_packages=False)
        print(document.to_urdf_string())
    except Exception as error:  # noqa: BLE001 - the files and their expressions raise anything
        print(
            "\n" + json.dumps(_report(error, folder, xacro.filestack[-1] if xacro.filestack else file)),
            file=sys.stderr,
        )
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


def _confine(folder: str, refused: type[Exception]) -> None:
    """From now on nothing is imported, and only files of the folder are read."""

    def inside(path: str | bytes) -> None:
        real = os.path.realpath(os.fsdecode(path))
        if real != folder and not real.startswith(folder.rstrip(os.sep) + os.sep):
            shown = os.path.relpath(os.fsdecode(path), folder)
            raise refused(shown, f"a file in the folder {folder} (--folder DIR)")

    def check(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, mode, flags = (*arguments, None, 0)[:3]
            if isinstance(path, int):
                raise refused(str(path), "the name of a file")
            if (mode and set(str(mode)) & set("wax+")) or (flags or 0) & (os.O_WRONLY | os.O_RDWR):
                raise refused(str(path), "nothing: xacro may not write")
            inside(path)
        elif event in LISTED:
            inside(arguments[0] if event.startswith("os.") else str(Path(arguments[0]).parent))
        elif event == "import":
            raise ImportError(f"{arguments[0]} may not be imported by xacro")
        elif event.startswith(FORBIDDEN):
            raise refused(event, "what xacro may do: read files and compute")

    sys.addaudithook(check)


def _report(error: BaseException, folder: Path, file: str | Path) -> dict[str, str]:
    """The cause first: where, what was found and what is valid."""
    where, expression = os.path.relpath(file, folder), ""
    while getattr(error, "exc", None) is not None:  # xacro wraps errors
        expression = str(getattr(error, "suffix", None) or expression)
        error = getattr(error, "exc")  # noqa: B009 - a name of xacro's exceptions only
    cause = str(error)[:LONGEST].replace("\n", " ")
    if hasattr(error, "expected"):
        value, expected = str(getattr(error, "value", "")), str(error.expected)
    elif type(error).__name__ == "ArgException":
        value, expected = f"$(arg {cause})", f"a value or a default (--arg {cause}:=VALUE)"
    elif isinstance(error, OSError) and error.filename:
        value, expected = os.path.relpath(error.filename, folder), f"a file that can be read ({error.strerror})"
    elif expression:
        value = expression.strip().removeprefix("when evaluating expression ")[1:-1]
        expected = f"an expression that can be evaluated ({type(error).__name__}: {cause})"
    else:
        value, expected = where, f"xacro that can be expanded ({cause or type(error).__name__})"
    return {"where": where, "value": value, "expected": expected}
