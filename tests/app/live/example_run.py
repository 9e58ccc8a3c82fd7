"""An example that connects to a page, run beside the test that watches the page."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

from fake_browser import FakeBrowser
from live_code import code_of


class ExampleRun:
    """The example in a thread of its own, with the code of the page.

    Attributes:
        codes: its exit code, once it has ended.
    """

    def __init__(
        self, main: Callable[[Sequence[str]], int], viewer: int, page: FakeBrowser, words: Sequence[object]
    ) -> None:
        self.codes: list[int] = []
        given = [code_of(page), "--address", f"http://127.0.0.1:{viewer}", *map(str, words)]
        self._thread = threading.Thread(target=lambda: self.codes.append(main(given)))
        self._thread.start()

    @property
    def alive(self) -> bool:
        return self._thread.is_alive()

    def wait(self) -> None:
        """Wait for the end."""
        self._thread.join(30.0)
        assert not self.alive

    def end(self, page: FakeBrowser) -> None:
        """Withdraw the code, and wait for the end."""
        if self.alive:
            page.send("GuiUpdateMessage", uuid=page.element("Withdraw the code"), updates={"value": True})
        self.wait()
