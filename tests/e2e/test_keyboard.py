"""Keyboard only: every control can be reached, shows its focus, and works."""

from __future__ import annotations

import pytest
from page import Tab
from playwright.sync_api import expect

import kin

pytestmark = pytest.mark.browser

PIONEER, PUMA = kin.get_robot("pioneer5"), kin.get_robot("puma560")
# viser takes the small arrows of a number field out of the tab order; the arrow keys do the same there.
NOT_REACHED = """() => {
  const area = document.querySelector("[data-status]").closest(".mantine-ScrollArea-viewport");
  const controls = 'input:not([type="hidden"]), button, summary, [role="slider"], [role="tab"], [role="button"]';
  return [...area.querySelectorAll(controls)]
    .filter((e) => e.checkVisibility() && !e.dataset.reached && !e.closest(".mantine-NumberInput-controls"))
    .map((e) => e.outerHTML.slice(0, 200));
}"""
REACHED = """() => {
  const e = document.activeElement;
  if (e === document.body) return null;
  e.dataset.reached = "yes";
  const style = getComputedStyle(e);
  const seen = style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2;
  return { seen, what: e.outerHTML.slice(0, 200) };
}"""


def walk(tab: Tab) -> None:
    """Press Tab from the first control to the last one, and check that every control got the focus."""
    tab.row("Robot").locator("input:visible").first.focus()
    for _ in range(3):  # back to the buttons before it
        tab.page.keyboard.press("Shift+Tab")
    expect(tab.page.get_by_role("button", name="Undo")).to_be_focused()
    for _ in range(100):
        reached = tab.page.evaluate(REACHED)
        if reached is None:
            break
        assert reached["seen"], f"no visible focus on {reached['what']}"
        tab.page.keyboard.press("Tab")
    assert tab.page.evaluate(NOT_REACHED) == []


def test_the_move_tab(tab: Tab) -> None:
    page = tab.page
    walk(tab)
    page.evaluate("addEventListener('keydown', () => { window.escaped = true; })")
    before = tab.number("2 rotating elbow")
    page.get_by_role("slider", name="2 rotating elbow").press("ArrowRight")
    expect(tab.row("2 rotating elbow").locator("input:visible").last).to_have_value(f"{before + 1:g}")
    assert not page.evaluate("'escaped' in window"), "viser would turn the view with the same key"

    lock = page.get_by_role("group", name="Locked").get_by_role("button", name="2", exact=True)
    lock.press("Space")
    expect(tab.status).to_contain_text("Joint 2 locked")
    page.get_by_role("button", name="Unlock all").press("Enter")
    expect(tab.status).to_contain_text("No joint is locked")

    folder = page.get_by_role("button", name="Posture and redundancy", exact=True)
    for key, state in (("Enter", "false"), ("Space", "true")):
        folder.press(key)
        expect(folder).to_have_attribute("aria-expanded", state)
    expect(page.get_by_text("Posture", exact=True)).to_be_visible()


def test_a_lesson(tab: Tab) -> None:
    page = tab.page
    tab.select(PUMA)
    page.get_by_role("tab", name="Learn").press("Enter")
    lesson = tab.row("Lesson").locator("input:visible").first
    lesson.press("Enter")
    for _ in range(10):
        if page.locator("[role=option][data-combobox-selected]", has_text="Postures").count():
            break
        page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(page.locator("[data-posture]")).to_have_count(8)
    walk(tab)
    here = page.locator("[data-here]")
    before = here.get_attribute("data-posture")
    # The same as a click on the ghost.
    page.get_by_role("group", name="Go").get_by_role("button", name="2", exact=True).press("Space")
    expect(here).not_to_have_attribute("data-posture", str(before))
