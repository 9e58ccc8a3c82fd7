"""What is typed stays, however late the service answers: a service that is held up most of the time."""

from __future__ import annotations

import contextlib
import random
import signal
import threading
from collections.abc import Iterator

import psutil
import pytest
from page import Tab
from playwright.sync_api import Locator, expect

pytestmark = pytest.mark.browser

HELD, RUNS = 0.25, 0.05  # seconds, in turns: an answer that takes some milliseconds takes a third of a second
SEED = 11


@contextlib.contextmanager
def held_up(address: str) -> Iterator[None]:
    """Stop the processes of the service most of the time."""
    port = int(address.rstrip("/").rpartition(":")[2])
    ours = psutil.Process().children(recursive=True)
    found = [each for each in ours if any(c.laddr.port == port for c in each.net_connections() if c.laddr)]
    assert found
    ended = threading.Event()

    def hold() -> None:
        while not ended.is_set():
            for process in found:
                process.send_signal(signal.SIGSTOP)
            ended.wait(HELD)
            for process in found:
                process.send_signal(signal.SIGCONT)
            ended.wait(RUNS)

    holding = threading.Thread(target=hold)
    holding.start()
    try:
        yield
    finally:
        ended.set()
        holding.join()


def test_a_length_typed_right_after_the_kind_of_a_joint_stays(desktop: Tab, address: str) -> None:
    page = desktop.page
    desktop.open("Robot")
    page.locator('[data-cell="start"]').select_option("ur5")
    length = page.locator('[data-cell="2 a"]')
    expect(length).to_have_value("−392.25")
    with held_up(address):
        page.locator('[data-cell="2 kind"]').select_option("prismatic")
        length.click()
        page.keyboard.type("-120.5", delay=60)
        expect(page.locator("[data-arm] tr[data-row=\"2\"] .kb-arm-variable [data-cell=\"2 d\"]")).to_be_visible()
        page.wait_for_timeout(1000)
        expect(length).to_have_value("-120.5")
        expect(length).to_be_focused()
    page.get_by_role("heading", name="Convert").click()
    expect(length).to_have_value("−120.5")
    expect(page.locator('[data-cell="2 kind"]')).to_have_value("prismatic")
