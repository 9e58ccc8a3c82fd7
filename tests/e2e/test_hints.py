"""The hints of the first minute: three, each closed by its button or by following it, and never again."""

from __future__ import annotations

import pytest
from page import PLAIN, WAIT
from playwright.sync_api import Browser, expect
from test_screens import problems

pytestmark = pytest.mark.browser


def test_hints_come_once(browser: Browser, address: str) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.add_init_script(PLAIN)
    page.set_default_timeout(WAIT)
    page.goto(address + "viewer/")
    hints = page.locator(".kb-hint")
    expect(hints).to_have_count(3, timeout=WAIT)
    page.locator("#webgl-software-rendering button").click()
    boxes = {hint.get_attribute("data-hint"): hint.bounding_box() for hint in hints.all()}
    area = page.locator("canvas[data-engine]").bounding_box()
    assert area is not None
    for name, box in boxes.items():
        assert box is not None
        assert box["x"] >= 0, name
        assert box["x"] + box["width"] <= area["x"] + area["width"], f"the hint {name} covers the panel"
    assert problems(page) == []

    page.get_by_role("button", name="Close the hint: Questions?").click()
    expect(hints).to_have_count(2)
    thumb = page.get_by_role("slider").first.bounding_box()
    assert thumb is not None
    page.mouse.click(thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2)
    expect(hints).to_have_count(1)
    page.mouse.click(area["x"] + 0.7 * area["width"], area["y"] + 0.8 * area["height"])
    expect(hints).to_have_count(0)

    page.reload()
    expect(page.locator("[data-hints]")).to_have_count(1, timeout=WAIT)
    expect(page.get_by_role("slider").first).to_be_visible(timeout=WAIT)
    page.wait_for_timeout(1000)  # a hint would be drawn within 0.4 s
    assert hints.count() == 0
    page.close()


def test_hint_on_joints_is_beside_joints_alone(browser: Browser, address: str) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.add_init_script(PLAIN)
    page.goto(address + "viewer/")
    hint = page.locator('.kb-hint[data-hint="joint"]')
    expect(hint).to_have_count(1, timeout=WAIT)
    page.get_by_role("tab", name="Workspace").click(force=True)
    expect(page.get_by_role("slider", name="Point size")).to_be_visible(timeout=WAIT)
    expect(hint).to_have_count(0)
    page.get_by_role("tab", name="Move").click(force=True)
    expect(hint).to_have_count(1, timeout=WAIT)
    page.close()


def test_cover_says_why_a_page_waits(browser: Browser, address: str) -> None:
    page = browser.new_page()
    silent = "window.Worker = class extends EventTarget { postMessage() {} terminate() {} }"
    page.add_init_script(silent)
    page.clock.install()
    page.goto(address + "viewer/")
    assert "compiles" in page.evaluate("getComputedStyle(document.documentElement, '::after').content")
    page.clock.fast_forward(60_000)
    expect(page.locator("html")).to_have_attribute("data-kb-cover", "light")
    page.clock.fast_forward(61_000)
    expect(page.locator("html")).not_to_have_attribute("data-kb-cover", "light")
    page.close()


def test_cover_says_that_a_script_failed(browser: Browser, address: str) -> None:
    page = browser.new_page()
    page.add_init_script("window.Worker = class { constructor() { throw new Error('no workers here'); } }")
    page.goto(address + "viewer/")
    said = page.get_by_role("alert").filter(has=page.get_by_role("button", name="Reload"))
    expect(said).to_contain_text("The page could not start.", timeout=WAIT)
    expect(said).to_contain_text("no workers here")
    expect(page.locator("html")).to_have_attribute("data-kb-cover", "light")
    page.close()


def test_a_page_that_comes_despite_an_error_says_nothing(browser: Browser, address: str) -> None:
    page = browser.new_page()
    page.route("**/static/hints.js", lambda route: route.abort())
    page.goto(address + "viewer/")
    expect(page.locator("html")).not_to_have_attribute("data-kb-cover", "light", timeout=WAIT)
    page.wait_for_timeout(2000)
    expect(page.locator("#kb-failed")).to_have_count(0)
    page.close()
