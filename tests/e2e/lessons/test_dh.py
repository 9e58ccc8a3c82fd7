"""The lesson on DH tables in a real browser: keyboard, typeset matrices, comparison of conventions."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from page import Tab
from playwright.sync_api import expect

import kin

pytestmark = pytest.mark.browser

TITLE = "DH table step by step"


def open_lesson(tab: Tab) -> None:
    tab.page.get_by_role("tab", name="Learn").click()
    tab.choose("Lesson", TITLE)
    expect(caption(tab)).to_contain_text("Frame 0 is at the base")


def caption(tab: Tab):
    return tab.page.locator('[data-dh="caption"]')


@pytest.fixture
def lesson(tab: Tab) -> Iterator[Tab]:
    open_lesson(tab)
    yield tab
    tab.page.get_by_role("tab", name="Learn").click()
    tab.choose("Lesson", "None")


def test_steps_by_keyboard_with_typeset_matrices(lesson: Tab) -> None:
    page = lesson.page
    following = page.get_by_role("button", name="Next")
    following.focus()
    entry = lesson.row("Row").locator("input:visible").last
    for step in ("0.25", "0.5", "0.75", "1", "1.25"):
        page.keyboard.press("Enter")
        expect(entry).to_have_value(step)
    expect(caption(lesson)).to_contain_text("Row 2 of 6: turn 30.0° about z₁ (θ₂, joint 2).")
    matrices = page.locator("math mtable")
    expect(matrices).to_have_count(2)
    box = matrices.first.bounding_box()
    assert box is not None
    assert box["height"] > 40
    assert box["width"] > 120, "MathML is laid out as a matrix, not in one line"
    widths = {cell.bounding_box()["width"] for cell in matrices.first.locator("mtd").all()}  # type: ignore[index]
    assert max(widths) - min(widths) < 0.5

    thumb = lesson.row("Row").get_by_role("slider").first
    thumb.focus()
    page.keyboard.press("ArrowRight")
    expect(entry).to_have_value("1.26")
    expect(caption(lesson)).to_contain_text("d₂ = 0")

    page.get_by_role("button", name="Play").focus()
    page.keyboard.press("Space")
    expect(caption(lesson)).to_contain_text("Row 3 of 6")
    page.get_by_role("button", name="Pause").press("Space")
    expect(page.get_by_role("button", name="Play")).to_be_visible()


def test_both_conventions_are_compared(lesson: Tab) -> None:
    page = lesson.page
    lesson.choose("Robot", kin.get_robot("redundant7").name)
    expect(caption(lesson)).to_contain_text("Frame 0")
    lesson.type_number("Row", "2")
    lesson.check("Symbols")
    lesson.check("Compare conventions")
    expect(page.locator('[data-dh="verdict"]')).to_contain_text("z₀ and z₁ coincide")
    expect(page.locator('[data-dh="verdict"]')).to_contain_text("7 joints, 6 degrees of freedom")
    expect(page.locator('[data-dh="table"]')).to_have_count(2)
    expect(page.locator("math mtable").first).to_contain_text("cos")
    lesson.screenshot("dh-compare")
    steps = page.locator('[data-dh="nine"]')
    steps.locator("summary").press("Enter")
    expect(steps.locator("li").last).to_be_visible()
    expect(steps.locator("li")).to_have_count(9)
