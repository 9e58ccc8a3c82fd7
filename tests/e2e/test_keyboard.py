"""Keyboard: every control can be reached, shows its focus, and works; typed values and targets; undo and Back."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from page import BLIND, WAIT, Tab
from playwright.sync_api import Browser, expect

import kin

pytestmark = pytest.mark.browser

PIONEER, PUMA, FANUC = (kin.get_robot(name) for name in ("pioneer5", "puma560", "lrmate200id"))
ELBOW = "2 rotating elbow"
# viser takes the small arrows of a number field out of the tab order; the arrow keys do the same there. A folder
# that closes is inert at once; if the browser leaves its transition out, its controls stay displayed, unseen.
NOT_REACHED = """() => {
  const area = document.querySelector("[data-status]").closest(".mantine-ScrollArea-viewport");
  const controls = 'input:not([type="hidden"]), button, summary, [role="slider"], [role="tab"], [role="button"]';
  return [...area.querySelectorAll(controls)]
    .filter((e) => e.checkVisibility() && !e.dataset.reached)
    .filter((e) => !e.closest(".mantine-NumberInput-controls, [inert]"))
    .filter((e) => e.type !== "radio" || e.checked) // arrow keys lead to the others
    .map((e) => e.outerHTML.slice(0, 200));
}"""
REACHED = """() => {
  const e = document.activeElement;
  if (e === document.body) return null;
  e.dataset.reached = "yes";
  const style = getComputedStyle(e);
  const seen = style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2;
  return { seen, what: e.outerHTML.slice(0, 200) };
}"""

DOCS = Path(__file__).parents[2] / "docs"
# Each row of the overview: where, keys, action.
OVERVIEW = """() => [...document.querySelectorAll("#kb-keys tr")].map((row) => [
  row.closest("table").caption.textContent, ...[...row.cells].map((cell) => cell.textContent),
])"""


def documented() -> list[list[str]]:
    """The rows of the docs' tables of keys: where, keys, action."""
    rows, where = [], ""
    for line in (DOCS / "teaching.md").read_text().split("## Keys")[1].split("On macOS")[0].splitlines()[4:]:
        if len(cells := [cell.strip() for cell in line.replace("*", "").split("|")[1:-1]]) == 3:
            where = cells[0] or where
            rows.append([where[0].upper() + where[1:], *cells[1:]])
    table = (DOCS / "own-arm.md").read_text().split("| key | in the table |")[1].split("\n\n")[0]
    return rows + [["The DH table", *found] for found in re.findall(r"^\| (.+) \| (.+) \|$", table, re.MULTILINE)]


def walk(tab: Tab) -> None:
    """Press Tab from the first control to the last one, and check that every control got the focus."""
    tab.row("Robot").locator("input:visible").first.focus()
    for _ in range(3):  # back to the buttons before it
        tab.page.keyboard.press("Shift+Tab")
    expect(tab.page.get_by_role("button", name="Undo")).to_be_focused()
    for _ in range(100):
        reached = tab.page.evaluate(REACHED)
        if reached is None:
            break
        assert reached["seen"], f"no visible focus on {reached['what']}"
        tab.page.keyboard.press("Tab")
    assert tab.page.evaluate(NOT_REACHED) == []


def test_the_move_tab(tab: Tab) -> None:
    page = tab.page
    walk(tab)
    page.evaluate("addEventListener('keydown', () => { window.escaped = true; })")
    before = tab.number("2 rotating elbow")
    page.get_by_role("slider", name="2 rotating elbow").press("ArrowRight")
    expect(tab.row("2 rotating elbow").locator("input:visible").last).to_have_value(f"{before + 1:g}")
    assert not page.evaluate("'escaped' in window"), "viser would turn the view with the same key"

    lock = page.get_by_role("group", name="Locked").get_by_role("button", name="2", exact=True)
    lock.press("Space")
    expect(tab.status).to_contain_text("Joint 2 locked")
    page.get_by_role("button", name="Unlock all").press("Enter")
    expect(tab.status).to_contain_text("No joint is locked")

    folder = page.get_by_role("button", name="Posture and redundancy", exact=True)
    for key, state in (("Enter", "false"), ("Space", "true")):
        folder.press(key)
        expect(folder).to_have_attribute("aria-expanded", state)
    expect(page.get_by_text("Posture", exact=True)).to_be_visible()


