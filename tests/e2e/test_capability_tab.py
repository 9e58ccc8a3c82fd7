"""The capability map in a real browser: computed, thinned out, cut, clicked on."""

from __future__ import annotations

import re

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import Browser, expect

import kin

pytestmark = pytest.mark.browser

PIONEER = kin.get_robot("pioneer5")


def compute(tab: Tab) -> None:
    tab.page.get_by_role("tab", name="Workspace").click()
    tab.page.get_by_text("Capability", exact=True).click()
    tab.page.wait_for_timeout(400)  # the folder opens
    tab.choose("Grid", "15 voxels long")
    tab.page.get_by_role("button", name="Compute").click()
    expect(tab.page.locator("[data-map]")).to_have_attribute("data-map", "done")
    tab.page.wait_for_timeout(1000)


def test_phone(browser: Browser, address: str) -> None:
    """First, while no other page is drawing: software rendering of two would take both cores."""
    phone = Tab(browser, address, 390, 844)
    compute(phone)
    phone.page.locator("[data-map]").scroll_into_view_if_needed()
    phone.screenshot("capability-phone")
    phone.page.locator("table[aria-label='capability in numbers']").scroll_into_view_if_needed()
    phone.screenshot("capability-phone-numbers")
    phone.close()


def test_a_map_is_drawn_and_a_click_tells_of_a_voxel(tab: Tab) -> None:
    compute(tab)
    found = kin.capability_map(PIONEER, resolution=15, directions=24)
    shown = tab.page.locator("[data-shown]")
    expect(shown).to_have_attribute("data-shown", str(len(found.index)))
    tab.page.locator("table[aria-label='capability in numbers']").scroll_into_view_if_needed()
    tab.screenshot("capability-light")
    # One on the outside, towards the eye: nothing is before it.
    row = int(np.argmax(found.centres @ np.array([0.5, 0.8, 0.3])))
    tab.page.mouse.click(*tab.pixel(PIONEER, found.centres[row]).tolist())
    picked = tab.page.locator("table[aria-label='picked voxel']")
    expect(picked).to_be_visible()
    x, y, z = (round(1000.0 * v) for v in found.centres[row].tolist())
    cell = re.sub(r"\s+", " ", picked.locator("td").first.inner_text()).replace("−", "-")
    assert [float(v) for v in cell.split()] == pytest.approx([x, y, z], abs=1.0)
    picked.scroll_into_view_if_needed()
    tab.screenshot("capability-picked-light")

    tab.type_number("Least (% best)", "48")
    expect(shown).not_to_have_attribute("data-shown", str(len(found.index)))
    tab.choose("Cut", "along the arm")
    tab.page.get_by_role("tab", name="View").click()
    tab.check("Dark page")
    tab.page.get_by_role("tab", name="Workspace").click()
    tab.choose("Voxels show", "Manipulability")
    tab.page.locator("[data-map]").scroll_into_view_if_needed()
    tab.screenshot("capability-cut-dark")
    tab.page.get_by_role("button", name="Clear").click()
    expect(tab.page.locator("[data-map]")).to_have_attribute("data-map", "ready")
    tab.choose("Cut", "none")
    tab.page.get_by_role("tab", name="View").click()
    tab.check("Dark page")
