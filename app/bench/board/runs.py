"""Runs of the benchmark that the service starts: one at a time, in a process of its own, with an end.

Several processes of a service may be asked to start a run, how far it is, and to cancel it. All of them, and the
process of the run, share a folder:

- ``lock``: locked by the process of the run as long as it lives, also where it is killed;
- ``status.json``: what the run says of itself;
- ``cancel``: exists when the run shall end;
- ``result.json``: the last run that was finished.

The process of the run reads a pipe of the process that started it, and ends with it.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from app.bench.board.views import Document

LIMIT = 900.0  # seconds until a run is given up
# Tries to lock, and seconds between two: a process that asks how far a run is has the lock for a moment, and a run
# that has said its last word for a moment longer.
_LOOKS, _TRIES, _WAIT = 4, 250, 0.02
_KEPT = (
    *("PATH", "HOME", "LANG", "LC_ALL", "TMPDIR"),
    *("XDG_CACHE_HOME", "KINBOARD_CACHE", "NUMBA_CACHE_DIR", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"),
)

State = Literal["idle", "running", "done", "failed", "cancelled"]


@dataclass(frozen=True, slots=True)
class Status:
    """How far a run is.

    Attributes:
        share: of the run that is done, from 0 to 1.
        started: seconds since 1970; 0 if no run was started.
    """

    state: State = "idle"
    words: str = "No run was started yet."
    share: float = 0.0
    started: float = 0.0


class Runs:
    """Starts runs, one at a time for all that share the folder.

    Args:
        folder: what the processes of the service share; None: a folder of this process.
        command: what the process of a run executes, for tests.
    """

    def __init__(self, folder: Path | None = None, command: Sequence[str] | None = None) -> None:
        self._own = folder is None
        self.folder = Path(tempfile.mkdtemp(prefix="kinboard-bench-")) if folder is None else folder
        package = (__package__ or "").rpartition(".")[0]
        self._command = command or [sys.executable, "-c", f"from {package}.child import main; main()"]
        self._process: subprocess.Popen[bytes] | None = None
        self._turn = threading.Lock()

    def start(self) -> bool:
        """Start a run; False if one is under way."""
        with self._turn:
            for k in range(_TRIES):
                with _free(self.folder) as lock:
                    if lock is not None:
                        self._begin(lock)
                        return True
                said = _read(self.folder / "status.json")
                if k >= _LOOKS and said is not None and said["state"] == "running":
                    break
                time.sleep(_WAIT)
        return False

    def _begin(self, lock: int) -> None:
        self._reap()
        (self.folder / "cancel").unlink(missing_ok=True)
        write_status(self.folder, Status("running", "starting", 0.0, time.time()))
        with (self.folder / "log").open("wb") as log:
            self._process = subprocess.Popen(
                [*self._command, str(self.folder)],
                env=_environment(),
                pass_fds=[lock],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=log,
            )

    def cancel(self) -> bool:
        """Ask the run to end, which takes a second; False if there is none."""
        if self.status().state != "running":
            return False
        (self.folder / "cancel").touch()
        return True

    def status(self) -> Status:
        """How far the run is. One whose process was killed has failed."""
        with self._turn:
            self._reap()
            with _free(self.folder) as lock:
                alive = lock is None
                said = _read(self.folder / "status.json")
        found = Status() if said is None else Status(**said)
        if found.state == "running" and not alive:
            return Status("failed", "The run ended before it was finished.", found.share, found.started)
        return found

    def result(self) -> Document | None:
        """The last finished run."""
        return _read(self.folder / "result.json")

    def close(self) -> None:
        """End the run of this process, and remove the folder if it is its own."""
        with self._turn:
            if self._process is not None:
                self._process.kill()
                self._reap(wait=True)
            if self._own:
                shutil.rmtree(self.folder, ignore_errors=True)

    def _reap(self, wait: bool = False) -> None:
        process = self._process
        if process is None:
            return
        if wait:
            process.wait()
        if process.poll() is not None:
            assert process.stdin is not None
            process.stdin.close()
            self._process = None


def write_status(folder: Path, status: Status) -> None:
    """Replace what the run says of itself."""
    write_json(folder / "status.json", asdict(status))


def write_json(file: Path, document: Document) -> None:
    """Replace a file at once, so that nobody reads half of it."""
    part = file.with_suffix(".part")
    part.write_text(json.dumps(document, allow_nan=False), "utf-8")
    part.replace(file)


def _read(file: Path) -> Document | None:
    try:
        found = json.loads(file.read_text("utf-8"))
    except FileNotFoundError:
        return None
    assert isinstance(found, dict)
    return found


@contextlib.contextmanager
def _free(folder: Path) -> Iterator[int | None]:
    """The locked file; None if the process of a run has locked it. A child that inherits it keeps the lock."""
    if sys.platform == "win32":
        raise OSError("runs cannot be started on Windows")
    import fcntl

    folder.mkdir(mode=0o700, exist_ok=True)  # programs that clean up temporary files remove it after some days
    file = os.open(folder / "lock", os.O_RDWR | os.O_CREAT, 0o600)
    try:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield None
        else:
            yield file
    finally:
        os.close(file)


def _environment() -> dict[str, str]:
    """What the run needs of the environment: nothing of the settings, which hold the token."""
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    threads = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR")}
    return kept | threads | {"PYTHONPATH": os.pathsep.join(sys.path)}
