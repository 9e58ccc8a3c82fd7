"""One table of faults, tried on a running service, and what must hold during each of them.

REST answers, or says 503, within `REST` seconds; visitors are back within `VISITORS` seconds of the fault; answers
that were confirmed to a student are there afterwards; the log is bounded. A service that hangs is noticed after
`KINBOARD_WORKER_TIMEOUT`, a process that computes and is stopped after `KINBOARD_TIME_BUDGET`, by which both times
are extended.

The processes that the code starts, the folders where it writes and the peers it talks to are compared with the
table. A new one needs rows here, or a test of its own that is named here.
"""

from __future__ import annotations

import ast
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import httpx2
import pytest
from attacks import ROOT, victim
from faulty_machine import (
    APART,
    HANG,
    MANNERS,
    PATIENCE,
    SEEDS,
    SILENCE,
    Asking,
    Machine,
    can_mount,
    launches,
    misbehave,
    running_machine,
    strain,
)
from live_server import wait_for

from app.service.compute.process import LOADING
from app.shared.settings import Settings

REST = 5.0  # s
VISITORS = 10.0  # s
LINES = 100  # of the log during one fault: after a hang it says where each thread was

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="the service starts again by itself on Linux only"),
    pytest.mark.full,
]

Act = Callable[[Machine, ExitStack], object]


@dataclass(frozen=True)
class Fault:
    """A row: what misbehaves, how, and what is expected beyond the common rules.

    Attributes:
        act: lets it happen; what it adds to the stack lasts while the service is watched.
        sample: whether it is tried in every run, not only in slow ones.
        late: seconds until the service can notice it.
        lost: requests that may break, because a process was working on them.
        keeps: whether the answers that were stored before are there afterwards.
    """

    what: str
    how: str
    act: Act
    sample: bool = False
    late: float = 0.0
    lost: int = 0
    keeps: bool = True

    def __str__(self) -> str:
        return f"{self.what} {self.how}"


# -- rows ------------------------------------------------------------------------------------------------------


def send(role: str, number: signal.Signals) -> Act:
    """A signal for a process, which ends it sooner or later. One that computes ignores what is sent to all."""

    def act(on: Machine, _: ExitStack) -> None:
        process = on.processes()[role]
        process.send_signal(number)
        if role == "service" or number not in (signal.SIGTERM, signal.SIGINT):
            wait_for(lambda: process not in on.processes().values(), PATIENCE)  # measured later

    return act


def and_replace_all(act: Callable[[Machine], object]) -> Act:
    """Do something to a folder, and let all processes be replaced by some that find it as it is."""

    def then(on: Machine, stack: ExitStack) -> None:
        act(on)
        for role in ("compute", "service"):
            send(role, signal.SIGKILL)(on, stack)

    return then


def hang_loading(on: Machine, stack: ExitStack) -> None:
    """The next process that computes hangs while it loads the core, until it is killed; another one does not."""
    on.hang_loading()
    send("compute", signal.SIGKILL)(on, stack)
    wait_for(lambda: any("has not loaded the core" in line for line in on.service.errors), LOADING + PATIENCE)
    on.mend()
    wait_for(on.computes, PATIENCE)


def clients(manner: str, first: bytes, lie: bytes) -> Act:
    def act(on: Machine, stack: ExitStack) -> None:
        stack.enter_context(misbehave(on.service, manner, first, lie))
        time.sleep(2.0)

    return act


def platform(manner: str) -> Act:
    def act(on: Machine, stack: ExitStack) -> None:
        stack.enter_context(launches(on.service, on.platforms[manner]))
        time.sleep(2.0)

    return act


SIGNALS = {
    "service": ("SIGTERM", "SIGKILL", "SIGINT", "SIGHUP", "SIGSEGV", HANG.name),
    "compute": ("SIGTERM", "SIGKILL", "SIGINT", "SIGHUP", "SIGSEGV", "SIGSTOP"),
}
SAMPLED = {
    ("compute", "SIGKILL"),
    ("service", "SIGKILL"),
    ("service", HANG.name),
    ("temp", "full"),
    ("temp", "gone"),
    ("exercises", "gone"),
}
PROCESSES = [
    Fault(
        role,
        name,
        send(role, signal.Signals[name]),
        (role, name) in SAMPLED,
        late=SILENCE if name in ("SIGSTOP", HANG.name) else 0.0,
        lost=1 if role == "service" else 0,
    )
    for role, names in SIGNALS.items()
    for name in names
]

