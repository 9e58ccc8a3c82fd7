"""The channel of a page in a browser: it is lost alone, and files go beside it. Storage may be forbidden."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from page import KEEP_SOCKETS, Tab
from playwright.sync_api import Browser, ConsoleMessage, expect

import kin
from tests.app.zips import packed, robot_files

pytestmark = [pytest.mark.browser, pytest.mark.full]

PIONEER = kin.get_robot("pioneer5")
FORBIDDEN = """
for (const name of ["localStorage", "sessionStorage"]) {
  Object.defineProperty(window, name, { get: () => { throw new DOMException("forbidden", "SecurityError"); } });
}
"""
UPLOAD_RATE = 3_000_000  # bytes a second


class SocketTab(Tab):
    """A tab whose channel can be cut."""

    scripts = Tab.scripts + KEEP_SOCKETS

    def listen(self, message: ConsoleMessage) -> None:
        if "413" not in message.text:  # the browser's own words for a refusal
            super().listen(message)


@pytest.fixture
def tab(browser: Browser, address: str) -> Iterator[SocketTab]:
    opened = SocketTab(browser, address, 1280, 720)
    opened.show(PIONEER)
    yield opened
    opened.close()


def test_a_page_has_one_channel_and_its_name_stands_in_no_address(tab: SocketTab) -> None:
    addresses = tab.page.evaluate("kbSockets.map(({ url }) => new URL(url).pathname)")
    assert addresses == ["/viewer/channel"]
    name = tab.page.evaluate("channel.name()")
    assert len(name) > 20
    assert name not in tab.page.url


def test_what_is_done_while_the_channel_is_lost_counts_once(tab: SocketTab) -> None:
    page, before = tab.page, tab.tool()
    page.evaluate("kbSockets.at(-1).close()")
    page.evaluate("""() => { for (let k = 0; k < 3; k++) channel.send("nudge", [2, false, 1, false]); }""")
    expect(page.locator("[data-send=undo]")).to_have_attribute("title", re.compile("Target moved by keys"))
    tab.rest()
    assert page.evaluate("kbSockets.length") == 2
    moved = [now - was for now, was in zip(tab.tool(), before, strict=True)]
    page.locator("[data-send=undo]").click()
    tab.rest()
    page.evaluate("""() => { for (let k = 0; k < 3; k++) channel.send("nudge", [2, false, 1, false]); }""")
    tab.rest()
    again = [now - was for now, was in zip(tab.tool(), before, strict=True)]
    assert any(abs(step) > 0.5 for step in moved), "mm"
    assert moved == pytest.approx(again, abs=0.11)


def test_a_message_that_the_service_cannot_read_ends_nothing_else(tab: SocketTab) -> None:
    page = tab.page
    page.evaluate("""() => {
      channel.send("target", ["position", "\\ud800"]);
      channel.send("nothing", 1, (error) => { window.kbRefused = error; });
      channel.send("nudge", [2, false, 1, false]);
    }""")
    expect(page.locator("[data-send=undo]")).to_have_attribute("title", re.compile("Target moved by keys"))
    page.wait_for_function("window.kbRefused === 'The service cannot read this.'")
    assert page.evaluate("kbSockets.length") == 2


def test_a_page_that_is_only_shown_something_answers_once_a_second(tab: SocketTab) -> None:
    counts = tab.page.evaluate("""() => {
      const line = kbSockets.at(-1), sent = [], counts = [], now = performance.now();
      let ahead = 0;
      line.send = (text) => { sent.push(text); };
      performance.now = () => now + ahead;
      const bring = (text) => {
        line.dispatchEvent(new MessageEvent("message", { data: JSON.stringify({ heard: 1e9, ...text }) }));
        counts.push(sent.length);
      };
      bring({});
      for (ahead of [500, 1000, 1001, 1500, 2001, 2002]) bring({ set: { "part-none": ahead } });
      bring({});
      delete performance.now;
      delete line.send;
      return counts;
    }""")
    assert counts == [1, 1, 1, 2, 2, 2, 3, 4]


def test_a_large_file_shows_how_far_it_is_and_cancel_ends_it(tab: SocketTab, tmp_path: Path) -> None:
    files = robot_files() | {"two/meshes/noise.bin": random.Random(1).randbytes(12_000_000)}
    (tmp_path / "two.zip").write_bytes(packed(files))
    (tmp_path / "big.zip").write_bytes(b"PK" + bytes(20_000_000))
    line = tab.page.context.new_cdp_session(tab.page)
    line.send("Network.enable")
    slow = {"offline": False, "latency": 0, "downloadThroughput": -1, "uploadThroughput": UPLOAD_RATE}
    line.send("Network.emulateNetworkConditions", slow)
    tab.open("Robot")
    block, field = tab.page.locator('[data-arm="files"]'), tab.page.locator("[data-arm-file]").first
    field.set_input_files(tmp_path / "two.zip")
    expect(block).to_contain_text(re.compile("Receiving “two.zip”: [1-9].* of 12.0 MB"))
    block.locator('[data-arm-do="cancel"]').click()
    expect(tab.status).to_contain_text("The file was not used; the arm stays as it is")
    expect(block).not_to_contain_text("Receiving")
    line.send("Network.emulateNetworkConditions", slow | {"uploadThroughput": -1})
    field.set_input_files(tmp_path / "big.zip")
    expect(tab.status).to_contain_text("big.zip: size: it is too large, expected at most 20 MB")
    field.set_input_files(tmp_path / "two.zip")
    expect(tab.status).to_contain_text("The meshes of two.zip are shown")


def test_a_browser_that_forbids_storage_opens_the_page(browser: Browser, address: str) -> None:
    class Forgetful(Tab):
        scripts = FORBIDDEN

    opened = Forgetful(browser, address, 1280, 720)
    opened.type_number("1 rotating base", "20")
    opened.wait_for_link(PIONEER, 0, 20)
    opened.close()
