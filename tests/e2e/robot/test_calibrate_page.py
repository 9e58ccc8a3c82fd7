"""*Calibrate by touching* in a browser, with a simulated arm that is connected."""

from __future__ import annotations

import re

import numpy as np
import pytest
from page import Tab
from playwright.sync_api import Locator, expect

import kin
from kin.calibration.chain import Chain
from kin.calibration.fit import Touches
from kin.calibration.fixtures import TouchBoard, TouchFixture
from kin.units import DEFAULT_UNITS, Units
from tests.kin.calibration.simulated import HOBBY, random_errors, touch, true_sockets

pytestmark = [pytest.mark.browser, pytest.mark.full]

SO101 = kin.get_robot("so101")
SHEET = TouchFixture([TouchBoard.sheet("A4")])
COUNT, BAD, TYPED = 14, 3, {5: "Take", 7: "Next"}  # by what typed values are taken
PROGRAM = re.compile(r'^import kin\n+page = kin\.connect\("(\S+)",\s"(\S+)"\)$', re.MULTILINE)


def simulated() -> np.ndarray:
    """What the joints of an arm with errors read in the postures that the page asks for; one reading is wrong."""
    plan, rng = kin.calibration.touch_postures(SO101, SHEET, COUNT), np.random.default_rng(4)
    chain = Chain(SO101)
    spots = true_sockets(SHEET, plan.places, rng)
    found = touch(chain, random_errors(chain, rng), HOBBY, Touches(plan.q, plan.sockets), SHEET, spots, rng)
    assert len(found) == COUNT
    found.q[BAD, 2] += np.radians(12.0)
    return found.q


# The letters of a text and a press, within one task of the page.
TYPE_AND_PRESS = """async ([input, text, button]) => {
  const setValue = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  for (let end = 1; end <= text.length; end++) {
    setValue.call(input, text.slice(0, end));
    input.dispatchEvent(new Event("input", { bubbles: true }));
    for (let k = 0; k < 20; k++) await null; // React draws
  }
  button.click();
}"""


def take(tab: Tab, at: int, q: np.ndarray, button: str) -> None:
    """Type what the joints read, letter by letter, and take it with the last letter."""
    page, text = tab.page, " ".join(f"{value:.2f}" for value in np.degrees(q))
    field = tab.row("Joint values").get_by_role("textbox").element_handle()
    press = page.get_by_role("button", name=button, exact=True)
    page.evaluate(TYPE_AND_PRESS, [field, text, press.element_handle()])
    if button == "Next":
        expect(page.locator(f'[data-calibrate-posture="{at + 2}"]')).to_be_visible()
        expect(tab.row("Joint values").get_by_role("textbox")).to_have_value("")
        page.get_by_role("button", name="Back", exact=True).click()
    cells = page.get_by_role("table", name=f"Posture {at + 1} of {COUNT}").get_by_role("cell")
    expect(cells.last).to_have_text(Units().angles.text(q[-1], 2))


def program(tab: Tab) -> tuple[str, ...]:
    """The address and the code with which a program connects to the page."""
    tab.open("Program")
    tab.page.get_by_role("button", name="Connect a program").click()
    said = PROGRAM.search(tab.page.locator(".kb-live").inner_text())
    assert said is not None
    return said.groups()


def has_arrived(shown: Locator, q: np.ndarray) -> None:
    """Wait until the page shows these values of the connected arm."""
    table = shown.locator("xpath=following-sibling::table[1]")
    for value in q:
        expect(table).to_contain_text(DEFAULT_UNITS.angles.text(float(value)))


@pytest.mark.parametrize("size", ["desktop", "phone"])
def test_touches_of_a_connected_arm_give_the_arm_of_the_page(request: pytest.FixtureRequest, size: str) -> None:
    tab: Tab = request.getfixturevalue(size)
    page, dark = tab.page, size == "phone"
    tab.set_dark(dark)
    address_and_code = program(tab)
    tab.open("Robot")
    page.locator('[data-cell="start"]').select_option("so101")
    expect(page.locator('[data-cell="0 name"]')).to_have_value("shoulder pan")
    folder = page.get_by_role("button", name="Calibrate by touching", exact=True)
    folder.click()
    tab.type_number("Touches", str(COUNT))
    propose = page.get_by_role("button", name="Propose", exact=True)
    propose.scroll_into_view_if_needed()
    tab.screenshot(f"calibrate-{size}-begin")
    propose.click()
    table = page.get_by_role("table", name="Touches")
    with kin.connect(*address_and_code, name="arm.py") as arm:
        for i, q in enumerate(simulated()):
            shown = page.locator(f'[data-calibrate-posture="{i + 1}"]')
            expect(shown).to_be_visible()
            arm.measured = q
            has_arrived(shown, q)
            if i in (1, 9):
                shown.evaluate("block => block.scrollIntoView()")  # at once: its numbers are written anew
                tab.screenshot(f"calibrate-{size}-posture-{i + 1}")
            if i in TYPED:
                take(tab, i, q, TYPED[i])
            else:
                page.get_by_role("button", name="Read", exact=True).click()
            expect(table.get_by_role("row")).to_have_count(i + 2)
            # The buttons have changed: a press on one that goes is lost.
            expect(page.get_by_role("button", name="Leave out", exact=True)).to_be_visible()
            if i < COUNT - 1:
                page.get_by_role("button", name="Next", exact=True).click()
        arm.measured = None
    found = page.locator('[data-calibrate="found"]')
    expect(table).to_contain_text("left out")
    expect(found).to_contain_text(f"ouch {BAD + 1}")
    expect(found).to_contain_text(f"{COUNT - 1} of {COUNT} touches were used")
    table.scroll_into_view_if_needed()
    tab.screenshot(f"calibrate-{size}-touches")
    found.scroll_into_view_if_needed()
    tab.screenshot(f"calibrate-{size}-found")
    page.wait_for_timeout(1500)  # the page stores what is done within a second
    page.reload()
    tab.open("Robot")
    folder.click()
    expect(table.get_by_role("row")).to_have_count(COUNT + 1)
    expect(found).to_contain_text(f"{COUNT - 1} of {COUNT} touches were used")
    page.get_by_role("button", name="Use this arm").click()
    expect(tab.status).to_contain_text("SO-101 is calibrated")
    expect(page.locator('[data-cell="1 name"]')).to_have_value("shoulder pan, tilt")
    tab.top()
    tab.screenshot(f"calibrate-{size}-used")
    page.get_by_role("button", name="Undo").click()
    expect(table.get_by_role("row")).to_have_count(COUNT + 1)
    page.get_by_role("button", name="Stop", exact=True).click()
    tab.set_dark(False)
