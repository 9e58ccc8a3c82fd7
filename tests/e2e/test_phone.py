"""The dashboard on a phone: the panel is a sheet, the scene gets the rest, fingers drag sliders and the gizmo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import expect

import kin

pytestmark = pytest.mark.browser

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
    touch(phone, start, start + np.array([60.0, 0.0]))
    expect(phone.status).to_contain_text("Joints moved by hand")
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
    moved = np.array(phone.tool()) / 1000 - home[:3, 3]
    assert moved @ home[:3, 2] < -0.03, "the tool went backwards along its own axis"
    assert np.linalg.norm(moved - home[:3, 2] * (moved @ home[:3, 2])) < 1e-3, "and nowhere else"
