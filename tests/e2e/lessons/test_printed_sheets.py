"""The worksheet of a lesson in a real browser: the printable page opens, filled, and files are saved."""

from __future__ import annotations

import pytest
from page import Tab
from playwright.sync_api import expect

from app.viewer.views.templates import render

pytestmark = pytest.mark.browser


def test_the_worksheet_of_a_lesson_is_printed_and_saved(tab: Tab) -> None:
    tab.open("View")
    with tab.page.context.expect_page() as opened:
        tab.page.locator(".kb-sheet:visible").get_by_role("button", name="Print").click()
    expect(opened.value.locator("article")).to_have_count(1)
    expect(opened.value.get_by_text("Two parts:")).to_be_hidden()
    opened.value.close()
    tab.choose_lesson("DH table step by step")
    row = tab.page.locator("[data-sheet-buttons] .kb-sheet")
    expect(row).to_be_visible()
    with tab.page.context.expect_page() as opened:
        row.get_by_role("button", name="Print").click()
    sheet = opened.value
    expect(sheet.locator("body")).to_have_attribute("data-ready", "1")
    expect(sheet).to_have_title("DH table step by step – Kinboard")
    expect(sheet.locator("article")).to_have_count(2)
    expect(sheet.locator("article").first.locator("figure svg")).to_be_visible()
    expect(sheet.locator("[data-solutions] .dh")).to_contain_text("θ₃ − 90.0")
    expect(sheet.get_by_text("Two parts:")).to_be_visible()
    sheet.emulate_media(media="print")
    expect(sheet.get_by_role("button")).to_be_hidden()
    sheet.close()
    tab.open("View")
    with tab.page.context.expect_page() as opened:
        tab.page.locator(".kb-sheet:visible").get_by_role("button", name="Print").click()
    expect(opened.value.locator("body")).to_have_attribute("data-ready", "1")
    expect(opened.value.locator("article")).to_have_count(2)
    opened.value.close()
    tab.open("Learn")
    with tab.page.expect_download() as saved:
        row.get_by_role("button", name="CSV").click()
    assert saved.value.suggested_filename == "pioneer-arm-dh.csv"


def test_a_sheet_that_says_not_now_offers_no_print(tab: Tab) -> None:
    with tab.page.context.expect_page() as opened:
        tab.page.evaluate("() => { window.kbSheet = window.open('../static/sheet.html'); }")
    sheet = opened.value
    expect(sheet.get_by_role("button", name="Print")).to_be_visible()
    send = "(page) => window.kbSheet.postMessage({ kinboardSheet: page, title: 'Sheet' }, location.origin)"
    for page, count in ((render("sheet/withheld"), 0), ("<article></article>", 1)):
        tab.page.evaluate(send, page)
        expect(sheet.locator("article")).to_have_count(1)
        expect(sheet.get_by_role("button", name="Print")).to_have_count(count)
    sheet.close()
