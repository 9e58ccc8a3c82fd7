"""The tab *Program* in a browser: record three poses, play, scrub, read the plot, save, rename, reload.

Programs are opened from files, the chart of postures is clicked, and a way is found around an obstacle.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import FilePayload, Locator, expect

import kin
from app.viewer.obstacles import placed
from app.viewer.panel.posture import short

pytestmark = pytest.mark.browser

PIONEER, UR5 = kin.get_robot("pioneer5"), kin.get_robot("ur5")
ANGLES = (90.0, 140.0, 60.0)  # of joint 1, degrees


def at(angle: float) -> np.ndarray:
    """Where the tool is with joint 1 at an angle."""
    q = PIONEER.q_home.copy()
    q[0] = np.radians(angle)
    return kin.fk(PIONEER, q)[:3, 3]


@pytest.fixture
def program(desktop: Tab) -> Iterator[Tab]:
    desktop.select(PIONEER)
    desktop.open("Move")
    desktop.page.get_by_role("button", name="Home").click()
    desktop.wait_for_tool(at(90), within=0.06)
    yield desktop
    desktop.open("Program")
    desktop.page.locator("[data-program-do=clear]").click()


@pytest.mark.full
def test_the_table_of_peaks_stays_open_while_the_page_updates(program: Tab) -> None:
    page = program.page
    for i in range(2):
        program.open("Move")
        program.type_number("1 rotating base", str(ANGLES[i]))
        program.wait_for_tool(at(ANGLES[i]), within=0.06)
        program.open("Program")
        page.locator("[data-program-do=record]").click()
        expect(page.locator("[data-program-item]")).to_have_count(i + 1)
    table = page.get_by_role("table", name="Peaks and limits of the joints")
    words = page.locator("[data-program=summary] > p").first
    expect(table).to_be_hidden()
    page.get_by_text("Peaks and limits of the joints").click()
    expect(table).to_be_visible()
    before = words.inner_text()
    page.locator("[data-program-do=choose]").nth(1).click()
    speed = page.locator("[data-program-field=speed]")
    speed.fill("20")
    speed.press("Enter")
    expect(words).not_to_have_text(before)
    expect(table).to_be_visible()
    page.get_by_text("Peaks and limits of the joints").click()
    expect(table).to_be_hidden()
    speed.fill("40")
    speed.press("Enter")
    expect(page.locator("[data-program-item]").nth(1)).to_contain_text("at 40 %")
    expect(table).to_be_hidden()


def is_kept(program: Tab) -> None:
    """A name that is given to a pose, and where the arm is, stay when the page is loaded again; so does undo."""
    page = program.page
    rows = page.locator("[data-program-item]")
    rows.nth(1).locator("[data-program-do=choose]").click()
    name = page.locator("[data-program-field=name]")
    name.fill("above the part")
    name.press("Enter")
    expect(rows.nth(1)).to_contain_text("above the part")
    page.locator("[data-program-do=go]").click()
    program.wait_for_tool(at(ANGLES[1]), within=0.06)
    program.wait_for_link(PIONEER, 0, ANGLES[1])

    page.reload()
    expect(rows).to_have_count(3)
    expect(rows.nth(1)).to_contain_text("above the part")
    program.wait_for_tool(at(ANGLES[1]), within=0.06)
    page.locator("[data-program-do=clear]").click()
    expect(rows).to_have_count(0)
    page.get_by_role("button", name="Undo").click()
    expect(rows).to_have_count(3)


def test_three_poses_are_recorded_played_saved_and_kept(program: Tab, tmp_path: Path) -> None:
    page = program.page
    for i, angle in enumerate(ANGLES):
        program.open("Move")
        program.type_number("1 rotating base", str(angle))
        program.wait_for_tool(at(angle), within=0.06)
        program.open("Program")
        page.locator("[data-program-do=record]").click()
        expect(page.locator("[data-program-item]")).to_have_count(i + 1)
    now = page.locator("[data-program-now]")
    duration = float(re.findall(r"/ ([\d.]+) s", now.inner_text())[0])

    clock = page.locator("[data-program=clock]")
    page.get_by_role("button", name="Play").click()
    expect(page.get_by_role("button", name="Pause", exact=True)).to_be_visible()
    expect(now).to_have_text(f"{duration:.2f} / {duration:.2f} s")
    expect(clock).to_have_attribute("data-playing", "0")
    program.wait_for_tool(at(ANGLES[-1]), within=0.06)
    assert clock.get_attribute("data-time") == clock.get_attribute("data-duration")

    slider = page.get_by_role("slider", name="Time in the program")
    slider.press("Home")
    program.wait_for_tool(at(ANGLES[0]), within=0.06)
    slider.fill("0.5")
    expect(now).to_contain_text("0.50 /")

    plot = page.locator("[data-program-plot]")
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    assert box is not None
    ends = [float(plot.get_attribute(f"data-{side}") or "nan") / 100 for side in ("left", "right")]
    page.mouse.click(box["x"] + box["width"] * ends[1] - 1, box["y"] + 40)
    program.wait_for_tool(at(ANGLES[-1]), within=2.0)
    left = page.locator("[data-program-cursor]").evaluate("node => parseFloat(node.style.left)")
    assert left == pytest.approx(100 * ends[1], abs=1.0)
    page.locator('[data-program-do=joint][data-argument="0"]').click()
    expect(plot.locator("svg")).to_have_attribute("aria-label", re.compile("joint 1"))
    expect(plot.locator(".kb-motion-band").first).to_be_attached()

    with page.expect_download() as download:
        page.locator("[data-program-do=download]").click()
    file = tmp_path / "program.toml"
    download.value.save_as(file)
    segments = tomllib.loads(file.read_text("utf-8"))["segments"]
    assert [round(np.degrees(segment["q"][0])) for segment in segments] == list(ANGLES)
    page.locator("[data-program-choice=language]").select_option("URScript")
    expect(page.locator("[data-program=files] code")).to_contain_text("six revolute joints")
    is_kept(program)


# A line of the UR5 that arrives in another posture than recorded, degrees.
LINE = (
    ("ptp", [215.70215832, -94.13277042, 106.01340862, -101.8806382, -90.0, 35.70215832]),
    ("lin", [209.38701291, -192.42399488, 91.0728513, 11.35114358, -90.0, 29.38701291]),
)


def open_file(tab: Tab, rows: list[tuple[str, list[float]]]) -> Locator:
    """Open a program with the button *Open…*; returns the rows of the list."""
    text = "units = { angle = 'deg' }\n"
    text += "".join(f"[[segments]]\nkind = '{kind}'\nq = {q}\n" for kind, q in rows)
    tab.open("Program")
    with tab.page.expect_file_chooser() as chooser:
        tab.page.get_by_role("button", name="Open…").click()
    chooser.value.set_files(FilePayload(name="new.toml", mimeType="application/toml", buffer=text.encode()))
    found = tab.page.locator("[data-program-item]")
    expect(found).to_have_count(len(rows))
    return found


@pytest.fixture
def ur5(desktop: Tab) -> Iterator[Tab]:
    desktop.show(UR5)
    yield desktop
    desktop.open("Program")
    desktop.page.locator("[data-program-do=clear]").click()
    expect(desktop.page.locator("[data-program-item]")).to_have_count(0)


@pytest.mark.full
def test_a_click_in_the_chart_of_postures_starts_there(ur5: Tab) -> None:
    rows = open_file(ur5, list(LINE))
    page = ur5.page
    expect(rows.nth(1)).to_contain_text("Arrives in another posture")
    rows.nth(1).locator("[data-program-do=choose]").click()
    page.get_by_role("button", name="Postures…").click()
    chart = page.locator("[data-program=postures]")
    expect(chart.get_by_role("heading")).to_be_in_viewport()
    wanted = chart.locator("li").filter(has_text=short(kin.branch_of(UR5, np.radians(LINE[1][1]))))
    expect(wanted).to_contain_text("the whole way")
    row = wanted.get_by_role("button").get_attribute("data-argument")
    chart.locator(f"rect[data-argument='{row}']").first.click()
    expect(chart).to_have_count(0)
    expect(rows.nth(1)).not_to_contain_text("Arrives")
    page.get_by_role("button", name="Undo").click()
    expect(rows.nth(1)).to_contain_text("Arrives in another posture")


@pytest.mark.full
def test_a_button_that_is_held_while_the_list_is_sent_again_is_pressed(ur5: Tab) -> None:
    """What was typed before is sent when the button takes the focus; the answer comes before it is released."""
    rows = open_file(ur5, list(LINE))
    page = ur5.page
    rows.nth(1).locator("[data-program-do=choose]").click()
    page.locator("[data-program-field=speed]").fill("40")
    button = page.get_by_role("button", name="Duplicate")
    button.hover()
    page.mouse.down()
    expect(rows.nth(1)).to_contain_text("at 40 %")
    page.mouse.up()
    expect(rows).to_have_count(3)
    expect(rows.nth(2)).to_contain_text("at 40 %")


@pytest.mark.full
def test_what_is_typed_while_the_list_is_sent_again_stays_and_is_used(ur5: Tab) -> None:
    rows = open_file(ur5, list(LINE))
    page = ur5.page
    rows.nth(1).locator("[data-program-do=choose]").click()
    speed, acceleration = (page.locator(f"[data-program-field={name}]") for name in ("speed", "acceleration"))
    speed.fill("40")
    acceleration.press("Control+a")
    acceleration.press("7")
    expect(rows.nth(1)).to_contain_text("at 40 %")
    expect(acceleration).to_have_value("7")
    expect(acceleration).to_be_focused()
    page.keyboard.type("5")
    expect(acceleration).to_have_value("75")
    page.keyboard.press("Enter")
    rows.nth(0).locator("[data-program-do=choose]").click()
    rows.nth(1).locator("[data-program-do=choose]").click()
    expect(acceleration).to_have_value("75")
    expect(speed).to_have_value("40")


@pytest.mark.full
def test_a_way_around_an_obstacle_is_put_into_the_program(ur5: Tab) -> None:
    (sphere,) = placed.added((), "sphere", UR5, UR5.q_home)
    T = kin.fk(UR5, UR5.q_home)
    T[:3, 3] = sphere.xyz
    middle = np.degrees(kin.solve_ik(UR5, T, q_seed=UR5.q_home).solutions[0].q)
    swing = [("ptp", [middle[0] + turn, *middle[1:]]) for turn in (-50.0, 50.0)]
    rows = open_file(ur5, [(kind, [float(value) for value in q]) for kind, q in swing])
    page = ur5.page
    ur5.open("Move")
    folder = page.get_by_text("Obstacles", exact=True)
    folder.click()
    page.get_by_role("button", name="Add a sphere").click()
    expect(page.get_by_role("button", name="Remove sphere")).to_be_visible()
    ur5.open("Program")
    page.get_by_role("button", name="Find a way to 2…").click()
    form = page.locator("[data-program=way]")
    expect(form.get_by_role("heading")).to_be_in_viewport()
    limit = form.get_by_label("Time limit")
    limit.fill("60")
    limit.press("Enter")
    expect(limit).to_have_value("60")
    form.get_by_role("button", name="Find a way").click()
    expect(form).to_have_count(0)
    expect(rows).not_to_have_count(2)
    expect(page.locator("[data-program=summary]")).not_to_contain_text("Touches")
    page.get_by_role("button", name="Undo").click()
    expect(rows).to_have_count(2)

    ur5.open("Move")
    page.get_by_role("button", name="Remove sphere").click()
    folder.click()
    expect(page.get_by_role("button", name="Add a sphere")).to_be_hidden()
