"""The process of a run that the service starts: low priority, little to read, an end in any case.

It is started with a folder, which :mod:`app.bench.board.runs` describes, and the service's end of a pipe as its
standard input.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from app.bench.board.runs import LIMIT, Status, write_json, write_status

LOOK = 0.2  # seconds between two looks whether the run shall end
COMMAND = "kinboard bench --quick --cpu-time"


def main() -> None:
    """Run the benchmark; its result is in the folder."""
    folder, began = Path(sys.argv[1]), time.time()
    if hasattr(os, "nice"):
        os.nice(19)
    said = [Status("running", "starting", 0.0, began)]

    def end(status: Status) -> None:
        write_status(folder, replace(status, share=said[0].share, started=began))
        os._exit(0)  # another thread may compile, or compute without end

    def say(words: str, share: float) -> None:
        said[0] = Status("running", words, share, began)
        write_status(folder, said[0])

    threading.Thread(target=_watch, args=(folder, began + LIMIT, end), daemon=True).start()
    try:
        write_json(folder / "result.json", _measured(say))
    except Exception as error:
        write_status(folder, Status("failed", f"{type(error).__name__}: {error}", said[0].share, began))
        raise
    write_status(folder, Status("done", "The run is finished.", 1.0, began))


def _measured(say: Callable[[str, float], None]) -> dict[str, object]:
    """The JSON of a quick run."""
    from app.bench import gate, report
    from app.bench.run import Settings, run

    settings = replace(Settings().quick(), clock=time.process_time_ns)
    found = run(settings, say)
    return report.as_json(found, gate.judge(found), COMMAND)


def _watch(folder: Path, until: float, end: Callable[[Status], None]) -> None:
    """End the run when it is cancelled, when it takes too long, or when the service has ended."""
    threading.Thread(target=_end_with_the_service, daemon=True).start()
    while time.time() < until:
        time.sleep(LOOK)
        if (folder / "cancel").exists():
            end(Status("cancelled", "The run was cancelled."))
    end(Status("failed", f"The run was given up after {LIMIT / 60.0:.0f} minutes."))


def _end_with_the_service() -> None:
    sys.stdin.buffer.read()
    os._exit(0)
