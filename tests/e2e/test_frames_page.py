"""A page of another site shows the viewer in a frame, if the operator lists that site."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from page import NO_HINTS, PLAIN, WAIT
from playwright.sync_api import Browser, Page, expect

import app.notebook as notebook
import kin

pytestmark = pytest.mark.browser

SCHOOL, STRANGER = "school.localhost", "stranger.localhost"  # browsers take both for this machine


# The texts of marks of one slider that lie on each other.
OVERLAPPING = """[...document.querySelectorAll(".mantine-Slider-root")].flatMap((slider) => {
  const marks = [...slider.querySelectorAll(".mantine-Slider-markLabel")].filter((mark) => mark.offsetParent);
  const [a, b] = [marks[0], marks.at(-1)].map((mark) => mark?.getBoundingClientRect());
  return marks.length > 1 && a.right > b.left ? [marks.map((mark) => mark.textContent).join(" ")] : [];
})"""


@pytest.fixture(scope="module")
def outer(address: str) -> Iterator[int]:
    """The port of a site whose pages have a frame: ``/?embed=panel`` shows the viewer in that mode."""

    class Course(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            frame = f'<iframe src="{address}viewer/{self.path[1:]}" width="800" height="500"></iframe>'
            self.send_response(200)
            self.send_header("content-type", "text/html")
            self.end_headers()
            self.wfile.write(f"<!doctype html><title>Course</title>{frame}".encode())

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Course)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server.server_address[1]
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    opened = browser.new_page(viewport={"width": 900, "height": 700})
    opened.add_init_script(PLAIN + NO_HINTS)
    opened.set_default_timeout(WAIT)
    expect.set_options(timeout=WAIT)
    yield opened
    opened.close()


def test_a_listed_site_embeds_the_viewer(page: Page, outer: int) -> None:
    page.goto(f"http://{SCHOOL}:{outer}/?embed=panel")
    frame = page.frame_locator("iframe")
    expect(frame.locator("[data-status]")).to_have_attribute("data-status", "hand")
    expect(frame.get_by_role("tablist")).to_be_hidden()
    expect(frame.get_by_text("Target must match", exact=True)).to_be_hidden()
    whole = frame.get_by_role("link", name="Open in Kinboard ↗")
    row = frame.get_by_text("1 rotating base", exact=True).locator("xpath=ancestor::div[.//input][1]")
    entry = row.locator("input")
    entry.last.fill("40")
    entry.last.press("Enter")
    expect(frame.locator("[data-status]")).to_contain_text("Joints moved by hand")
    expect(whole).to_have_attribute("href", re.compile(r"/viewer/#s=[\w-]+$"))  # once the arm rests


def test_a_small_frame_opens_with_the_arm_of_its_address_and_no_marks_overlap(page: Page, address: str) -> None:
    page.set_viewport_size({"width": 900, "height": 480})
    page.goto(f"{address}viewer/?embed=panel&robot=ur5")
    expect(page.get_by_text("2 shoulder", exact=True)).to_be_visible()
    expect(page.locator("[data-status]")).to_be_visible()
    overlapping = page.evaluate(OVERLAPPING)
    assert overlapping == []


@pytest.mark.full
def test_the_scene_alone(page: Page, address: str) -> None:
    page.goto(f"{address}viewer/?embed=1")
    expect(page.locator("[data-status]")).to_be_visible()
    expect(page.get_by_text("1 rotating base", exact=True)).to_be_hidden()
    page.wait_for_function(
        "Math.abs(document.querySelector('canvas[data-engine]').getBoundingClientRect().width - innerWidth) < 2"
    )


@pytest.mark.slow
def test_a_notebook_moves_the_arm(page: Page) -> None:
    robot = kin.get_robot("pioneer5")
    view = kin.show(robot, q=robot.q_home)
    try:
        page.goto(view.url.replace("localhost", "127.0.0.1"))  # reloads until the service is ready
        expect(page.locator("[data-status]")).to_be_visible(timeout=4 * WAIT)
        view.q = q = robot.q_home + 0.1
        expect(page.locator("[data-status]")).to_contain_text("moved by the notebook")
        x = f"{1000 * kin.fk(robot, q)[0, 3]:.1f}".replace("-", "−")
        expect(page.locator('table[aria-label="tool pose"] tr').first).to_contain_text(x)
    finally:
        notebook.running().close()


@pytest.mark.full
def test_another_site_does_not(page: Page, outer: int) -> None:
    refused: list[str] = []
    page.on("console", lambda message: refused.append(message.text))
    page.goto(f"http://{STRANGER}:{outer}/?embed=1")
    end = time.monotonic() + WAIT / 1000
    while not any("frame-ancestors" in text for text in refused):
        assert time.monotonic() < end, refused
        page.wait_for_timeout(50)
    expect(page.frame_locator("iframe").locator("[data-status]")).to_have_count(0)
