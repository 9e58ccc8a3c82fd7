"""*Compare with…* of the tab Robot in a browser: a pasted table, a proposal applied by a click."""

from __future__ import annotations

import pytest
from page import Tab
from playwright.sync_api import expect

pytestmark = pytest.mark.browser

TABLE = "\n".join(
    ["q1 89.159 0 90", "q2 0 -425 0", "q3 0 -392.25 0", "q4 109.15 0 90", "q5 94.65 0 -90", "q6 82.3 0 0"]
)


def test_a_pasted_table_mends_a_mistake(tab: Tab) -> None:
    page = tab.page
    tab.open("Robot")
    page.locator('[data-cell="start"]').select_option("ur5")
    cell = page.locator('[data-cell="1 a"]')
    expect(cell).to_have_value("−425")
    cell.fill("-400")
    page.locator('[data-cell="other"]').select_option("typed")
    page.locator("[data-compare-text]").fill(TABLE)
    page.locator('[data-compare-do="send"]').click()
    answer = page.locator('[data-arm="compared"]')
    expect(answer).to_contain_text("a of row 2 is wrong (−425 mm, not −400 mm)")
    tab.screenshot("compare")
    answer.get_by_role("button", name="Apply").first.click()
    expect(answer).to_contain_text("equal joint values give equal poses")
    expect(cell).to_have_value("−425")
