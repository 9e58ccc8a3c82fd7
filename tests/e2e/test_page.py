"""The page around the controls: colours, a picture, hints, width, legible text, legends; and the page on a phone.

On a phone the panel is a sheet, the scene gets the rest, and fingers drag sliders and the gizmo.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from page import BLIND, NO_HINTS, WAIT, Tab
from playwright.sync_api import Browser, Page, expect

import kin
from app.viewer.panel.joints import label
from app.viewer.scene.camera import DIRECTION, UP
from app.viewer.session.state import decode

pytestmark = pytest.mark.browser

ROBOTS = tuple(kin.files.classic_robots().values())

PUMA = kin.get_robot("puma560")
ILLEGIBLE = """() => {
  const area = document.querySelector("[data-status]").closest(".mantine-ScrollArea-viewport");
  const parts = "label, input:not([type=hidden]), button, .mantine-Slider-markLabel, td, th";
  const texts = [...area.querySelectorAll(parts)];
  return texts.filter((e) => e.checkVisibility()).map((e) => [getComputedStyle(e), e.outerHTML.slice(0, 150)])
    .filter(([style]) => parseFloat(style.fontSize) < 11 || !["normal", "0px"].includes(style.letterSpacing))
    .map(([style, what]) => `${style.fontSize}, ${style.letterSpacing}: ${what}`);
}"""
# Also without a font for mathematics: its MATH table says where subscripts are.
SUBSCRIPTS_ON_THE_LINE = """() => {
  const parts = [...document.querySelectorAll(".kb-jacobian msub")].map((e) => [...e.children]);
  const boxes = parts.map((part) => part.map((e) => e.getBoundingClientRect()));
  const high = boxes.filter(([base, index]) => index.bottom < base.bottom + 0.1 * base.height);
  return boxes.length ? high : ["no subscripts"];
}"""
CELLS_THAT_OVERFLOW = """() => [...document.querySelectorAll(".kb-jacobian td[data-j] > span")].filter((e) => {
  const text = document.createRange();
  text.selectNodeContents(e);
  return text.getBoundingClientRect().width > e.getBoundingClientRect().width;
}).map((e) => e.textContent)"""
AXES_END_AT = """(ends) => ["x", "y", "z"].every((name, i) => {
  const circle = document.querySelector(`#kb-axes [data-axis=${name}] circle`);
  return circle && Math.hypot(circle.cx.baseVal.value - ends[i][0], circle.cy.baseVal.value - ends[i][1]) < 0.5;
})"""
UNDER_THE_SCROLLBAR = """() => {
  const area = document.querySelector("[data-status]").closest(".mantine-ScrollArea-viewport");
  const bar = area.parentElement.querySelector(".mantine-ScrollArea-scrollbar[data-orientation=vertical]");
  if (!bar) return ["no scrollbar"];
  const left = bar.getBoundingClientRect().left;
  return [...area.querySelectorAll("input:not([type=hidden]), button, table")]
    .filter((e) => e.checkVisibility() && e.getBoundingClientRect().right > left)
    .map((e) => e.outerHTML.slice(0, 120));
}"""


# Notes the colours of the cover that a page shows while it loads, however short that is.
COVERS = """
window.covers = [];
new MutationObserver(() => {
  const colour = document.documentElement.dataset.kbCover;
  if (colour && window.covers.at(-1) !== colour) window.covers.push(colour);
}).observe(document, {attributes: true, subtree: true, attributeFilter: ["data-kb-cover"]});
"""


def test_the_page_follows_the_colours_of_the_system(tab: Tab) -> None:
    page, root = tab.page, tab.page.locator("html")
    tab.open("View")
    tab.choose("Page colours", "Like the system")
    for scheme in ("dark", "light", "dark"):
        page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        expect(root).to_have_attribute("data-mantine-color-scheme", scheme)
    page.add_init_script(COVERS)
    page.reload()
    expect(root).to_have_attribute("data-mantine-color-scheme", "dark")
    expect(root).not_to_have_attribute("data-kb-cover", "dark")
    assert page.evaluate("window.covers") == ["dark"]
    tab.open("View")
    tab.choose("Page colours", "Light")
    expect(root).to_have_attribute("data-mantine-color-scheme", "light")
    page.emulate_media(color_scheme="light")
    tab.choose("Page colours", "Like the system")


@pytest.mark.full
def test_a_page_that_may_only_look_follows_the_colours_of_the_system_and_the_size_of_the_text(
    browser: Browser, read_only_address: str
) -> None:
    page = browser.new_page(color_scheme="light")
    page.add_init_script(BLIND)
    page.goto(read_only_address + "viewer/")
    expect(page.locator("[data-looking]")).to_be_attached(timeout=WAIT)
    page.evaluate("window.kbStays = true")
    page.get_by_role("tab", name="View").click()
    page.get_by_role("button", name="Projector").click()
    expect(page.locator("html")).to_have_attribute("data-kb-text", "Projector")
    for scheme in ("dark", "light"):
        page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", scheme)
    assert page.evaluate("window.kbStays"), "it is the same page, not loaded again"
    page.close()


@pytest.mark.full
def test_a_page_that_may_only_look_looks_from_all_sides_and_chooses_the_frame_of_its_numbers(
    browser: Browser, read_only_address: str
) -> None:
    page = browser.new_page()
    page.add_init_script(BLIND + NO_HINTS)
    page.goto(read_only_address + "viewer/")
    expect(page.locator("[data-looking]")).to_be_attached(timeout=WAIT)
    look_from_the_top(page)
    page.get_by_label("Tool in the frame").select_option("base")
    expect(page.locator("tr[data-type=position]")).to_have_attribute("title", re.compile("in the frame base"))
    page.close()


@pytest.mark.full
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


def look_from_the_top(page: Page) -> None:
    """Press the button; the camera stands in the link, a moment after it has come to rest."""
    page.get_by_role("button", name="View from the top").click()
    page.wait_for_function("new URLSearchParams(location.hash.slice(1)).has('s')")
    for _ in range(100):
        text = page.evaluate("new URLSearchParams(location.hash.slice(1)).get('s')")
        chosen = decode(text, ROBOTS).camera
        if chosen is not None:
            break
        page.wait_for_timeout(100)
    assert chosen is not None
    above = chosen[0] - chosen[1]
    assert above[2] > 0.99 * np.linalg.norm(above)


@pytest.mark.full
def test_the_toolbar_looks_from_the_top(desktop: Tab) -> None:
    page = desktop.page
    look_from_the_top(page)
    desktop.open("View")
    page.get_by_role("button", name="Reset view").click()


@pytest.mark.full
def test_labels_show_hints_but_not_over_a_menu(desktop: Tab) -> None:
    tab = desktop
    tab.open("Move")
    hint = tab.page.get_by_role("tooltip")
    tab.page.get_by_text("Target must match", exact=True).hover()
    expect(hint).to_contain_text("position and orientation of the tool")
    area, place = tab.page.locator("canvas[data-engine]").bounding_box(), hint.bounding_box()
    assert area is not None
    assert place is not None
    assert place["x"] + place["width"] < area["x"] + area["width"], "over the scene, not over the controls"
    tab.page.mouse.move(5, 300)
    expect(hint).not_to_be_visible()
    tab.row("Target must match").locator("input:visible").first.click()
    tab.page.get_by_role("option", name="Point only", exact=True).hover()
    tab.page.get_by_text("Target must match", exact=True).hover()
    tab.page.wait_for_timeout(900)
    expect(hint).not_to_be_visible()
    tab.page.keyboard.press("Escape")


@pytest.mark.full
def test_a_press_hides_the_hint(desktop: Tab) -> None:
    tab = desktop
    tab.open("Move")
    hint = tab.page.get_by_role("tooltip")
    thumb = tab.page.get_by_role("slider").first
    thumb.hover()
    expect(hint).to_be_visible()
    tab.page.mouse.down()
    expect(hint).not_to_be_visible()
    tab.page.mouse.up()
    tab.page.wait_for_timeout(900)  # longer than a hint waits
    expect(hint).not_to_be_visible()
    tab.row("Target must match").locator("input:visible").first.hover()
    expect(hint).to_be_visible()


@pytest.mark.full
def test_the_panel_is_made_wider_at_its_edge(desktop: Tab) -> None:
    tab = desktop
    width = "document.querySelector('[data-dock-region=right]').offsetWidth"
    tab.page.wait_for_function(f"Math.abs({width} - 380) < 3")  # the page may have just come
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
    tab.page.locator("[data-dock-region-resize=right]").focus()
    tab.page.keyboard.press("ArrowLeft")
    tab.page.wait_for_function(f"Math.abs({width} - {before + 24}) < 3")
    tab.page.wait_for_function(f"Number(localStorage.getItem('kinboard-panel-width')) === {width}")
    kept = tab.page.evaluate(width)
    tab.page.reload()
    tab.page.wait_for_function(
        f"document.querySelector('[data-dock-region=right]') && Math.abs({width} - {kept}) < 3"
    )
    tab.page.locator("[data-dock-region-resize=right]").press("ArrowRight")
    tab.page.wait_for_function(f"Math.abs({width} - {before}) < 3")
    expect(tab.status).to_have_attribute("data-status", "hand")


# The window is 1440 wide, and 1280 again in the moment in which the panel has followed it.
MADE_NARROWER = """() => new Promise((done) => {
  const panel = document.querySelector("[data-dock-region=right]");
  let wide = 1440;
  Object.defineProperty(window, "innerWidth", { configurable: true, get: () => wide });
  const followed = new MutationObserver(() => {
    if (Math.abs(panel.offsetWidth - 440) > 3) return;
    followed.disconnect();
    wide = 1280;
    setTimeout(() => { dispatchEvent(new Event("resize")); done(); }, 300);
  });
  followed.observe(document.body, { attributes: true, subtree: true });
  dispatchEvent(new Event("resize"));
})"""


@pytest.mark.full
def test_the_panel_is_as_wide_as_the_window_allows_until_a_width_is_chosen(browser: Browser, address: str) -> None:
    tab = Tab(browser, address, 1920, 1080)
    width = "document.querySelector('[data-dock-region=right]').offsetWidth"
    for wide, panel in ((1920, 520), (1440, 440), (1280, 380)):
        tab.page.set_viewport_size({"width": wide, "height": 1080})
        tab.page.wait_for_function(f"Math.abs({width} - {panel}) < 3")
        tab.page.wait_for_function("document.documentElement.dataset.kbText === 'Normal'")
    tab.page.evaluate(MADE_NARROWER)
    tab.page.wait_for_function(f"Math.abs({width} - 380) < 3")
    tab.page.wait_for_function("localStorage.getItem('kinboard-panel-width') === null")
    tab.page.locator("[data-dock-region-resize=right]").focus()
    tab.page.keyboard.press("ArrowLeft")
    tab.page.wait_for_function("Math.abs(Number(localStorage.getItem('kinboard-panel-width')) - 404) < 3")
    tab.page.set_viewport_size({"width": 1920, "height": 1080})
    tab.page.wait_for_timeout(
        600
    )  # nothing may happen: longer than the page waits for a window that is being drawn
    assert abs(tab.page.evaluate(width) - 404) < 3, "the width that was chosen stays"
    tab.close()


# Fields of tables whose number is longer than the field, with both widths in pixels.
CUT = """() => [...document.querySelectorAll("[data-arm] table input:not(.kb-arm-text)")].map((cell) => {
  const { font, paddingLeft, paddingRight } = getComputedStyle(cell), text = cell.value || cell.placeholder;
  const pen = document.createElement("canvas").getContext("2d");
  pen.font = font;
  const room = cell.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight);
  return [text, pen.measureText(text).width, room];
}).filter(([, needed, room]) => needed > room)"""


@pytest.mark.full
@pytest.mark.parametrize(
    ("robot", "longest"), [("panda", "−166.003062"), pytest.param("ur5", "−392.25", marks=pytest.mark.slow)]
)
def test_no_number_of_an_arm_s_tables_is_cut(desktop: Tab, robot: str, longest: str) -> None:
    desktop.select(kin.get_robot(robot))
    desktop.open("Robot")
    for width, height in ((1920, 1080), (1440, 900), (1280, 720)):
        with desktop.sized(width, height):
            cells = desktop.page.locator('[data-arm="table"] input')
            assert longest in cells.evaluate_all("cells => cells.map((cell) => cell.value)")
            desktop.page.wait_for_function(f"({CUT})().length === 0", timeout=5000)
    desktop.select(kin.get_robot("pioneer5"))


@pytest.mark.full
def test_the_menu_of_robots_shows_their_pictures_and_makers(desktop: Tab) -> None:
    page = desktop.page
    desktop.row("Robot").locator("input:visible").first.click()
    option = page.get_by_role("option", name="UR5", exact=True).and_(page.locator("[data-combobox-option]"))
    expect(option).to_have_attribute("data-kb-maker", "Universal Robots")
    picture = option.evaluate("node => getComputedStyle(node).backgroundImage")
    address = picture.removeprefix('url("').removesuffix('")')
    assert page.request.get(address).headers["content-type"] == "image/webp"
    page.keyboard.press("Escape")
    expect(option).to_be_hidden()


# A phone's status card gets a long text.
LENGTHEN = """() => {
  const text = document.createElement("span");
  text.dataset.lengthened = "";
  text.textContent = "a long text ".repeat(20);
  document.querySelector("[data-status] .kb-callout-text").append(text);
}"""
AXES_BELOW_CARD = """() => {
  const high = document.querySelector("[data-status]").offsetHeight;
  return high > 90 && document.querySelector("#kb-axes").getBoundingClientRect().top >= high;
}"""


@pytest.mark.full
def test_axes_in_a_corner_point_as_those_of_the_world(desktop: Tab, phone: Tab) -> None:
    page = desktop.page
    desktop.open("View")
    for button, out in (("Reset view", DIRECTION), ("Side", np.array([0.0, -1.0, 0.0]))):
        page.get_by_role("button", name=button, exact=True).click()
        right = np.cross(UP, out)
        down = np.cross(right, out)
        ends = 36.0 + 25.0 * np.column_stack([right / np.linalg.norm(right), down / np.linalg.norm(down)])
        page.wait_for_function(AXES_END_AT, arg=ends.tolist())
    page.get_by_role("button", name="Reset view").click()
    phone.page.evaluate(f"({LENGTHEN})()")
    phone.page.wait_for_function(f"({AXES_BELOW_CARD})()")
    for tab in (desktop, phone):
        axes, scene = (tab.page.locator(part).bounding_box() for part in ("#kb-axes", "canvas[data-engine]"))
        assert axes is not None
        assert scene is not None
        assert scene["x"] <= axes["x"]
        assert axes["x"] + axes["width"] <= scene["x"] + scene["width"]
        assert scene["y"] <= axes["y"]
        assert axes["y"] + axes["height"] <= scene["y"] + scene["height"]
        for part in ("#kb-tools", "[data-status]"):
            other = tab.page.locator(part).bounding_box()
            assert other is not None
            across = min(axes["x"] + axes["width"], other["x"] + other["width"]) - max(axes["x"], other["x"])
            down = min(axes["y"] + axes["height"], other["y"] + other["height"]) - max(axes["y"], other["y"])
            assert across <= 0.0 or down <= 0.0, f"the axes cover {part}"
    phone.page.evaluate("document.querySelector('[data-lengthened]').remove()")


@pytest.mark.full
def test_the_size_of_the_text_is_chosen_and_kept(desktop: Tab) -> None:
    tab, width = desktop, "document.querySelector('[data-dock-region=right]').offsetWidth"
    tab.open("View")
    before, high = tab.page.evaluate(width), tab.row("Lengths").bounding_box()
    assert high is not None
    tab.page.get_by_role("button", name="Projector").click()
    tab.page.wait_for_function(f"Math.abs({width} - {min(1.7 * before, 640)}) < 12")
    higher = tab.row("Lengths").bounding_box()
    assert higher is not None
    assert higher["height"] == pytest.approx(1.7 * high["height"], rel=0.1)
    assert tab.page.evaluate("localStorage.getItem('kinboard-text-size')") == "Projector"
    assert tab.page.evaluate("document.querySelector('[data-status]').scrollWidth <= innerWidth")
    tab.page.get_by_role("button", name="Normal", exact=True).click()
    expect(tab.page.get_by_role("button", name="Normal", exact=True)).to_have_attribute("aria-pressed", "true")
    tab.page.wait_for_function(f"Math.abs({width} - {before}) < 12")


def test_texts_are_legible_the_status_stays_and_drawings_have_a_legend(tab: Tab) -> None:
    assert tab.page.evaluate(ILLEGIBLE) == []
    tab.select(PUMA)
    tab.choose_lesson("Velocity")
    tab.show_answer("Velocity")
    legend = tab.page.get_by_role("list", name="drawn at the tool").get_by_role("listitem")
    expect(legend).to_have_text(["possible velocities of the tool point"])
    tab.page.get_by_role("group", name="Column").get_by_role("button", name="2", exact=True).click()
    expect(legend).to_contain_text(["possible velocities", "column of joint 2"])

    area = tab.page.locator(".mantine-ScrollArea-viewport:has([data-status])").first
    assert tab.page.evaluate(SUBSCRIPTS_ON_THE_LINE) == []
    assert tab.page.evaluate(CELLS_THAT_OVERFLOW) == []
    assert tab.hidden() > 100
    tab.page.mouse.move(1150, 600)
    assert tab.page.evaluate(UNDER_THE_SCROLLBAR) == []
    area.evaluate("area => area.scrollTo(0, area.scrollHeight)")
    expect(tab.status).to_be_in_viewport(ratio=1)
    tab.top()

    tab.open("Move")
    tab.type_number(label(PUMA, 4), "0")
    expect(legend.last).to_contain_text("impossible here")  # it stays as long as what it explains
    expect(legend.last).to_be_visible()
    tab.choose_lesson("None")
    expect(legend).to_have_count(0)
    tab.choose_lesson("Velocity")  # it opens at the pose of its step
    expect(tab.page.locator("[data-singular=far]")).to_be_visible()
    expect(legend.first).to_contain_text("possible velocities")
    expect(legend.last).not_to_contain_text("impossible here")
    tab.screenshot("velocity-legend")


# On a phone


PIONEER, SRS = kin.get_robot("pioneer5"), kin.get_robot("redundant7-craig")
FINGER = 44  # px
# Heights of what a finger presses: of a slider's track with the area around it, of a check box with its line.
SMALL = """() => {
  const area = document.querySelector("[data-kb-panel]");
  const seen = (e) => e.checkVisibility() && e.getClientRects().length;
  const all = (selector) => [...area.querySelectorAll(selector)].filter(seen);
  const parts = all("input:not([type=hidden], [type=checkbox]), button, [role=tab], .mantine-Checkbox-root")
    .map((e) => [e.getBoundingClientRect().height, e.outerHTML.slice(0, 120)]);
  const tracks = all(".mantine-Slider-trackContainer").map((e) => {
    const { top, bottom } = getComputedStyle(e, "::after");
    return [e.offsetHeight - parseFloat(top) - parseFloat(bottom), "a slider"];
  });
  const small = [...parts, ...tracks].filter(([height]) => height < 43.5);
  return small.map(([height, what]) => `${height} px: ${what}`);
}"""


def touch(tab: Tab, start: np.ndarray, end: np.ndarray, steps: int = 6) -> None:
    """Drag with one finger."""
    session = tab.page.context.new_cdp_session(tab.page)

    def send(kind: str, *points: np.ndarray) -> None:
        places = [{"x": float(x), "y": float(y)} for x, y in points]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})

    send("touchStart", start)
    for k in range(1, steps + 1):
        send("touchMove", start + (end - start) * k / steps)
        tab.page.wait_for_timeout(60)
    send("touchEnd")
    session.detach()


def box(tab: Tab, selector: str) -> dict[str, float]:
    found = tab.page.locator(selector).first.bounding_box()
    assert found is not None
    return dict(found)


def drag_sheet(tab: Tab, to: float) -> None:
    rest = "document.getElementById('kb-grip').getAnimations().map((motion) => motion.finished)"
    tab.page.evaluate(f"() => Promise.all({rest})")
    grip = box(tab, "#kb-grip")
    start = np.array([195.0, grip["y"] + FINGER / 2])
    touch(tab, start, np.array([195.0, to]), steps=4)


def test_the_sheet_has_three_heights(phone: Tab) -> None:
    page, root = phone.page, phone.page.locator("html")
    expect(root).to_have_attribute("data-kb-sheet", "half")
    sheet, scene = box(phone, "[data-kb-panel]"), box(phone, "canvas")
    assert (sheet["x"], sheet["width"]) == (0, 390), "the full width"
    assert abs(sheet["y"] - 422) <= 1, "half of the window"
    assert abs(scene["y"] + scene["height"] - sheet["y"]) <= 1, "the scene ends where the sheet begins"
    assert page.evaluate(SMALL) == []
    for to, step in ((40.0, "full"), (800.0, "peek"), (430.0, "half")):
        drag_sheet(phone, to)
        expect(root).to_have_attribute("data-kb-sheet", step)
        expect(phone.status).to_be_in_viewport(ratio=1)
    for step in ("full", "peek"):
        page.locator("#kb-grip").tap()
        expect(root).to_have_attribute("data-kb-sheet", step)
    expect(page.get_by_role("tab", name="Move")).not_to_be_visible()
    page.wait_for_function("document.querySelector('canvas').clientHeight > 650")
    page.locator("#kb-grip").press("ArrowUp")
    expect(root).to_have_attribute("data-kb-sheet", "half")
    expect(page.get_by_role("tab", name="Move")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth") == 390


def test_a_finger_drags_a_slider(phone: Tab) -> None:
    phone.show(PIONEER)
    thumb = phone.row("1 rotating base").get_by_role("slider").first
    thumb.scroll_into_view_if_needed()
    handle = thumb.bounding_box()
    assert handle is not None
    start = np.array([handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2 + 14])
    field = phone.row("1 rotating base").locator("input:visible").last
    expect(field).to_have_value("90")
    touch(phone, start, start + np.array([60.0, 0.0]))
    expect(field).not_to_have_value("90")
    expect(phone.status).to_contain_text("Joints moved by hand")
    expect(phone.page.locator(".mantine-Tooltip-tooltip:visible")).to_have_count(0)
    phone.rest()
    degrees = phone.number("1 rotating base")
    assert degrees > 110
    q = PIONEER.q_home.copy()
    q[0] = math.radians(degrees)
    phone.wait_for_tool(kin.fk(PIONEER, q)[:3, 3], within=0.06)


def test_a_finger_drags_the_gizmo(phone: Tab) -> None:
    phone.show(SRS)
    home = kin.fk(SRS, SRS.q_home)
    arrow, at = phone.arrow(SRS, home, axis=2), phone.page.locator("canvas").first.bounding_box()
    assert at is not None
    assert at["y"] < arrow[0][1] < at["y"] + at["height"], "the gizmo is in the picture"
    touch(phone, arrow[0], arrow[0] - 0.6 * (arrow[1] - arrow[0]))
    expect(phone.status).to_have_attribute("data-status", "reached")
    phone.rest()
    moved = np.array(phone.tool()) / 1000 - home[:3, 3]
    assert moved @ home[:3, 2] < -0.03, "the tool went backwards along its own axis"
    assert np.linalg.norm(moved - home[:3, 2] * (moved @ home[:3, 2])) < 1e-3, "and nowhere else"


@pytest.mark.full
def test_a_phone_that_is_turned_keeps_tab_and_history(phone: Tab) -> None:
    page = phone.page
    phone.open("Move")
    page.get_by_role("button", name="Home").tap()
    phone.open("Learn")
    phone.rest()
    history = page.locator("[data-send=undo]").get_attribute("title")
    for width, height in ((844, 390), (390, 844)):
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_timeout(300)
        expect(page.get_by_role("tab", name="Learn")).to_have_attribute("aria-selected", "true")
        # The lines below tabs, in two rows if need be, are below each row and not through it.
        expect(page.get_by_role("tablist")).to_have_css("background-size", "100% 44px")
        assert history is not None
        expect(page.locator("[data-send=undo]")).to_have_attribute("title", history)
    phone.open("Move")


@pytest.mark.full
def test_a_closed_sheet_leaves_the_status_and_a_tap_reaches_the_scene(phone: Tab) -> None:
    """viser ignores captured pointers, and browsers capture every touch."""
    page = phone.page
    page.evaluate(
        "addEventListener('pointerdown', (e) => { window.captured = e.target.hasPointerCapture(e.pointerId); })"
    )
    sheet = page.locator("#kb-grip")
    while page.evaluate("document.documentElement.dataset.kbSheet") != "peek":
        sheet.press("ArrowDown")
    expect(phone.status).to_be_visible()
    page.touchscreen.tap(60, 120)
    page.wait_for_function("window.captured === false")
    sheet.press("ArrowUp")
