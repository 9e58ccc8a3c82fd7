"""The worksheet of a lesson in a real browser: the printable page opens, filled, and files are saved."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from lesson_arms import arms_of
from page import Tab
from playwright.sync_api import Browser, expect

import kin
from app.exports.worksheet import Sheet
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.views.templates import render
from app.viewer.worksheet.feature import parts_of
from app.viewer.worksheet.views import page_html
from kin.units import DEFAULT_UNITS

pytestmark = [pytest.mark.browser, pytest.mark.full]
ROOT = Path(__file__).parents[3]


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


# The page as columns of the size of a sheet's text: they are filled by the rules by which pages are.
COLUMNS = """main { width: %(width)smm; height: %(height)smm; column-width: %(width)smm; }
main { column-gap: 0; column-fill: auto; }
.solutions { break-before: column; }"""
DIVIDED = """() => {
  const page = document.querySelector('main'), { left, width } = page.getBoundingClientRect();
  const columns = (node) => {
    const range = document.createRange();
    range.selectNodeContents(node);
    const boxes = [...range.getClientRects()].filter((box) => box.width);
    return new Set(boxes.map((box) => Math.floor((box.left - left + 1) / width)));
  };
  const texts = [...page.querySelectorAll('p, li, h1, h2, th, td, figcaption, .question')];
  const after = (head) => head.nextElementSibling.firstElementChild ?? head.nextElementSibling;
  const alone = (head) => Math.max(...columns(head)) < Math.min(...columns(after(head)));
  const words = (nodes) => nodes.map((node) => node.textContent);
  return {
    count: 1 + Math.max(...texts.flatMap((node) => [...columns(node)])),
    divided: words(texts.filter((node) => columns(node).size > 1)),
    alone: words([...page.querySelectorAll('h2')].filter(alone)),
  };
}"""
PAPERS = {"A4": (210, 297), "Letter": (215.9, 279.4)}
MARGINS = (15, 16)  # of @page in static/sheet.css, mm: at the sides, above and below
CSS = (ROOT / "static" / "sheet.css").read_text()


def divided(browser: Browser, pages: Sequence[str], css: str = CSS) -> dict[tuple[int, str], dict[str, object]]:
    """What is divided between pages of each sheet, on each paper; the count of pages is that of the PDF."""
    found, page = {}, browser.new_page()
    page.emulate_media(media="print")
    for number, html in enumerate(pages):
        for paper, (width, height) in PAPERS.items():
            page.set_content(f"<!doctype html><style>{css}</style><main>{html}</main>")
            printed = page.pdf(format=paper, prefer_css_page_size=False)
            size = {"width": width - 2 * MARGINS[0], "height": height - 2 * MARGINS[1]}
            page.add_style_tag(content=COLUMNS % size)
            found[number, paper] = page.evaluate(DIVIDED)
            found[number, paper]["pages"] = len(re.findall(rb"/Type\s*/Page\b", printed))
    page.close()
    return found


def sheet_of(lesson: type[Lesson], robot: kin.Robot) -> str:
    outline = lesson.asked(robot, DEFAULT_UNITS)
    parts, left = parts_of(outline), lesson.left
    return page_html(Sheet(lesson.title, robot, robot.q_home, DEFAULT_UNITS, outline.goal, parts, (), left))


@pytest.mark.parametrize(
    "lesson",
    [
        pytest.param(each, id=each.key, marks=() if i % 3 == 0 else pytest.mark.slow)
        for i, each in enumerate(LESSONS)
    ],
)
def test_no_page_ends_inside_a_sentence(browser: Browser, lesson: type[Lesson]) -> None:
    sheets = [sheet_of(lesson, robot) for robot in arms_of(lesson.key)]
    for at, found in divided(browser, sheets).items():
        assert found["divided"] == found["alone"] == [], at
        assert 2 <= found["count"] == found["pages"], at


def test_without_its_rules_a_sheet_is_divided(browser: Browser) -> None:
    css = re.sub(r"break-(?:inside|after): avoid;", "", CSS)
    sheets = [sheet_of(lesson, arms_of(lesson.key)[0]) for lesson in LESSONS]
    assert any(found["divided"] for found in divided(browser, sheets, css).values())
