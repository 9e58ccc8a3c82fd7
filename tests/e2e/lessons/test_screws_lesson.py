"""The lesson "Screws" in a browser, by mouse and by keyboard."""

from __future__ import annotations

import pytest
from page import Tab
from playwright.sync_api import expect

import kin

pytestmark = [pytest.mark.browser, pytest.mark.full]

SCARA = kin.get_robot("scara")


def test_screws_by_mouse_and_keyboard(desktop: Tab) -> None:
    tab, page = desktop, desktop.page
    tab.open("Learn")
    tab.choose("Lesson", "None")
    tab.select(SCARA)
    tab.explore("Screws")
    tab.show_answer("Screws")
    table = page.locator('table[aria-label="screws"]')
    expect(table.locator("[data-s]")).to_have_count(24)
    expect(table.locator("[data-pitch]")).to_have_text(["0", "0", "∞", "0"])
    product = page.locator("[data-product]")
    expect(product).to_contain_text("both products are the pose of the tool")
    # By keyboard: one factor less.
    handle = tab.row("Factors").get_by_role("slider")
    handle.press("ArrowLeft")
    expect(product).to_contain_text("The factors of the last 3 joints act on M")
    numbers = [product.locator(f'[data-by="{key}"]').inner_text().split() for key in ("screws", "table")]
    assert numbers[0] == numbers[1] != []
    # By mouse: the other form.
    tab.choose("Form", "Body (tool frame)")
    expect(table).to_have_attribute("data-form", "body")
    expect(product).to_contain_text("The factors of the first 3 joints act on M")
    page.get_by_role("button", name="Step 3").click()
    page.get_by_role("button", name="ω = 0, v = its direction").press("Enter")
    expect(page.locator('[data-feedback="3"]')).to_contain_text("Right.")
    tab.screenshot("screws")
    tab.choose("Lesson", "None")