@pytest.mark.full
def test_a_lesson(tab: Tab) -> None:
    page = tab.page
    tab.select(PUMA)
    page.get_by_role("tab", name="Learn").press("Enter")
    lesson = tab.row("Lesson").locator("input:visible").first
    lesson.focus()  # its menu opens; Enter would choose what is marked there: None
    marked = page.locator("[role=option][data-combobox-selected]")
    expect(page.get_by_role("option", name="Postures")).to_be_visible()
    for _ in range(page.get_by_role("option").count()):
        page.keyboard.press("ArrowDown")
        if marked.inner_text() == "Postures":
            break
    page.keyboard.press("Enter")
    tab.show_answer("Postures", by_key=True)  # the question withholds the list
    expect(page.locator("[data-posture]")).to_have_count(8)
    walk(tab)
    here = page.locator("[data-here]")
    before = here.get_attribute("data-posture")
    # The same as a click on the ghost.
    page.get_by_role("group", name="Go").get_by_role("button", name="2", exact=True).press("Space")
    expect(here).not_to_have_attribute("data-posture", str(before))


def with_elbow(degrees: float) -> np.ndarray:
    q = PIONEER.q_home.copy()
    q[1] = np.radians(degrees)
    point: np.ndarray = kin.fk(PIONEER, q)[:3, 3]
    return point


@pytest.mark.full
def test_a_field_names_what_is_valid_and_keeps_its_digits(tab: Tab) -> None:
    field = tab.row(ELBOW).locator("input:visible").last
    for text in ("abc", "NaN", "   ", "200", "1e999"):
        field.fill(text)
        field.press("Enter")
        expect(field).to_have_attribute("aria-invalid", "true")
        expect(field).to_have_value(text)
        expect(tab.status).to_contain_text("Valid: 0 … 150°")
    field.press("Escape")
    expect(field).to_have_value("30")
    expect(field).not_to_have_attribute("aria-invalid", "true")
    tab.type_number(ELBOW, "pi/6 + 0,5")
    tab.wait_for_tool(with_elbow(30.5), within=0.06)
    expect(field).to_have_value("30.5")
    tab.type_number(ELBOW, "45.678")
    tab.wait_for_tool(with_elbow(45.678), within=0.06)
    expect(field).to_have_value("45.678")
    expect(field).not_to_have_attribute("aria-invalid", "true")
    assert tab.row(ELBOW).locator(".kb-field-unit").inner_text() == "°"


def test_slider_keys_undo_and_the_browsers_back(tab: Tab) -> None:
    page = tab.page
    field = tab.row(ELBOW).locator("input:visible").last
    slider = page.get_by_role("slider", name=ELBOW)
    undo = page.get_by_role("button", name="Undo")
    for key, degrees in (("ArrowUp", 31), ("Shift+ArrowUp", 31.1), ("PageDown", 21.1), ("End", 150), ("Home", 0)):
        slider.press(key)
        expect(field).to_have_value(f"{degrees:g}")
    tab.wait_for_link(PIONEER, 1, 0)
    tab.type_number(ELBOW, "60")
    expect(undo).to_have_attribute("title", "Undo: Typed value (Ctrl+Z)")
    tab.wait_for_link(PIONEER, 1, 60)
    page.keyboard.press("Control+z")
    expect(field).to_have_value("0")
    tab.wait_for_tool(with_elbow(0), within=0.06)
    page.keyboard.press("Control+Shift+Z")
    expect(field).to_have_value("60")
    tab.wait_for_link(PIONEER, 1, 60)
    page.go_back()
    expect(field).to_have_value("0")
    tab.wait_for_link(PIONEER, 1, 0)
    page.go_forward()
    expect(field).to_have_value("60")
    tab.wait_for_tool(with_elbow(60), within=0.06)


