"""Where the bar of a class lies, by rectangles: it covers no tool, and nothing covers it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from page import PLAIN, save_picture
from playwright.sync_api import Browser, Page, expect
from test_class import EXERCISE, Member

pytestmark = [pytest.mark.browser, pytest.mark.full]

BOX = """(selector) => {
  const node = [...document.querySelectorAll(selector)].find((each) => each.checkVisibility());
  const { left, top, right, bottom } = node?.getBoundingClientRect() ?? {};
  return node ? { left, top, right, bottom } : null;
}"""
# Hints come, and the picture gets its size: whether all boxes are where they were in the last four looks.
AT_REST = """(selectors) => {
  const nodes = selectors.flatMap((each) => [...document.querySelectorAll(each)]);
  const now = JSON.stringify(nodes.map((node) => node.getBoundingClientRect())), before = window.kbBoxes;
  window.kbBoxes = { now, looks: before?.now === now ? before.looks + 1 : 0 };
  const rest = window.kbBoxes.looks >= 4;
  if (rest) delete window.kbBoxes;
  return rest;
}"""
BAR, SCENE, CARD, HINT = "[data-class-bar]", "canvas[data-engine]", "[data-status]", ".kb-hint"
CORNER = 0.4  # of the picture's width, which a bar that lies over it takes at most


class Student(Member):
    """A student with a screen of any size, who is new: hints and notes are not closed."""

    scripts = PLAIN

    def __init__(self, browser: Browser, address: str, code: str, alias: str, width: int, height: int) -> None:
        self._new_size = {"width": width, "height": height}
        super().__init__(browser, address, code, alias, phone=min(width, height) < 500)

    def _open(self) -> None:
        self._size = self._new_size
        super()._open()


@pytest.fixture
def class_of_screens(browser: Browser, address: str) -> Iterator[tuple[Member, list[Student]]]:
    teacher = Member(browser, address)
    sizes = {"Eve": (390, 844), "Lea": (844, 390), "Dan": (1280, 720)}
    students = []
    try:
        for alias, size in sizes.items():
            students.append(Student(browser, address, teacher.code, alias, *size))
        yield teacher, students
    finally:
        for member in (teacher, *students):
            member.close()


def box(page: Page, selector: str) -> dict[str, float] | None:
    found: dict[str, float] | None = page.evaluate(BOX, selector)
    return found


def overlap(one: dict[str, float] | None, other: dict[str, float] | None) -> bool:
    return (
        one is not None
        and other is not None
        and one["left"] < other["right"]
        and other["left"] < one["right"]
        and one["top"] < other["bottom"]
        and other["top"] < one["bottom"]
    )


def keeps_apart(student: Student, bar: str) -> None:
    """Wait until the bar is there, and the picture has made room for it; nothing lies on the bar."""
    page = student.page
    student.shows(bar)
    page.wait_for_function(AT_REST, arg=[BAR, SCENE, CARD, HINT], polling=100)
    ours, scene = box(page, BAR), box(page, SCENE)
    assert ours is not None
    assert scene is not None
    assert not overlap(ours, box(page, CARD)), "the status card lies on the bar"
    assert not overlap(ours, box(page, HINT)), "a hint lies on the bar"
    middle = {"x": (ours["left"] + ours["right"]) / 2, "y": (ours["top"] + ours["bottom"]) / 2}
    assert page.evaluate(
        "({x, y}) => document.elementFromPoint(x, y)?.closest('[data-class-bar]') !== null", middle
    )
    if student.touch and overlap(ours, scene):
        width = ours["right"] - ours["left"]
        assert width <= CORNER * (scene["right"] - scene["left"]), "the bar lies across the picture"
        assert scene["right"] - ours["right"] < 20, "the bar is in the corner"
    assert ours["right"] <= page.viewport_size["width"]  # type: ignore[index]
    assert ours["bottom"] <= page.viewport_size["height"]  # type: ignore[index]


def test_the_bar_covers_no_tool_and_nothing_covers_the_bar(class_of_screens: tuple[Member, list[Student]]) -> None:
    teacher, students = class_of_screens

    def all_keep_apart(bar: str, name: str) -> None:
        for student in students:
            keeps_apart(student, bar)
            save_picture(student.page, f"bar-{name}-{student.page.viewport_size['width']}")  # type: ignore[index]

    all_keep_apart("[data-class-bar=free]", "free")
    teacher.page.locator("[data-guide=class-task] select").select_option(EXERCISE)
    teacher.page.locator("[data-guide=class-task] [data-guide-do=fields]").click()
    for student in students:
        expect(student.page.locator(f"[data-exercise={EXERCISE}]")).to_be_attached()
    all_keep_apart("[data-class-bar=free]", "task")
    for student in students:
        student.open("Move")
    all_keep_apart("[data-class-bar=free] [data-guide-do=task]", "task-to-open")
    teacher.do("follow")
    for student in students:
        expect(student.page.locator("[data-class-paused]")).to_have_text("Task paused")
    all_keep_apart("[data-class-bar=led]", "led")
    teacher.do("follow")
    teacher.page.locator("[data-guide=class-ask] [data-guide-do=fields]").click()
    for student in students:
        expect(student.page.locator("[data-guide-do=vote]:visible")).to_have_count(2)
    all_keep_apart("[data-class-bar=free]", "vote")
    for student in students:
        student.do("vote")
        expect(student.page.locator("[data-class-voted]")).to_be_visible()
    all_keep_apart("[data-class-bar=free]", "voted")
