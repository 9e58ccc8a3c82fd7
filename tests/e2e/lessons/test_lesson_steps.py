"""The steps and the check of every lesson in a browser, by mouse and by keyboard."""

from __future__ import annotations

import pytest
from page import Tab
from playwright.sync_api import Locator, expect

import kin
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Choice, Number, Question
from kin.units import Units

pytestmark = pytest.mark.browser

PIONEER = kin.get_robot("pioneer5")


def right(question: Question) -> str:
    """What to press or to type."""
    if isinstance(question, Number):
        return question.value_text
    assert isinstance(question, Choice)
    return next(str(i) for i, option in enumerate(question.options) if option.right)


def answer(tab: Tab, key: str, question: Question, keyboard: bool) -> None:
    box = tab.page.locator(f'[data-question="{key}"]')
    if isinstance(question, Number):
        field = box.locator("input")
        field.fill(right(question))
        if keyboard:
            field.press("Enter")
        else:
            box.get_by_role("button", name="Answer", exact=True).click()
    else:
        option = box.locator(f'[data-guide-do=answer][data-argument="{right(question)}"]')
        if keyboard:
            option.press("Enter")
        else:
            option.click()
    expect(box).to_have_attribute("data-closed", "1")
    expect(box.locator("[data-feedback]")).to_contain_text("Right.")


def turn(tab: Tab, keyboard: bool) -> Locator:
    following = tab.page.locator(".kb-guide-turn button").last
    if keyboard:
        following.press("Enter")
    else:
        following.click()
    return tab.page.locator("[data-guide=steps]")


# All lessons are walked through in the same way; one of them is enough for every run.
WALKS = [
    pytest.param(lesson, id=lesson.key, marks=[] if lesson.key == "equations" else [pytest.mark.slow])
    for lesson in LESSONS
]


@pytest.mark.parametrize("lesson", WALKS)
def test_a_lesson_from_its_first_step_to_its_check(desktop: Tab, lesson: type[Lesson]) -> None:
    tab, keyboard = desktop, lesson.key in ("dh", "velocity")
    tab.open("Learn")
    tab.choose("Lesson", "None")
    tab.select(PIONEER)
    tab.choose("Lesson", lesson.title)
    outline = lesson.outline(PIONEER, Units())
    questions = dict(outline.questions())
    steps = tab.page.locator("[data-guide=steps]")
    for number in range(1, len(outline.steps) + 1):
        expect(steps).to_have_attribute("data-step", str(number))
        for key in (f"e{number}", str(number)):
            if key in questions:
                answer(tab, key, questions[key], keyboard)
        turn(tab, keyboard)
    expect(steps).to_have_attribute("data-step", "check")
    for key, question in questions.items():
        if key.startswith("c"):
            answer(tab, key, question, keyboard)
    count = len(outline.check)
    expect(tab.page.locator("[data-guide=score]")).to_have_text(f"{count} of {count} right")
    turn(tab, keyboard)
    expect(steps).to_have_attribute("data-step", "1")
    tab.choose("Lesson", "None")


def test_the_keyboard_keeps_its_place(desktop: Tab) -> None:
    tab, page = desktop, desktop.page
    tab.select(PIONEER)
    tab.choose_lesson("Equations")
    page.get_by_role("button", name="Step 2").press("Enter")
    field = page.locator('[data-question="2"] input')
    field.fill("6")
    field.press("Enter")
    expect(page.locator('[data-feedback="2"]')).to_contain_text("Too small.")
    expect(field).to_be_focused()
    page.get_by_role("button", name="Show the answer").press("Enter")
    expect(page.locator('[data-feedback="2"]')).to_contain_text("The answer.")
    expect(page.locator("[data-guide=steps] :focus")).to_have_count(1)
    page.locator(".kb-guide-turn button").last.press("Enter")
    expect(page.get_by_role("button", name="Step 2, The tool point: answer shown")).to_be_visible()
    expect(page.locator("[data-guide=steps] :focus")).to_have_count(1)
    tab.choose("Lesson", "None")
