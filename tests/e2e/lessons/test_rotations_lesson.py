"""The lesson "Rotations and frames" in a browser, by mouse and by keyboard."""

from __future__ import annotations

import pytest
from page import Tab
from playwright.sync_api import expect

import kin

pytestmark = [pytest.mark.browser, pytest.mark.full]


def test_gimbal_lock_and_a_chain_by_mouse_and_by_keyboard(desktop: Tab) -> None:
    tab, page = desktop, desktop.page
    tab.select(kin.get_robot("planar2r"))
    tab.explore("Rotations and frames")
    tab.show_answer("Rotations and frames")
    lock, chain = page.locator("[data-lock]"), page.locator("[data-chain]")
    expect(lock).to_have_attribute("data-lock", "far")
    tab.type_number("β about y", "90")
    expect(lock).to_have_attribute("data-lock", "at")
    tab.choose("Angles", "Z-X-Z moving")
    expect(lock).to_have_attribute("data-lock", "far")
    page.get_by_role("button", name="From tool", exact=True).press("Enter")
    expect(lock).to_have_attribute("data-lock", "at")
    tab.choose("Show", "Chain of frames")
    add = page.get_by_role("button", name="Add", exact=True)
    add.click()
    expect(chain).to_have_attribute("data-chain", "1")
    tab.choose("Motion", "Shift along x")
    add.press("Enter")
    expect(chain).to_have_attribute("data-chain", "2")
    expect(page.locator("[data-product]")).to_have_text("T = Rz(90.0°) · Tx(200.0 mm)")
    page.get_by_role("button", name="Swap", exact=True).click()
    expect(page.locator("[data-product]")).to_have_text("T = Tx(200.0 mm) · Rz(90.0°)")
    tab.screenshot("rotations-chain")
    tab.choose("Lesson", "None")
