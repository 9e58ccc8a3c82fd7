"""The workspace tab in a real browser: drawing a cloud, cutting it, picking a point, and the section plot."""

from __future__ import annotations

import re

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import expect

import kin
from app.shared.clouds import Cloud
from app.viewer.scene.camera import round_points

pytestmark = pytest.mark.browser

PIONEER = kin.get_robot("pioneer5")
FEW = 10_000  # points; the page is rendered in software


def draw(tab: Tab, points: int) -> None:
    tab.page.get_by_role("tab", name="Workspace").click()
    tab.type_number("Points", str(points))
    tab.page.get_by_role("button", name="Start").first.click()
    expect(tab.page.locator("[data-cloud]")).to_have_attribute("data-cloud", "done")
    tab.page.wait_for_timeout(700)


def test_a_cloud_is_drawn_and_a_click_moves_the_arm_to_its_point(tab: Tab) -> None:
    draw(tab, FEW)
    points = Cloud(PIONEER, FEW).slice(0, FEW).points.astype(float)
    # A point on the outside that faces the camera, so that nothing hides it.
    room = [round_points(points[: Cloud(PIONEER, FEW).edges[1]])]
    index = int(np.argmax(points @ np.array([0.5, 0.8, 0.0]) - 2.0 * np.abs(points[:, 2] + 0.1)))
    tab.page.mouse.click(*tab.pixel(PIONEER, points[index], room).tolist())
    expect(tab.status).to_contain_text("Moved to point")
    found = int(re.sub(r"\D", "", re.search(r"point ([\d\s]+)", tab.status.inner_text())[1]))  # type: ignore[index]
    assert np.linalg.norm(tab.pixel(PIONEER, points[found], room) - tab.pixel(PIONEER, points[index], room)) < 12
    q = kin.workspace.workspace_configurations(PIONEER, found)
    tab.wait_for_tool(kin.fk(PIONEER, q)[:3, 3], within=0.06)
    expect(tab.page.locator("table[aria-label='picked point']")).to_be_visible()
    tab.screenshot("workspace-picked")

    before = tab.status.inner_text()
    tab.page.mouse.move(300, 560)
    tab.page.mouse.down()
    tab.page.mouse.move(360, 540, steps=4)
    tab.page.mouse.up()
    tab.page.wait_for_timeout(500)
    assert tab.status.inner_text() == before, "orbiting the view picks no point"
    tab.page.get_by_role("button", name="Clear").first.click()
    tab.page.get_by_role("tab", name="View").click()
    tab.page.get_by_role("button", name="Reset view").click()


@pytest.mark.full
def test_a_cut_and_the_section_plot(tab: Tab) -> None:
    draw(tab, FEW)
    tab.choose("Colour by", "Manipulability")
    tab.choose("Cut", "along the arm")
    expect(tab.page.get_by_text("Cut at (mm)")).to_be_visible()
    tab.check("Section plot")
    expect(tab.page.locator("[data-plot=section] image")).to_have_count(1)
    section = tab.page.locator("[data-plot=section] svg").bounding_box()
    dot = tab.page.locator("[data-plot=tool] svg").bounding_box()
    assert section is not None
    assert dot is not None
    assert abs(section["y"] - dot["y"]) < 1.5, "the tool's drawing lies over the section's"
    assert abs(section["x"] - dot["x"]) < 1.5
    assert section["height"] < 700
    tab.page.get_by_role("tab", name="View").click()
    tab.choose("Lengths", "cm")
    tab.page.get_by_role("tab", name="Workspace").click()
    expect(tab.page.get_by_text("Cut at (cm)")).to_be_visible()
    expect(tab.page.locator("[data-plot=section]")).to_contain_text("z: height, cm")
    expect(tab.page.locator('table[aria-label="tool pose"]')).to_contain_text("cm")
    tab.screenshot("workspace-section-cm")
    tab.page.get_by_role("tab", name="View").click()
    tab.choose("Lengths", "mm")
    tab.page.get_by_role("tab", name="Workspace").click()
    tab.choose("Compare with", kin.get_robot("scara").name)
    expect(tab.page.locator("[data-legend=names]")).to_contain_text("orange")
    expect(tab.page.locator("[data-cloud]")).to_have_attribute("data-cloud", "done")
    tab.screenshot("workspace-compared")
    tab.page.get_by_role("button", name="Clear").first.click()
    expect(tab.page.locator("[data-cloud]")).to_have_attribute("data-cloud", "ready")
    tab.check("Section plot")
    expect(tab.page.locator("[data-plot=section]")).to_have_count(0)


@pytest.mark.full
def test_a_click_in_a_posture_map_lists_the_postures_of_the_place(tab: Tab) -> None:
    tab.show(kin.get_robot("ur5"))
    tab.page.get_by_role("tab", name="Workspace").click()
    folder = tab.page.get_by_role("button", name="Postures", exact=True)
    if folder.get_attribute("aria-expanded") != "true":
        folder.click()
    tab.page.get_by_role("button", name="Start").last.click()
    nodes = tab.page.locator("[data-guide-map] image")
    expect(nodes).to_have_count(1)
    expect(tab.page.get_by_text(re.compile(r"regions?\. A: "))).to_be_visible()
    tab.page.get_by_role("button", name="A", exact=True).click()
    rows = tab.page.locator("[data-posture]")
    expect(rows.first).to_be_visible()
    nodes.scroll_into_view_if_needed()
    box = nodes.bounding_box()
    assert box is not None
    tab.page.mouse.click(box["x"] + 2, box["y"] + 2)  # the corner of the map is out of reach
    expect(tab.page.get_by_text("No posture at the place chosen.")).to_be_visible()
    expect(tab.status).to_contain_text("Out of reach")
    expect(rows).to_have_count(0)
