"""A class in browsers: a teacher and two students, from the join code through a task to the CSV."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from page import NO_HINTS, PLAIN, WAIT, save_picture
from playwright.sync_api import Browser, Locator, Page, expect

from app.classroom import COOKIE, Hub
from app.classroom.results.store import attempts_of
from app.classroom.results.table import to_csv

pytestmark = pytest.mark.browser

EXERCISE = "which-joint-goes-down"


class Class:
    """Pages of one room, each in a browser of its own."""

    def __init__(self, browser: Browser, address: str) -> None:
        self._browser, self._address = browser, address
        self._pages: list[Page] = []

    def page(self, door: str, form: dict[str, str], narrow: bool = False) -> Page:
        size = {"width": 390, "height": 844} if narrow else {"width": 1280, "height": 720}
        page = self._browser.new_context(viewport=size, has_touch=narrow).new_page()  # type: ignore[arg-type]
        page.add_init_script(PLAIN + NO_HINTS)
        page.set_default_timeout(WAIT)
        answer = page.request.post(self._address + door, form=form)
        assert answer.ok, answer.text()
        page.goto(self._address + "viewer/")
        expect(page.locator("[data-class-bar]")).to_be_visible(timeout=WAIT)
        notice = page.locator("#webgl-software-rendering button")
        expect(notice).to_have_count(1, timeout=WAIT)
        notice.dispatch_event("click")
        self._pages.append(page)
        return page

    def close(self) -> None:
        for page in self._pages:
            page.context.close()


def same_text(one: Locator, other: Locator) -> None:
    """Wait until both show the same."""
    end = time.monotonic() + WAIT / 1000
    while one.inner_text() != other.inner_text():
        assert time.monotonic() < end, f"{one.inner_text()} is not {other.inner_text()}"
        one.page.wait_for_timeout(100)


@pytest.fixture
def room(browser: Browser, address: str) -> Iterator[Class]:
    found = Class(browser, address)
    expect.set_options(timeout=WAIT)
    yield found
    found.close()


@pytest.mark.slow
def test_a_class_from_the_join_code_to_the_csv(room: Class, data: Path) -> None:
    teacher = room.page("room", {"title": "Robotics", "hours": "1"})
    teacher.get_by_role("tab", name="Class").click(force=True)
    code = teacher.locator("[data-class-code]").inner_text()
    expect(teacher.locator(".kb-class-join img")).to_have_js_property("complete", True)
    assert teacher.locator(".kb-class-join img").evaluate("image => image.naturalWidth") > 0
    ann = room.page("room/join", {"code": code, "alias": "Ann <b>"})
    bob = room.page("room/join", {"code": code, "alias": "=Bob"}, narrow=True)
    expect(teacher.locator("[data-question-key][data-guide-do=pick] .kb-class-alias")).to_have_text(
        ["Ann <b>", "=Bob"]
    )

    # Follow me: the students' read-outs show the teacher's pose.
    teacher.locator("[data-guide-do=follow]").click()
    for student in (ann, bob):
        expect(student.locator("[data-class-bar=led]")).to_be_visible()
    teacher.get_by_role("tab", name="Move").click(force=True)
    pose = teacher.locator('table[aria-label="tool pose"]')
    before = pose.inner_text()
    teacher.get_by_role("button", name="Random").click()
    expect(pose).not_to_have_text(before)
    for student in (ann, bob):
        same_text(student.locator('table[aria-label="tool pose"]'), pose)

    # One lets go and is called back by the freeze.
    ann.locator("[data-class-bar] [data-guide-do=go]").click()
    expect(ann.locator("[data-class-bar=gone]")).to_be_visible()
    teacher.get_by_role("tab", name="Class").click(force=True)
    teacher.locator("[data-guide-do=freeze]").click()
    expect(ann.locator("[data-class-bar=led][data-class-frozen]")).to_be_visible()
    save_picture(ann, "class-student")
    save_picture(bob, "class-student-phone")
    save_picture(teacher, "class-teacher")

    # A task opens on every page; the answers reach the teacher and the CSV.
    teacher.locator("[data-guide=class-task] select").select_option(EXERCISE)
    teacher.locator("[data-guide=class-task] [data-guide-do=fields]").click()
    options = "[data-exercises=question] [data-guide-do=answer]"
    for student, choices in ((ann, (0, 2)), (bob, (2,))):
        expect(student.locator(f"[data-exercise={EXERCISE}]")).to_be_visible()
        for choice in choices:
            student.locator(options).nth(choice).click()
            expect(student.locator("[data-exercises-note]")).to_contain_text("Stored for your teacher")
    expect(teacher.locator("[data-class-solved]")).to_have_text("2 of 2 solved it")
    hub = Hub(data)
    ticket = hub.ticket(next(c["value"] for c in teacher.context.cookies() if c["name"] == COOKIE))
    assert ticket is not None
    rows = to_csv(attempts_of(hub.database, ticket.room), {}).splitlines()
    hub.close()
    assert len(rows) == 4, rows
    assert sum("'=Bob" in row for row in rows) == 1

    # The end needs two presses.
    end = teacher.locator("[data-guide=class-end] button")
    end.click()
    expect(end).to_contain_text("Press again")
    end.click()
    expect(ann.locator("[data-class-bar=closed]")).to_be_visible()
