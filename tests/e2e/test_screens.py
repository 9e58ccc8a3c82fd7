"""Every screen, light and dark, on a desk and on a phone: nothing is cut off or overlaps, all of it can be read.

What a machine can see is asserted (`screens.js`: boxes, and axe-core's rules of WCAG 2.1 A and AA). The rest is
for eyes: a picture of each screen is kept in tests/artifacts, named tab-lesson-theme.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from axe_playwright_python.base import AXE_SCRIPT
from page import ARTIFACTS, Tab
from playwright.sync_api import Browser, Page, expect

import kin
from app.service.web.pages import static_folder

pytestmark = pytest.mark.browser

LOOK = (Path(__file__).parent / "screens.js").read_text(encoding="utf-8")
COLD = 120_000  # ms; a service that is ready may still be compiling what sections and maps need
PATIENCE = 12  # looks
FEW = 4000  # points; the picture is rendered in software

# What is found of viser's own and cannot be mended by static/viewer.css and .js: a part of the finding, and why.
VISERS: dict[str, str] = {}


def problems(page: Page) -> list[str]:
    """What is wrong with the screen, one sentence each."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE_SCRIPT)
    found: list[str] = []
    for _ in range(PATIENCE):  # folders unfold when a tab opens
        found = [p for p in page.evaluate(LOOK) if not any(part in p for part in VISERS)]
        if not found:
            break
        page.wait_for_timeout(500)
    return found


def lesson(robot: str, title: str, ready: str) -> Callable[[Tab], None]:
    def show(tab: Tab) -> None:
        tab.take(kin.get_robot(robot))
        tab.open("Learn")
        tab.choose("Lesson", title)
        if ready:
            expect(tab.page.locator(ready).first).to_be_visible()

    return show


def cloud(tab: Tab) -> None:
    tab.choose_lesson("None")
    tab.take(kin.get_robot("pioneer5"))
    tab.open("Workspace")
    tab.type_number("Points", str(FEW))
    tab.page.get_by_role("button", name="Start").click()
    expect(tab.page.locator("[data-cloud]")).to_have_attribute("data-cloud", "done")


def section(tab: Tab) -> None:
    tab.choose("Cut", "along the arm")
    tab.check("Section plot")
    tab.check("Sizes")
    expect(tab.page.locator("[data-plot=section] image")).to_have_count(1, timeout=COLD)
    expect(tab.page.locator("table[aria-label='sizes of the workspace']")).not_to_contain_text(
        "computing", timeout=COLD
    )


def capability(tab: Tab) -> None:
    tab.check("Section plot")
    tab.check("Sizes")
    tab.choose("Cut", "none")
    tab.page.get_by_role("button", name="Cancel").click()
    folder = tab.page.get_by_role("button", name="Capability")
    if folder.get_attribute("aria-expanded") != "true":
        folder.press("Enter")
    tab.choose("Grid", "15 voxels long")
    tab.page.get_by_role("button", name="Compute").click()
    expect(tab.page.locator("[data-map]")).to_have_attribute("data-map", "done", timeout=COLD)


def view(tab: Tab) -> None:
    if tab.page.get_by_role("button", name="Clear").count():
        tab.page.get_by_role("button", name="Clear").click()
    tab.open("View")


SCREENS: dict[str, Callable[[Tab], None]] = {
    "move": lambda tab: tab.open("Move"),
    "learn": lambda tab: tab.choose_lesson("None"),
    "learn-dh": lesson("pioneer5", "DH table step by step", "[data-dh=table]"),
    "learn-equations": lesson("pioneer5", "Equations", "[data-equation]"),
    "learn-postures": lesson("puma560", "Postures", "[data-posture]"),
    "learn-velocity": lesson("puma560", "Velocity", "[data-singular]"),
    "learn-redundancy": lesson("redundant7-craig", "Redundancy", "[data-stops]"),
    "workspace-cloud": cloud,
    "workspace-section": section,
    "workspace-capability": capability,
    "view": view,
}
# Every screen is looked at dark on a desk and light on a phone; these the other way round as well.
ON_A_DESK = ("move", "learn-equations", "learn-postures", "learn-velocity", "workspace-cloud")
DARK_ON_A_PHONE = ("learn-velocity",)


def walk(tab: Tab, names: tuple[str, ...], suffix: str) -> None:
    found = {}
    for name in names:
        SCREENS[name](tab)
        tab.top()
        tab.screenshot(f"{name}-{suffix}")
        found[name] = problems(tab.page)
        tab.picture_of_the_rest(f"{name}-{suffix}-below")
    assert {name: told for name, told in found.items() if told} == {}


def test_on_a_desk(tab: Tab) -> None:
    walk(tab, ON_A_DESK, "light")


def test_on_a_desk_in_the_dark(tab: Tab) -> None:
    tab.dark(True)
    walk(tab, tuple(SCREENS), "dark")
    tab.dark(False)


def test_on_a_phone(phone: Tab) -> None:
    walk(phone, tuple(SCREENS), "phone-light")


def test_on_a_phone_in_the_dark(phone: Tab) -> None:
    phone.dark(True)
    walk(phone, DARK_ON_A_PHONE, "phone-dark")
    phone.dark(False)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pages_without_a_viewer(browser: Browser, address: str, scheme: str) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 720}, color_scheme=scheme)
    page.route("**/readyz", lambda route: route.fulfill(status=503, body='{"status": "warming"}'))
    login = (
        (static_folder() / "login.html")
        .read_text(encoding="utf-8")
        .replace("{{message}}", "This is not the token.")
    )
    page.route("**/login", lambda route: route.fulfill(body=login, content_type="text/html"))
    for name, path in (("landing", ""), ("login", "login")):
        page.goto(address + path)
        if name == "landing":
            expect(page.locator(".card h3 a")).to_have_count(len(kin.builtin_robots()))
        for width, height in ((1280, 720), (390, 844)):
            page.set_viewport_size({"width": width, "height": height})
            assert problems(page) == []
            page.screenshot(path=ARTIFACTS / f"{name}-{width}-{scheme}.png", full_page=True)
    page.close()
