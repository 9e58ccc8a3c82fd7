"""The tab *Robot* in a real browser: typing, a wrong cell, undo, and a reload that keeps the arm."""

from __future__ import annotations

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import expect

import kin

pytestmark = pytest.mark.browser

PIONEER = kin.get_robot("pioneer5")


def longer(a: str) -> np.ndarray:
    """The tool point of the Pioneer arm at home with another length in row 2."""
    data = kin.robot_to_dict(PIONEER)
    data["rows"][1]["a"] = a
    return kin.fk(kin.robot_from_dict(data), PIONEER.q_home)[:3, 3]


def test_an_arm_of_ones_own(tab: Tab) -> None:
    page = tab.page
    tab.open("Robot")
    before = page.url
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
    page.keyboard.type("9o")
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
    page.wait_for_function("before => location.href !== before", arg=before)

    page.reload()
    expect(cell).to_have_value("250")
    tab.wait_for_tool(longer("250 mm"), within=0.06)
    tab.dismiss_notice()
    page.go_back()
    tab.wait_for_tool(kin.fk(PIONEER, PIONEER.q_home)[:3, 3], within=0.06)
