"""A frozen class: what acts is disabled in the pages of students, and comes back without a reload."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser, expect
from test_class import Member

import kin

pytestmark = [pytest.mark.browser, pytest.mark.full]

JOINT = "2 rotating elbow"


def test_what_was_disabled_comes_back_when_a_frozen_class_goes_on(browser: Browser, address: str) -> None:
    teacher = Member(browser, address)
    student = Member(browser, address, teacher.code, "Ann")
    page = student.page
    student.open("Move")
    slider, hand = page.get_by_role("slider", name=JOINT), page.locator("[data-class-bar] [data-guide-do=hand]")
    acts = slider, page.get_by_role("button", name="Home"), student.row("Robot").locator("input:visible").first
    for control in acts:
        expect(control).to_be_enabled()
    teacher.do("freeze")
    student.shows("[data-class-frozen]")
    for control in acts:
        expect(control).to_be_disabled()
    expect(hand).to_be_enabled()
    student.open("View")
    expect(student.row("Radians").locator("input")).to_be_enabled()
    student.open("Program")
    expect(page.get_by_role("button", name="Connect a program")).to_be_enabled()
    student.open("Move")
    teacher.do("freeze")
    for control in (*acts, hand):
        expect(control).to_be_enabled()
    assert page.locator("[data-part] :disabled").count() == 0
    student.type_number(JOINT, "44")
    expect(slider).to_have_attribute("aria-valuenow", "44")
    for member in (student, teacher):
        member.close()


def test_controls_with_the_focus_and_those_that_others_disable_or_enable(browser: Browser, address: str) -> None:
    """viser or the service may enable a control while a class is frozen, or have disabled one before."""
    teacher = Member(browser, address)
    student = Member(browser, address, teacher.code, "Ann")
    student.open("Move")
    home, recall = (student.page.get_by_role("button", name=name) for name in ("Home", "Move target to tool"))
    student.select(kin.get_robot("so101"))
    slider = student.page.get_by_role("slider", name="Gripper (%)")
    before = slider.get_attribute("aria-valuenow", timeout=8000)
    assert before is not None
    slider.focus()
    recall.evaluate("button => { button.disabled = true; }")
    teacher.do("freeze")
    student.shows("[data-class-frozen]")
    expect(home).to_be_disabled()
    student.page.keyboard.press("ArrowLeft")
    expect(slider).to_have_attribute("aria-valuenow", before)
    home.evaluate("button => { button.disabled = false; }")
    expect(home).to_be_disabled()
    teacher.do("freeze")
    expect(home).to_be_enabled()
    expect(recall).to_be_disabled()
    for member in (student, teacher):
        member.close()
