"""HTML that comes by the channel: an update leaves what the visitor does, in any part of the page."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from page import KEEP_SOCKETS, Tab
from playwright.sync_api import Browser, Page, expect

pytestmark = pytest.mark.browser

# A part beside those of the page. Whatever is chosen in its select is sent.
SETUP = """() => {
  window.html = (n, rows = "") => `<p class="kb-x">${n}</p>${rows}<details><summary>More</summary>d${n}</details>
    <input type="text" data-cell="a" value="${n}"><textarea data-cell="t">${n}</textarea>
    <select data-cell="b">
      <option>x</option><option ${n === 3 ? "selected" : ""}>y</option><option>z</option>
    </select>
    <button data-do="b">b${n}</button>`;
  window.bring = (text) => {
    kbSockets.at(-1).dispatchEvent(new MessageEvent("message", { data: JSON.stringify(text) }));
  };
  window.show = (...what) => bring({ heard: 0, set: { "part-test": html(...what) } });
  window.box = document.createElement("div");
  box.dataset.part = "part-test";
  box.innerHTML = html(1);
  document.body.prepend(box);
  box.addEventListener("change", ({ target }) => { if (target.matches("select")) channel.send("snap", true); });
}"""


class SocketTab(Tab):
    scripts = Tab.scripts + KEEP_SOCKETS


@pytest.fixture
def page(browser: Browser, address: str) -> Iterator[Page]:
    tab = SocketTab(browser, address, 1280, 720)
    tab.page.evaluate(SETUP)
    yield tab.page
    tab.close()


def test_focus_selection_text_and_details_stay_where_html_is_renewed(page: Page) -> None:
    page.evaluate("""() => {
      box.querySelector("summary").click();
      box.querySelector("p").classList.add("kb-here"); // as our scripts do
      window.field = box.querySelector("input");
      window.button = box.querySelector("button");
    }""")
    page.locator("[data-part=part-test] input").click()
    page.keyboard.press("Control+a")
    page.keyboard.type("half")
    page.keyboard.press("Shift+ArrowLeft")
    page.evaluate("show(2, '<button data-do=new>new</button><input data-cell=new value=8>')")
    assert page.evaluate("""() => ({
      same: [field === document.activeElement, button === box.querySelector("[data-do=b]")],
      marked: [field.value, field.selectionStart, field.selectionEnd],
      texts: [box.querySelector("p").textContent, box.querySelector("p").className, button.textContent,
        box.querySelector("textarea").value, box.querySelector("[data-cell=new]").value],
      open: box.querySelector("details").open,
    })""") == {
        "same": [True, True],
        "marked": ["half", 3, 4],
        "texts": ["2", "kb-x kb-here", "b2", "2", "8"],
        "open": True,
    }
    page.evaluate("show(4)")
    assert page.evaluate("[field.value, box.querySelector('[data-do=new]')]") == ["half", None]
    page.keyboard.press("Escape")
    page.evaluate("bring({ heard: 0, set: { 'part-test': null } })")
    assert page.evaluate("box.querySelector('p').textContent") == "4"


def test_a_choice_is_left_alone_until_the_service_has_acted_on_it(page: Page) -> None:
    found = page.evaluate("""() => {
      const choice = box.querySelector("select"), seen = [];
      choice.value = "z";
      choice.dispatchEvent(new Event("change", { bubbles: true }));
      const number = channel.followed() + 1e6; // no message of this page has it
      show(2);
      seen.push(choice.value); // the service may not have heard of it
      bring({ heard: 0, done: number });
      seen.push(choice.value); // it has, and says something else
      choice.value = "z";
      show(3);
      seen.push(choice.value);
      return seen;
    }""")
    assert found == ["z", "x", "y"]
    expect(page.locator("[data-part=part-test] select")).to_have_value("y")


def test_what_is_typed_in_one_question_stays_where_another_one_is_answered(page: Page) -> None:
    page.evaluate("""() => {
      window.questions = (n) => `<p>${n}</p>
        <fieldset data-question="a">
          <input type="text" data-cell="0" value=""><button data-do="a">a</button>
        </fieldset>
        <fieldset data-question="b"><button data-do="b">b</button></fieldset>`;
      window.sent = 0;
      channel.watchSent((number) => { sent = number; });
      bring({ heard: 0, set: { "part-test": questions(1) } });
      box.addEventListener("click", ({ target }) => { if (target.matches("button")) channel.send("snap", true); });
    }""")
    field = page.locator("[data-part=part-test] [data-cell='0']")
    field.click()
    page.keyboard.type("half")
    page.locator("[data-part=part-test] [data-do=b]").click()
    page.evaluate("bring({ heard: sent, done: sent, set: { 'part-test': questions(2) } })")
    assert page.evaluate("box.querySelector('p').textContent") == "2"
    expect(field).to_have_value("half")
    page.locator("[data-part=part-test] [data-do=a]").click()
    page.evaluate("bring({ heard: sent, done: sent, set: { 'part-test': questions(3) } })")
    expect(field).to_have_value("")  # the service has acted on it


@pytest.mark.full
def test_a_table_that_is_being_typed_stays_where_the_comparison_is_set(page: Page) -> None:
    page.get_by_role("tab", name="Robot").click()
    page.locator("#kb-arm-other").select_option("typed")
    table = page.locator("[data-compare-text]")
    table.click()
    page.keyboard.type("q1 89 0 90")
    page.locator("#kb-arm-agree").focus()
    page.locator("#kb-arm-agree").select_option("free")
    expect(page.locator("#kb-arm-agree option[selected]")).to_have_attribute("value", "free")
    expect(table).to_have_value("q1 89 0 90")
