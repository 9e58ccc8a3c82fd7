"""*Match motors* in a browser: three poses in the picture, typed readings, signs and zeros in words and arm."""

from __future__ import annotations

from dataclasses import replace

import pytest
from page import Tab
from playwright.sync_api import expect

import kin
from app.viewer.tabs.robot.motors.run import COUNT, begun

pytestmark = [pytest.mark.browser, pytest.mark.full]

SO101 = kin.get_robot("so101")
REAL = [replace(motor, sign=-1, offset=91.4) for motor in SO101.motors if motor.id != 6]


def test_three_poses_and_what_was_read_in_them_give_signs_and_zeros(tab: Tab) -> None:
    page = tab.page
    tab.open("Robot")
    page.locator('[data-cell="start"]').select_option("so101")
    expect(page.locator('[data-cell="0 name"]')).to_have_value("shoulder pan")
    page.get_by_role("button", name="Motors", exact=True).click()
    table = page.get_by_role("table", name="Motors", exact=True)
    expect(table).to_contain_text("elbow flex")
    table.scroll_into_view_if_needed()
    tab.screenshot("motors-table")
    page.get_by_role("button", name="Match motors").click()
    poses = begun(SO101, ()).poses
    for i, readings in enumerate(kin.motors.readings_from_q(replace(SO101, motors=REAL), poses).round(1).tolist()):
        shown = page.locator(f'[data-motors-pose="{i + 1}"]')
        expect(shown).to_be_visible()
        tab.wait_for_tool(kin.fk(SO101, poses[i])[:3, 3], within=0.06)
        entry = tab.row("Readings").locator("input:visible").last
        expect(entry).to_have_value("")
        entry.fill(" ".join(map(str, readings)))
        entry.press("Enter")
        shown.scroll_into_view_if_needed()
        tab.screenshot(f"motors-pose-{i + 1}")
        page.get_by_role("button", name="Next pose" if i < COUNT - 1 else "Find signs and zeros").click()
    found = page.locator('[data-motors-result="complete"]')
    expect(found).to_contain_text("Motor 3, elbow flex, counts backwards, its zero is at 91.4°.")
    found.scroll_into_view_if_needed()
    tab.screenshot("motors-found")
    page.get_by_role("button", name="Use", exact=True).click()
    expect(table.get_by_role("row", name="elbow flex")).to_contain_text("−91.4")
