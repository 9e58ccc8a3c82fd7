"""A page that may only look: what acts is disabled, for mouse, finger and key, and nothing asks to type."""

from __future__ import annotations

import re

import pytest
from page import Tab
from playwright.sync_api import Browser, Locator, expect

from app.viewer.session.state import PageState, encode

pytestmark = [pytest.mark.browser, pytest.mark.full]

# Names of the controls in sight that are not disabled, in the order of the page.
ENABLED = """() => {
  const ours = "[data-part] :is(button, input, select, textarea)";
  const inputs = ":is(.mantine-Flex-root :is(input, textarea), .mantine-Button-root, [role=slider])";
  return [...document.querySelectorAll(`${ours}, .mantine-ScrollArea-viewport ${inputs}`)]
    .filter((each) => each.checkVisibility() && !each.disabled && each.ariaDisabled !== "true")
    .map((each) => each.ariaLabel ?? (each.labels?.[0] ?? each).textContent.trim());
}"""
# A file over the page: whether it is offered a place, and whether the page keeps the browser from opening it.
DRAG = """(kind) => {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File(["x"], "arm.toml"));
  const event = new DragEvent(kind, { dataTransfer, bubbles: true, cancelable: true });
  const kept = !document.body.dispatchEvent(event);
  return [document.documentElement.hasAttribute("data-arm-drop"), kept];
}"""
IN_TABS = {
    "Move": (),
    "Learn": (),
    "Robot": ("Wide or narrow: this below the picture, over its whole width (key B)", "Limits ›"),
    "Program": (),
    "Workspace": (),
}


def opened(browser: Browser, address: str, touch: bool = False) -> Tab:
    """A page of a service at which visitors may only look."""
    tab = Tab(browser, address, *((390, 844) if touch else (1280, 720)), touch=touch)
    expect(tab.page.locator("[data-looking]")).to_be_attached()
    return tab


def press(tab: Tab, slider: Locator) -> None:
    """Put mouse or finger on the end of a slider."""
    box = tab.page.locator(".mantine-Slider-root", has=slider).bounding_box()
    assert box is not None
    x, y = box["x"] + 0.9 * box["width"], box["y"] + box["height"] / 2
    if tab.touch:
        tab.page.touchscreen.tap(x, y)
    else:
        tab.page.mouse.click(x, y)


@pytest.mark.parametrize("touch", [False, True])
def test_what_acts_is_disabled_and_no_slider_moves(browser: Browser, read_only_address: str, touch: bool) -> None:
    tab = opened(browser, read_only_address, touch)
    page = tab.page
    slider = page.get_by_role("slider", name="2 rotating elbow")
    expect(slider).to_be_disabled()
    expect(page.get_by_text("View only", exact=True)).to_be_visible()
    before = slider.get_attribute("aria-valuenow")
    assert before is not None
    press(tab, slider)
    for key in ("Tab", "ArrowRight"):
        page.keyboard.press(key)
    expect(slider).to_have_attribute("aria-valuenow", before)
    tab.open("View")
    tab.check("Radians")
    expect(tab.page.locator("tr[data-type=angles] .kb-unit")).to_have_text("rad")
    for title, names in IN_TABS.items():
        tab.open(title)
        expected = ["Tool in the frame", *(names[1:] if touch else names)]
        same = f"names => JSON.stringify(({ENABLED})()) === JSON.stringify(names)"
        page.wait_for_function(same, arg=expected)
    tab.close()


def test_nothing_asks_to_type_where_one_may_only_look(browser: Browser, read_only_address: str) -> None:
    tab = opened(browser, read_only_address)
    rows = tab.page.locator("tr[data-type]")
    expect(rows).to_have_count(3)
    for row in rows.all():
        expect(row).not_to_have_attribute("title", re.compile("Click"))
    tab.page.goto(f"{read_only_address}viewer/?another#s={encode(PageState('crx10ia'))}")
    pendant = tab.page.get_by_role("button", name="Type joint values as the pendant shows them")
    expect(pendant).to_be_disabled()
    tab.page.locator("[data-pendant]").click(position={"x": 2, "y": 2})
    expect(tab.page.locator("[data-typed]")).to_be_hidden()
    tab.close()


def test_no_file_is_taken_where_one_may_only_look(browser: Browser, read_only_address: str) -> None:
    tab = opened(browser, read_only_address)
    tab.page.evaluate("window.kbSent = 0; channel.watchSent(() => { window.kbSent++; });")
    for kind in ("dragover", "drop"):
        assert tab.page.evaluate(DRAG, kind) == [False, True]
    tab.page.wait_for_timeout(300)
    assert tab.page.evaluate("window.kbSent") == 0
    tab.close()
