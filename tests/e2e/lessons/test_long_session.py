"""A long session at random: robots, tabs, lessons and other controls, with nothing in the browser's console.

The run prints its seed, and does the same again with `KINBOARD_TEST_SEED`. How long it goes on is in
`KINBOARD_TEST_SECONDS`, a minute if that is not set.
"""

from __future__ import annotations

import os
import random
import time
from collections.abc import Callable, Iterator

import pytest
from page import WAIT, Tab
from playwright.sync_api import Browser, Locator, expect
from playwright.sync_api import Error as PlaywrightError

import kin
from app.viewer.lessons import LESSONS

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.full]
SECONDS = float(os.environ.get("KINBOARD_TEST_SECONDS", "60"))
SEED = int(os.environ.get("KINBOARD_TEST_SEED", "0")) or random.randrange(1, 10**6)
TABS = ["Learn", "Robot", "Workspace", "Program", "View", "Move"]
ROBOTS = ["pioneer5", "planar3r", "ur5", "puma560", "scara"]
# These leave the page, open a file, or take minutes.
LEFT = ("Save", "Open", "Print", "Download", "Share", "Copy", "Leave", "Delete", "Erase")
PATIENCE = 3000  # ms; what has gone meanwhile is no fault


def session(tab: Tab, chance: random.Random) -> list[Callable[[], object]]:
    """What a visitor may do, each by one call."""
    page = tab.page

    def one_of(found: Locator) -> Locator | None:
        seen = [each for each in found.all() if each.is_visible() and each.is_enabled()]
        return chance.choice(seen) if seen else None

    def press_a_button() -> None:
        names = [each for each in page.locator("[data-dock-region] button").all() if each.is_visible()]
        usable = [each for each in names if not (each.inner_text() or "Save").startswith(LEFT)]
        if usable:
            chance.choice(usable).click(timeout=PATIENCE)

    def move_a_slider() -> None:
        if (slider := one_of(page.get_by_role("slider"))) is not None:
            slider.focus(timeout=PATIENCE)
            for _ in range(chance.randrange(1, 12)):
                page.keyboard.press(chance.choice(["ArrowRight", "ArrowLeft", "PageUp", "PageDown"]))

    return [
        lambda: tab.open(chance.choice(TABS)),
        lambda: tab.choose_lesson(chance.choice(["None", *(lesson.title for lesson in LESSONS)])),
        lambda: tab.select(kin.get_robot(chance.choice(ROBOTS))),
        press_a_button,
        move_a_slider,
        lambda: page.keyboard.press(chance.choice(["Control+z", "Control+Shift+z", "Escape"])),
        lambda: page.wait_for_timeout(chance.choice([0, 100, 1000])),
    ]


@pytest.fixture
def impatient() -> Iterator[None]:
    """Waits of `expect` are as short as those of clicks."""
    yield
    expect.set_options(timeout=WAIT)


def test_a_session_at_random_leaves_the_console_empty(browser: Browser, address: str, impatient: None) -> None:
    print(f"KINBOARD_TEST_SEED={SEED}")
    tab, chance = Tab(browser, address, 1280, 720), random.Random(SEED)
    tab.page.set_default_timeout(PATIENCE)
    expect.set_options(timeout=PATIENCE)
    acts = session(tab, chance)
    done, end = 0, time.monotonic() + SECONDS
    while time.monotonic() < end:
        try:
            chance.choice(acts)()
            done += 1
        except (PlaywrightError, AssertionError):  # the control has gone, or is covered: another one
            tab.page.keyboard.press("Escape")
        assert tab.errors == [], f"after {done} acts with seed {SEED}: {tab.errors}"
    print(f"{done} acts")
    assert done > SECONDS / 10, "the page let itself be used"
    tab.close()
