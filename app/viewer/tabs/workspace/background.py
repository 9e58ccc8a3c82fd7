"""Runs slow work of the workspace tab in background threads, which post their results."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import CancelledError

from app.shared.threads import lower_priority
from app.viewer.panel import Post


def run_in_background(work: Callable[[], None], name: str, post: Post) -> None:
    """Run `work` in a thread of low priority; posts ``"failed"`` with the exception if it raises one.

    What is cancelled because its visitor does not want it any more posts nothing.
    """

    def run() -> None:
        lower_priority()
        try:
            work()
        except CancelledError:
            return
        except Exception as error:  # noqa: BLE001 - the receiver of the post raises it
            post("failed", error)

    threading.Thread(target=run, name=f"workspace-{name}", daemon=True).start()
