"""What processes of a class do in tests: ``python classes.py ROLE FOLDER TOKEN …`` prints what happens."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path

from app.classroom import Hub, NewAttempt


def submits(hub: Hub, token: str) -> None:
    """Submits answers without end; prints the id of each that was confirmed."""
    page = hub.attend(hub.ticket(token), lambda: None)
    page.raise_hand(True)
    page.tell_page("mine")
    for seed in range(1_000_000):
        print(page.submit(NewAttempt("swing", seed, [seed], "right", 1.0, 0.0)).id, flush=True)


def follows(hub: Hub, *tokens: str) -> None:
    """Students who follow; prints each page of the teacher with the times at which it came, in nanoseconds."""
    lock = threading.Lock()
    seen: dict[str, list[int]] = {}
    done = threading.Event()

    def watcher(token: str) -> None:
        latest = [""]

        def changed() -> None:
            page = attendance.room.page
            if page != latest[0]:
                latest[0] = page
                with lock:
                    seen.setdefault(page, []).append(time.monotonic_ns())
                if page == "end":
                    done.set()

        attendance = hub.attend(hub.ticket(token), lambda: changed() if ready.is_set() else None)

    ready = threading.Event()
    for token in tokens:
        watcher(token)
    ready.set()
    print("ready", flush=True)
    done.wait(120)
    time.sleep(0.3)
    for page, times in seen.items():
        print(page, *times, flush=True)


if __name__ == "__main__":
    role, folder, *tokens = sys.argv[1:]
    hub = Hub(Path(folder), None) if "://" not in folder else Hub(Path("/nonexistent"), folder)
    {"submits": submits, "follows": follows}[role](hub, *tokens)
    hub.close()
