"""The process that compiles the parts of the core one after the other."""

from __future__ import annotations

import threading

import pytest
from live_server import wait_for

from app.service import compiler
from app.service.compiler import PartsCompiler
from kin.warmup import COLLISIONS, parts
from kin.warmup.preparation import Preparation


@pytest.fixture
def preparation() -> Preparation:
    """Only the collisions are left to compile."""
    made = Preparation()
    made.begin()
    for name in parts():
        while name != COLLISIONS and not made.ready((name,)):
            made.done(name)
    return made


@pytest.mark.full
def test_the_other_process_does_every_step_that_is_left(preparation):
    assert PartsCompiler(preparation).run()
    assert preparation.ready(parts())


@pytest.mark.full
def test_a_process_that_ends_early_does_not_count_as_done(preparation, monkeypatch):
    program = compiler._PARTS.replace("()\n", "()\n    if step == '2': sys.exit()\n")
    assert program != compiler._PARTS
    monkeypatch.setattr(compiler, "_PARTS", program)
    assert not PartsCompiler(preparation).run()
    assert preparation.next() == (COLLISIONS, 2)


def test_a_stop_ends_the_other_process_and_what_waits_for_it(preparation, monkeypatch):
    monkeypatch.setattr(compiler, "_PARTS", "import time; time.sleep(300)")
    compiling, answers = PartsCompiler(preparation), []
    thread = threading.Thread(target=lambda: answers.append(compiling.run()))
    thread.start()
    wait_for(lambda: compiling._child is not None)
    compiling.stop()
    thread.join(10)
    assert answers == [False]
    assert compiling._child.poll() is not None
    assert not compiling.run(), "it does not start again"