def test_a_target_is_typed_and_moved_by_keys(tab: Tab) -> None:
    page = tab.page
    page.get_by_text("Locked", exact=True).dblclick()
    assert page.evaluate("String(getSelection()).trim()"), "a word is marked, as for copying"
    page.get_by_role("button", name="Type a target").click()
    text = page.locator("[data-typed] textarea")
    expect(text).to_be_focused()
    text.fill("1 2")
    text.press("Enter")
    expect(page.locator("[data-typed-error]")).to_contain_text("Found 2")
    expect(text).to_have_value("1 2")
    before = tab.tool()
    text.fill("0,1 0,12 -0,15")
    text.press("Enter")
    expect(page.locator("[data-typed-error]")).to_contain_text(
        "can be read as “0 1 0 12 -0 15” or as “0.1 0.12 -0.15”"
    )
    expect(text).to_have_value("0,1 0,12 -0,15")
    readings = page.locator("[data-typed-readings] button")
    assert readings.all_inner_texts() == ["0 1 0 12 -0 15", "0.1 0.12 -0.15"]
    np.testing.assert_allclose(tab.tool(), before)
    text.fill("[[1,0,0,0.1],[0,1,0,0.12],[0,0,1,-0.15],[0,0,0,1]]")
    text.press("Enter")
    expect(page.locator("[data-typed-error]")).to_contain_text("look like metres; the unit on screen is mm")
    expect(readings).to_have_text(["Lengths in m", "Lengths in mm"])
    text.fill("0.1 0.12 -0.15 m")
    expect(readings).to_have_count(0)  # those of the text before
    text.press("Enter")
    readings.first.click()
    expect(text).to_be_hidden()
    tab.wait_for_tool(np.array([0.1, 0.12, -0.15]), within=0.06)
    expect(tab.row("Target must match").locator("input:visible").first).to_have_value("Point only")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("g")
    page.keyboard.press("Shift+L")
    tab.wait_for_tool(np.array([0.101, 0.12, -0.15]), within=0.06)
    page.keyboard.press("g")
    page.locator("tr[data-type=position]").click()
    expect(text).to_have_value("101.0  120.0  -150.0")
    text.press("Escape")
    expect(text).to_be_hidden()
    tab.choose("Target must match", "Full pose")


def test_of_the_buttons_that_open_the_same_form_one_is_expanded(tab: Tab) -> None:
    page = tab.page
    tab.show(FANUC)
    pendant = page.get_by_role("button", name="Type joint values as the pendant shows them")
    target = page.get_by_role("button", name="Type a target")
    pendant.click()
    expect(pendant).to_have_attribute("aria-expanded", "true")
    target.click()
    expect(target).to_have_attribute("aria-expanded", "true")
    expect(pendant).to_have_attribute("aria-expanded", "false")
    pendant.click()
    expect(page.locator("[data-typed] textarea")).to_have_accessible_name("Joint values on the pendant")
    expect(target).to_have_attribute("aria-expanded", "false")
    pendant.click()
    expect(page.locator("[data-typed] textarea")).to_be_hidden()


@pytest.mark.full
def test_the_overview_of_keys_is_that_of_the_docs_and_takes_all_keys_while_it_is_open(
    tab: Tab, phone: Tab
) -> None:
    page, dialog = tab.page, tab.page.get_by_role("dialog", name="Keys")
    rows = documented()
    assert len(rows) == 22
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("?")
    expect(dialog).to_be_visible()
    assert sorted(page.evaluate(OVERVIEW)) == sorted(rows)
    for key in ("t", "?", "Tab"):  # none of them reaches the page behind
        page.keyboard.press(key)
    expect(page.locator("[data-typed]")).to_be_hidden()
    page.keyboard.press("Escape")
    expect(dialog).to_be_hidden()
    tab.row(ELBOW).locator("input:visible").last.press("?")  # a text that is being typed
    expect(dialog).to_be_hidden()
    tab.open("View")
    for shown in (tab, phone):
        shown.open("View")
        window, opener = shown.page, shown.page.get_by_role("button", name="All keys")
        opener.press("Enter")
        shut = window.get_by_role("dialog", name="Keys").get_by_role("button", name="Close")
        box, size = window.locator("#kb-keys").bounding_box(), window.viewport_size
        assert box is not None
        assert size is not None
        assert box["x"] >= 0
        assert box["y"] >= 0
        assert box["x"] + box["width"] <= size["width"]
        assert box["y"] + box["height"] <= size["height"]
        shown.screenshot("keys" if shown is tab else "keys-phone")
        shut.click()
        expect(window.locator("#kb-keys")).to_be_hidden()
        expect(opener).to_be_focused()
        shown.open("Move")


@pytest.mark.full
def test_who_may_only_look_sees_the_keys_that_work_then(browser: Browser, read_only_address: str) -> None:
    page = browser.new_page()
    page.add_init_script(BLIND)
    page.goto(read_only_address + "viewer/")
    expect(page.locator("[data-looking]")).to_be_attached(timeout=WAIT)
    page.keyboard.press("?")
    shown = page.get_by_role("dialog", name="Keys")
    expect(shown).to_be_visible()
    assert shown.locator("caption:visible").all_inner_texts() == ["Anywhere", "Scene"]
    assert shown.locator("th:visible").all_text_contents() == ["?", "B", "W, A, S, D, Q, E, arrow keys"]
    page.goto(read_only_address + "viewer/?embed=panel")
    expect(page.locator("[data-looking]")).to_be_attached(timeout=WAIT)
    page.keyboard.press("?")
    expect(shown).to_be_visible()
    assert shown.locator("th:visible").all_text_contents() == ["?", "W, A, S, D, Q, E, arrow keys"]
    page.close()


