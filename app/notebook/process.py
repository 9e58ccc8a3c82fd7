"""The service as a process of its own, for one notebook."""

from __future__ import annotations

import atexit
import json
import os
import re
import subprocess
import sys
import threading
from collections.abc import Mapping
from typing import Any

from kin import KinematicsError

PATIENCE = 180.0  # s until the service must listen; in a checkout it may compile kernels before
STOP = 5.0  # s for its end
_ADDRESS = re.compile(r"https?://[^\s/]*:(\d+)/")


class ServiceProcess:
    """Starts the service and waits until it listens; raises `KinematicsError` if it does not."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", f"{__package__}.child"],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,  # gets no Ctrl-C that interrupts a cell
        )
        self._writing = threading.Lock()
        atexit.register(self.close)
        timer = threading.Timer(PATIENCE, self._process.kill)
        timer.start()
        self.port = self._read_port()
        timer.cancel()
        threading.Thread(target=self._drain, daemon=True).start()

    def _read_port(self) -> int:
        assert self._process.stdout is not None
        said = ""
        for line in self._process.stdout:
            if (found := _ADDRESS.search(line)) is not None:
                return int(found[1])
            said += line
        raise KinematicsError(f"the service of the notebook did not start: {said[-2000:].strip() or 'no answer'}")

    def _drain(self) -> None:
        assert self._process.stdout is not None
        for _ in self._process.stdout:
            pass

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process.poll() is None

    def send(self, command: Mapping[str, Any]) -> None:
        """Tell the process to move an arm; raises `KinematicsError` if it has ended."""
        assert self._process.stdin is not None
        try:
            with self._writing:
                self._process.stdin.write(json.dumps(command) + "\n")
                self._process.stdin.flush()
        except (OSError, ValueError) as error:
            raise KinematicsError("the service of the notebook has ended; call kin.show again") from error

    def close(self) -> None:
        """End the process."""
        atexit.unregister(self.close)
        if self._process.stdin is not None and not self._process.stdin.closed:
            try:
                self._process.stdin.close()
            except OSError:  # the process has ended
                self._process.poll()
        try:
            self._process.wait(STOP)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
