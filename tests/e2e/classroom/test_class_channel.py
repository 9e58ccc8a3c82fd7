"""A student whose page loses its channel alone, before an answer and with it: each answer counts once."""

from __future__ import annotations

import pytest
from page import KEEP_SOCKETS
from playwright.sync_api import Browser, expect
from test_class import Member

pytestmark = [pytest.mark.browser, pytest.mark.full]

EXERCISE = "which-joint-goes-down"
RIGHT, WRONG = 2, 0  # choices of this exercise
CUT = "kbSockets.at(-1).close()"
ANSWER_AND_CUT = f"""(choice) => {{
  document.querySelectorAll("[data-exercises=question] [data-guide-do=answer]")[choice].click();
  {CUT};
}}"""


class CutMember(Member):
    """A student whose channel can be cut."""

    scripts = Member.scripts + KEEP_SOCKETS


def test_an_answer_counts_once_where_the_channel_is_lost_before_it_or_with_it(
    browser: Browser, address: str
) -> None:
    teacher = Member(browser, address)
    ann = CutMember(browser, address, teacher.code, "Ann")
    teacher.page.locator("[data-guide=class-task] select").select_option(EXERCISE)
    teacher.page.locator("[data-guide=class-task] [data-guide-do=fields]").click()
    expect(ann.page.locator(f"[data-exercise={EXERCISE}]")).to_be_visible()
    row = teacher.page.locator(".kb-class-list li button")

    ann.page.evaluate(CUT)
    ann.answer(WRONG)
    expect(row).to_contain_text("1 try")

    ann.page.evaluate(ANSWER_AND_CUT, RIGHT)
    expect(row).to_contain_text("solved · 2 tries")
    expect(ann.page.locator("[data-exercises-note]")).to_contain_text("Stored for your teacher")
    expect(ann.page.locator(".kb-class-offline")).to_be_hidden()
    ann.page.wait_for_function("kbSockets.length === 3")
    for member in (ann, teacher):
        member.close()
