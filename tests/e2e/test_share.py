"""Links, reloads and lost connections restore the view; an own arm; the landing page with its request box."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
import time
from collections.abc import Iterator
from urllib.parse import parse_qs, urlsplit

import msgspec
import numpy as np
import pytest
from page import WAIT, Tab, save_picture
from playwright.sync_api import Browser, FilePayload, FrameLocator, Page, expect

import kin
from app.viewer.panel.joints import LOCKED
from app.viewer.scene import camera
from app.viewer.scene.meshes import body
from app.viewer.session.state import PageState, decode, encode

pytestmark = pytest.mark.browser

PIONEER, UR5 = kin.get_robot("pioneer5"), kin.get_robot("ur5")
ROBOTS = tuple(kin.files.classic_robots().values())


class Proxy:
    """A TCP proxy in front of the service whose connections can be cut, as by pulling a cable."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._ends: list[socket.socket] = []
        self.address = f"http://127.0.0.1:{self._listener.getsockname()[1]}/"
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                visitor, _ = self._listener.accept()
                service = socket.create_connection(("127.0.0.1", self._port))
                self._ends += [visitor, service]
                for source, sink in ((visitor, service), (service, visitor)):
                    threading.Thread(target=self._carry, args=(source, sink), daemon=True).start()

    def _carry(self, source: socket.socket, sink: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                sink.sendall(data)
            sink.shutdown(socket.SHUT_WR)

    def cut(self) -> int:
        """End every connection; returns how many there were."""
        ends, self._ends = self._ends, []
        for end in ends:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
        return len(ends)

    def close(self) -> None:
        self.cut()
        self._listener.close()


@pytest.fixture(scope="module")
def proxy(address: str) -> Iterator[Proxy]:
    port = urlsplit(address).port
    assert port is not None
    opened = Proxy(port)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def shared(browser: Browser, proxy: Proxy) -> Iterator[Tab]:
    opened = Tab(browser, proxy.address, 1280, 720)
    opened.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    yield opened
    opened.close()


def state_of(page: Page) -> PageState:
    """The state that the URL contains."""
    return decode(page.evaluate("new URLSearchParams(location.hash.slice(1)).get('s') ?? ''"), ROBOTS)


def wait_for_url(page: Page, key: str) -> None:
    page.wait_for_function("key => new URLSearchParams(location.hash.slice(1)).has(key)", arg=key, timeout=WAIT)


def turned(degrees: float) -> np.ndarray:
    q = PIONEER.q_home.copy()
    q[0] = np.radians(degrees)
    return q


def wait_for_tool(page: Page, shown: Page | FrameLocator, T: np.ndarray) -> None:
    """Wait until the panel shows the position of this pose; a page that reconnects shows none."""
    wanted = 1000 * T[:3, 3]
    cells = shown.locator('table[aria-label="tool pose"] tr').first.locator("td span")
    end = time.monotonic() + WAIT / 1000
    while True:
        numbers = [float(text.replace("−", "-")) for text in cells.all_inner_texts()]
        if len(numbers) == 3 and np.abs(np.array(numbers) - wanted).max() < 0.06:
            return
        assert time.monotonic() < end, f"the tool is at {numbers}, expected {wanted}"
        page.wait_for_timeout(50)


def cameras(page: Page) -> list[np.ndarray]:
    """A list that grows with each camera ``(2, 3)``, position and target, that a reconnecting page reports."""
    reported: list[np.ndarray] = []

    def note(frame: str | bytes) -> None:
        message = msgspec.msgpack.decode(frame) if isinstance(frame, bytes) else {}
        if message.get("type") == "ViewerCameraMessage":
            reported.append(np.array([message["position"], message["look_at"]]))

    page.on("websocket", lambda socket: socket.on("framesent", note))
    return reported


def wait_for_camera(page: Page, reported: list[np.ndarray], place: np.ndarray) -> None:
    end = time.monotonic() + WAIT / 1000
    while not reported or np.abs(reported[-1] - place).max() > 2e-3:
        assert time.monotonic() < end, f"the camera is at {reported[-1:]}, expected {place}"
        page.wait_for_timeout(50)


def wait_for_viewpoint(page: Page) -> np.ndarray:
    """The camera in the URL, once it no longer changes."""
    end = time.monotonic() + WAIT / 1000
    before = None
    while (kept := state_of(page).camera) is None or before is None or not np.array_equal(kept, before):
        assert time.monotonic() < end, "the URL contains no camera"
        before = kept
        page.wait_for_timeout(1000)
    return kept


def orbit(page: Page, right: int, down: int) -> None:
    """Orbit the view by dragging the floor."""
    area = page.locator("canvas").first.bounding_box()
    assert area is not None
    x, y = area["x"] + 0.12 * area["width"], area["y"] + 0.7 * area["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + right, y + down, steps=8)
    page.mouse.up()


@pytest.mark.full
@pytest.mark.parametrize(
    ("said", "opened"), [pytest.param("", "Learn", marks=pytest.mark.slow), ("&tab=Robot", "Robot")]
)
def test_a_link_to_a_lesson_opens_it(browser: Browser, address: str, said: str, opened: str) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.goto(f"{address}viewer/#s={encode(PageState(PIONEER.id, lesson='dh'))}{said}")
    expect(page.locator("[data-status]").first).to_be_attached(timeout=4 * WAIT)
    page.wait_for_function("channel.value('start')?.[0]", timeout=WAIT)
    expect(page.get_by_role("tab", name=opened, exact=True)).to_have_attribute("aria-selected", "true")
    wait_for_url(page, "tab")
    assert parse_qs(urlsplit(page.url).fragment)["tab"] == [opened]
    page.get_by_role("tab", name="Move", exact=True).click()
    expect(page.get_by_role("tab", name="Move", exact=True)).to_have_attribute("aria-selected", "true")
    page.wait_for_function("location.hash.includes('tab=Move')")  # the link has what was turned to
    page.reload()
    expect(page.locator("[data-status]").first).to_be_attached(timeout=4 * WAIT)
    expect(page.get_by_role("tab", name="Move", exact=True)).to_have_attribute("aria-selected", "true")
    page.close()


def test_link_reload_and_lost_connection(shared: Tab, proxy: Proxy, browser: Browser) -> None:
    page = shared.page
    assert page.url == proxy.address + "viewer/", "a fresh page has a short URL"
    shared.type_number("1 rotating base", "37.25")
    wait_for_url(page, "s")
    assert np.abs(state_of(page).q - turned(37.25)).max() < 1e-9

    page.get_by_role("button", name="2", exact=True).click()
    expect(page.get_by_role("button", name=f"{LOCKED}2", exact=True)).to_be_visible()
    orbit(page, 260, -60)
    place = wait_for_viewpoint(page)[:2]
    assert np.abs(place - np.stack(camera.view(body(PIONEER), 1.6))).max() > 0.3
    shared.screenshot("share-orbited")
    reported = cameras(page)  # of later connections

    page.get_by_role("tab", name="View").click()
    wait_for_url(page, "tab")
    with page.expect_event("framenavigated", timeout=WAIT):
        shared.choose("Page colours", "Dark")
    shared.screenshot("share-dark")
    with page.expect_event("framenavigated", timeout=WAIT):
        shared.choose("Page colours", "Light")
    shared.screenshot("share-light")
    page.get_by_role("button", name="Copy code").click()
    page.wait_for_function("navigator.clipboard.readText().then(text => text.startsWith('curl -s http'))")
    page.get_by_role("button", name="Copy link").click()
    page.wait_for_function("navigator.clipboard.readText().then(text => text.includes('/viewer/#s='))")
    link = page.evaluate("navigator.clipboard.readText()")

    page.reload()
    expect(shared.status).to_have_attribute("data-status", "hand")
    shared.wait_for_tool(kin.fk(PIONEER, turned(37.25))[:3, 3], within=0.06)
    expect(page.get_by_role("tab", name="View")).to_have_attribute("aria-selected", "true")
    wait_for_camera(page, reported, place)

    page.get_by_role("tab", name="Move").click()
    expect(page.get_by_role("button", name=f"{LOCKED}2", exact=True)).to_be_visible()
    shared.type_number("1 rotating base", "60")
    page.wait_for_function("link => !link.includes(location.hash.split('&')[0])", arg=link, timeout=WAIT)
    shared.screenshot("share-restored")
    page.evaluate("window.sinceLoad = true")
    with page.expect_websocket(timeout=WAIT):
        assert proxy.cut() > 0
    wait_for_tool(page, page, kin.fk(PIONEER, turned(60)))
    assert page.evaluate("window.sinceLoad"), "the page was not reloaded"
    wait_for_camera(page, reported, place)
    assert state_of(page).locks == (1,)

    other = browser.new_page(viewport={"width": 1280, "height": 720})
    other.goto(link)
    expect(other.locator("[data-status]")).to_have_attribute("data-status", "hand", timeout=WAIT)
    wait_for_tool(other, other, kin.fk(PIONEER, turned(37.25)))
    other.close()
    shared.wait_for_tool(kin.fk(PIONEER, turned(60))[:3, 3], within=0.06)


@pytest.mark.full
def test_the_landing_page_asks_again_after_a_failed_start(browser: Browser, address: str) -> None:
    page = browser.new_page()
    page.route("**/readyz", lambda route: route.fulfill(status=503, body='{"status": "failed"}'))
    page.route("**/viewer/", lambda route: route.fulfill(body="the viewer"))
    page.goto(address)
    expect(page.locator("#state-text")).to_contain_text("The service could not start whole")
    page.unroute("**/readyz")
    expect(page.locator("#frame iframe")).to_have_count(1, timeout=WAIT)
    page.close()


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "width", "height", "scheme"),
    [("light", 1280, 720, "light"), ("dark", 1280, 720, "dark"), ("phone", 390, 844, "dark")],
)
def test_the_landing_page(browser: Browser, address: str, name: str, width: int, height: int, scheme: str) -> None:
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    if name != "light":  # loading the embedded viewer once is enough: it is rendered in software
        page.route("**/readyz", lambda route: route.fulfill(status=503, body='{"status": "starting"}'))
    page.goto(address)
    expect(page.locator(".card h3 a:visible")).to_have_count(len(ROBOTS) + 1)  # the visitor's own
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "nothing sticks out"
    page.locator("#cards").scroll_into_view_if_needed()
    page.evaluate(
        "document.querySelectorAll('.card:not([hidden]) img').forEach(image => { image.loading = 'eager'; })"
    )
    expect(page.locator(".shown svg")).to_have_count(1)
    loaded = "[...document.querySelectorAll('.shown img')].filter(image => image.naturalWidth === 320).length"
    end = time.monotonic() + WAIT / 1000
    while page.evaluate(loaded) != len(ROBOTS):
        assert time.monotonic() < end, page.evaluate(loaded)
        page.wait_for_timeout(50)

    page.get_by_role("button", name="Inverse").click()
    page.get_by_role("button", name="Send").click()
    expect(page.locator("#outcome")).to_contain_text("200", timeout=WAIT)
    expect(page.locator("#answer")).to_contain_text('"status": "solved"')
    page.locator("#body").fill('{"target": 5}')
    page.get_by_role("button", name="Send").click()
    expect(page.locator("#outcome")).to_contain_text("422", timeout=WAIT)
    page.get_by_role("button", name="Workspace").click()
    page.get_by_role("button", name="Send").click()
    expect(page.locator("#outcome")).to_contain_text("200", timeout=WAIT)
    save_picture(page, f"landing-{name}", full_page=True)

    if name == "light":
        viewer = page.frame_locator("#frame iframe")
        expect(viewer.locator("[data-status]")).to_have_attribute("data-status", "hand", timeout=WAIT)
        page.evaluate("scrollTo(0, 0)")
        card, stage = page.locator(".card").first.bounding_box(), page.locator("#frame").bounding_box()
        assert card is not None
        assert stage is not None
        assert card["y"] < height - 60, "the first cards are seen"
        page.mouse.move(stage["x"] + 200, stage["y"] + 200)
        page.mouse.wheel(0, 150)
        end = time.monotonic() + WAIT / 1000
        while page.evaluate("scrollY") < 100:
            assert time.monotonic() < end, "the wheel over the picture scrolls the page"
            page.wait_for_timeout(50)
        page.get_by_role("link", name="UR5").click()
        expect(viewer.locator("input[value='UR5']").first).to_be_visible(timeout=WAIT)
        wait_for_tool(page, viewer, kin.fk(UR5, UR5.q_home))
        save_picture(page, "landing-card")
        page.get_by_role("link", name="Your arm").click()
        expect(viewer.get_by_role("tab", name="Robot")).to_have_attribute("aria-selected", "true", timeout=WAIT)
        expect(viewer.locator("input[value='UR5']").first).to_be_visible(timeout=WAIT)
    if name == "phone":
        page.get_by_role("link", name="lessons and courses").click()
        expect(page.get_by_role("tab", name="Learn")).to_have_attribute("aria-selected", "true", timeout=WAIT)
        expect(page.get_by_role("button", name="Courses")).to_be_visible()
    assert errors == []
    page.close()


