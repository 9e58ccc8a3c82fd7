"""What is typed stays, however late the service answers: a service that is held up most of the time."""

from __future__ import annotations

import contextlib
import random
import signal
import threading
from collections.abc import Iterator

import psutil
import pytest
from page import Tab
from playwright.sync_api import expect

pytestmark = pytest.mark.browser

HELD, RUNS = 0.25, 0.05  # seconds, in turns: an answer that takes some milliseconds takes a third of a second
SEED = 11


@contextlib.contextmanager
def held_up(address: str) -> Iterator[None]:
    """Stop the processes of the service most of the time."""
    port = int(address.rstrip("/").rpartition(":")[2])
    ours = psutil.Process().children(recursive=True)
    found = [each for each in ours if any(c.laddr.port == port for c in each.net_connections() if c.laddr)]
    assert found
    ended = threading.Event()

    def hold() -> None:
        while not ended.is_set():
            for process in found:
                process.send_signal(signal.SIGSTOP)
            ended.wait(HELD)
            for process in found:
                process.send_signal(signal.SIGCONT)
            ended.wait(RUNS)

    holding = threading.Thread(target=hold)
    holding.start()
    try:
        yield
    finally:
        ended.set()
        holding.join()


def test_a_length_typed_right_after_the_kind_of_a_joint_stays(tab: Tab, address: str) -> None:
    page = tab.page
    tab.open("Robot")
    page.locator('[data-cell="start"]').select_option("ur5")
    length = page.locator('[data-cell="2 a"]')
    expect(length).to_have_value("−392.25")
    with held_up(address):
        page.locator('[data-cell="2 kind"]').select_option("prismatic")
        length.click()
        page.keyboard.type("-120.5", delay=60)
        expect(page.locator('[data-arm] tr[data-row="2"] .kb-arm-variable [data-cell="2 d"]')).to_be_visible()
        page.wait_for_timeout(1000)
        expect(length).to_have_value("-120.5")
        expect(length).to_be_focused()
    page.get_by_role("heading", name="Convert").click()
    expect(length).to_have_value("−120.5")
    expect(page.locator('[data-cell="2 kind"]')).to_have_value("prismatic")


@pytest.mark.full
def test_the_place_of_an_obstacle_typed_faster_than_the_page_answers_is_used(tab: Tab, address: str) -> None:
    page, texts = tab.page, {"x": "321", "y": "-456", "z": "234"}
    page.get_by_text("Obstacles", exact=True).click()
    page.get_by_role("button", name="Add a sphere").click()
    page.locator("#kb-obstacle-x").click()
    with held_up(address):
        for text in texts.values():
            page.keyboard.press("Control+a")
            page.keyboard.type(text, delay=70)
            page.keyboard.press("Tab")
        for name, text in texts.items():
            expect(page.locator(f"#kb-obstacle-{name}")).to_have_value(text.replace("-", "−"))
    page.get_by_role("button", name="Done").click()
    page.get_by_role("button", name="sphere", exact=True).click()
    for name, text in texts.items():
        expect(page.locator(f"#kb-obstacle-{name}")).to_have_value(text.replace("-", "−"))
    page.get_by_role("button", name="Remove sphere").click()
    page.get_by_text("Obstacles", exact=True).click()
    expect(page.get_by_role("button", name="Add a sphere")).to_be_hidden()


# Every field with text in sight, but for lists to choose from.
FIELDS = ", ".join(
    f"{kind}:visible:enabled:not([readonly], [aria-haspopup])"
    for kind in ("input[type=text]", "input:not([type])", "textarea")
)
FOCUSED = "() => document.activeElement.value"


def another(text: str) -> str:
    """A text as valid as this one; whole, as some fields take no other numbers."""
    try:
        return str(int(float(text.replace("−", "-"))) + 1)
    except ValueError:
        return "ab"


def type_slowly(tab: Tab, k: int, text: str, chance: random.Random) -> set[str]:
    """Type into the field with this number, and return what it shows until a while after that."""
    tab.page.locator(FIELDS).nth(k).click(force=True)
    tab.page.keyboard.press("Control+a")
    for letter in text:
        tab.page.keyboard.type(letter)
        tab.page.wait_for_timeout(chance.choice((0, 30, 120)))
    shown = set()
    for _ in range(8):
        tab.page.wait_for_timeout(80)
        shown.add(tab.page.evaluate(FOCUSED).replace("−", "-"))
    return shown


def type_everywhere(tab: Tab, address: str, title: str, most: int) -> None:
    chance = random.Random(SEED)
    tab.open(title)
    expect(tab.page.get_by_role("tab", name=title)).to_have_attribute("aria-selected", "true")
    found = tab.page.locator(FIELDS)
    expect(found).not_to_have_count(0)
    count = found.count()
    with held_up(address):
        for k in sorted(chance.sample(range(count), min(count, most))):
            text = another(found.nth(k).input_value())
            assert type_slowly(tab, k, text, chance) == {text}, f"field {k + 1} of {title}"


@pytest.mark.full
def test_a_field_shows_what_was_typed_while_it_has_the_focus(tab: Tab, address: str) -> None:
    type_everywhere(tab, address, "Move", 2)
    type_everywhere(tab, address, "Robot", 3)
    # What was typed last has arrived: the next test finds the arm of the table, not one about to be replaced.
    expect(tab.row("Robot").locator("input:visible").first).to_have_value("My arm (Pioneer arm variant)")


@pytest.mark.slow
@pytest.mark.parametrize("title", ["Move", "Workspace", "Robot"])
def test_each_field_shows_what_was_typed_while_it_has_the_focus(tab: Tab, address: str, title: str) -> None:
    type_everywhere(tab, address, title, 1000)
    tab.spoilt = True
