"""Layout and contrast of every screen, light and dark, in desktop and phone size.

`screens.js` checks that nothing is cut off or overlaps, and the rules of WCAG 2.1 A and AA (axe-core). With
KINBOARD_TEST_PICTURES set, a picture of each screen is saved in tests/artifacts, named tab-lesson-theme.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from axe_playwright_python.base import AXE_SCRIPT
from page import Tab, save_picture
from playwright.sync_api import Browser, Page, expect

import kin
from app.shared.settings import static_folder

pytestmark = [pytest.mark.browser, pytest.mark.full]

LOOK = (Path(__file__).parent / "screens.js").read_text(encoding="utf-8")
ATTEMPTS = 12
FEW = 4000  # points; the page is rendered in software

# Findings in viser's own parts that static/viewer.css and .js cannot correct: part of the finding, and why.
ACCEPTED: dict[str, str] = {}


def problems(page: Page) -> list[str]:
    """Findings on the screen, one sentence each."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE_SCRIPT)
    found: list[str] = []
    for _ in range(ATTEMPTS):  # folders unfold when a tab opens
        found = [p for p in page.evaluate(LOOK) if not any(part in p for part in ACCEPTED)]
        if not found:
            break
        page.wait_for_timeout(500)
    return found


def lesson(robot: str, title: str, ready: str) -> Callable[[Tab], None]:
    def show(tab: Tab) -> None:
        tab.select(kin.get_robot(robot))
        tab.open("Learn")
        tab.choose("Lesson", title)
        if title != "None":
            tab.show_answer(title)
        if ready:
            expect(tab.page.locator(ready).first).to_be_visible()

    return show


def trajectories(tab: Tab) -> None:
    lesson("ur5", "Trajectories", "[data-guide=steps]")(tab)
    step = tab.page.get_by_role("button", name="Step 2")
    step.click()
    expect(step).to_have_attribute("aria-current", "step")
    if tab.page.locator(".kb-reveal").count():
        tab.page.locator(".kb-reveal").click()
    expect(tab.page.locator(".kb-chart")).to_be_visible()


def robot(tab: Tab) -> None:
    tab.open("Robot")
    expect(tab.page.locator('[data-arm-do="convert"]').first).to_be_visible()
    if not tab.page.locator(".kb-arm-converted").count():
        tab.page.locator('[data-arm-do="convert"]').click()
    expect(tab.page.locator(".kb-arm-converted")).to_be_visible()
    tab.page.locator('[data-cell="1 a"]').fill("1/0")
    expect(tab.page.locator('[data-arm="wrong"]')).to_contain_text("divides by zero")


def program(tab: Tab) -> None:
    tab.choose_lesson("None")
    tab.select(kin.get_robot("pioneer5"))
    for i, button in enumerate(("Home", "Random")):
        tab.open("Move")
        tab.page.get_by_role("button", name=button).click()
        tab.open("Program")
        tab.page.locator("[data-program-do=record]").click()
        expect(tab.page.locator("[data-program-item]")).to_have_count(i + 1)
    tab.page.locator("[data-program-do=choose]").last.click()
    expect(tab.page.locator("[data-program-field=speed]")).to_be_visible()


def leave_program(tab: Tab) -> None:
    tab.open("Program")
    tab.page.locator("[data-program-do=clear]").click()
    expect(tab.page.locator("[data-program-item]")).to_have_count(0)


def cloud(tab: Tab) -> None:
    tab.choose_lesson("None")
    tab.select(kin.get_robot("pioneer5"))
    tab.open("Workspace")
    tab.type_number("Points", str(FEW))
    tab.page.get_by_role("button", name="Start").first.click()
    expect(tab.page.locator("[data-cloud]")).to_have_attribute("data-cloud", "done")


def section(tab: Tab) -> None:
    tab.choose("Cut", "along the arm")
    tab.check("Section plot")
    tab.check("Sizes")
    expect(tab.page.locator("[data-plot=section] image")).to_have_count(1)
    expect(tab.page.locator("table[aria-label='sizes of the workspace']")).not_to_contain_text("computing")


