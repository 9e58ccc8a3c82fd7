"""The process that serves a notebook: the service on a free port of this machine, moved by its standard input.

Each line is JSON: ``key`` of the arm, ``path`` of configurations and ``seconds``; or, for a page that will be
opened, ``ticket`` and ``code``. The process ends with its input.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from collections.abc import Iterable
from typing import Any

from app.live import RESERVED, expect
from app.service.main import run
from app.shared.settings import Settings
from app.viewer.shown import SHOWN

# Where notebooks are; `KINBOARD_FRAME_ANCESTORS` names others.
NOTEBOOKS = ("http://localhost:*", "http://127.0.0.1:*")


def follow(lines: Iterable[str]) -> None:
    """Move arms as the lines say."""
    for line in lines:
        command = json.loads(line)
        if "ticket" in command:
            expect(command["ticket"], command["code"])
            continue
        RESERVED.add(command["key"])  # the kernel may connect to the pages that show the arm
        SHOWN.play(command["key"], command["path"], command["seconds"])


def main() -> int:
    """Serve until the input ends."""
    environment: dict[str, Any] = {}
    given = Settings(**environment)
    settings = given.on_this_machine().model_copy(update={"frame_ancestors": (*NOTEBOOKS, *given.frame_ancestors)})

    def until_closed() -> None:
        try:
            follow(sys.stdin)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=until_closed, daemon=True).start()
    return run(settings)


if __name__ == "__main__":
    sys.exit(main())
