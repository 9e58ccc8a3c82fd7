"""The processes that compile kernels, and the threads that wait for them; a short program stands for one."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError, ThreadPoolExecutor
from pathlib import Path

import pytest
from compiling import kernel, stand_in_for_the_compiler
from live_server import wait_for

from app.api.problems import ProblemError
from app.service.compiler import Compilers, CompilerStoppedError, KernelCompiler, ahead


@pytest.fixture(autouse=True)
def program(monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in_for_the_compiler(monkeypatch)


@pytest.fixture
def made() -> Iterator[KernelCompiler]:
    found = KernelCompiler()
    yield found
    found.stop()


@pytest.fixture
def compilers() -> Iterator[Compilers]:
    found = Compilers()
    yield found
    found.stop()


def test_kernels_are_compiled_in_their_order(made, tmp_path):
    first, second = kernel(tmp_path, "first", False), kernel(tmp_path, "second")
    answers = [made.submit(line) for line in (first, second)]
    assert not answers[1].done()
    Path(first).touch()
    assert answers[1].result(20)
    assert answers[0].done()


def test_a_process_that_ends_says_so_and_the_next_kernel_has_a_new_one(made, tmp_path, caplog):
    for _ in range(2):
        assert not made.submit(str(tmp_path / "end")).result(20)
    assert made.submit(kernel(tmp_path, "next")).result(20)
    assert [record.message.partition(";")[0] for record in caplog.records] == ["a compiling process ended early"]


def test_a_process_that_is_killed_says_so_too(made, tmp_path):
    answer = made.submit(kernel(tmp_path, "first", False))
    wait_for(lambda: made.child is not None)
    made.child.kill()
    assert not answer.result(20)
    assert made.submit(kernel(tmp_path, "next")).result(20)


def test_the_kernel_after_an_idle_process_has_ended_has_a_new_one(made, tmp_path, caplog):
    for name in ("first", "second"):
        assert made.submit(kernel(tmp_path, name)).result(20)
        made.child.stdin.close()  # it ends by itself
        made.child.wait(20)
    assert not caplog.records


def test_an_idle_process_that_has_ended_leaves_the_table_of_the_system_at_once(made, tmp_path):
    assert made.submit(kernel(tmp_path, "first")).result(20)
    made.child.stdin.close()  # it ends by itself
    wait_for(lambda: made.child.returncode is not None)


@pytest.mark.full
def test_an_idle_process_ends_with_its_memory():
    program = "from kin.kernels import elsewhere; elsewhere.IDLE = 0.01; elsewhere.serve()"
    with subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE) as process:
        assert process.wait(60) == 0


def test_a_stop_ends_the_process_and_all_waiting(made, tmp_path):
    answers = [made.submit(kernel(tmp_path, name, False)) for name in ("first", "second")]
    wait_for(lambda: made.child is not None)
    child = made.child
    made.stop()
    for answer in answers:
        with pytest.raises((CompilerStoppedError, CancelledError)):
            answer.result(20)
    assert child.poll() is not None
    with pytest.raises(CompilerStoppedError):
        made.submit(kernel(tmp_path, "third"))


def test_what_is_asked_for_does_not_wait_for_what_is_compiled_ahead(compilers, tmp_path):
    later = kernel(tmp_path, "later", False)

    def compile_ahead() -> bool:
        ahead.set(True)
        return compilers.compile(later)

    with ThreadPoolExecutor() as threads:
        waiting = threads.submit(compile_ahead)
        wait_for(lambda: compilers.ahead.child is not None)
        assert compilers.compile(kernel(tmp_path, "now"))
        assert not waiting.done()
        Path(later).touch()
        assert waiting.result(20)


def test_an_event_loop_does_not_wait_and_the_kernel_is_compiled_all_the_same(compilers, tmp_path):
    line = kernel(tmp_path, "kernel", False)

    async def ask() -> None:
        compilers.compile(line)

    with pytest.raises(ProblemError) as refused:
        asyncio.run(ask())
    assert refused.value.problem.type == "urn:kinboard:problem:preparing"
    answer = compilers.asked.submit(line)
    Path(line).touch()
    assert answer.result(20)


def test_a_thread_that_waits_when_the_service_stops_gets_an_error(compilers, tmp_path):
    raised: list[BaseException] = []

    def ask() -> None:
        try:
            compilers.compile(kernel(tmp_path, "kernel", False))
        except CompilerStoppedError as error:
            raised.append(error)

    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    wait_for(lambda: compilers.asked.child is not None)
    compilers.stop()
    thread.join(10)
    assert len(raised) == 1