def longer(a: str) -> np.ndarray:
    """The tool point of the Pioneer arm at home with another length in row 2."""
    data = kin.robot_to_dict(PIONEER)
    data["rows"][1]["a"] = a
    return kin.fk(kin.robot_from_dict(data), PIONEER.q_home)[:3, 3]


def remembers(url: str, typed: str) -> bool:
    """Whether this link contains a text that was typed in the tab Robot."""
    state = parse_qs(urlsplit(url).fragment).get("s", [""])[0]
    return typed in json.dumps(decode(state, ROBOTS).features)


def test_an_arm_of_ones_own_is_typed_and_kept(tab: Tab) -> None:
    page = tab.page
    tab.open("Robot")
    cell = page.locator('[data-cell="1 a"]')
    cell.click()
    page.keyboard.type("2*125")
    tab.wait_for_tool(longer("250 mm"), within=0.06)
    expect(cell).to_be_focused()
    assert cell.input_value() == "2*125"
    expect(tab.row("Robot").locator("input:visible").first).to_have_value(f"My arm ({PIONEER.name} variant)")

    page.keyboard.press("Enter")
    twist = page.locator('[data-cell="1 alpha"]')
    expect(twist).to_be_focused()
    page.keyboard.insert_text("9o")  # at once: 9 alone would be another arm
    expect(twist).to_have_attribute("aria-invalid", "true")
    expect(page.locator('[data-arm="wrong"]')).to_contain_text("Row 2, α: “9o” is not a number")
    tab.wait_for_tool(longer("250 mm"), within=0.06)
    tab.screenshot("own-arm-wrong")
    page.keyboard.press("Control+z")
    expect(page.locator('[data-arm="wrong"]')).to_be_hidden()
    expect(twist).to_have_value("0")
    expect(twist).to_be_focused()

    page.keyboard.press("Control+z")
    tab.wait_for_tool(kin.fk(PIONEER, PIONEER.q_home)[:3, 3], within=0.06)
    expect(cell).to_have_value("160")
    page.keyboard.press("Control+Shift+z")
    tab.wait_for_tool(longer("250 mm"), within=0.06)
    end = time.monotonic() + WAIT / 1000
    while not remembers(page.url, "2*125"):  # the address follows when the page has been at rest for a while
        assert time.monotonic() < end, page.url
        page.wait_for_timeout(50)

    name = page.locator("#kb-arm-name")
    name.press("ArrowDown")
    name.press("Enter")
    expect(name).not_to_be_focused()

    page.reload()
    expect(cell).to_have_value("2*125")
    tab.wait_for_tool(longer("250 mm"), within=0.06)
    page.go_back()
    tab.wait_for_tool(kin.fk(PIONEER, PIONEER.q_home)[:3, 3], within=0.06)


@pytest.mark.full
def test_a_large_file_of_ones_own_comes_in_whole(tab: Tab) -> None:
    page = tab.page
    tab.open("Robot")
    comment = "# 臂臂臂臂臂臂臂臂臂臂🤖\n" * 2400
    text = comment + kin.robot_to_toml(UR5).replace('name = "UR5"', 'name = "工業機械臂"')
    file = FilePayload(name="臂.toml", mimeType="application/toml", buffer=text.encode())
    page.locator("[data-arm-file]").set_input_files(file)
    expect(page.locator("#kb-arm-name")).to_have_value("工業機械臂")
    tab.wait_for_tool(kin.fk(UR5, UR5.q_home)[:3, 3], within=0.06)

    cell = page.locator('[data-cell="1 a"]')
    cell.click()
    expect(cell).to_be_focused()
    page.mouse.click(300, 300)
    expect(cell).not_to_be_focused()
    page.evaluate("""document.body.append(document.createElement("i"))""")
    page.wait_for_function(
        "new Promise(done => requestAnimationFrame(() => done(document.activeElement === document.body)))"
    )
