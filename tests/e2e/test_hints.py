"""The hints of the first minute: three, each closed by its button or by following it, and never again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from page import PLAIN, WAIT, Tab, pixel
from playwright.sync_api import Browser, FloatRect, Page, expect
from test_screens import problems

import kin

pytestmark = pytest.mark.browser
KEPT_CLEAR = ("[data-status]", "#kb-tools", "#kb-grip")  # what no hint covers, beside arm, arrows and thumbs
BAR_ABOVE_SCENE = """() => {
  const box = (selector) => document.querySelector(selector).getBoundingClientRect();
  const [bar, scene] = [box("[data-status]"), box("canvas[data-engine]")];
  return bar.bottom <= scene.top + 1 && bar.left === scene.left && Math.abs(bar.right - scene.right) < 1;
}"""


def box_of(page: Page, selector: str) -> FloatRect | None:
    node = page.locator(selector).first
    return node.bounding_box() if node.is_visible() else None


def distance(box: FloatRect, point: Sequence[float]) -> float:
    """From a box to a point of the page, pixels."""
    dx = max(box["x"] - point[0], 0.0, point[0] - box["x"] - box["width"])
    dy = max(box["y"] - point[1], 0.0, point[1] - box["y"] - box["height"])
    return float(np.hypot(dx, dy))


def covered_by(page: Page, hint: FloatRect) -> list[str]:
    """What a hint covers of arm, tools and handles."""
    robot = kin.get_robot("pioneer5")
    area = box_of(page, "canvas[data-engine]")
    assert area is not None
    where = (area["x"], area["y"], area["width"], area["height"])
    origins = np.vstack([robot.T_world_base[:3, 3], kin.link_frames(robot, robot.q_home)[:, :3, 3]])
    joints = [pixel(where, robot, origin) for origin in origins]
    found = [f"frame {i}" for i, joint in enumerate(joints) if distance(hint, joint) < 12.0]
    others = {selector: box_of(page, selector) for selector in KEPT_CLEAR}
    others |= {f"thumb {i}": thumb.bounding_box() for i, thumb in enumerate(page.get_by_role("slider").all())}
    for name, other in others.items():
        if other is None or other["width"] == 0.0:
            continue
        across = min(hint["x"] + hint["width"], other["x"] + other["width"]) - max(hint["x"], other["x"])
        down = min(hint["y"] + hint["height"], other["y"] + other["height"]) - max(hint["y"], other["y"])
        if across > 0.0 and down > 0.0:
            found.append(name)
    return found


BESIDE_THE_PANEL = """() => {
  const edge = document.querySelector("canvas[data-engine]").getBoundingClientRect().right;
  return [...document.querySelectorAll(".kb-hint")].every((hint) => hint.getBoundingClientRect().right <= edge);
}"""


def test_hints_come_once(browser: Browser, address: str) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.add_init_script(PLAIN)
    page.set_default_timeout(WAIT)
    page.goto(address + "viewer/")
    hints = page.locator(".kb-hint")
    expect(hints).to_have_count(3, timeout=WAIT)
    page.wait_for_function(BESIDE_THE_PANEL)  # they follow the picture, which the panel makes narrower as it comes
    boxes = {hint.get_attribute("data-hint"): hint.bounding_box() for hint in hints.all()}
    area = page.locator("canvas[data-engine]").bounding_box()
    assert area is not None
    for name, box in boxes.items():
        assert box is not None
        assert box["x"] >= 0, name
        assert box["x"] + box["width"] <= area["x"] + area["width"], f"the hint {name} covers the panel"
        assert covered_by(page, box) == [], f"the hint {name} covers something"
    assert problems(page) == []

    page.get_by_role("button", name="Close the hint: Questions?").click()
    expect(hints).to_have_count(2)
    thumb = page.get_by_role("slider").first.bounding_box()
    assert thumb is not None
    page.mouse.click(thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2)
    expect(hints).to_have_count(1)
    page.mouse.click(area["x"] + 0.7 * area["width"], area["y"] + 0.8 * area["height"])
    expect(hints).to_have_count(0)

    page.reload()
    expect(page.locator("[data-hints]")).to_have_count(1, timeout=WAIT)
    expect(page.get_by_role("slider").first).to_be_visible(timeout=WAIT)
    page.wait_for_timeout(1000)  # a hint would be drawn within 0.4 s
    assert hints.count() == 0
    page.close()


@pytest.mark.full
@pytest.mark.parametrize(("width", "height"), [(390, 844), (900, 600)])
def test_hints_of_small_screens_cover_nothing(browser: Browser, address: str, width: int, height: int) -> None:
    touch = min(width, height) < 500
    page = browser.new_page(viewport={"width": width, "height": height}, has_touch=touch, is_mobile=touch)
    page.add_init_script(PLAIN)
    page.goto(address + "viewer/")
    hints = page.locator(".kb-hint")
    seen = set()
    expect(hints).not_to_have_count(0, timeout=WAIT)
    while hints.count():
        page.wait_for_timeout(600)  # the picture gets its size, and the hint its place
        name, box = hints.first.get_attribute("data-hint"), hints.first.bounding_box()
        assert box is not None
        assert covered_by(page, box) == [], f"the hint {name} covers something"
        assert name not in seen
        seen.add(name)
        hints.first.get_by_role("button").click()
        page.wait_for_timeout(600)
    assert seen
    page.close()


@pytest.mark.full
def test_hints_go_while_another_tab_is_open(browser: Browser, address: str) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.add_init_script(PLAIN)
    page.goto(address + "viewer/")
    hints = page.locator(".kb-hint")
    expect(hints).to_have_count(3, timeout=WAIT)
    page.get_by_role("tab", name="Workspace").click(force=True)
    expect(page.get_by_role("slider", name="Point size")).to_be_visible(timeout=WAIT)
    expect(hints).to_have_count(0)
    page.get_by_role("tab", name="Move").click(force=True)
    expect(hints).to_have_count(3, timeout=WAIT)
    page.get_by_role("slider").first.press("ArrowRight")
    expect(page.locator('.kb-hint[data-hint="joint"]')).to_have_count(0, timeout=WAIT)
    page.get_by_role("tab", name="Learn").click(force=True)
    expect(hints).to_have_count(0)
    page.get_by_role("tab", name="Move").click(force=True)
    expect(hints).to_have_count(1, timeout=WAIT)
    expect(page.locator('.kb-hint[data-hint="drag"]')).to_have_count(1)
    page.evaluate("document.querySelector('[data-hints]').dataset.hints = '0 0 0'")  # as for an arm that is hidden
    expect(hints).to_have_count(0)
    page.close()


@pytest.mark.full
def test_card_and_legend_of_a_projector_cover_nothing_of_the_arm(browser: Browser, address: str) -> None:
    tab = Tab(browser, address, 1280, 720)
    page = tab.page
    tab.open("View")
    page.get_by_role("button", name="Projector").click()
    expect(page.locator("html")).to_have_attribute("data-kb-text", "Projector")
    tab.choose_lesson("Velocity")
    tab.show_answer("Velocity")
    legend = page.get_by_role("list", name="drawn at the tool")
    expect(legend).to_be_visible(timeout=WAIT)
    page.wait_for_function(BAR_ABOVE_SCENE)
    for covering in (legend, page.locator("[data-status]")):
        box = covering.bounding_box()
        assert box is not None
        assert [name for name in covered_by(page, box) if name.startswith("frame")] == []
    tab.close()


@pytest.mark.full
def test_note_on_slow_drawing_in_the_status_card_is_closed_for_good(browser: Browser, address: str) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.add_init_script(PLAIN)
    page.set_default_timeout(WAIT)
    page.goto(address + "viewer/")
    note = page.locator("[data-status] .kb-slow")
    expect(note).to_be_visible(timeout=WAIT)
    expect(note).to_contain_text("without a graphics card")
    expect(page.locator("#webgl-software-rendering")).to_be_hidden()
    assert problems(page) == []
    page.set_viewport_size({"width": 1278, "height": 506})  # on the landing page, in a window of 1440 × 900
    expect(note).to_be_hidden()
    page.set_viewport_size({"width": 1280, "height": 720})
    page.get_by_role("button", name="Close the note").click()
    expect(note).to_be_hidden()
    page.reload()
    expect(page.locator("[data-status]")).to_have_attribute("data-status", "hand", timeout=WAIT)
    expect(note).to_be_hidden()
    page.close()


@pytest.mark.full
def test_cover_ends_after_a_minute_in_any_case(browser: Browser, address: str) -> None:
    page = browser.new_page()
    silent = "window.Worker = class extends EventTarget { postMessage() {} terminate() {} }"
    page.add_init_script(silent)
    page.clock.install()
    page.goto(address + "viewer/")
    page.clock.fast_forward(30_000)
    expect(page.locator("html")).to_have_attribute("data-kb-cover", "light")
    page.clock.fast_forward(31_000)
    expect(page.locator("html")).not_to_have_attribute("data-kb-cover", "light")
    page.close()


@pytest.mark.full
def test_cover_says_that_a_script_failed(browser: Browser, address: str) -> None:
    page = browser.new_page()
    page.add_init_script("window.Worker = class { constructor() { throw new Error('no workers here'); } }")
    page.goto(address + "viewer/")
    said = page.get_by_role("alert").filter(has=page.get_by_role("button", name="Reload"))
    expect(said).to_contain_text("The page could not start.", timeout=WAIT)
    expect(said).to_contain_text("no workers here")
    expect(page.locator("html")).to_have_attribute("data-kb-cover", "light")
    page.close()


@pytest.mark.full
def test_a_page_that_comes_despite_an_error_says_nothing(browser: Browser, address: str) -> None:
    page = browser.new_page()
    page.route("**/static/hints.js", lambda route: route.abort())
    page.goto(address + "viewer/")
    expect(page.locator("html")).not_to_have_attribute("data-kb-cover", "light", timeout=WAIT)
    page.wait_for_timeout(2000)
    expect(page.locator("#kb-failed")).to_have_count(0)
    page.close()