def capability(tab: Tab) -> None:
    tab.check("Section plot")
    tab.check("Sizes")
    tab.choose("Cut", "none")
    tab.page.get_by_role("button", name="Clear").first.click()
    folder = tab.page.get_by_role("button", name="Capability")
    if folder.get_attribute("aria-expanded") != "true":
        folder.press("Enter")
    tab.choose("Grid", "15 voxels long")
    tab.page.get_by_role("button", name="Start").last.click()
    expect(tab.page.locator("[data-map]")).to_have_attribute("data-map", "done")


def view(tab: Tab) -> None:
    if tab.page.get_by_role("button", name="Clear").count():
        tab.page.get_by_role("button", name="Clear").last.click()
    tab.open("View")


SCREENS: dict[str, Callable[[Tab], None]] = {
    "move": lambda tab: tab.open("Move"),
    "learn": lambda tab: tab.choose_lesson("None"),
    "learn-dh": lesson("pioneer5", "DH table step by step", "[data-dh=table]"),
    "learn-screws": lesson("scara", "Screws", "[data-product]"),
    "learn-equations": lesson("pioneer5", "Equations", "[data-equation]"),
    "learn-postures": lesson("puma560", "Postures", "[data-posture]"),
    "learn-rotations": lesson("ur5", "Rotations and frames", "[data-lock]"),
    "learn-numeric": lesson("ur5", "Numeric IK", "[data-outcome]"),
    "learn-velocity": lesson("puma560", "Velocity", "[data-singular]"),
    "learn-redundancy": lesson("redundant7-craig", "Redundancy", "[data-limits]"),
    "learn-trajectories": trajectories,
    "robot": robot,
    "program": program,
    "program-empty": leave_program,
    "workspace-cloud": cloud,
    "workspace-section": section,
    "workspace-capability": capability,
    "view": view,
}
# Every screen is checked dark in desktop size and light in phone size; these the other way round as well, those in
# desktop size among the slow tests.
LIGHT_DESKTOP = (
    *("move", "learn-equations", "learn-postures", "learn-velocity", "robot"),
    *("program", "program-empty", "workspace-cloud"),
)
DARK_PHONE = ("learn-velocity",)


def walk(tab: Tab, names: tuple[str, ...], suffix: str) -> None:
    found = {}
    for name in names:
        SCREENS[name](tab)
        tab.top()
        tab.screenshot(f"{name}-{suffix}")
        found[name] = problems(tab.page)
        tab.picture_of_the_rest(f"{name}-{suffix}-below")
    assert {name: sentences for name, sentences in found.items() if sentences} == {}


@pytest.mark.slow
def test_desktop_light(tab: Tab) -> None:
    walk(tab, LIGHT_DESKTOP, "light")


def test_desktop_dark(tab: Tab) -> None:
    tab.set_dark(True)
    walk(tab, tuple(SCREENS), "dark")
    tab.set_dark(False)


def test_phone_light(phone: Tab) -> None:
    walk(phone, tuple(SCREENS), "phone-light")


def test_phone_dark(phone: Tab) -> None:
    phone.set_dark(True)
    walk(phone, DARK_PHONE, "phone-dark")
    phone.set_dark(False)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pages_without_a_viewer(browser: Browser, address: str, scheme: str) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 720}, color_scheme=scheme)
    page.route("**/readyz", lambda route: route.fulfill(status=503, body='{"status": "starting"}'))
    login = (
        (static_folder() / "login.html")
        .read_text(encoding="utf-8")
        .replace("{{message}}", "This is not the token.")
    )
    page.route("**/login", lambda route: route.fulfill(body=login, content_type="text/html"))
    for name, path in (("landing", ""), ("login", "login"), ("scoreboard", "scoreboard")):
        page.goto(address + path)
        if name == "landing":
            expect(page.locator(".card h3 a:visible")).to_have_count(
                len(kin.files.classic_robots()) + 1
            )  # the visitor's own
            page.get_by_role("button", name="more arms").click()
            expect(page.locator(".card h3 a:visible")).to_have_count(len(kin.builtin_robots()) + 1)
            page.reload()
            expect(page.locator(".card h3 a:visible")).to_have_count(
                len(kin.files.classic_robots()) + 1
            )  # the visitor's own
        for width, height in ((1280, 720), (390, 844)):
            page.set_viewport_size({"width": width, "height": height})
            assert problems(page) == []
            save_picture(page, f"{name}-{width}-{scheme}", full_page=True)
    page.close()
