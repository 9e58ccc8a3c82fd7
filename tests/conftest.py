"""Profiles of hypothesis, the order of files, and a check that tests leave the environment as it was.

Random examples of hypothesis are new in every local run and always the same in CI: a test that fails there fails
because of a change, not by chance.
"""

from __future__ import annotations

import gc
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from playwright.sync_api import Browser, sync_playwright

settings.register_profile("local", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")

TESTS = Path(__file__).parent
CHROMIUM = Path(os.environ.get("KINBOARD_TEST_CHROMIUM", "/usr/bin/chromium"))
# Few tests that take tens of seconds together. Begun first, so that no process is left alone with one at the end:
# pytest-xdist would begin with the files of most tests (scripts/test.sh switches that off).
LONG = frozenset(
    TESTS / file
    for file in (
        "test_docs.py",
        "app/api/test_generated_client.py",
        "app/api/test_schemathesis.py",
        "app/cli/test_cli.py",
        "app/cli/test_xacro.py",
        "app/service/test_fault_table.py",
        "app/service/test_faults.py",
        "app/service/test_workers.py",
        "app/viewer/room/test_leaks.py",
        "app/viewer/scene/test_viewer_camera.py",
        "app/viewer/session/test_state.py",
        "app/viewer/tabs/robot/test_uploads.py",
        "bench/test_load.py",
        "deploy/test_ways_in.py",
        "e2e/classroom/test_class_lines.py",
        "e2e/lessons/test_accessibility.py",
        "e2e/test_dashboard.py",
        "e2e/test_screens.py",
        "kin/kernels/test_kernels.py",
        "kin/kernels/test_loaded_kernels.py",
        "kin/warmup/test_warmup.py",
    )
)
assert not (moved := [str(file) for file in LONG if not file.exists()]), moved


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Collect without looking for garbage, which takes a third of the time and finds next to none.

    What has been collected stays: later looks leave it out.
    """
    gc.disable()
    found = yield
    gc.freeze()
    gc.enable()
    return found


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the long files; then files of `kin`, which compute, take turns with those that often wait."""
    files = list(dict.fromkeys(item.path for item in items))
    computing = {path for path in files if path.is_relative_to(TESTS / "kin")}
    place = {}
    for part in ([path for path in files if (path in computing) == computes] for computes in (True, False)):
        place |= {path: (path not in LONG, i / len(part)) for i, path in enumerate(part)}
    items.sort(key=lambda item: place[item.path])


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say why each test that is run again failed: the plugin that runs it again tells its name alone."""
    for report in terminalreporter.stats.get("rerun", ()):
        terminalreporter.section(f"run again: {report.nodeid} ({report.when})")
        terminalreporter.line(report.longreprtext)


def pytest_sessionstart(session: pytest.Session) -> None:
    """Send at once what ``pytest --reruns`` sends before each test from its process to the one that counts.

    Otherwise each of its messages waits until the one before is acknowledged, for 40 ms. Most tests are shorter.
    """
    counts = getattr(session.config, "failures_db", None)
    if (line := getattr(counts, "sock", None)) is not None:
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that renews ``tests/data/snapshots``."""
    parser.addoption(
        "--snapshot-update", action="store_true", help="rewrite tests/data/snapshots with today's answers"
    )


@pytest.fixture(autouse=True)
def environment_unchanged() -> Iterator[None]:
    """Processes that later tests start inherit the environment."""
    before = dict(os.environ)
    yield
    del before["PYTEST_CURRENT_TEST"]
    after = {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}
    assert after == before, "the test changed environment variables and did not restore them"


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """One Chromium for all tests of a process, which can run Playwright's synchronous interface once only."""
    if not CHROMIUM.exists():
        pytest.fail(
            f"no Chromium at {CHROMIUM}: install it (apt-get install chromium) or set KINBOARD_TEST_CHROMIUM"
        )
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        yield started
        started.close()
