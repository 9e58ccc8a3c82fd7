"""A class in browsers: one teacher and three students, from the landing page through a task to the CSV."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Iterator

import numpy as np
import pytest
from page import WAIT, DrawnTab, Tab, save_picture
from PIL import Image
from playwright.sync_api import Browser, Page, expect
from test_screens import problems

import kin
from app.viewer.room.member import SURE

pytestmark = pytest.mark.browser

EXERCISE = "which-joint-goes-down"
RIGHT, WRONG = 2, 0  # choices of this exercise
ROBOT = kin.get_robot("pioneer5")


class Member(Tab):
    """A tab of the teacher, whose wall is looked at, or of a student who has joined by code and alias."""

    def __init__(
        self, browser: Browser, address: str, code: str = "", alias: str = "", phone: bool = False
    ) -> None:
        self._code, self._alias = code, alias
        self.code = ""
        if not code:
            self.scripts = DrawnTab.scripts
        super().__init__(browser, address, *((390, 844) if phone else (1280, 720)), touch=phone)

    def _arrive(self) -> None:
        """Go from the landing page to the viewer, as the page leads."""
        page = self.page
        page.goto(self._address)
        if self._code:
            page.get_by_label("In a class?").fill(self._code)
            page.get_by_role("button", name="Join").click()
            page.get_by_label("Alias").fill(self._alias)
            page.get_by_role("button", name="Join").click()
        else:
            page.get_by_role("link", name="Open a room").click()
            page.get_by_label("Title").fill("Robotics <i>")
            page.get_by_role("button", name="Open a room").click()
            self.code = page.locator(".code").inner_text()
            page.get_by_role("link", name="Start teaching").click()
        page.wait_for_url("**/viewer/")

    def do(self, kind: str) -> None:
        """Press a control of the bar or of the tab Class."""
        self.page.locator(f"[data-guide-do={kind}]:visible").first.click()

    def shows(self, bar: str) -> None:
        """Wait until the bar over the scene says who leads this page."""
        expect(self.page.locator(f"[data-class-bar]{bar}")).to_be_visible()

    def answer(self, choice: int) -> None:
        """Choose an answer of the task, and wait until it is stored."""
        self.page.locator("[data-exercises=question] [data-guide-do=answer]").nth(choice).click()
        expect(self.page.locator("[data-exercises-note]")).to_contain_text("Stored for your teacher")

    def follows(self, other: Tab) -> None:
        """Wait until the tool is where the other page has it."""
        end = time.monotonic() + WAIT / 1000
        while np.abs(np.array(self.tool()) - other.tool()).max() > 0.15:  # both round
            assert time.monotonic() < end, f"the tool is at {self.tool()}, the other page's at {other.tool()}"
            self.page.wait_for_timeout(50)


@pytest.fixture
def members(browser: Browser, address: str) -> Iterator[list[Member]]:
    """The teacher, Ann and Bob at desktops, Eve with a phone."""
    found = [Member(browser, address)]
    try:
        for alias, phone in (("Ann <b>", False), ("=Bob", False), ("Eve", True)):
            found.append(Member(browser, address, found[0].code.lower(), alias, phone))
        yield found
    finally:
        for member in found:
            member.close()


def pads(page: Page) -> int:
    """How many pixels of the scene have the green of a solved task, which nothing but the wall's pads has."""
    page.mouse.move(400, 300)  # a page that rests is not drawn again
    page.mouse.move(410, 300)
    r, g, b = np.moveaxis(np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int), 2, 0)
    return int(((g > r + 60) & (g > b + 15))[60:640, 80:900].sum())


