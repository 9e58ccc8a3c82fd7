"""The capability map in a real browser: computing, filtering, cutting and picking."""

from __future__ import annotations

import re

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import expect

import kin

pytestmark = [pytest.mark.browser, pytest.mark.full]

PIONEER = kin.get_robot("pioneer5")


def compute(tab: Tab) -> None:
    tab.page.get_by_role("tab", name="Workspace").click()
    folder = tab.page.get_by_role("button", name="Capability")
    if folder.get_attribute("aria-expanded") != "true":
        folder.click()
    tab.choose("Grid", "15 voxels long")
    tab.page.get_by_role("button", name="Start").last.click()
    expect(tab.page.locator("[data-map]")).to_have_attribute("data-map", "done")
    tab.page.wait_for_timeout(1000)


def test_a_map_is_drawn_and_a_click_shows_the_voxel(tab: Tab) -> None:
    compute(tab)
    tab.choose("Cut", "along the arm")  # as it opens by itself, unless this page has chosen a cut before
    tab.screenshot("capability-opens-cut")
    tab.choose("Cut", "none")
    found = kin.workspace.capability_map(PIONEER, resolution=15, directions=24)
    shown = tab.page.locator("[data-shown]")
    expect(shown).to_have_attribute("data-shown", str(len(found.index)))
    # A voxel on the outside that faces the camera, so that nothing hides it.
    row = int(np.argmax(found.centres @ np.array([0.5, 0.8, 0.3])))
    sides = np.array(found.grid.shape) * found.grid.voxel
    room = [(np.array(found.grid.origin) + sides / 2.0, float(sides.max()) / 2.0)]
    tab.page.mouse.click(*tab.pixel(PIONEER, found.centres[row], room).tolist())
    picked = tab.page.locator("table[aria-label='picked voxel']")
    expect(picked).to_be_visible()
    x, y, z = (round(1000.0 * v) for v in found.centres[row].tolist())
    cell = re.sub(r"\s+", " ", picked.locator("td").first.inner_text()).replace("−", "-")
    assert [float(v) for v in cell.split()] == pytest.approx([x, y, z], abs=1.0)
    picked.scroll_into_view_if_needed()
    tab.screenshot("capability-picked-light")

    tab.type_number("Hide voxels below (% of the best)", "48")
    expect(shown).not_to_have_attribute("data-shown", str(len(found.index)))
    tab.choose("Cut", "along the arm")
    tab.choose("Voxels show", "Manipulability")
    tab.screenshot("capability-cut")
    tab.page.get_by_role("button", name="Clear").last.click()
    expect(tab.page.locator("[data-map]")).to_have_attribute("data-map", "ready")
    tab.choose("Cut", "none")
