"""What processes do in tests of their supervision: a module that is imported quickly, by each of them."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path


def fails(part: object, alive: Callable[[], None]) -> int:
    """Ends at once."""
    return 3


def stops_once(noted: Path, part: object, alive: Callable[[], None]) -> int:
    """The first time it stops after its first report; the second time it ends the service."""
    first = not noted.exists()
    with noted.open("a") as file:
        print(os.getpid(), file=file)
    alive()
    os.kill(*((os.getpid(), signal.SIGSTOP) if first else (os.getppid(), signal.SIGTERM)))
    time.sleep(60)
    return 0


def ignores(code: int, part: object, alive: Callable[[], None]) -> int:
    """Ignores the signal to stop."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    os.kill(os.getppid(), signal.SIGTERM)
    time.sleep(60)
    return code
