"""The page around the controls: colours of the system, a picture, hints, width, legible text, legends."""

from __future__ import annotations

from pathlib import Path

import pytest
from page import Tab
from playwright.sync_api import expect

import kin
from app.viewer.panel.joints import label

pytestmark = pytest.mark.browser

PUMA = kin.get_robot("puma560")
ILLEGIBLE = """() => {
  const area = document.querySelector("[data-status]").closest(".mantine-ScrollArea-viewport");
  const parts = "label, input:not([type=hidden]), button, .mantine-Slider-markLabel, td, th";
  const texts = [...area.querySelectorAll(parts)];
  return texts.filter((e) => e.checkVisibility()).map((e) => [getComputedStyle(e), e.outerHTML.slice(0, 150)])
    .filter(([style]) => parseFloat(style.fontSize) < 11 || !["normal", "0px"].includes(style.letterSpacing))
    .map(([style, what]) => `${style.fontSize}, ${style.letterSpacing}: ${what}`);
}"""
UNDER_THE_SCROLLBAR = """() => {
  const area = document.querySelector("[data-status]").closest(".mantine-ScrollArea-viewport");
  const bar = area.parentElement.querySelector(".mantine-ScrollArea-scrollbar[data-orientation=vertical]");
  if (!bar) return ["no scrollbar"];
  const left = bar.getBoundingClientRect().left;
  return [...area.querySelectorAll("input:not([type=hidden]), button, table")]
    .filter((e) => e.checkVisibility() && e.getBoundingClientRect().right > left)
    .map((e) => e.outerHTML.slice(0, 120));
}"""


def test_the_page_follows_the_colours_of_the_system(tab: Tab) -> None:
    page, root = tab.page, tab.page.locator("html")
    tab.open("View")
    tab.choose("Page colours", "Like the system")
    for scheme in ("dark", "light", "dark"):
        page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        expect(root).to_have_attribute("data-mantine-color-scheme", scheme)
    page.reload(wait_until="commit")
    expect(root).to_have_attribute("data-kb-cover", "dark")
    expect(root).not_to_have_attribute("data-kb-cover", "dark")
    expect(root).to_have_attribute("data-mantine-color-scheme", "dark")
    tab.dismiss_notice()
    tab.open("View")
    tab.choose("Page colours", "Light")
    expect(root).to_have_attribute("data-mantine-color-scheme", "light")
    page.emulate_media(color_scheme="light")
    tab.choose("Page colours", "Like the system")
    expect(page.get_by_text("The system is dark")).not_to_be_visible()


def test_a_picture_is_offered_and_the_settings_of_viser_are_not(desktop: Tab, tmp_path: Path) -> None:
    tab = desktop
    with tab.page.expect_download() as download:
        tab.page.get_by_role("button", name="Save a picture of the scene").click()
    file = tmp_path / download.value.suggested_filename
    download.value.save_as(file)
    assert file.name == "kinboard.png"
    assert file.read_bytes()[:4] == b"\x89PNG"
    assert file.stat().st_size > 4000, "an empty picture is smaller"
    expect(tab.page.locator(".tabler-icon-adjustments")).to_have_count(1)
    expect(tab.page.locator(".tabler-icon-adjustments")).not_to_be_visible()


def test_labels_show_hints_but_not_over_a_menu(desktop: Tab) -> None:
    tab = desktop
    tab.open("Move")
    hint = tab.page.get_by_role("tooltip")
    tab.page.get_by_text("Target must match", exact=True).hover()
    expect(hint).to_contain_text("position and orientation of the tool")
    tab.page.mouse.move(5, 300)
    expect(hint).not_to_be_visible()
    tab.row("Target must match").locator("input:visible").first.click()
    tab.page.get_by_role("option", name="Point only", exact=True).hover()
    tab.page.get_by_text("Target must match", exact=True).hover()
    tab.page.wait_for_timeout(900)
    expect(hint).not_to_be_visible()
    tab.page.keyboard.press("Escape")


def test_the_panel_is_made_wider_at_its_edge(desktop: Tab) -> None:
    tab = desktop
    width = "document.querySelector('[data-dock-region=right]').offsetWidth"
    before = tab.page.evaluate(width)
    for way in (-120, 120):
        grip = tab.page.locator("[data-dock-region-resize=right]").bounding_box()
        assert grip is not None
        x, y = grip["x"] + 4, grip["y"] + grip["height"] / 2
        tab.page.mouse.move(x, y)
        tab.page.mouse.down()
        tab.page.mouse.move(x + way, y, steps=2)
        tab.page.mouse.up()
        tab.page.wait_for_function(f"Math.abs({width} - {before - min(way, 0)}) < 12")


def test_texts_are_legible_the_status_stays_and_drawings_have_a_legend(tab: Tab) -> None:
    assert tab.page.evaluate(ILLEGIBLE) == []
    tab.select(PUMA)
    tab.choose_lesson("Velocity")
    legend = tab.page.get_by_role("list", name="drawn at the tool").get_by_role("listitem")
    expect(legend).to_have_text(["possible velocities of the tool point"])
    tab.page.get_by_role("group", name="Column").get_by_role("button", name="2", exact=True).click()
    expect(legend).to_contain_text(["possible velocities", "column of joint 2"])

    area = tab.page.locator(".mantine-ScrollArea-viewport:has([data-status])").first
    assert tab.hidden() > 100
    tab.page.mouse.move(1150, 600)
    assert tab.page.evaluate(UNDER_THE_SCROLLBAR) == []
    area.evaluate("area => area.scrollTo(0, area.scrollHeight)")
    expect(tab.status).to_be_in_viewport(ratio=1)
    tab.top()

    tab.open("Move")
    tab.type_number(label(PUMA, 4), "0")
    tab.open("Learn")
    expect(tab.page.locator("[data-singular=at]")).to_be_visible()
    expect(legend.last).to_contain_text("impossible here")
    tab.screenshot("velocity-legend")
