"""A phone: what matters is on its small screen, and nothing there covers it."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest
from page import WAIT, Tab
from playwright.sync_api import Page, expect

import kin
from app.viewer.lessons.equations.lesson import EquationsLesson
from app.viewer.lessons.guide.outline import Choice, Number, Question
from app.viewer.lessons.inverse.lesson import InverseLesson
from app.viewer.lessons.postures.lesson import Postures
from app.viewer.session.state import decode
from kin.units import Units

pytestmark = pytest.mark.browser

PIONEER = kin.get_robot("pioneer5")
SIZES = [(390, 844), (360, 640)]

# Sliders whose thumb the visitor can press where it is.
PRESSABLE = """() => [...document.querySelectorAll("[role=slider]")].filter((thumb) => {
  const { left, top, width, height } = thumb.getBoundingClientRect();
  const at = document.elementFromPoint(left + width / 2, top + height / 2);
  return at !== null && thumb.closest(".mantine-Slider-root").contains(at);
}).length"""


@pytest.fixture(params=SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def small(phone: Tab, no_spoilt_page: None, request: pytest.FixtureRequest) -> Iterator[Tab]:
    """The phone with a window of this size."""
    with phone.sized(*request.param):
        yield phone


def test_three_joints_can_be_moved_without_scrolling(phone: Tab) -> None:
    phone.show(PIONEER)
    phone.top()
    assert phone.page.evaluate(PRESSABLE) >= 3
    expect(phone.page.get_by_role("button", name="Undo")).to_be_in_viewport(ratio=1)
    expect(phone.page.get_by_role("button", name="Type a target")).to_be_in_viewport(ratio=1)


def answer_wrong(tab: Tab, key: str, question: Question) -> None:
    box = tab.page.locator(f'[data-question="{key}"]')
    if isinstance(question, Number):
        box.locator("input").fill("6000")
        box.locator("input").press("Enter")
    else:
        assert isinstance(question, Choice)
        wrong = next(i for i, option in enumerate(question.options) if not option.right)
        box.locator(f'[data-guide-do=answer][data-argument="{wrong}"]').click()


def test_the_reason_of_a_wrong_answer_is_in_the_window(small: Tab) -> None:
    page = small.page
    small.show(PIONEER)
    small.choose_lesson(EquationsLesson.title)
    questions = dict(EquationsLesson.outline(PIONEER, Units()).questions())
    steps = page.locator("[data-guide=steps]")
    for number in (2, 3):
        page.locator(f'[data-guide=steps] [data-guide-do=go][data-argument="{number - 1}"]').first.click()
        expect(steps).to_have_attribute("data-step", str(number))
        expect(steps.get_by_role("heading").first).to_be_in_viewport(ratio=1)
        answer_wrong(small, str(number), questions[str(number)])
        said = page.locator(f'[data-feedback="{number}"]')
        expect(said).not_to_be_empty()
        expect(said).to_be_in_viewport(ratio=1)
    small.choose("Lesson", "None")


@pytest.mark.full
def test_the_way_on_from_a_branch_that_ends_is_in_the_window(phone: Tab, no_spoilt_page: None) -> None:
    """The other shoulder is right, and leads to an elbow that does not reach: the way on is on the screen."""
    phone.reopen()  # with no answer yet
    page = phone.page
    phone.show(PIONEER)
    phone.choose_lesson(InverseLesson.title)
    steps, turn = page.locator("[data-guide=steps]"), page.locator(".kb-guide-turn button")
    expect(steps).to_be_visible()
    page.locator('.kb-guide-row [data-argument="1"]').tap()
    expect(steps).to_have_attribute("data-step", "2")
    page.locator('[data-question="2"] input').fill("-90")
    page.locator('[data-question="2"] [data-guide-do=fields]').tap()
    expect(page.locator('[data-feedback="2"]')).to_contain_text("Right")
    turn.last.tap()
    expect(steps).to_contain_text("No solution")
    on = page.locator("[data-guide-do=offer]")
    expect(on).to_be_in_viewport(ratio=1)
    on.tap()
    expect(steps.locator('[data-question="3"]')).to_be_visible()
    expect(steps).not_to_contain_text("No solution")
    phone.choose("Lesson", "None")


@pytest.mark.full
def test_what_comes_under_the_finger_does_not_look_pressed(phone: Tab, no_spoilt_page: None) -> None:
    phone.reopen()  # with no answer yet
    page = phone.page
    phone.show(PIONEER)
    phone.choose_lesson(Postures.title)
    steps = page.locator("[data-guide=steps]")
    expect(steps).to_be_visible()
    page.locator('.kb-guide-row [data-argument="1"]').tap()
    expect(steps).to_have_attribute("data-step", "2")
    option = page.locator('[data-question="2"] .kb-option').nth(0)
    plain = option.evaluate("one => getComputedStyle(one).backgroundColor")
    box = option.bounding_box()
    assert box is not None
    page.touchscreen.tap(box["x"] + 10, box["y"] + 10)
    expect(page.locator('[data-feedback="2"]')).not_to_be_empty()
    assert option.evaluate("one => one.matches(':hover')"), "the browser takes the finger for a pointer that stays"
    assert option.evaluate("one => getComputedStyle(one).backgroundColor") == plain
    phone.choose("Lesson", "None")


@pytest.mark.full
def test_what_is_opened_is_shown_below_the_head_of_the_sheet(phone: Tab, no_spoilt_page: None) -> None:
    page = phone.page
    phone.show(PIONEER)
    phone.choose_lesson("Exercises")
    page.locator(".kb-exercise-list button").first.tap()
    task = page.locator("[data-exercises=task]")
    expect(task).to_be_in_viewport()
    page.wait_for_function(
        """() => {
          const head = document.querySelector(".kb-head").getBoundingClientRect();
          const task = document.querySelector("[data-exercises=task]").getBoundingClientRect();
          return task.top >= head.bottom - 1 && task.top < head.bottom + 60;
        }"""
    )
    scrolled = page.evaluate(
        "[...document.querySelectorAll('.mantine-ScrollArea-root')].filter((one) => one.scrollTop).length"
    )
    assert scrolled == 0, "the sheet itself"
    phone.choose("Lesson", "None")


@pytest.mark.full
def test_a_course_leads_on_from_where_the_answer_is(phone: Tab, no_spoilt_page: None) -> None:
    phone.reopen()  # with no answer yet
    page = phone.page
    phone.open("Learn")
    phone.choose("Lesson", "Courses")
    page.get_by_role("button", name="First steps").first.tap()
    page.get_by_role("button", name="Start", exact=True).tap()
    expect(page.locator("[data-exercise=which-joint-goes-down]")).to_be_visible()
    page.locator("[data-exercises=question] [data-guide-do=answer]").nth(2).tap()
    expect(page.locator("[data-exercises-verdict]")).to_contain_text("Right")
    page.get_by_role("button", name="Next in the course").tap()
    task = page.locator("[data-exercise=which-joint-has-moved], [data-exercise=which-joint-moved]")
    expect(task).to_be_visible()
    expect(page.locator("[data-course=bar]").get_by_text("2 of 12")).to_be_in_viewport(ratio=1)

    page.locator("[data-course=bar] [data-guide-do=next]").tap()
    steps = page.locator("[data-guide=steps]")
    expect(steps).to_have_attribute("data-step", "1")
    expect(page.locator("[data-course=bar]").get_by_text("3 of 12")).to_be_in_viewport(ratio=1)
    page.locator(".kb-guide-turn button").last.tap()  # below the step
    expect(steps).to_have_attribute("data-step", "2")
    expect(steps.get_by_role("heading").first).to_be_in_viewport(ratio=1)
    phone.choose("Lesson", "None")


def left_off_at(page: Page) -> object:
    """The item of the course to which the next page of this browser is led."""
    text = page.evaluate("localStorage.getItem('kinboard-left-off') ?? ''")
    return decode(text, list(kin.builtin_robots().values())).features.get("course", {}).get("at")


@pytest.mark.full
def test_a_closed_page_is_continued_in_the_next_one(phone: Tab, no_spoilt_page: None) -> None:
    phone.reopen()
    page = phone.page
    left_off = "Continue where you left off"
    phone.open("Learn")
    expect(page.locator("[data-review=row]")).to_be_visible()
    expect(page.get_by_role("button", name=left_off)).to_be_hidden()  # a browser that was nowhere yet
    phone.choose("Lesson", "Courses")
    page.get_by_role("button", name="First steps").first.tap()
    page.get_by_role("button", name="Start", exact=True).tap()
    expect(page.locator("[data-exercise=which-joint-goes-down]")).to_be_visible()
    page.locator("[data-course=bar] [data-guide-do=next]").dispatch_event("click")
    expect(page.locator("[data-exercise]:not([data-exercise=which-joint-goes-down])")).to_be_visible()
    end = time.monotonic() + WAIT / 1000
    while left_off_at(page) != 1:  # stored
        assert time.monotonic() < end, "the next page is led to an earlier place"
        page.wait_for_timeout(50)

    address = page.url.partition("#")[0]
    page.evaluate("sessionStorage.clear()")  # as in another tab
    page.goto(address.replace("viewer/", "livez"))
    page.goto(address)
    page.get_by_role("tab", name="Learn").tap()
    page.get_by_role("button", name=left_off).dispatch_event("click")
    expect(page.locator("[data-course=bar]").get_by_text("2 of 12")).to_be_visible()
    expect(page.locator("[data-exercise]:not([data-exercise=which-joint-goes-down])")).to_be_visible()
    phone.reopen()
