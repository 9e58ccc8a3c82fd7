"""Exercises in a browser: opened, answered by keyboard and mouse, and closed."""

from __future__ import annotations

import re

import pytest
from page import Tab
from playwright.sync_api import Locator, expect

from app.exercises import Exercise, Exercises

pytestmark = pytest.mark.browser

ALL = Exercises()


def exercise(exercise_id: str) -> Exercise:
    found = ALL.get(exercise_id)
    assert found is not None
    return found


def block(tab: Tab, name: str) -> Locator:
    return tab.page.locator(f"[data-exercises={name}]")


def test_exercises_by_keyboard_and_mouse(tab: Tab) -> None:
    page = tab.page
    tab.open("Learn")
    tab.choose("Lesson", "None")
    page.locator(".kb-practise").get_by_role("button", name="Exercises").click()
    expect(block(tab, "list")).to_contain_text("solved")

    # By keyboard: a choice, wrong first; the focus stays where it was.
    opener = page.locator("[data-question-key=which-joint-goes-down]")
    opener.focus()
    page.keyboard.press("Enter")
    expect(page.locator("[data-exercise=which-joint-goes-down]")).to_be_visible()
    options = page.locator("[data-exercises=question] [data-guide-do=answer]")
    options.nth(0).focus()
    page.keyboard.press("Enter")
    expect(block(tab, "foot")).to_contain_text("the tool moves on a horizontal circle")
    expect(options.nth(0)).to_be_focused()
    options.nth(2).press("Enter")
    expect(page.locator("[data-exercises-verdict]")).to_contain_text("Right")
    expect(page.locator("[data-exercises-attempts]")).to_contain_text("2 attempts")

    # By mouse: another exercise, a hint, the solution; what was typed stays.
    page.locator("[data-guide-do=list]").click()
    expect(block(tab, "list")).to_contain_text(f"1 of {len(ALL.all)} solved")
    page.locator("[data-question-key=row-distance]").click()
    numbers = re.compile(r"d = (\d+) mm and a = (\d+) mm")
    expect(block(tab, "task")).to_contain_text(numbers)
    found = numbers.search(block(tab, "task").inner_text())
    assert found is not None
    d, a = (float(text) for text in found.groups())
    field = page.locator("[data-exercises=question] input[data-cell]")  # tables of the tab Robot have cells too
    field.fill(str(d + a))
    page.locator("[data-guide-do=hint]").click()
    expect(block(tab, "foot")).to_contain_text("Hint 1.")
    expect(field).to_have_value(str(d + a))
    page.locator("[data-exercises=question] [data-guide-do=fields]").click()
    expect(block(tab, "foot")).to_contain_text("You get this with the sides added.")
    field.fill(str((d * d + a * a) ** 0.5))
    field.press("Enter")
    expect(page.locator("[data-exercises-verdict]")).to_contain_text("Right")
    expect(field).to_have_attribute("readonly", "")
    following = page.locator("[data-exercises=foot] [data-guide-do=open]")
    for _ in range(50):  # until the page has scrolled to the verdict, and no longer away from the pointer
        following.hover()
        if following.evaluate("one => getComputedStyle(one).backgroundColor") == "rgb(23, 74, 109)":
            break
    expect(following).to_have_css("background-color", "rgb(23, 74, 109)")  # white letters stay legible

    page.locator("[data-guide-do=list]").click()
    expect(block(tab, "list")).to_contain_text(f"2 of {len(ALL.all)} solved")
    tab.choose("Lesson", "None")
    expect(page.locator("[data-exercises]")).to_have_count(0)


@pytest.mark.full
def test_exercises_on_a_phone(phone: Tab) -> None:
    """Nothing is wider than the screen, and what is pressed is large enough."""
    page = phone.page
    phone.open("Learn")
    phone.choose("Lesson", "Exercises")
    page.locator("[data-question-key=scara-solutions]").tap()
    expect(page.locator("[data-exercise=scara-solutions]")).to_be_visible()
    expect(page.locator("[data-exercises=question] tr[data-row]")).to_have_count(6)
    width = page.evaluate("document.documentElement.scrollWidth")
    assert width <= 390
    for button in page.locator("[data-feature=exercises] button:visible").all():
        box = button.bounding_box()
        assert box is not None
        assert box["height"] >= 44 - 0.5, button.inner_text()
    page.locator("[data-guide-do=list]").tap()
    expect(block(phone, "list")).to_be_visible()
    phone.choose("Lesson", "None")