# A request that waits for it ends with its time, which is less.
LOADS = [Fault("loading", "hangs", hang_loading, late=LOADING + SILENCE)]

FOLDERS = [
    Fault(
        name,
        how,
        and_replace_all(act),
        (name, how) in SAMPLED,
        lost=2,
    )
    for name in ("temp", "shm", "data", *SEEDS)
    for how, act in (
        ("full", lambda on, name=name: on.fill(name)),
        ("read-only", lambda on, name=name: on.protect(name)),
        ("gone", lambda on, name=name: on.remove(name)),
    )
]

CLOCKS = [
    Fault("clock", how, lambda on, _, seconds=seconds: on.set_clock(seconds))
    for how, seconds in (("an hour back", -3600.0), ("an hour on", 3600.0), ("ten years on", 3.2e8))
]

REQUEST = b"GET /api/v1/robots/pioneer5 HTTP/1.1\r\nHost: localhost\r\n\r\n"
HALF = b"POST /api/v1/robots/pioneer5/ik HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9999\r\n\r\n{"
HANDSHAKE = (
    b"GET /viewer HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)
PEERS = [
    Fault(name, manner, act)
    for manner in MANNERS
    for name, act in (
        ("program", clients(manner, REQUEST, HALF)),
        ("visitor", clients(manner, HANDSHAKE, HANDSHAKE + b"\x82\xfe\xff\xff" + bytes(5000))),
        ("platform", platform(manner)),
    )
]

TABLE = [*PROCESSES, *LOADS, *FOLDERS, *CLOCKS, *PEERS]


# -- what must hold --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machine]:
    with running_machine(tmp_path_factory.mktemp("machine")) as found:
        if not found.mounted:
            print("no mounts allowed: folders that should be full or read-only are replaced by a file")
        yield found


@pytest.mark.parametrize(
    "fault", [pytest.param(row, marks=() if row.sample else pytest.mark.slow, id=str(row)) for row in TABLE]
)
def test_the_service_holds(fault: Fault, service: Machine) -> None:
    if not service.cookie:
        service.enter_room()
    with service.student() as page:
        service.answer(page)
    said = len(service.service.errors)
    with Asking(service.service) as asking, ExitStack() as stack:
        stack.callback(service.mend)
        wait_for(lambda: len(asking.answers) > 3, 60)
        factor = strain()
        began = time.monotonic()
        fault.act(service, stack)
        service.visit(factor * VISITORS + fault.late)
        back = time.monotonic() - began
        factor = max(factor, strain())
        count = len(asking.answers)
        wait_for(lambda: len(asking.answers) > count + 3, PATIENCE)
    worst = max(seconds for seconds, _ in asking.answers)
    broken = sum(status is None for _, status in asking.answers)
    lines = service.service.errors[said:]
    print(
        f"{fault}: visitors after {back:.1f} s, REST within {worst:.1f} s, strain {factor:.1f}, {broken} requests "
        f"lost, {len(lines)} lines of the log"
    )
    assert back <= factor * VISITORS + fault.late
    assert worst <= factor * REST + fault.late
    assert broken <= fault.lost
    assert {status for _, status in asking.answers} <= {200, 503, None}
    assert len(lines) <= LINES, "".join(lines)
    if (fault.what, fault.how) == ("data", "gone"):  # nothing can keep what somebody has deleted
        service.enter_room()
        service.confirmed = 0
    assert service.kept() >= service.confirmed
    with service.student() as page:
        service.answer(page)


@pytest.mark.skipif(not can_mount(), reason="needs filesystems of its own")
def test_the_service_starts_beside_a_read_only_and_a_full_folder(tmp_path: Path) -> None:
    """`/dev/shm` is read-only, and the folder for temporary files has no byte free."""
    mounts = (
        'mount -t tmpfs -o ro tmpfs /dev/shm && mount -t tmpfs -o size=64k tmpfs "$TMPDIR" || exit 1\n'
        'cat /dev/zero > "$TMPDIR/junk" 2> /dev/null\nexec "$@"'
    )
    with victim(before=(*APART, "sh", "-c", mounts, "sh"), TMPDIR=str(tmp_path)) as service:
        answer = httpx2.get(f"{service.url}/api/v1/robots/pioneer5", trust_env=False, timeout=60)
        assert answer.status_code == 200
        assert service.metric('kinboard_requests_total{method="GET",route="/livez",status="200"}') > 0
        assert "Traceback" not in service.log


# -- what the table must contain -------------------------------------------------------------------------------

# What the code declares, and where it is tried: rows of the table, or tests, by their files below tests/.
DECLARED = {
    "processes": {
        "app/service/restarts.py": (
            "service",
            "app/service/test_restarts.py::test_one_that_does_not_stop_is_killed",
        ),
        "app/service/compute/process.py": (
            "compute",
            "loading",
            "app/service/compute/test_pool.py::test_a_process_that_ends_loses_one_request",
        ),
        "kin/codegen/extension/build.py": (
            "kin/kernels/test_ahead.py::test_where_it_cannot_be_built_it_is_said_what_to_set",
        ),
        "kin/kernels/ahead.py": (
            "kin/kernels/test_ahead.py::test_where_it_cannot_be_built_it_is_said_what_to_set",
        ),
        "app/notebook/process.py": ("app/notebook/test_notebook.py::test_the_process_serves_and_ends",),
        "app/viewer/meshes/reader.py": ("app/viewer/meshes/test_loading.py::test_the_process_says_what_is_wrong",),
        "app/cli/xacro/__init__.py": ("app/cli/test_xacro.py::test_what_is_missing_is_named",),
    },
    "folders": {
        "data": ("data",),
        "robots": ("robots",),
        "exercises": ("exercises",),
        "courses": ("courses",),
        "lti": ("app/classroom/test_lti.py::test_the_service_does_not_start_with_a_wrong_file",),
        "lessons": ("app/exercises/test_lesson_words.py::test_a_folder_that_cannot_be_listed_is_refused",),
        "kin/codegen/extension/build.py": (
            "kin/codegen/extension/test_build.py::test_only_a_unit_that_has_changed_is_compiled_again",
        ),
        "app/bench/contestants/motions.py": ("bench/test_bench.py::test_a_library_that_is_missing_or_fails",),
    },
    "peers": {
        "app/service/server.py": ("program", "visitor"),
        "app/classroom/lti/exchange.py": ("platform",),
        "app/classroom/database.py": (
            "data",
            "app/classroom/test_postgres.py::test_a_server_that_dies",
        ),
    },
}
# How a module declares it: what it calls.
CALLS = {
    "processes": {"Popen", "Process", "fork", "run_subprocess"},
    "folders": {
        "mkdtemp",
        "mkstemp",
        "TemporaryDirectory",
        "TemporaryFile",
        "NamedTemporaryFile",
    },
    "peers": {"create_server", "create_engine", "HTTPConnection", "HTTPSConnection", "urlopen", "build_opener"},
}


def called(file: Path) -> set[str]:
    """Names of the functions and classes that a module calls."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            of = getattr(getattr(node.func, "value", None), "id", "")
            found.add("run_subprocess" if (of, name) == ("subprocess", "run") else name)
    return found


@pytest.mark.parametrize("kind", DECLARED)
def test_whatever_the_code_declares_is_in_the_table(kind: str) -> None:
    files = [file for room in ("app", "kin") for file in (ROOT / room).rglob("*.py")]
    found = {str(file.relative_to(ROOT)) for file in files if called(file) & CALLS[kind]}
    if kind == "folders":
        found |= {name for name, field in Settings.model_fields.items() if "Path" in str(field.annotation)}
    assert found == set(DECLARED[kind])
    rows = {row.what for row in TABLE}
    for place in (each for places in DECLARED[kind].values() for each in places):
        file, _, test = place.partition("::")
        assert place in rows or f"def {test}" in (ROOT / "tests" / file).read_text("utf-8"), place


def test_the_table_is_complete() -> None:
    """Each thing misbehaves in each way."""

    def ways(*things: str) -> dict[str, set[str]]:
        return {thing: {row.how for row in TABLE if row.what == thing} for thing in things}

    assert ways(*SIGNALS) == {role: set(names) for role, names in SIGNALS.items()}
    folders = {row.what for row in FOLDERS}
    assert ways(*folders) == {folder: {"full", "read-only", "gone"} for folder in folders}
    peers = {row.what for row in PEERS}
    assert ways(*peers) == {peer: set(MANNERS) for peer in peers}
    assert len({str(row) for row in TABLE}) == len(TABLE)
