"""The report about a URDF of the tab Robot in a browser: a file that is refused is mended and shown."""

from __future__ import annotations

from pathlib import Path

import pytest
from page import Tab
from playwright.sync_api import expect

pytestmark = pytest.mark.browser

UR5 = Path(__file__).parents[2] / "data" / "urdf" / "ur5.urdf"


def test_a_refused_urdf_is_mended_by_a_click(tab: Tab, tmp_path: Path) -> None:
    text = UR5.read_text(encoding="utf-8").replace('<axis xyz="0 1 0" />', '<axis xyz="0 2 0" />', 1)
    text = text.replace('<parent link="forearm_link" />', '<parent link="fore_link" />', 1)
    text = text[: text.index('<joint name="ee_fixed_joint"')] + "</robot>"  # one end
    file = tmp_path / "ur5.urdf"
    file.write_text(text, encoding="utf-8")
    page = tab.page
    tab.open("Robot")
    page.locator("[data-arm-file]").set_input_files([file])
    report = page.locator('[data-arm="doctor"]')
    expect(report).to_contain_text("Its parent is “fore_link”, which does not exist")
    expect(report).to_contain_text('Write link="forearm_link".')
    report.scroll_into_view_if_needed()
    tab.screenshot("doctor")
    with page.expect_download() as download:
        report.get_by_role("button", name="Save mended").click()
    assert download.value.suggested_filename == "ur5-mended.urdf"
    assert '<parent link="forearm_link" />' in Path(download.value.path()).read_text(encoding="utf-8")
    report.get_by_role("button", name="Open mended").click()
    expect(report).to_contain_text("Nothing is wrong or suspicious.")
    expect(page.locator('[data-cell="5 d"]')).to_be_visible()
