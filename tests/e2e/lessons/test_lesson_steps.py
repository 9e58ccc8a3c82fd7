"""The steps and the check of every lesson in a browser, by mouse and by keyboard."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import Locator, expect

import kin
from app.exercises.contract import Posed
from app.exercises.lesson_text import texts_of
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.content import arm_for
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Choice, Number, Question
from kin.poses import roll_pitch_yaw
from kin.transforms import pose_from_position_wxyz
from kin.units import Units

pytestmark = pytest.mark.browser

PIONEER = kin.get_robot("pioneer5")


def right(question: Question) -> str:
    """What to press or to type."""
    if isinstance(question, Number):
        return question.value_text
    assert isinstance(question, Choice)
    return next(str(i) for i, option in enumerate(question.options) if option.right)


def do(box: Locator, question: Posed, press: Callable[[Locator], None]) -> str:
    """Sort, put into order, place or sketch; an arm that has to be driven is driven by *Show the answer*."""
    asked, right = question.asked(), question.right()
    enter = box.locator(".kb-exercise-answer, [data-guide-do=fields]")
    match asked.form:
        case "order":
            for place in right:  # type: ignore[attr-defined]
                press(box.locator(f'[data-guide-do=pick][data-argument="{place}"]'))
                expect(box.locator(f'[data-guide-do=pick][data-argument="{place}"]')).to_have_attribute(
                    "aria-pressed", "true"
                )
        case "fields":
            for i, text in enumerate(right):  # type: ignore[arg-type]
                box.locator("input").nth(i).fill(text)
        case "frame":
            pose = pose_from_position_wxyz(right[:3], np.array(right[3:]))  # type: ignore[index]
            angles = np.degrees(roll_pitch_yaw(pose[:3, :3]))
            box.locator("input").fill(" ".join(f"{x:.3f}" for x in [*(1e3 * pose[:3, 3]), *angles]))
        case _:
            press(enter)
            expect(box.locator("[data-feedback]")).to_contain_text("Not quite.")
            press(box.locator("[data-guide-do=reveal]"))
            return "The answer."
    press(enter)
    return "Right."


def answer(tab: Tab, key: str, question: Question, keyboard: bool) -> None:
    box, said = tab.page.locator(f'[data-question="{key}"]'), "Right."
    if isinstance(question, Posed):
        said = do(box, question, lambda button: button.press("Enter") if keyboard else button.click())
    elif isinstance(question, Number):
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
    expect(box.locator("[data-feedback]")).to_contain_text(said)


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


@pytest.mark.full
@pytest.mark.parametrize("lesson", WALKS)
def test_a_lesson_from_its_first_step_to_its_check(desktop: Tab, lesson: type[Lesson]) -> None:
    tab, keyboard = desktop, lesson.key in ("dh", "velocity")
    tab.open("Learn")
    tab.choose("Lesson", "None")
    tab.select(PIONEER)
    tab.choose("Lesson", lesson.title)
    outline = lesson.asked(arm_for(texts_of(lesson.key), PIONEER), Units())
    questions = dict(outline.questions())
    steps = tab.page.locator("[data-guide=steps]")
    steps.get_by_role("button", name=re.compile(r"^Step 1\b")).click()  # where it was left
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
    again = tab.page.get_by_role("button", name="Start again")
    again.press("Enter") if keyboard else again.click()
    expect(steps).to_have_attribute("data-step", "1")
    expect(tab.page.locator("[data-guide=goal]")).to_have_attribute("data-lesson", lesson.title)
    tab.choose("Lesson", "None")


def test_a_half_typed_answer_is_there_after_a_reload(desktop: Tab) -> None:
    tab, page = desktop, desktop.page
    tab.select(PIONEER)
    tab.choose_lesson("Equations")
    page.get_by_role("button", name="Step 2").press("Enter")
    field, said = page.locator('[data-question="2"] input'), page.locator('[data-feedback="2"]')
    field.fill("6")
    field.press("Enter")
    expect(said).to_contain_text("Too small.")
    field.fill("7")
    page.reload()
    expect(said).to_contain_text("Too small.")
    expect(field).to_have_value("7")
    field.press("Enter")
    expect(said).to_contain_text("nearer than 6 mm, your answer before.")
    page.reload()
    expect(field).to_have_value("7")
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
