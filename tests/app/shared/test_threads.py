"""The priority of threads, read back from the system; how a forked process ends."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from app.shared import threads

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="Linux only")


@pytest.mark.parametrize(("own", "then"), [(0, threads.NICENESS), (threads.NICENESS + 5, threads.NICENESS + 5)])
def test_a_thread_steps_back_and_never_forward(own, then):
    """Only root may take a niceness back."""
    found = []

    def act():
        thread = threading.get_native_id()
        began = os.getpriority(os.PRIO_PROCESS, thread)
        os.setpriority(os.PRIO_PROCESS, thread, max(began, own))
        threads.lower_priority()
        found.append((began, os.getpriority(os.PRIO_PROCESS, thread)))

    thread = threading.Thread(target=act)
    thread.start()
    thread.join()
    ((began, after),) = found
    assert after == max(began, then)


FORKED = """
import atexit, os, sys, tempfile
from multiprocessing.util import Finalize
from app.shared.threads import end_process, forget_exit_handlers

folder = tempfile.TemporaryDirectory()
atexit.register(print, "exit handler of the parent")
Finalize(None, print, ("finalizer of the parent",), exitpriority=1)
sys.stdout.flush()
if os.fork() == 0:
    forget_exit_handlers()
    own = tempfile.TemporaryDirectory()
    atexit.register(print, "exit handler of the child")
    print(own.name)
    end_process(0)
os.wait()
print(os.path.isdir(folder.name))
"""


def test_a_forked_process_runs_its_own_exit_handlers_and_not_those_of_its_parent():
    root = Path(__file__).parents[3]
    said = subprocess.run(
        [sys.executable, "-c", FORKED],
        env=os.environ | {"PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    own, *rest = said
    assert not Path(own).exists()
    assert rest == [
        "exit handler of the child",
        "True",
        "exit handler of the parent",
        "finalizer of the parent",
    ]
