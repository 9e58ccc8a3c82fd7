"""The buttons below the DH table in a browser: which row they mean, and that the page rests after them."""

from __future__ import annotations

import pytest
from page import Tab
from playwright.sync_api import expect

pytestmark = pytest.mark.browser

# How often the page says that a field was left, within seconds in which it was left once for a button.
LEFT = """() => new Promise((done) => {
  const { send } = channel;
  let left = 0;
  channel.send = (...message) => { left += message[1]?.[1]?.[0] === "left"; return send(...message); };
  document.querySelector('[data-cell="0 name"]').focus();
  document.querySelector('[data-arm-do="add"]').focus();
  setTimeout(() => { channel.send = send; done(left); }, 2500);
})"""
# Something else of the page changes before the service has answered.
ADD = """() => {
  document.querySelector('[data-arm-do="add"]').click();
  document.body.append(document.createElement("i"));
}"""


@pytest.fixture
def empty(tab: Tab) -> Tab:
    """The page with an arm of one joint."""
    tab.open("Robot")
    tab.page.locator('[data-cell="start"]').select_option("one-joint")
    expect(tab.page.locator("[data-arm] tr[data-row]")).to_have_count(1)
    expect(tab.page.locator('[data-cell="0 a"]')).to_have_value("300")
    return tab


def test_a_field_that_is_left_for_a_button_is_left_once(empty: Tab) -> None:
    page = empty.page
    before = page.locator('[data-arm="table"]').get_attribute("data-written")
    assert page.evaluate(LEFT) == 1, "the table is written, the button gets its focus back, and that is all"
    expect(page.locator('[data-arm="table"]')).not_to_have_attribute("data-written", str(before))
    expect(page.locator('[data-arm-do="add"]')).to_be_focused()


@pytest.mark.full
def test_a_new_row_is_the_one_for_the_buttons(empty: Tab) -> None:
    page = empty.page
    page.evaluate(ADD)
    expect(page.locator("[data-arm] tr[data-row]")).to_have_count(2)
    here = page.locator("[data-arm-here]")
    expect(here).to_have_text("Row 2")
    page.evaluate(ADD)
    page.evaluate(ADD)
    expect(page.locator("[data-arm] tr[data-row]")).to_have_count(4)
    expect(here).to_have_text("Row 4")
    page.locator('[data-cell="start"]').select_option("one-joint")
    expect(page.locator("[data-arm] tr[data-row]")).to_have_count(1)
    expect(here).to_have_text("Row 1")
    page.evaluate(ADD)
    expect(here).to_have_text("Row 2")


def test_escape_takes_back_a_choice_that_was_refused(empty: Tab) -> None:
    kind, wrong = empty.page.locator('[data-cell="0 kind"]'), empty.page.locator('[data-arm="wrong"]')
    kind.select_option("fixed")
    expect(wrong).to_contain_text("Row 1, kind")
    kind.press("Escape")
    expect(wrong).to_be_hidden()
    expect(kind).to_have_value("revolute")
