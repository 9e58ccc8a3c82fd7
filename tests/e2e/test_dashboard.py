"""The dashboard in a real headless Chromium, through the public port of the real service."""

from __future__ import annotations

import math
import random
import re
from dataclasses import replace

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import expect

import kin
from app.viewer.obstacles import placed
from tests.app.zips import TWO_JOINTS, packed, robot_files

pytestmark = pytest.mark.browser

TYPE_SLOWLY = """texts => new Promise(done => {
    const sent = [], cell = document.querySelector('[data-arm] input[data-cell="tool z"]');
    cell.focus();
    const { send } = WebSocket.prototype;
    WebSocket.prototype.send = function (text) {
        const [, name, argument] = JSON.parse(text);
        if (name === "feature" && argument[1][0] === "cell") {
            sent.push(argument[2][1]);
            setTimeout(() => { WebSocket.prototype.send = send; done(sent); }, 500);
        }
        return send.call(this, text);
    };
    texts.forEach((text, i) => setTimeout(() => {
        cell.value = text;
        cell.dispatchEvent(new Event("input", { bubbles: true }));
    }, 150 * i));
})"""  # what is sent of texts that are typed
PIONEER = kin.get_robot("pioneer5")
SRS = kin.get_robot("redundant7-craig")


def home_with(robot: kin.Robot, index: int, degrees: float) -> np.ndarray:
    q = robot.q_home.copy()
    q[index] = math.radians(degrees)
    return q


def test_sliders_by_keyboard_mouse_and_number(tab: Tab) -> None:
    tab.type_number("1 rotating base", "37.25")
    tab.wait_for_tool(kin.fk(PIONEER, home_with(PIONEER, 0, 37.25))[:3, 3], within=0.06)
    expect(tab.row("1 rotating base").locator("input:visible").last).to_have_value("37.25")
    expect(tab.status).to_contain_text("Joints moved by hand")

    thumb = tab.row("1 rotating base").get_by_role("slider").first
    thumb.focus()
    for _ in range(5):
        tab.page.keyboard.press("ArrowRight")
    expect(tab.row("1 rotating base").locator("input:visible").last).to_have_value("42.25")
    tab.wait_for_tool(kin.fk(PIONEER, home_with(PIONEER, 0, 42.25))[:3, 3], within=0.06)

    handle = thumb.bounding_box()
    assert handle is not None
    x, y = handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x + 50, y, steps=10)
    tab.page.mouse.up()
    expect(tab.row("1 rotating base").locator("input:visible").last).not_to_have_value("42.25")
    tab.rest()
    degrees = tab.number("1 rotating base")
    assert degrees > 60
    tab.wait_for_tool(kin.fk(PIONEER, home_with(PIONEER, 0, degrees))[:3, 3], within=0.06)


def test_dragging_the_gizmo_moves_the_arm_and_reports_out_of_reach(tab: Tab) -> None:
    tab.show(SRS)
    home = kin.fk(SRS, SRS.q_home)
    tab.drag_arrow(SRS, home, axis=2, lengths=-0.6)
    expect(tab.status).to_have_attribute("data-status", "reached")
    expect(tab.status).to_contain_text("Reached")
    tab.rest()
    moved = np.array(tab.tool()) / 1000 - home[:3, 3]
    assert moved @ home[:3, 2] < -0.03, "the tool went backwards along its own axis"
    assert np.linalg.norm(moved - home[:3, 2] * (moved @ home[:3, 2])) < 1e-3, "and nowhere else"
    q = np.radians([tab.number(f"Joint {i + 1}") for i in range(SRS.n)])
    assert np.abs(kin.fk(SRS, q)[:3, 3] * 1000 - tab.tool()).max() < 0.5, "the sliders show the solution"
    tab.screenshot("drag-reached")

    reached = home.copy()
    reached[:3, 3] += moved
    tab.drag_arrow(SRS, reached, axis=2, lengths=4.2)
    expect(tab.status).to_have_attribute("data-status", "unreachable")
    expect(tab.status).to_contain_text(re.compile(r"by \d+ mm"))
    tab.screenshot("drag-out-of-reach")

    tab.page.get_by_role("button", name="Home").click()
    tab.wait_for_tool(home[:3, 3], within=0.06)


