"""A program of a few lines that stands for the compiling process of a service, and kernels that it compiles."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.service import compiler

# Lines name files. It ends at one that is called "end", and otherwise waits until the file is there.
PROGRAM = (
    "import os, pathlib, sys, time\n"
    "parent = os.getppid()\n"
    "for line in sys.stdin:\n"
    "    file = pathlib.Path(line.strip())\n"
    "    if file.name == 'end': sys.exit(1)\n"
    "    while not file.exists():\n"
    "        if os.getppid() != parent: sys.exit()  # the test was killed\n"
    "        time.sleep(0.01)\n"
    "    print('done', flush=True)\n"
)


def stand_in_for_the_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on compiling processes run `PROGRAM`."""
    start = compiler.start_process
    monkeypatch.setattr(compiler, "start_process", lambda _, **options: start(PROGRAM, **options))


def kernel(folder: Path, name: str, ready: bool = True) -> str:
    """The line of a kernel, which is compiled at once, or when its file is made."""
    if ready:
        (folder / name).touch()
    return str(folder / name)
