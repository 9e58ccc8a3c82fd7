"""A zip of a URDF and its meshes in a real browser."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from page import Tab
from playwright.sync_api import expect

import kin

sys.path.append(str(Path(__file__).parents[1] / "app"))
from zips import TWO_JOINTS, packed, robot_files

pytestmark = pytest.mark.browser


def test_a_zip_shows_the_real_arm_and_delete_removes_it(tab: Tab) -> None:
    page, two = tab.page, kin.load_urdf(TWO_JOINTS)
    tab.open("Robot")
    file = {"name": "two.zip", "mimeType": "application/zip", "buffer": packed(robot_files())}
    page.locator("[data-arm-file]").set_input_files([file])
    expect(tab.status.first).to_contain_text("The meshes of two.zip are shown")
    expect(page.locator('[data-arm="files"]')).to_contain_text("stay while this page is open")
    tab.wait_for_tool(kin.fk(two, two.q_home)[:3, 3], within=0.06)
    tab.screenshot("meshes")
    page.get_by_role("button", name="Delete my arm").click()
    expect(tab.status.first).to_contain_text("was deleted")
    tab.show(kin.get_robot("pioneer5"))
