"""What the files of a folder hold, read by another process.

A process that reads SQLite's file beside its own connections gives up their locks when it closes it (POSIX locks
belong to a process, not to an open file: https://www.sqlite.org/howtocorrupt.html, section 2.2). A checkpoint of
another connection then truncates a log that is being read, and that reading fails with "disk I/O error".
"""

from __future__ import annotations

import subprocess
from pathlib import Path


def stored_bytes(folder: Path) -> bytes:
    """The bytes of all files; one that goes away meanwhile is left out."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    return subprocess.run(["cat", "--", *files], capture_output=True, check=False).stdout if files else b""