def lead(teacher: Member, students: list[Member]) -> None:
    """Follow me, by a drag of the teacher's target; one lets go by dragging and comes back; freeze."""
    home = kin.fk(ROBOT, ROBOT.q_home)
    ann, bob, eve = students
    teacher.do("follow")
    for student in students:
        student.shows("[data-class-bar=led]")
    before = teacher.tool()
    teacher.drag_arrow(ROBOT, home, axis=0, lengths=0.6)
    assert np.abs(np.array(teacher.tool()) - before).max() > 5, "the drag has moved the teacher's arm"
    for student in students:
        student.follows(teacher)

    teacher.open("Move")
    teacher.page.get_by_role("button", name="Home").click()
    teacher.wait_for_tool(home[:3, 3], within=0.06)
    ann.follows(teacher)
    ann.drag_arrow(ROBOT, home, axis=0, lengths=0.6)
    ann.shows("[data-class-bar=gone]")
    assert np.abs(np.array(ann.tool()) - teacher.tool()).max() > 5, "the drag has moved Ann's arm"
    bob.follows(teacher)
    ann.do("back")
    ann.shows("[data-class-bar=led]")
    ann.follows(teacher)

    for member, name in ((teacher, "teacher"), (ann, "student"), (eve, "phone")):
        member.open("Class")
        save_picture(member.page, f"class-{name}")
        assert problems(member.page) == [], name
    teacher.do("freeze")
    for student in (ann, eve):
        student.shows("[data-class-bar=led][data-class-frozen]")
    expect(ann.page.locator("[data-class-bar] [data-guide-do=go]")).to_have_count(0)


def test_a_class_from_the_landing_page_to_the_csv(members: list[Member], address: str) -> None:
    teacher, ann, bob, eve = members
    shown = teacher.page.locator("[data-class-code]")  # the tab Class has opened by itself
    expect(shown).to_have_text(teacher.code)
    assert shown.evaluate("code => code.scrollWidth <= code.clientWidth"), "the join code is cut off"
    assert teacher.page.locator(".kb-class-join img").evaluate("image => image.naturalWidth") > 0
    expect(teacher.page.locator("[data-guide-do=pick] .kb-class-alias")).to_have_text(["Ann <b>", "=Bob", "Eve"])

    lead(teacher, members[1:])

    # A task opens on every page, and ends Follow me and Freeze. Answers reach the teacher.
    teacher.page.locator("[data-guide=class-task] select").select_option(EXERCISE)
    teacher.page.locator("[data-guide=class-task] [data-guide-do=fields]").click()
    for student in members[1:]:
        expect(student.page.locator(f"[data-exercise={EXERCISE}]")).to_be_visible()
        student.shows("[data-class-bar=free]")
    with teacher.page.expect_popup() as popup:
        teacher.page.get_by_role("link", name="Results and CSV").click()
    results = popup.value
    expect(results.locator("table").first.locator("tbody tr", has_text="not begun")).to_have_count(3)
    for student, choices in ((ann, (WRONG, RIGHT)), (bob, (WRONG,)), (eve, (RIGHT,))):
        for choice in choices:
            student.answer(choice)
    expect(teacher.page.locator("[data-class-solved]")).to_have_text("2 of 3 solved it")

    teacher.do("wall")
    teacher.shows("[data-class-wall]")
    for _ in range(int(WAIT / 500)):
        if (green := pads(teacher.page)) > 100:
            break
        teacher.page.wait_for_timeout(500)
    assert green > 100, "the pads of those who have solved the task are green"
    save_picture(teacher.page, "class-wall")
    teacher.do("wall")

    # The table has renewed itself; the file has one row per attempt, and no formula.
    expect(results.locator("table").first.locator("tbody tr")).to_have_count(3)
    expect(results.locator("table").first.locator("tbody tr").first).to_contain_text("=Bob")
    save_picture(results, "class-results")
    size = results.viewport_size
    results.set_viewport_size({"width": 390, "height": 844})
    assert results.evaluate("document.documentElement.scrollWidth") <= 390
    assert size is not None
    results.set_viewport_size(size)
    answer = results.request.get(address + "room/results.csv")
    rows = list(csv.DictReader(io.StringIO(answer.body().decode("utf-8-sig"))))
    assert [(row["alias"], row["exercise"], float(row["score"])) for row in rows] == [
        *(("Ann <b>", EXERCISE, 0.0), ("Ann <b>", EXERCISE, 1.0)),
        *(("'=Bob", EXERCISE, 0.0), ("Eve", EXERCISE, 1.0)),
    ]

    # The end needs two presses.
    end = teacher.page.locator("[data-guide=class-end] button")
    end.click()
    expect(end).to_contain_text("Press again")
    teacher.page.wait_for_timeout(1000 * SURE)  # a double click is no second press
    end.click()
    ann.shows("[data-class-bar=closed]")
    assert results.request.get(address + "room/results.csv").status == 403
