"""The lesson "Velocity" in a browser: jogging by mouse and keyboard, a singular pose, a phone."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import expect

import kin
from kin.units import fixed

pytestmark = pytest.mark.browser

ABB = kin.get_robot("irb120")
IIWA = kin.get_robot("iiwa14")


def open_lesson(tab: Tab) -> None:
    tab.explore("Velocity")
    tab.show_answer("Velocity")
    expect(tab.page.locator("[data-singular]")).to_be_visible()


@pytest.fixture
def lesson(desktop: Tab) -> Iterator[Tab]:
    """The lesson with the ABB arm at home."""
    if desktop.row("Robot").locator("input:visible").first.input_value() != ABB.name:
        desktop.choose("Robot", ABB.name)
    desktop.page.get_by_role("tab", name="Move").click()
    desktop.page.get_by_role("button", name="Home").click()
    desktop.wait_for_tool(kin.fk(ABB, ABB.q_home)[:3, 3], within=0.06)
    open_lesson(desktop)
    yield desktop
    desktop.choose("Lesson", "None")


def test_jogging_by_click_by_keyboard_and_by_holding(lesson: Tab) -> None:
    page = lesson.page
    at = kin.fk(ABB, ABB.q_home)[:3, 3]
    down = page.get_by_role("button", name="−z", exact=True)
    down.click()
    lesson.wait_for_tool(at - [0, 0, 0.005], within=0.06)
    expect(lesson.status.first).to_contain_text("Jogged 5 mm along −z of the base")
    down.press("Enter")
    lesson.wait_for_tool(at - [0, 0, 0.010], within=0.06)

    sideways = page.get_by_role("button", name="+y", exact=True)
    box = sideways.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 5, box["y"] + 5)
    page.mouse.down()
    end = time.monotonic() + 20.0
    while lesson.tool()[1] < 1000 * at[1] + 12.0 and time.monotonic() < end:
        page.wait_for_timeout(100)
    page.mouse.up()
    page.wait_for_timeout(800)
    moved = np.array(lesson.tool()) / 1000 - at
    assert moved[1] > 0.0145, "three steps at least"
    assert moved[[0, 2]] == pytest.approx([0.0, -0.010], abs=1e-4), "and nowhere else"

    buttons = [page.get_by_role("button", name=n, exact=True).bounding_box() for n in ("−x", "+z", "−rx", "+rz")]
    tops = [b["y"] for b in buttons if b is not None]
    assert tops[0] == tops[1] < tops[2] == tops[3], "six in a row"


@pytest.mark.full
def test_a_singular_pose_and_the_lost_direction(lesson: Tab) -> None:
    lesson.page.get_by_role("tab", name="Move").click()
    lesson.type_number("5 axis 5", "0")
    lesson.page.get_by_role("tab", name="Learn").click()
    warning = lesson.page.locator("[data-singular]")
    expect(warning).to_have_attribute("data-singular", "at")
    expect(warning).to_contain_text("At a wrist singularity")
    expect(warning).to_contain_text("Cannot move along base y")
    lesson.choose("Show", "Force")
    lesson.screenshot("velocity-singular")


@pytest.mark.full
def test_force_null_space_and_line_by_mouse_and_keyboard(lesson: Tab) -> None:
    page = lesson.page
    for folder in ("Forces", "Null space", "Along a line"):
        page.get_by_role("button", name=folder, exact=True).press("Enter")
    lesson.type_number("Fz, N", "-20")
    torques = page.locator("[data-torque]")
    expect(torques).to_have_count(6)
    expected = kin.jacobian(ABB, ABB.q_home)[2] * -20.0
    expect(torques.nth(1)).to_have_text(fixed(float(expected[1]), 2))
    page.get_by_role("button", name="Cheapest direction").click()
    expect(page.locator("[data-cheap]")).to_contain_text("per newton")
    expect(page.locator("[data-null]")).to_contain_text("null space: only 0")
    page.get_by_role("button", name="Plot the line").press("Enter")
    expect(page.locator("[data-line]")).to_contain_text("Start and end are the same")
    page.get_by_role("button", name="−z", exact=True).click()
    expect(lesson.status.first).to_contain_text("Jogged")
    page.get_by_role("button", name="Plot the line").press("Enter")
    expect(page.locator("[data-line] .kb-motion-curve")).to_have_count(3)
    lesson.check("Force at the tool")
    expect(torques).to_have_count(0)
    for folder in ("Forces", "Null space", "Along a line"):
        page.get_by_role("button", name=folder, exact=True).press("Enter")


@pytest.mark.full
def test_seven_columns_fit_a_phone(phone: Tab) -> None:
    phone.select(IIWA)
    open_lesson(phone)
    matrix = phone.page.locator('table[aria-label="Jacobian"]')
    expect(matrix.locator("[data-j]")).to_have_count(42)
    within = matrix.evaluate("e => e.scrollWidth <= e.parentElement.clientWidth + 1")
    assert within, "the matrix needs no scrolling"