def test_branches_and_the_arm_angle_move_the_arm_and_not_the_tool(tab: Tab) -> None:
    tab.show(SRS)
    home = kin.fk(SRS, SRS.q_home)[:3, 3]
    name = next(n for n in kin.branch_names(SRS) if "back" in n and "elbow positive" in n and "no-flip" in n)
    tab.choose("Posture", "back · elbow + · no-flip")
    expect(tab.status).to_contain_text("Reached")
    expect(tab.page.locator("[data-branch]")).to_have_text("now: back · elbow + · no-flip")
    tab.wait_for_tool(home, within=0.06)
    tab.type_number("Arm angle ψ", "60")
    expect(tab.row("Arm angle ψ").locator("input:visible").last).to_have_value("60")
    tab.rest()
    tab.wait_for_tool(home, within=0.06)
    q = np.radians([tab.number(f"Joint {i + 1}") for i in range(SRS.n)])
    assert kin.branch_of(SRS, q) == name
    assert np.abs(kin.fk(SRS, q)[:3, 3] - home).max() < 5e-4
    assert abs(q[0]) > 0.2, "the elbow swung out"
    expect(tab.page.locator("[data-redundancy=psi]")).to_contain_text("feasible: −111.7 … 111.7°")
    tab.mark_is_under_thumb("Arm angle ψ", 60)
    tab.screenshot("posture-light")
    tab.type_number("Arm angle ψ", "150")
    expect(tab.status).to_contain_text("−111.7° … 111.7°")
    tab.rest()
    tab.wait_for_tool(home, within=0.06)
    expect(tab.row("Arm angle ψ").locator("input:visible").last).to_have_attribute("aria-invalid", "true")
    assert tab.number("Arm angle ψ") == 150, "what was refused can be corrected"
    tab.mark_is_under_thumb("Arm angle ψ", 60)
    kept = np.radians([tab.number(f"Joint {i + 1}") for i in range(SRS.n)])
    assert np.abs(kept - q).max() < 1e-6, "the arm stays"


@pytest.mark.full
def test_five_joints_name_the_roll_error(tab: Tab) -> None:
    home = kin.fk(PIONEER, PIONEER.q_home)
    axes = [tab.pixel(PIONEER, home[:3, 3] + 0.05 * home[:3, k]) for k in range(3)]
    origin = tab.pixel(PIONEER, home[:3, 3])
    axis = int(np.argmax([np.linalg.norm(a - origin) for a in axes]))
    tab.drag_arrow(PIONEER, home, axis, lengths=-0.25)
    expect(tab.status).to_have_attribute("data-status", "compromise")
    expect(tab.status).to_contain_text("error")
    tab.rest()
    assert np.linalg.norm(np.array(tab.tool()) / 1000 - home[:3, 3]) > 0.002
    tab.screenshot("roll-error")


@pytest.mark.full
def test_the_move_tab_fits_a_small_window(tab: Tab) -> None:
    assert tab.hidden() <= 75, "more than the heads of the closed folders Jog and Obstacles"


def test_phone(phone: Tab) -> None:
    phone.show(PIONEER)
    phone.type_number("1 rotating base", "60")
    phone.wait_for_tool(kin.fk(PIONEER, home_with(PIONEER, 0, 60))[:3, 3], within=0.06)


@pytest.mark.full
def test_a_zip_or_several_files_show_the_real_arm_and_delete_removes_it(tab: Tab) -> None:
    page, two = tab.page, kin.load_robot(TWO_JOINTS)
    tab.open("Robot")
    files = {**robot_files(), "two/noise.bin": random.Random(1).randbytes(200_000)}  # in several parts
    file = {"name": "two.zip", "mimeType": "application/zip", "buffer": packed(files)}
    page.locator("[data-arm-file]").set_input_files([file])
    expect(tab.status.first).to_contain_text("The meshes of two.zip are shown")
    expect(page.locator('[data-arm="files"]')).to_contain_text("stay while this page is open")
    tab.wait_for_tool(kin.fk(two, two.q_home)[:3, 3], within=0.06)
    tab.screenshot("meshes")
    tab.rest()
    expect(page.locator('[data-arm] input[data-cell="tool z"]')).to_be_visible()
    sent = page.evaluate(TYPE_SLOWLY, ["0", "1", "10", "100"])
    assert sent == ["100"], "an arm with meshes is sent once typing rests"
    page.get_by_role("button", name="Delete my arm").click()
    expect(tab.status.first).to_contain_text("was deleted")
    several = [
        {
            "name": name.rpartition("/")[2],
            "mimeType": "",
            "buffer": text.encode() if isinstance(text, str) else text,
        }
        for name, text in robot_files().items()
    ]
    page.locator("[data-arm-file]").set_input_files(several)
    expect(tab.status.first).to_contain_text("The meshes of two.urdf are shown")
    page.get_by_role("button", name="Delete my arm").click()
    tab.show(kin.get_robot("pioneer5"))


