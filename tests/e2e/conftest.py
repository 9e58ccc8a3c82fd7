"""Fixtures of the browser tests: the service, Chromium, and one tab each in desktop and phone size."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from page import Tab
from playwright.sync_api import Browser

import kin

ROOT = Path(__file__).parents[2]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Add what the pages showed to the report of a test that failed."""
    report: pytest.TestReport = yield  # type: ignore[assignment, misc]
    if report.when == "call" and report.failed:
        for name, opened in getattr(item, "funcargs", {}).items():
            if isinstance(opened, Tab):
                report.sections.append((f"page of {name}", opened.text()))
                opened.spoilt = True
    return report  # type: ignore[return-value]


@pytest.fixture(scope="session")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder for the service's database of rooms."""
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="session")
def address(data: Path) -> Iterator[str]:
    """The service as a user starts it, on a free port."""
    with running(data, KINBOARD_FRAME_ANCESTORS="http://school.localhost:*") as url:
        yield url


@pytest.fixture
def read_only_address(tmp_path: Path) -> Iterator[str]:
    """A service at which visitors may only look."""
    with running(tmp_path, KINBOARD_READ_ONLY="1") as url:
        yield url


@contextmanager
def running(data: Path, **settings: str) -> Iterator[str]:
    """A service with its folder for data, and other settings."""
    env = {**os.environ, "PYTHONPATH": str(ROOT), "KINBOARD_DATA": str(data), **settings}
    command = [sys.executable, "-m", "app.cli", "serve", "--port", "0"]
    log = data / "service.log"
    with (
        log.open("w") as output,
        subprocess.Popen(command, cwd=ROOT, env=env, stdout=output, stderr=subprocess.STDOUT) as process,
    ):
        try:
            url = announced(log, process)
            wait_until_ready(url)
            yield url
        finally:
            process.terminate()
            process.wait(20)


def announced(log: Path, process: subprocess.Popen[bytes], seconds: float = 60.0) -> str:
    """The address that a service has written into its log."""
    end = time.monotonic() + seconds
    while (found := re.search(r"http://\S+", text := log.read_text())) is None:
        assert process.poll() is None, f"the service did not start: {text}"
        assert time.monotonic() < end, f"the service says no address: {text}"
        time.sleep(0.05)
    return found[0]


def wait_until_ready(url: str, seconds: float = 180.0) -> None:
    end = time.monotonic() + seconds
    reason = ""
    while time.monotonic() < end:
        try:
            with urllib.request.urlopen(url + "readyz", timeout=5):
                return
        except OSError as error:  # 503 until it is ready
            reason = str(error)
        time.sleep(0.2)
    pytest.fail(f"not ready after {seconds} s: {reason}")


@pytest.fixture(scope="session")
def desktop(browser: Browser, address: str) -> Iterator[Tab]:
    """The desktop tab of all tests: opening a page costs seconds, as software rendering compiles its shaders."""
    opened = Tab(browser, address, 1280, 720)
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def phone(browser: Browser, address: str) -> Iterator[Tab]:
    """The tab on a phone, with a touch screen."""
    opened = Tab(browser, address, 390, 844, touch=True)
    yield opened
    opened.close()


@pytest.fixture(autouse=True)
def no_spoilt_page(request: pytest.FixtureRequest) -> None:
    """A test never begins on a page that a failed one has left in some state."""
    for name in {"desktop", "phone"} & set(request.fixturenames):
        opened: Tab = request.getfixturevalue(name)
        if opened.spoilt:
            opened.reopen()


@pytest.fixture
def tab(desktop: Tab, no_spoilt_page: None) -> Tab:
    """The desktop tab with the Pioneer arm in its home configuration."""
    desktop.show(kin.get_robot("pioneer5"))
    return desktop
