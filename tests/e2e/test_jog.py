"""Jog: buttons that move the arm in steps, held or pressed by a key; and arcs of the gizmo, dragged."""

from __future__ import annotations

import math

import numpy as np
import pytest
from page import WAIT, Tab
from playwright.sync_api import Browser, expect

import kin
from app.viewer.scene import viewpoints
from app.viewer.scene.arm.arm_scene import GIZMO
from app.viewer.scene.meshes import body
from app.viewer.session.state import PageState, encode
from kin.poses import roll_pitch_yaw

pytestmark = pytest.mark.browser

PIONEER, UR5 = kin.get_robot("pioneer5"), kin.get_robot("ur5")
ARC = 0.65  # radius of the gizmo's arcs, in lengths of its arrows
HOME = kin.fk(PIONEER, PIONEER.q_home)[:3, 3]


@pytest.fixture
def jogging(tab: Tab) -> Tab:
    """The tab with the folder of the pad open."""
    if not tab.page.get_by_label("Joints", exact=True).is_visible():
        tab.page.get_by_role("button", name="Jog", exact=True).click()
    return tab


@pytest.mark.full
def test_a_held_button_goes_on_until_it_is_released(jogging: Tab) -> None:
    tab, page = jogging, jogging.page
    down = page.get_by_role("button", name="z −", exact=True)
    page.get_by_label("Base", exact=True).check()
    page.get_by_label("10", exact=True).check()
    tab.screenshot("jog")
    down.press("Enter")  # a click takes as long as the machine likes, and would be a held button
    tab.wait_for_tool(HOME - (0.0, 0.0, 0.010), within=0.06)
    down.hover()
    page.mouse.down()
    page.wait_for_function(
        "(z) => Number(document.querySelectorAll('.kb-readout .kb-number')[2].textContent.replace('−', '-')) < z",
        arg=1000 * HOME[2] - 45,
    )
    page.mouse.up()
    tab.rest()
    rested = np.array(tab.tool())
    page.wait_for_timeout(500)
    assert np.array_equal(tab.tool(), rested)
    page.get_by_role("button", name="Undo").click()
    tab.wait_for_tool(HOME - (0.0, 0.0, 0.010), within=0.06)


def test_joints_are_jogged_by_keys(jogging: Tab) -> None:
    tab, page = jogging, jogging.page
    page.get_by_label("Joints", exact=True).check()
    page.get_by_label("5", exact=True).check()
    expect(page.get_by_role("button", name="x −", exact=True)).to_be_hidden()
    page.locator('[data-pad="1 1"]:visible').focus()
    page.keyboard.press("Enter")
    page.keyboard.press("Space")
    tab.wait_for_link(PIONEER, 1, float(np.degrees(PIONEER.q_home[1])) + 10.0)
    tab.screenshot("jog joints")


class LinkTab(Tab):
    """A tab that is opened by the link to a state."""

    def __init__(self, browser: Browser, address: str, state: PageState) -> None:
        self._link = f"{address}viewer/#s={encode(state)}"
        super().__init__(browser, address, 1280, 720)

    def _arrive(self) -> None:
        self.page.goto(self._link)


@pytest.mark.full
@pytest.mark.parametrize("tilt", [1.0, pytest.param(15.0, marks=pytest.mark.slow)])
def test_an_arc_seen_edge_on_turns_with_the_pointer(browser: Browser, address: str, tilt: float) -> None:
    T, radius = kin.fk(UR5, UR5.q_home), ARC * GIZMO * body(UR5).radius
    above, aside, turned = math.radians(tilt), math.radians(35.0), math.radians(25.0)
    outward = T[:3, :3] @ [math.sqrt(0.5), math.sqrt(0.5), 0.0]  # the middle of the arc about the tool's z
    level = math.cos(aside) * outward + math.sin(aside) * np.cross([0.0, 0.0, 1.0], outward)
    camera = T[:3, 3] + 1.6 * (math.cos(above) * level + [0.0, 0.0, math.sin(above)])
    view = np.array([camera, T[:3, 3], [0.0, 0.0, 1.0]])
    tab = LinkTab(browser, address, PageState(UR5.id, camera=view))
    expect(tab.row("Robot").locator("input:visible").first).to_have_value(UR5.name, timeout=4 * WAIT)
    tab.rest()

    def seen(angle: float) -> np.ndarray:
        """Page coordinates of the point of the arc at an angle from the tool's x."""
        area = tab.page.locator("canvas").first.bounding_box()
        assert area is not None
        out = T[:3, :3] @ [math.cos(angle), math.sin(angle), 0.0]
        point = T[:3, 3] + radius * out
        x, y, _ = viewpoints.places(view, area["width"] / area["height"], point[None])[0]
        unit = min(area["width"], area["height"]) / 2
        return np.array([area["x"] + area["width"] / 2 + x * unit, area["y"] + area["height"] / 2 - y * unit])

    start, end = seen(math.pi / 4), seen(math.pi / 4 + turned)
    mouse = tab.page.mouse
    mouse.move(*start.tolist())
    tab.page.wait_for_timeout(300)  # the arc lights up under the pointer
    mouse.down()
    for k in range(1, 7):
        mouse.move(*(start + (end - start) * k / 6).tolist())
        tab.page.wait_for_timeout(60)
    mouse.up()
    tab.rest()
    angles = tab.page.locator('table[aria-label="tool pose"] tr').nth(1).locator("td span").all_inner_texts()
    roll, pitch, yaw = (float(text.replace("−", "-")) for text in angles)
    home = math.degrees(roll_pitch_yaw(T[:3, :3])[2])
    assert (abs(roll), pitch) == (180.0, 0.0), "it turns about the tool's z alone"
    assert abs(abs(yaw - home) - 25.0) < 5.0, "as far as the pointer went along the arc"
    tab.close()
