"""Tests with and without a browser in one process, in any order."""

from __future__ import annotations

import asyncio

import pytest
from playwright.sync_api import Browser

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module", autouse=True)
def used_before(request: pytest.FixtureRequest) -> None:
    """Other tests of this process have had a browser."""
    browser: Browser = request.getfixturevalue("browser")
    browser.version  # noqa: B018 - a call after which Playwright's loop waits


def test_a_test_without_a_browser_can_run_an_event_loop() -> None:
    assert asyncio.run(asyncio.sleep(0.0, "ran")) == "ran"


def test_the_browser_goes_on_afterwards(browser: Browser) -> None:
    page = browser.new_page()
    assert page.evaluate("1 + 1") == 2
    page.close()
