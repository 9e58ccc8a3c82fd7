"""The lesson "Inverse kinematics step by step" in a browser: typed ways, a dragged target, the tree."""

from __future__ import annotations

import re

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import expect

import kin
from app.viewer.lessons.inverse.arm import arm_of
from app.viewer.lessons.inverse.drawing import room
from app.viewer.lessons.inverse.exercise import example, exercise

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.full]

PIONEER = kin.get_robot("pioneer5")


def vector(text: str, before: str) -> np.ndarray:
    """The first three numbers in brackets after a text."""
    found = re.search(rf"{before}\(([^()]*,[^()]*,[^()]*)\)", text)
    assert found is not None, text
    return np.array([float(x.replace("−", "-")) for x in found.group(1).split(",")])


def test_a_derivation_by_keyboard_and_mouse(desktop: Tab) -> None:
    tab, page = desktop, desktop.page
    tab.show(PIONEER)
    tab.choose_lesson("Inverse kinematics step by step")
    arm = arm_of(PIONEER)
    assert arm is not None
    given = exercise(arm, example(arm))
    derivation = page.locator("[data-derivation]")
    expect(derivation).to_have_attribute("data-derivation", given.followed.name)
    expect(derivation.locator('[data-open="1"]')).to_have_count(0)

    # By keyboard: the first step, then the way over the back, then the other one again.
    field = page.locator('[data-question="1"] input')
    field.fill("-90 mm")
    field.press("Enter")
    expect(page.locator('[data-derived="centre"]')).to_have_attribute("data-open", "1")
    expect(page.locator('[data-derived="centre"] [data-line="w"]')).to_contain_text(
        "(−0.0, 208.6, −90.0) mm"[-14:]
    )
    page.locator(".kb-guide-turn button").last.press("Enter")
    field = page.locator('[data-question="2"] input')
    field.fill("0")
    field.press("Enter")
    expect(page.locator('[data-feedback="2"]')).to_contain_text("atan2 takes y first")
    field.fill("-90")
    field.press("Enter")
    expect(derivation).to_have_attribute("data-derivation", given.beside(0).name)
    expect(page.locator('[data-feedback="2"]')).to_contain_text("This is “shoulder back”")
    page.locator(".kb-guide-turn button").last.press("Enter")
    expect(page.locator('[data-derived-note="too far"]')).to_contain_text("the cosine would be")

    # By mouse: another branch in the tree, all numbers, and a dragged target.
    tab.row("Follow").get_by_role("button", name="1", exact=True).click()
    expect(derivation).to_have_attribute("data-derivation", given.followed.name)
    expect(page.locator(".kb-question input")).to_be_visible()
    tab.check("All numbers")
    expect(page.locator("[data-derived-result=reached]")).to_contain_text("All joints are within their limits.")
    expect(page.locator('[data-tree="1"] [data-state="inside"]')).to_have_count(1)
    w = page.locator('[data-derived="centre"] [data-line="w"]')
    shown = room(arm, given.followed.derivation, arm.keys)
    tab.drag_arrow(PIONEER, given.T, axis=2, lengths=-0.3, room=shown)
    expect(w).not_to_contain_text("208.6")
    tab.rest()
    p, a = (vector(derivation.inner_text(), f"{name} = ") for name in "pa")
    assert np.abs(p - 120.0 * a - vector(w.inner_text(), "")).max() < 0.5, "behind the target that was dragged"
    tab.screenshot("inverse-lesson")
    page.locator("[data-tree]").evaluate("tree => tree.scrollIntoView()")
    tab.check("All numbers")
    tab.choose_lesson("None")
