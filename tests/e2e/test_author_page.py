"""An exercise is written in a browser: fields with help, values of three students, refusals, a try, a file."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from page import Tab
from playwright.sync_api import expect

from app.exercises import load_exercise

pytestmark = pytest.mark.browser


def test_a_teacher_writes_an_exercise_and_tries_it(tab: Tab, tmp_path: Path) -> None:
    page = tab.page
    tab.open("Learn")
    tab.choose("Lesson", "None")
    page.locator(".kb-practise").get_by_role("button", name="Write an exercise").click()
    page.locator("[data-guide-change=new]").select_option("planar-tool-point")
    state = page.locator("[data-author-state]")
    expect(state).to_contain_text("Checked.")
    expect(page.locator("[data-author=students] li")).to_have_count(3)
    tab.screenshot("author-light")

    # By keyboard, through fields that are sent again when one was left.
    title = page.get_by_label("Title", exact=True)
    title.fill("Where is the tip?")
    title.press("Tab")
    expect(page.get_by_label("Id", exact=True)).to_be_focused()
    expect(page.locator("[data-author=head] b").first).to_have_text("Where is the tip?")
    value = page.locator("[data-guide-change='answer.value']")
    right = value.input_value()
    value.fill("nobody\ny")
    value.blur()
    expect(state).to_contain_text("answer.value[0]: got 'nobody'")
    expect(value).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_role("button", name="Try it as a student")).to_have_attribute("aria-disabled", "true")
    tab.screenshot("author-refused")
    value.fill(right)
    value.blur()
    expect(state).to_contain_text("Checked.")
    values = page.locator("[data-author-cell='answer.value'] .kb-author-values")
    expect(values).to_have_count(len(right.split("\n")))

    with page.expect_download() as saved:
        page.get_by_role("button", name="Save TOML").click()
    path = tmp_path / saved.value.suggested_filename
    saved.value.save_as(path)
    one = load_exercise(path)
    one.verify()
    assert one.title == "Where is the tip?"
    assert tomllib.loads(path.read_text())["id"] == path.stem

    page.get_by_role("button", name="Try it as a student").click()
    expect(page.locator(f"[data-exercise={one.id}] h3")).to_have_text("Where is the tip?")
    page.get_by_role("button", name="Go on writing").click()
    expect(state).to_contain_text("Checked.")
    tab.set_dark(True)
    tab.open("Learn")
    tab.screenshot("author-dark")
    tab.set_dark(False)
    tab.open("Learn")
    page.locator("[data-author=head]").get_by_role("button", name="Close").click()
    expect(page.locator("[data-author=start]")).to_be_visible()
    tab.choose("Lesson", "None")
    tab.spoilt = True  # its list of exercises has one more, which is open


@pytest.mark.full
def test_the_form_fits_a_phone(phone: Tab) -> None:
    page = phone.page
    phone.open("Learn")
    phone.choose("Lesson", "Write an exercise")
    page.locator("[data-guide-change=new]").select_option("kind:number")
    expect(page.locator("[data-author-state]")).to_contain_text("Checked.")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    controls = page.locator("[data-feature=author] :is(button, input, select):visible")
    expect(controls.nth(20)).to_be_visible()
    for control in controls.all():
        box = control.bounding_box()
        assert box is not None
        assert box["height"] >= 44 - 0.5, control.evaluate("node => node.outerHTML.slice(0, 90)")
    page.locator("[data-author=Numbers]").scroll_into_view_if_needed()
    phone.screenshot("author-phone")
    page.locator("[data-author=head]").get_by_role("button", name="Close").tap()
    expect(page.locator("[data-author=start]")).to_be_visible()
    phone.choose("Lesson", "None")
