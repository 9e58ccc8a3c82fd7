"""The lesson "Numeric IK" in a browser, by mouse and by keyboard."""

from __future__ import annotations

import pytest
from page import Tab
from playwright.sync_api import expect

import kin

pytestmark = [pytest.mark.browser, pytest.mark.full]

PLANAR = kin.get_robot("planar2r")


def test_iterations_by_mouse_and_by_keyboard(desktop: Tab) -> None:
    tab, page = desktop, desktop.page
    tab.select(PLANAR)
    tab.explore("Numeric IK")
    tab.show_answer("Numeric IK")
    outcome, iterate = page.locator("[data-outcome]"), page.locator("[data-iterate]")
    expect(outcome).to_have_attribute("data-outcome", "reached")
    page.get_by_role("button", name="First", exact=True).click()
    expect(iterate).to_have_attribute("data-iterate", "0")
    page.get_by_role("button", name="Next", exact=True).press("Enter")
    expect(iterate).to_have_attribute("data-iterate", "1")
    page.get_by_role("button", name="Target here", exact=True).press("Enter")
    expect(outcome).to_contain_text("Converged in 0 iterations")
    # The straight arm: the start that Newton cannot leave.
    tab.open("Move")
    tab.type_number("2 elbow", "0")
    tab.open("Learn")
    expect(outcome).to_have_attribute("data-outcome", "singular")
    tab.choose("Method", "Damped least squares")
    expect(outcome).to_have_attribute("data-outcome", "reached")
    tab.check("Basins of attraction")
    expect(page.locator("[data-basins] image")).to_have_count(1)
    tab.screenshot("numeric-basins")
    tab.choose("Lesson", "None")
    tab.show(PLANAR)
