"""The lessons "Postures" and "Redundancy", and the padlocks, in a real browser."""

from __future__ import annotations

import re

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import expect

import kin
from app.viewer.postures.survey import survey
from app.viewer.skeleton import places

pytestmark = pytest.mark.browser

PUMA, SRS, PRINTED, PIONEER = (
    kin.get_robot(name) for name in ("puma560", "redundant7-craig", "redundant7", "pioneer5")
)


def learn(tab: Tab, robot: kin.Robot, lesson: str) -> None:
    tab.show(robot)  # at home: a robot keeps its pose while others are shown
    tab.explore(lesson)
    tab.show_answer(lesson)


def press(tab: Tab, at: np.ndarray) -> None:
    """Click like a person: approach, pause, press, release."""
    tab.page.mouse.move(*(at - 2).tolist())
    tab.page.wait_for_timeout(200)
    tab.page.mouse.move(*at.tolist())
    tab.page.wait_for_timeout(200)
    tab.page.mouse.down()
    tab.page.wait_for_timeout(100)
    tab.page.mouse.up()
    tab.page.wait_for_timeout(900)


def test_a_click_on_a_ghost_in_the_picture_morphs_the_arm(tab: Tab) -> None:
    learn(tab, PUMA, "Postures")
    rows = tab.page.locator("[data-posture]")
    expect(rows).to_have_count(8)
    T = kin.fk(PUMA, PUMA.q_home)
    postures = survey(PUMA, T, kin.IKOptions(), PUMA.q_home)
    here = kin.branch_of(PUMA, PUMA.q_home)
    expect(tab.page.locator("[data-here]")).to_have_attribute("data-posture", here)
    wanted = next(p for p in postures if p.available and p.name != here)
    assert wanted.q is not None
    for point in places(PUMA, np.array([wanted.q]))[0][0][4:]:
        press(tab, tab.pixel(PUMA, point))
        if tab.page.locator("[data-here]").get_attribute("data-posture") != here:
            break
    taken = tab.page.locator("[data-here]").get_attribute("data-posture")
    assert taken in {p.name for p in postures if p.available and p.name != here}
    tab.wait_for_tool(T[:3, 3], within=0.06)
    tab.row("Go").get_by_role("button", name=str(list(kin.branch_names(PUMA)).index(here) + 1)).click()
    expect(tab.page.locator("[data-here]")).to_have_attribute("data-posture", here)


@pytest.mark.full
def test_the_reason_for_no_solution_and_a_remedy(tab: Tab) -> None:
    learn(tab, PUMA, "Postures")
    tab.drag_arrow(PUMA, kin.fk(PUMA, PUMA.q_home), axis=2, lengths=3.0)
    expect(tab.page.locator("[data-why=unreachable]")).to_contain_text(re.compile(r"by \d+ mm"))
    button = tab.page.get_by_role("button", name="Nearest reachable pose")
    expect(button).to_be_visible()
    tab.screenshot("why-not")
    button.click()
    expect(tab.page.locator("[data-why]")).to_contain_text("Target reached")
    expect(button).to_have_count(0)


@pytest.mark.full
def test_the_cone_and_the_rings_of_five_joints(tab: Tab) -> None:
    learn(tab, PIONEER, "Postures")
    expect(tab.page.locator("[data-cone]")).to_contain_text("% of all directions")
    tab.screenshot("approach-cone")


@pytest.mark.full
def test_the_ring_of_arm_angles(tab: Tab) -> None:
    learn(tab, SRS, "Redundancy")
    p = kin.fk(SRS, SRS.q_home)[:3, 3]
    tab.type_number("Set ψ (tool held)", "70")
    expect(tab.row("Set ψ (tool held)").locator("input:visible").last).to_have_value("70")
    tab.rest()
    tab.wait_for_tool(p, within=0.06)
    expect(tab.page.locator("[data-residual]")).to_contain_text("Tool held to")
    expect(tab.page.locator("[data-limits]")).to_contain_text("limit of joint 6")
    tab.mark_is_under_thumb("Set ψ (tool held)", 70)
    tab.screenshot("redundancy-ring")
    learn(tab, PRINTED, "Redundancy")
    expect(tab.page.locator("[data-idea]")).to_contain_text("The axes of joints 1 and 2 coincide")
    tab.screenshot("redundancy-trade")


@pytest.mark.full
def test_lock_buttons(tab: Tab) -> None:
    tab.show(PUMA)
    tab.row("Locked").get_by_role("button", name="2", exact=True).click()
    expect(tab.status).to_contain_text("Joint 2 locked")
    tab.drag_arrow(PUMA, kin.fk(PUMA, PUMA.q_home), axis=0, lengths=0.4)
    tab.rest()
    assert tab.number("2 shoulder") == 45
    tab.page.get_by_role("button", name="Unlock all").click()
    expect(tab.status).to_have_attribute("data-status", "reached")