@pytest.mark.full
def test_keys_that_act_do_nothing_where_one_may_only_look(browser: Browser, read_only_address: str) -> None:
    page = browser.new_page()
    page.add_init_script(BLIND)
    page.goto(read_only_address + "viewer/")
    expect(page.locator("[data-looking]")).to_be_attached(timeout=WAIT)
    slider = page.get_by_role("slider", name="2 rotating elbow")
    before = slider.get_attribute("aria-valuenow")
    assert before is not None
    page.evaluate("window.kbSent = 0; channel.watchSent(() => { window.kbSent++; });")
    for key in ("Control+z", "Control+y", "Control+k", "j", "Shift+l", "Alt+i", "g", "t"):
        page.keyboard.press(key)
    for key in ("ArrowRight", "Shift+ArrowUp", "PageUp", "Home", "End"):
        slider.press(key)
    page.locator(".kb-field input:visible").nth(1).press("PageDown")
    page.locator("tr[data-type=position]").click()
    expect(page.locator("[data-typed] textarea")).to_be_hidden()
    expect(page.get_by_role("button", name="Type a target")).to_be_hidden()
    page.wait_for_timeout(700)  # a key on a slider is let go after 600 ms
    assert page.evaluate("window.kbSent") == 0
    expect(slider).to_have_attribute("aria-valuenow", before)
    page.close()


@pytest.mark.full
@pytest.mark.parametrize("mode", ["1", "panel"])
def test_within_another_page_the_keys_that_work_are_listed(browser: Browser, address: str, mode: str) -> None:
    page, panel = browser.new_page(), mode == "panel"
    page.add_init_script(BLIND)
    page.goto(f"{address}viewer/?embed={mode}")
    expect(page.locator("[data-status]")).to_have_attribute("data-status", "hand", timeout=WAIT)
    page.keyboard.press("?")
    shown = page.get_by_role("dialog", name="Keys")
    expect(shown).to_be_visible()
    nowhere = {"The DH table"} if panel else {"The DH table", "A joint's slider", "The field beside it"}
    idle = {"Ctrl+K", "B"} if panel else {"Ctrl+K", "B", "T"}
    works = [key for where, key, _ in documented() if where not in nowhere and key not in idle]
    assert sorted(shown.locator("th:visible").all_text_contents()) == sorted(works)
    expect(shown).not_to_contain_text("tab View", use_inner_text=True)
    page.keyboard.press("Escape")
    expect(shown).to_be_hidden()
    page.keyboard.press("Control+k")
    page.keyboard.press("t")
    expect(page.locator("[data-typed] textarea")).to_be_visible(visible=panel)
    expect(page.get_by_placeholder("Search commands...")).to_have_count(0)
    page.close()


@pytest.mark.slow
def test_the_overview_of_keys_is_dark_on_a_dark_page(tab: Tab) -> None:
    colours = "node => [getComputedStyle(node).backgroundColor, getComputedStyle(node).color]"
    for dark in (True, False):
        tab.set_dark(dark)
        tab.page.get_by_role("button", name="All keys").click()
        back, ink = (
            sum(map(int, re.findall(r"\d+", colour)[:3])) / 3
            for colour in tab.page.locator("#kb-keys").evaluate(colours)
        )
        assert (back < 60, ink > 180) == (dark, dark)
        assert (back > 230, ink < 60) == (not dark, not dark)
        tab.page.keyboard.press("Escape")


@pytest.mark.full
def test_tabs_arms_and_lessons_are_found_by_typing(tab: Tab) -> None:
    """The palette, without a mouse."""
    tab.open("Move")
    for words, row in (("ur10e", "Arm: UR10e"), ("workspace", "Workspace"), ("lesson veloc", "Lesson: Velocity")):
        tab.page.keyboard.press("Control+k")
        expect(tab.page.get_by_placeholder("Search commands...")).to_be_focused()
        tab.page.keyboard.type(words)
        expect(
            tab.page.locator("[data-action][data-selected]").or_(tab.page.locator("[data-action]").first)
        ).to_contain_text(row)
        if words == "ur10e":
            tab.screenshot("palette")
        tab.page.keyboard.press("Enter")
        expect(tab.page.get_by_placeholder("Search commands...")).to_have_count(0)
        if words == "ur10e":  # an open question of the lesson may bring its own arm
            expect(tab.row("Robot").locator("input").first).to_have_value("UR10e")
    expect(tab.page.get_by_role("tab", name="Learn")).to_have_attribute("aria-selected", "true")
    expect(tab.row("Lesson").locator("input").first).to_have_value("Velocity")
