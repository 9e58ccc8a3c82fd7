"""A page that a program drives something with has a red frame, in words too, wherever its panel is."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from page import Tab
from playwright.sync_api import expect

import kin
from app.live.recording import Entry, Recording, to_csv, to_mcap

pytestmark = pytest.mark.browser

WORDS = "Drives: SO-101 at /dev/ttyACM0 · nothing here is a safety function"
# The frame is at the edges of the page, its words are within the page, and nothing lies over them.
SEEN = """() => {
  const frame = document.getElementById("kb-driven"), words = frame.querySelector("p");
  const style = getComputedStyle(frame), box = frame.getBoundingClientRect(), text = words.getBoundingClientRect();
  const shown = [...words.querySelectorAll("b, span")], parts = shown.map((part) => part.getBoundingClientRect());
  frame.style.pointerEvents = "auto"; // what lies over it would be found in its place
  const over = parts.map(({ x, y, width, height }) => document.elementFromPoint(x + width / 2, y + height / 2));
  frame.style.pointerEvents = "";
  return {
    covers: [box.left, box.top, box.right - innerWidth, box.bottom - innerHeight],
    width: style.borderLeftWidth, color: style.borderLeftColor,
    inside: parts.every(({ left, right, top, bottom }) =>
      left >= 0 && right <= innerWidth && top >= 0 && bottom <= text.bottom),
    seen: over.every((node) => words.contains(node)),
    cut: shown.some((part) => part.scrollWidth > part.clientWidth + 1),
    lets_through: document.elementFromPoint(2, innerHeight / 2) !== frame,
  };
}"""


@pytest.fixture
def driving(tab: Tab, address: str) -> Iterator[Any]:
    """A program that is connected to the desktop page, and drives something."""
    yield from connected(tab, address)


def connected(tab: Tab, address: str) -> Iterator[Any]:
    tab.open("Program")
    tab.page.get_by_role("button", name="Connect a program").click()
    code = tab.page.locator("[data-live-code]").inner_text()
    said = re.search(
        r'^import kin\n+page = kin\.connect\("(\S+)",\s"(\S+)"\)$',
        tab.page.locator(".kb-live").inner_text(),
        re.MULTILINE,
    )
    assert said is not None
    at, typed = said.groups()
    assert (at + "/", typed) == (address, code)
    with kin.connect(at, typed, name="arm.py", drives="SO-101 at /dev/ttyACM0") as arm:
        yield arm
    tab.open("Program")
    withdraw = tab.page.get_by_role("button", name="Withdraw the code")
    withdraw.click()
    expect(withdraw).to_have_count(0)


def assert_framed(tab: Tab, more: str = "") -> None:
    frame = tab.page.locator("#kb-driven")
    expect(frame).to_have_text(WORDS + more)
    seen = tab.page.evaluate(SEEN)
    assert seen.pop("width") >= "4px"
    assert seen == {
        "covers": [0, 0, 0, 0],
        "color": "rgb(200, 30, 30)",
        "inside": True,
        "seen": True,
        "cut": False,
        "lets_through": True,
    }


def test_the_frame_is_there_as_long_as_something_is_driven(tab: Tab, driving: Any) -> None:
    frame = tab.page.locator("#kb-driven")
    assert_framed(tab)
    tab.open("Move")
    assert_framed(tab)
    tab.screenshot("driven")
    status = tab.page.locator("[data-status]").bounding_box()
    words = frame.locator("p").bounding_box()
    assert status is not None
    assert words is not None
    assert status["y"] >= words["y"] + words["height"], "the status card makes way"
    driving.drives = None
    expect(frame).to_be_hidden()
    driving.drives = "SO-101 at /dev/ttyACM0"
    assert_framed(tab)
    driving.close()
    expect(frame).to_be_hidden()


@pytest.mark.full
def test_the_frame_stays_and_goes_while_the_panel_is_folded_away(tab: Tab, driving: Any) -> None:
    frame = tab.page.locator("#kb-driven")
    tab.page.get_by_label("Collapse panel area").or_(tab.page.get_by_label("Collapse column")).first.click()
    expect(tab.page.locator("[data-status]")).to_have_count(0)
    assert_framed(tab)
    driving.drives = None
    expect(frame).to_be_hidden()
    driving.drives = "SO-101 at /dev/ttyACM0"
    assert_framed(tab)
    tab.page.get_by_label("Expand").first.click()
    expect(tab.page.locator("[data-status]")).to_be_visible()
    assert_framed(tab)


ENABLE = {
    "name": "enable",
    "label": "Enable",
    "confirm": "The arm will follow this page at up to 20 deg/s. Keep its power switch within reach.",
}
STOP = {"name": "stop", "label": "Stop", "stops": True}


def test_what_a_program_offers_is_pressed_with_a_second_step_and_stopped_at_once(tab: Tab, driving: Any) -> None:
    page, dialog = tab.page, tab.page.locator("#kb-confirm")
    events = (event.value for event in driving.events() if event.kind == "pressed")
    driving.announce("The ghost is where the arm is.", [ENABLE])
    card = tab.status.locator("[data-announced]")
    expect(card).to_contain_text("Ready arm.py: The ghost is where the arm is.")
    for no in ("Escape", "Cancel"):
        card.get_by_role("button", name="Enable").click()
        expect(dialog).to_be_visible()
        expect(dialog).to_contain_text(ENABLE["confirm"])
        expect(dialog.get_by_role("button", name="Cancel")).to_be_focused()
        if no == "Escape":
            tab.screenshot("enable-asked")
            page.keyboard.press("j")  # moves no target meanwhile
            page.keyboard.press("Escape")
        else:
            dialog.get_by_role("button", name="Cancel").click()
        expect(dialog).to_be_hidden()
    card.get_by_role("button", name="Enable").click()
    driving.announce("The ghost is where the arm is. Its power is off.", [ENABLE], state="fault")
    expect(dialog).to_be_hidden()
    expect(card).to_contain_text("Fault")
    card.get_by_role("button", name="Enable").click()
    dialog.get_by_role("button", name="Enable").click()
    assert next(events) == "enable", "the first press that the program has heard"
    driving.announce("The arm follows this page at up to 20 deg/s.", [STOP], state="enabled")
    stop = page.locator("#kb-driven").get_by_role("button", name="Stop")
    expect(stop).to_be_visible()
    tab.screenshot("enabled")
    card.get_by_role("button", name="Stop").click()
    assert next(events) == "stop"
    page.get_by_label("Collapse panel area").or_(page.get_by_label("Collapse column")).first.click()
    expect(tab.page.locator("[data-status]")).to_have_count(0)
    stop.click()
    assert next(events) == "stop", "with the panel folded away"
    page.get_by_label("Expand").first.click()
    assert driving.target is None, "keys of the scene rest while something is asked"
    driving.announce(None)
    expect(stop).to_have_count(0)


RELEASE = {"name": "release", "label": "Release", "confirm": "Hold the arm with your hand, or it falls."}


def test_what_stops_is_within_reach_whatever_dialog_is_open(tab: Tab, driving: Any) -> None:
    page, dialog, overview = tab.page, tab.page.locator("#kb-confirm"), tab.page.locator("#kb-keys")
    events = (event.value for event in driving.events() if event.kind == "pressed")
    driving.announce("The arm follows this page at up to 20 deg/s.", [STOP, RELEASE], state="enabled")
    release, frame = tab.status.get_by_role("button", name="Release"), page.locator("#kb-driven")
    stop = frame.get_by_role("button", name="Stop")
    for place in (frame, dialog.locator("footer")):
        release.click()
        expect(dialog.get_by_role("button", name="Cancel")).to_be_focused()
        tab.screenshot("release-asked")
        assert_framed(tab, " Stop")
        place.get_by_role("button", name="Stop").click()
        assert next(events) == "stop"
        expect(dialog).to_be_hidden()
    assert_framed(tab, " Stop")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("?")
    expect(overview).to_be_visible()
    stop.click()
    assert next(events) == "stop", "with the overview of the keys open"
    page.keyboard.press("Escape")
    expect(overview).to_be_hidden()
    page.keyboard.press("Control+k")
    commands = page.get_by_placeholder("Search commands...")
    expect(commands).to_be_focused()
    stop.click()
    assert next(events) == "stop", "with the list of commands open"
    page.keyboard.press("Escape")
    expect(commands).to_have_count(0)
    driving.drives = None
    expect(frame).to_be_hidden()
    release.click()
    dialog.get_by_role("button", name="Stop").press("Enter")
    assert next(events) == "stop", "of a program that does not say what it drives"
    driving.announce(None)


OPEN = """([name, text, drop]) => {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([Uint8Array.from(text)], name));
  if (drop) {
    const event = new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true });
    document.querySelector("canvas[data-engine]").dispatchEvent(event);
  } else {
    const input = document.querySelector("[data-arm-file], [data-program-file]");
    input.files = dataTransfer.files;
    input.dispatchEvent(new Event("change", { bubbles: true }));
  }
}"""


@pytest.mark.full
def test_what_is_dropped_or_opened_goes_to_where_it_belongs(tab: Tab) -> None:
    page, robot = tab.page, kin.get_robot("ur5")
    tab.show(robot)
    tab.open("Robot")
    made = Recording(robot)
    rows = [robot.q_home + 0.02 * k for k in range(6)]
    entries = [Entry(0.2 * k, "/page/q", json.dumps({"q": q.tolist()}).encode()) for k, q in enumerate(rows)]
    made.restored(entries, 1.0)
    # A recording is dropped while another tab is open.
    page.evaluate(OPEN, ["run.mcap", list(to_mcap(made)), True])
    expect(page.locator('[data-live-recording="opened"]')).to_be_in_viewport(ratio=1)
    expect(page.get_by_role("tab", name="Program")).to_have_attribute("aria-selected", "true")
    page.get_by_role("button", name="Play recording").click()
    tab.wait_for_tool(kin.fk(robot, rows[-1])[:3, 3], within=0.06)
    tab.screenshot("recording-opened")
    page.get_by_role("button", name="Discard recording").click()
    # A table is opened by the button of the programs, and a program by that of the arms.
    page.evaluate(OPEN, ["run.csv", list(to_csv(made).encode()), False])
    expect(page.locator('[data-live-recording="opened"]')).to_be_visible()
    page.get_by_role("button", name="Discard recording").click()
    tab.open("Robot")
    text = "".join(f"[[segments]]\nkind = 'ptp'\nq = {rows[k].tolist()}\n" for k in (0, 3))
    page.evaluate(OPEN, ["two.toml", list(text.encode()), False])
    expect(page.locator("[data-program-item]")).to_have_count(2)
    # A calibration is dropped.
    so101 = kin.get_robot("so101")
    tab.show(so101)
    entry = {"drive_mode": 0, "homing_offset": 0, "range_min": 700, "range_max": 3300}
    text = json.dumps({motor.name: {"id": motor.id, **entry} for motor in so101.motors})
    page.evaluate(OPEN, ["my_arm.json", list(text.encode()), True])
    expect(tab.status.first).to_contain_text("The calibration my_arm.json is used")
    # Something else is refused, and everything stays.
    page.evaluate(OPEN, ["photo.csv", [255, 216, 255, 0], True])
    expect(tab.status.first).to_contain_text("The file was not used")
    page.evaluate(OPEN, ["empty.mcap", [], True])
    expect(tab.status.first).to_contain_text("a recording of a connection (MCAP or CSV)")


@pytest.mark.full
def test_the_words_fit_a_phone(phone: Tab, address: str) -> None:
    phone.show(kin.get_robot("pioneer5"))
    for arm in connected(phone, address):
        assert_framed(phone)
        phone.screenshot("driven-phone")
        words, stop = (
            phone.page.locator("#kb-driven p").bounding_box(),
            phone.status.get_by_role("button", name="Stop"),
        )
        card, button = phone.status.bounding_box(), stop.bounding_box()
        assert words is not None
        assert card is not None
        assert button is not None
        assert card["y"] == pytest.approx(words["y"] + words["height"], abs=0.5)
        assert button["height"] >= 44, "large enough for a finger"
        stop.click(trial=True)  # nothing lies over it
        arm.drives = "x" * 60
        expect(phone.page.locator("#kb-driven")).to_contain_text("x" * 60)
        seen = phone.page.evaluate(SEEN)
        assert seen["inside"]
        assert seen["seen"]
        arm.announce("The arm follows this page at up to 20 deg/s.", [STOP, ENABLE], state="enabled")
        in_frame = phone.page.locator("#kb-driven button")
        expect(in_frame).to_be_visible()
        button, words = in_frame.bounding_box(), phone.page.locator("#kb-driven b").bounding_box()
        assert button is not None
        assert words is not None
        assert button["height"] >= 44
        assert words["x"] + words["width"] <= button["x"], "the words end before it"
        phone.screenshot("enabled-phone")
        phone.status.get_by_role("button", name="Enable").click()
        expect(phone.page.locator("#kb-confirm")).to_be_visible()
        phone.screenshot("enable-asked-phone")
        in_frame.click(trial=True)
        phone.page.get_by_role("button", name="Cancel").click()
        in_frame.click(trial=True)
