"""``kinboard bench``: runs the benchmark, prints tables, writes JSON, a picture and a page."""

from __future__ import annotations

import json
import sys
import time
from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from typing import TextIO

from app.bench import gate, report
from app.bench.board.page import page
from app.bench.board.picture import standalone
from app.bench.board.views import Document
from app.bench.contestants import PEERS, Peer
from app.bench.rows import ROWS, Row
from app.bench.run import Settings, run
from kin import InputError
from kin.kernels.compile import PLAIN

INSTALL = "pip install 'kinboard[bench]'"
_INTERRUPTED = 130  # exit code that shells expect after Ctrl-C


def bench(arguments: Namespace) -> int:
    """Returns 0, or 1 if our own answers are wrong, 2 if it cannot start, 130 after Ctrl-C.

    The verdicts of the gate are printed but do not change the exit code: a single run can fail by noise alone.
    """
    settings = Settings(rows=_rows(arguments.rows), peers=_peers(arguments.peers))
    if arguments.quick:
        settings = settings.quick()
    if arguments.cpu_time:
        settings = replace(settings, clock=time.process_time_ns)
    files = [_file(name, getattr(arguments, name)) for name in ("json", "picture", "html")]
    if PLAIN:
        return _refuse("kernels run as plain Python: unset KINBOARD_KERNELS")
    missing = [peer.name for peer in settings.peers if not peer.installed]
    if missing and arguments.peers:
        words = [INSTALL, *(peer.name for peer in settings.peers if not peer.extra)]
        return _refuse(f"not installed: {', '.join(missing)}. {' '.join(words)} installs all of them")
    if missing:
        print(f"kinboard: not installed: {', '.join(missing)}; {INSTALL} installs them", file=sys.stderr)
    progress = _Progress(sys.stderr)
    try:
        found = run(settings, progress.say)
    except KeyboardInterrupt:
        progress.end()
        return _refuse("stopped before anything was measured", _INTERRUPTED)
    progress.end()
    if not found.rows:
        return _refuse("nothing was measured", _INTERRUPTED if found.interrupted else 1)
    verdicts = gate.judge(found)
    print(report.table(found))
    print("\n" + report.LEGEND)
    print("\n" + "\n".join(report.notes(found)))
    if verdicts:
        print("\ngate, fastest rounds:\n" + "\n".join(map(str, verdicts)))
    _write(report.as_json(found, verdicts, words_of(arguments)), *files)
    for fault in found.faults:
        print(f"kinboard: {fault}", file=sys.stderr)
    if found.interrupted:
        return _INTERRUPTED
    return int(bool(found.faults))


def _write(document: Document, json_file: Path | None, picture_file: Path | None, page_file: Path | None) -> None:
    """Write the files that were asked for; the JSON of a page is beside it."""
    if page_file is not None:
        page_file.write_text(page(document), "utf-8")
        json_file = json_file or page_file.with_suffix(".json")
    if json_file is not None:
        json_file.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", "utf-8")
    if picture_file is not None:
        picture_file.write_text(standalone(document), "utf-8")


def words_of(arguments: Namespace) -> str:
    """The command that repeats the run, without the files it writes."""
    words = ["kinboard bench"]
    words += ["--quick"] * arguments.quick + ["--cpu-time"] * arguments.cpu_time
    for name in ("rows", "peers"):
        if given := getattr(arguments, name):
            words += [f"--{name}", *given]
    return " ".join(words)


def _rows(names: list[str] | None) -> tuple[Row, ...]:
    known = {row.id: row for row in ROWS}
    for name in names or ():
        if name not in known:
            raise InputError("--rows", name, "of " + ", ".join(known))
    return tuple(row for row in ROWS if not names or row.id in names)


def _peers(names: list[str] | None) -> tuple[Peer, ...]:
    known = {peer.name: peer for peer in PEERS}
    if names == ["none"]:
        return ()
    for name in names or ():
        if name not in known:
            raise InputError("--peers", name, "of " + ", ".join(known) + ", or none")
    return tuple(peer for peer in PEERS if (peer.name in names if names else peer.extra or peer.installed))


def _file(name: str, given: str | None) -> Path | None:
    """Path of a file to write; an invalid one is rejected before the run."""
    if given is None:
        return None
    path = Path(given)
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise InputError(f"--{name}", given, "a file in a folder that exists")
    return path


def _refuse(message: str, code: int = 2) -> int:
    print(f"kinboard: {message}", file=sys.stderr)
    return code


class _Progress:
    """Status messages: one line that is overwritten on a terminal, separate lines elsewhere."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._on_terminal = stream.isatty()

    def say(self, words: str) -> None:
        self._stream.write(f"\r\033[K{words}…" if self._on_terminal else f"{words}…\n")
        self._stream.flush()

    def end(self) -> None:
        if self._on_terminal:
            self._stream.write("\r\033[K")
            self._stream.flush()
