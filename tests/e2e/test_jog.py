"""Jog: buttons that move the arm in steps, held or pressed by a key."""

from __future__ import annotations

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import expect

import kin

pytestmark = pytest.mark.browser

PIONEER = kin.get_robot("pioneer5")
HOME = kin.fk(PIONEER, PIONEER.q_home)[:3, 3]


def test_a_held_button_goes_on_until_it_is_released(tab: Tab) -> None:
    page = tab.page
    page.get_by_role("button", name="Jog", exact=True).click()
    down = page.get_by_role("button", name="z −", exact=True)
    page.get_by_label("Base", exact=True).check()
    page.get_by_label("10", exact=True).check()
    tab.screenshot("jog")
    down.press("Enter")  # a click takes as long as the machine likes, and would be a held button
    tab.wait_for_tool(HOME - (0.0, 0.0, 0.010), within=0.06)
    down.hover()
    page.mouse.down()
    page.wait_for_function(
        "(z) => Number(document.querySelectorAll('.kb-readout .kb-number')[2].textContent.replace('−', '-')) < z",
        arg=1000 * HOME[2] - 45,
    )
    page.mouse.up()
    tab.rest()
    rested = np.array(tab.tool())
    page.wait_for_timeout(500)
    assert np.array_equal(tab.tool(), rested)
    page.get_by_role("button", name="Undo").click()
    tab.wait_for_tool(HOME - (0.0, 0.0, 0.010), within=0.06)


def test_joints_are_jogged_by_keys(tab: Tab) -> None:
    page = tab.page
    page.get_by_label("Joints", exact=True).check()
    page.get_by_label("5", exact=True).check()
    expect(page.get_by_role("button", name="x −", exact=True)).to_be_hidden()
    page.locator('[data-pad="1 1"]:visible').focus()
    page.keyboard.press("Enter")
    page.keyboard.press("Space")
    tab.wait_for_link(PIONEER, 1, float(np.degrees(PIONEER.q_home[1])) + 10.0)
    tab.screenshot("jog joints")