DROP = """(text) => {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([text], "two.urdf"));
  const scene = document.querySelector("canvas[data-engine]");
  for (const kind of ["dragover", "drop"]) {
    scene.dispatchEvent(new DragEvent(kind, { dataTransfer, bubbles: true, cancelable: true }));
    if (kind === "dragover") window.kbOffer = getComputedStyle(document.body, "::after").content;
  }
  return window.kbOffer;
}"""


def test_a_file_dropped_onto_the_scene_is_the_arm(tab: Tab) -> None:
    page, two = tab.page, kin.load_robot(TWO_JOINTS)
    assert "to open it" in page.evaluate(DROP, TWO_JOINTS)
    tab.wait_for_tool(kin.fk(two, two.q_home)[:3, 3], within=0.06)
    expect(page.get_by_role("tab", name="Robot")).to_have_attribute("aria-selected", "true")
    page.get_by_role("button", name="Delete my arm").click()
    tab.show(kin.get_robot("pioneer5"))


@pytest.mark.full
def test_the_choice_between_several_ends_is_seen(tab: Tab) -> None:
    page = tab.page
    tab.open("Robot")
    turn = "<joint name='{0}' type='revolute'><parent link='base'/><child link='{0}-end'/><axis xyz='0 0 1'/>"
    limit = "<limit lower='-1' upper='1' velocity='1' effort='1'/></joint><link name='{0}-end'/>"
    text = "<robot name='fork'><link name='base'/>" + "".join((turn + limit).format(x) for x in "ab") + "</robot>"
    choice = page.locator('select[data-cell="tip"]')
    for name in ("fork.urdf", "other.urdf"):
        tab.top()
        file = {"name": name, "mimeType": "", "buffer": text.encode()}
        page.locator("[data-arm-file]").set_input_files([file])
        expect(tab.status.first).to_contain_text(f"{name} has several ends")
        expect(choice).to_be_in_viewport(ratio=1)


def test_three_poses_are_recorded_played_and_scrubbed(tab: Tab) -> None:
    angles = (30.0, 80.0, 120.0)
    places = [kin.fk(PIONEER, home_with(PIONEER, 0, angle))[:3, 3] for angle in angles]
    page = tab.page
    rows = page.locator("[data-program-item]")
    for i, angle in enumerate(angles):
        tab.open("Move")
        tab.type_number("1 rotating base", str(angle))
        tab.wait_for_tool(places[i], within=0.06)
        tab.open("Program")
        page.locator("[data-program-do=record]").click()
        expect(rows).to_have_count(i + 1)

    clock = page.locator("[data-program=clock]")
    page.get_by_role("button", name="Play").click()
    page.wait_for_function("document.querySelector('[data-program=clock]').dataset.playing === '1'")
    expect(page.get_by_role("button", name="Pause", exact=True)).to_be_visible()
    page.wait_for_function("document.querySelector('[data-program=clock]').dataset.playing === '0'")
    tab.wait_for_tool(places[-1], within=0.06)
    assert clock.get_attribute("data-time") == clock.get_attribute("data-duration")

    time = page.get_by_role("slider", name="Time in the program")
    time.focus()
    page.keyboard.press("Home")
    tab.wait_for_tool(places[0], within=0.06)
    plot = page.locator("[data-program-plot]")
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] - 3, box["y"] + 40)
    tab.wait_for_tool(places[-1], within=0.06)
    expect(page.locator("[data-program-cursor]")).to_be_visible()

    page.locator("[data-program-do=clear]").click()
    expect(rows).to_have_count(0)


def test_an_arm_that_touches_a_table_says_so(tab: Tab) -> None:
    arm = kin.get_robot("pioneer5")
    (table,) = placed.added((), "table", arm, arm.q_home)
    top = next(
        z
        for z in np.arange(table.xyz[2], 1.0, 0.01).tolist()
        if kin.clearance(arm, arm.q_home, [replace(table, xyz=(*table.xyz[:2], z))]) < -0.005
    )
    tab.page.get_by_text("Obstacles", exact=True).click()
    tab.page.get_by_role("button", name="Add a table").click()
    expect(tab.status).to_contain_text("Added: table")
    field = tab.page.locator("#kb-obstacle-z")
    field.fill(f"{1000 * top:.0f}")
    field.press("Enter")
    expect(tab.status).to_contain_text("touches the table")
    expect(tab.status).to_contain_text("deep.")
    expect(tab.page.get_by_role("button", name="table ⊗ touched")).to_be_visible()
    tab.screenshot("obstacles")
    tab.page.get_by_role("button", name="Remove table").click()
    expect(tab.status).not_to_contain_text("touches")
    expect(tab.page.get_by_role("button", name="Remove table")).to_have_count(0)
    tab.page.get_by_text("Obstacles", exact=True).click()
    expect(tab.page.get_by_role("button", name="Add a table")).to_be_hidden()
