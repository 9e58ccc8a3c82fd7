"""The lesson on DH tables in a real browser: keyboard, typeset matrices, comparison of conventions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import expect

import kin
from app.viewer.lessons.dh.assign import PROMPTS
from app.viewer.lessons.dh.assignment import Assignment, read_row
from app.viewer.lessons.dh.attempt import Attempt

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


@pytest.mark.full
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


@pytest.mark.full
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


def test_a_student_assigns_a_frame_and_fills_its_row_by_mouse_and_keyboard(lesson: Tab) -> None:
    page = lesson.page
    # The same steps without a page say which values are right.
    mirror = Attempt(Assignment(kin.get_robot("pioneer5")))
    lesson.check("Assign it yourself")
    block = page.locator("[data-guide=assign]")
    prompt, feedback = block.locator("legend"), block.locator("[data-feedback=assign]")
    expect(prompt).to_have_text("Which line is z₀?")
    expect(caption(lesson)).not_to_be_visible()
    block.get_by_role("button", name="axis of joint 2").click()
    expect(feedback).to_contain_text("Not quite. z₀ is the axis of joint 1")
    block.get_by_role("button", name="axis of joint 1").click()
    expect(prompt).to_have_text("Which way does z₀ point?")
    mirror.choose("axis", 0)

    # By keyboard: the next choice has the focus after each one.
    block.get_by_role("button", name="as the joint counts").press("Enter")
    mirror.choose("direction", 0)
    while mirror.number == 0:
        expect(prompt).to_have_text(PROMPTS[mirror.part or "x"].format(i="₀" if mirror.part == "x" else 0))
        expect(block.locator(".kb-option").first).to_be_focused()
        page.keyboard.press("Enter")
        mirror.choose(mirror.part, 0)
    for number in range(1, 6):
        expect(block.get_by_role("heading")).to_contain_text("Frame 1 of 5")
        block.get_by_role("button", name="Show me").click()
        mirror.show()
        expect(block.locator(".kb-settled li")).to_have_count(number)

    row = read_row("standard", mirror.work.frames[-1], mirror.chosen)
    home = float(mirror.work.robot.q_home[0])
    right = {"theta": row.theta + home, "d": row.d, "a": row.a, "alpha": row.alpha}
    typed = {key: f"{np.degrees(v) if key in ('theta', 'alpha') else 1000 * v:.1f}" for key, v in right.items()}
    for key, text in typed.items():
        block.locator(f"[data-guide-field={key}]").fill(f"{-float(text)}" if key == "alpha" else text)
    block.get_by_role("button", name="Check").click()
    expect(feedback).to_contain_text("α₁ is wrong. The size of α₁ is right, its sign is not.")
    alpha = block.locator("[data-guide-field=alpha]")
    expect(alpha).to_have_attribute("aria-invalid", "true")
    expect(block.locator("[data-guide-field=a]")).to_have_value(typed["a"])
    lesson.screenshot("dh-assign")
    alpha.fill(typed["alpha"])
    alpha.press("Enter")
    expect(block.get_by_role("heading")).to_have_text("Frame 2 of 5")
    expect(feedback).to_contain_text("Right")
    expect(page.locator('[data-dh="table"] tr')).to_have_count(2)
    lesson.check("Assign it yourself")
    expect(caption(lesson)).to_be_visible()
