"""The lesson on equations in a real browser: typesetting, live values, and fit in the panel."""

from __future__ import annotations

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import Locator, expect

import kin
from app.equations import book

pytestmark = [pytest.mark.browser, pytest.mark.full]

PIONEER = kin.get_robot("pioneer5")


def open_lesson(tab: Tab) -> None:
    tab.page.get_by_role("tab", name="Learn").click()
    tab.choose("Lesson", "Equations")
    tab.show_answer("Equations")
    expect(shown(tab)).to_be_visible()


def shown(tab: Tab) -> Locator:
    return tab.page.locator("[data-equation]")


def off(tab: Tab) -> Locator:
    return tab.page.locator("[data-off]")


def stays_inside(tab: Tab) -> None:
    """Assert that the lesson is no wider than the panel and that every formula is laid out."""
    width = tab.page.viewport_size["width"]
    for part in (shown(tab), off(tab)):
        box = part.bounding_box()
        assert box is not None
        assert box["width"] > 150
        assert box["x"] + box["width"] <= width
    for formula in tab.page.locator("[data-equation] math").all():
        box = formula.bounding_box()
        assert box is not None
        assert box["height"] > 5, "MathML is laid out"


def test_equations_are_typeset_and_marked_and_the_largest_error_is_shown(tab: Tab) -> None:
    open_lesson(tab)
    expect(shown(tab)).to_have_attribute("data-verdict", "misprinted")
    expect(tab.page.get_by_text("Equation (6):")).to_be_visible()
    stays_inside(tab)
    tab.page.get_by_role("button", name="Show the worst pose").click()
    worst = book(PIONEER).equation("6").worst
    expect(off(tab)).to_contain_text("135 mm here")
    tab.wait_for_tool(kin.fk(PIONEER, np.array(worst))[:3, 3], within=0.06)
    tab.screenshot("equations-worst")
    tab.choose("Equation", "(13) x of a ✕ misprinted")
    expect(off(tab)).to_contain_text("no difference at this pose")  # θ4 is 0 here
    tab.page.get_by_role("button", name="Show the worst pose").click()
    expect(off(tab)).to_contain_text("by 35.3° here, by 35.3° at worst")
    stays_inside(tab)
    expect(tab.page.locator('[aria-label="term by term"] tr[data-kind=factor]')).to_have_count(1)
    expect(tab.page.locator("[data-finding]")).to_contain_text("Column a and row x cannot be right")
    tab.choose("Equation", "(3) the whole matrix ? unreadable")
    matrix = tab.page.locator("[data-matrix]")
    expect(matrix).to_be_visible()
    assert matrix.evaluate("(box) => box.scrollWidth > box.clientWidth"), "wider than the panel: it scrolls"
    assert tab.page.evaluate("document.fonts.check('16px \"Kinboard Math\"', '𝑐')"), "the font has its letters"
    tab.screenshot("equations-matrix")
    tab.choose("Equation", "(4) x of p ✓")
    expect(off(tab)).to_contain_text("equal to the DH product")


def test_the_other_arms(tab: Tab) -> None:
    open_lesson(tab)
    step = tab.page.get_by_role("button", name="Step 2")  # which withholds nothing, whatever the arm
    step.click()
    expect(step).to_have_attribute("aria-current", "step")
    for robot_id in ("redundant7", "redundant7-craig", "puma560"):
        tab.choose("Robot", kin.get_robot(robot_id).name)
        first = "19" if robot_id == "redundant7" else "p_x"
        expect(tab.page.locator(f"[data-robot={robot_id}][data-equation='{first}']")).to_be_visible()
        stays_inside(tab)
        tab.screenshot(f"equations-{robot_id}")
    tab.choose("Equation", "x of n")
    tab.page.get_by_text("Symbols", exact=True).click()
    expect(tab.page.locator("table[aria-label=symbols]")).to_be_visible()
    tab.screenshot("equations-derived-symbols")
