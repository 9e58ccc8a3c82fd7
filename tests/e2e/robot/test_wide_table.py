"""Room to work: the table of an arm and a program below the scene, over its whole width."""

from __future__ import annotations

import pytest
from page import Tab
from playwright.sync_api import FloatRect, Locator, expect

import kin

pytestmark = [pytest.mark.browser, pytest.mark.full]

UR5, PIONEER = kin.get_robot("ur5"), kin.get_robot("pioneer5")
BOTTOM = "document.querySelector('canvas[data-engine]').getBoundingClientRect().bottom"
ROOM_BELOW = """(node) => {
  const ends = [...node.children].map((each) => each.getBoundingClientRect().bottom);
  return innerHeight - Math.max(...ends);
}"""


def box(node: Locator) -> FloatRect:
    found = node.bounding_box()
    assert found is not None
    return found


def test_the_whole_table_is_seen_below_the_scene_and_typed_into(desktop: Tab) -> None:
    tab = desktop
    tab.select(UR5)
    tab.open("Robot")
    page, table = tab.page, tab.page.locator("[data-arm=table]")
    expect(table).to_be_visible()
    page.locator("body").press("b")
    expect(page.locator("html")).to_have_attribute("data-kb-drawer", "")
    page.wait_for_function(f"{BOTTOM} < 720")
    scene, drawer = box(page.locator("canvas[data-engine]")), box(table)
    assert drawer["y"] >= scene["y"] + scene["height"] - 1.0, "it covers nothing of the picture"
    assert drawer["x"] == pytest.approx(scene["x"], abs=1.0)
    assert drawer["width"] == pytest.approx(scene["width"], abs=1.0)
    assert scene["height"] > 300
    for part in ("#kb-tools", "#kb-axes"):
        place = box(page.locator(part))
        assert place["y"] + place["height"] <= drawer["y"], f"it covers {part}"
    for head in table.locator("thead th").all():
        place = box(head)
        assert drawer["x"] <= place["x"]
        assert place["x"] + place["width"] <= drawer["x"] + drawer["width"], "every column is seen at once"
    for row in range(6):
        place = box(table.locator(f'[data-cell="{row} high"]'))
        assert place["y"] + place["height"] <= 720, "and every row"
    assert table.evaluate("node => node.scrollHeight <= node.clientHeight"), "nothing has to be scrolled"
    assert table.evaluate(ROOM_BELOW) < 40, "nor is there room for nothing"
    table.locator('[data-cell="0 high"]').fill("90")
    table.locator('[data-cell="0 high"]').press("Enter")
    expect(tab.row("Robot").locator("input:visible").first).to_have_value(f"My arm ({UR5.name} variant)")
    expect(table.locator('[data-cell="0 high"]')).to_have_value("90")
    table.evaluate("node => { node.style.display = 'none'; }")  # as a tab that viser hides long after the click
    page.wait_for_function(f"{BOTTOM} > 719")
    table.evaluate("node => { node.style.display = ''; }")
    page.wait_for_function(f"{BOTTOM} < 720")
    tab.open("Move")
    page.wait_for_function(f"{BOTTOM} > 719")
    tab.open("Robot")
    page.wait_for_function(f"{BOTTOM} < 720")
    table.locator("[data-wide-do]").click()
    page.wait_for_function(f"{BOTTOM} > 719")
    assert box(table)["x"] > scene["x"] + scene["width"], "it is back in the panel"
    tab.select(PIONEER)


@pytest.mark.parametrize(("width", "height"), [(570, 720), (1280, 470)])
def test_in_a_small_window_there_is_no_drawer_and_no_key_for_it(desktop: Tab, width: int, height: int) -> None:
    page, keys = desktop.page, desktop.page.get_by_role("dialog", name="Keys")
    row = keys.get_by_role("row", name="B tabs Robot and Program")

    def assert_listed(listed: bool) -> None:
        page.locator("body").press("?")
        expect(keys).to_be_visible()
        expect(row).to_be_visible(visible=listed)
        page.keyboard.press("Escape")
        expect(keys).to_be_hidden()

    desktop.open("Robot")
    assert_listed(True)
    with desktop.sized(width, height):
        desktop.open("Robot")
        expect(page.locator("[data-arm=table]")).to_be_visible()
        page.locator("body").press("b")
        assert_listed(False)
    desktop.open("Robot")
    expect(page.locator("[data-arm=table] [data-wide-do]")).to_be_visible()
    page.wait_for_function(f"{BOTTOM} > 719")
    expect(page.locator("html")).not_to_have_attribute("data-kb-drawer", "")


def test_rows_and_plot_of_a_program_stand_side_by_side(desktop: Tab) -> None:
    tab, page = desktop, desktop.page
    for i, button in enumerate(("Home", "Random")):
        tab.open("Move")
        page.get_by_role("button", name=button).click()
        tab.open("Program")
        page.locator("[data-program-do=record]").click()
        expect(page.locator("[data-program-item]")).to_have_count(i + 1)
    expect(page.locator("[data-program=plot] svg")).to_be_visible()
    page.locator("[data-program=list] [data-wide-do]").click()
    page.wait_for_function(f"{BOTTOM} < 720")
    rows, plot = box(page.locator("[data-program=list]")), box(page.locator("[data-program=plot]"))
    assert rows["x"] + rows["width"] <= plot["x"] + 1.0
    assert rows["y"] == pytest.approx(plot["y"], abs=1.0)
    page.locator("[data-program=list] [data-wide-do]").click()
    page.wait_for_function(f"{BOTTOM} > 719")
    page.locator("[data-program-do=clear]").click()
    expect(page.locator("[data-program-item]")).to_have_count(0)
