"""Profiles of hypothesis, the order of files, and a check that tests leave the environment as it was.

Random examples of hypothesis are new in every local run and always the same in CI: a test that fails there fails
because of a change, not by chance.
"""

from __future__ import annotations

import asyncio
import gc
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from arms import ONE_OF_EACH_SOLVER, one_of_each_family
from hypothesis import settings
from playwright.sync_api import Browser, Playwright, sync_playwright

import kin

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
        "app/api/clients/test_generated_client.py",
        "app/api/clients/test_schemathesis.py",
        "app/cli/test_cli.py",
        "app/cli/test_xacro.py",
        "app/service/test_fault_table.py",
        "app/service/test_faults.py",
        "app/viewer/lessons/test_asked_before_shown.py",
        "app/viewer/lessons/test_whole_lessons.py",
        "app/viewer/meshes/test_links.py",
        "app/viewer/room/test_leaks.py",
        "app/viewer/scene/test_viewer_camera.py",
        "app/viewer/session/test_state.py",
        "app/viewer/tabs/robot/test_uploads.py",
        "bench/test_load.py",
        "deploy/test_ways_in.py",
        "e2e/classroom/test_class_lines.py",
        "e2e/lessons/test_accessibility.py",
        "e2e/test_dashboard.py",
        "e2e/test_other_browsers.py",
        "e2e/test_screens.py",
        "kin/codegen/test_exact.py",
        "kin/codegen/test_generated_files.py",
    )
)
assert not (moved := [str(file) for file in LONG if not file.exists()]), moved


# Without --all, a test of each built-in arm runs for these: in tests/kin for one of each family of closed forms,
# elsewhere, where a closed form is a black box, for some with five to seven joints and one with a slide.
ONE_OF_EACH_FAMILY = frozenset(robot.id for robot in one_of_each_family())
# Of tests that generate code, or a page with code, for each arm, or leave its singularities, those that are no
# example of a solver are slow ones.
COSTLY = (
    "test_leaving.py",
    "test_exact.py",
    "test_generated_files.py",
    "test_takehome.py",
    "test_takehome_solver.py",
)
SOME = frozenset({"pioneer5", "redundant7-craig", "puma560", "scara"})


def arms_of(item: pytest.Item) -> set[str]:
    """The ids of the built-in arms that a test is of."""
    values = (
        item.callspec.params.values() if isinstance(item, pytest.Function) and hasattr(item, "callspec") else ()
    )
    ids = {
        each.id if isinstance(each, kin.Robot) else each for each in values if isinstance(each, kin.Robot | str)
    }
    return ids & kin.builtin_robots().keys()


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


@pytest.hookimpl(tryfirst=True)  # before -m is applied
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of arms that stand for no others as `full`, and begin with the long files.

    Then files of `kin`, which compute, take turns with those that often wait.
    """
    for item in items:
        arms = arms_of(item)
        if not arms <= (ONE_OF_EACH_FAMILY if item.path.is_relative_to(TESTS / "kin") else SOME):
            item.add_marker(pytest.mark.full)
        if item.path.name in COSTLY and not arms <= set(ONE_OF_EACH_SOLVER):
            item.add_marker(pytest.mark.slow)
    files = list(dict.fromkeys(item.path for item in items))
    computing = {path for path in files if path.is_relative_to(TESTS / "kin")}
    place = {}
    for part in ([path for path in files if (path in computing) == computes] for computes in (True, False)):
        place |= {path: (path not in LONG, i / len(part)) for i, path in enumerate(part)}
    items.sort(key=lambda item: place[item.path])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Iterator[None]:
    """Escape what a test prints that no UTF-8 can hold: pytest-xdist sends all of it to another process."""
    report: pytest.TestReport = yield  # type: ignore[assignment, misc]
    report.sections = [(name, text.encode(errors="backslashreplace").decode()) for name, text in report.sections]
    return report  # type: ignore[return-value]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add options: to renew ``tests/data/snapshots``, and to let another process compute for REST."""
    parser.addoption("--compute", action="store_true", help="another process computes answers of REST")
    parser.addoption(
        "--snapshot-update", action="store_true", help="rewrite tests/data/snapshots with today's answers"
    )


@pytest.fixture(scope="module", autouse=True)
def young_heap() -> Iterator[None]:
    """What a file has left is not looked through again for garbage: a look would soon take seconds."""
    yield
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def environment_unchanged() -> Iterator[None]:
    """Processes that later tests start inherit the environment."""
    before = dict(os.environ)
    yield
    del before["PYTEST_CURRENT_TEST"]
    after = {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}
    assert after == before, "the test changed environment variables and did not restore them"


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
    """Playwright's synchronous interface, which a process can run once only."""
    with sync_playwright() as started:
        yield started


@pytest.fixture(scope="session")
def browser(playwright: Playwright) -> Iterator[Browser]:
    """One Chromium for all tests of a process."""
    if not CHROMIUM.exists():
        pytest.fail(
            f"no Chromium at {CHROMIUM}: install it (apt-get install chromium) or set KINBOARD_TEST_CHROMIUM"
        )
    started = playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
    yield started
    started.close()


@pytest.fixture(autouse=True)
def no_loop_of_playwright(request: pytest.FixtureRequest) -> Iterator[None]:
    """Tests without a browser can run an event loop, in a process where others have a browser.

    Between two calls Playwright's own loop waits in a greenlet of this thread, and counts as running all the time.
    """
    loop = None if "playwright" in request.node.fixturenames else asyncio._get_running_loop()
    if loop is None:
        yield
        return
    asyncio._set_running_loop(None)
    yield
    asyncio._set_running_loop(loop)
