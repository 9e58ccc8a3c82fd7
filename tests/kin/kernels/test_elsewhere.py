"""Kernels that another process compiles: which ones it is asked for, and what happens when it fails."""

from __future__ import annotations

import io
import os
import pickle
import sys
import threading
from collections.abc import Iterator
from importlib import import_module, invalidate_caches
from pathlib import Path
from types import ModuleType

import pytest
from numba import config, types

from kin.kernels import elsewhere
from kin.kernels.compile import jit
from kin.kernels.elsewhere import DONE, TRIES, VAIN, compile_elsewhere, serve
from kin.kernels.private import CACHE, CALLS, MISSING

KERNEL = """
from kin.kernels.compile import jit

@jit
def inner(x):
    return 2.0 * x

@jit
def outer(x):
    return inner(x) + 1.0

@jit
def other(x):
    return x
"""
FLOAT = (types.float64,)


class Helper:
    """Stands for another process: what it was asked, and what it then does."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.works = True

    def __call__(self, line: str) -> bool:
        self.asked.append(line.split()[1])
        assert pickle.loads(bytes.fromhex(line.split()[2])) == FLOAT
        return self.works


@pytest.fixture
def helper() -> Iterator[Helper]:
    made = Helper()
    compile_elsewhere(made)
    yield made
    compile_elsewhere(None)


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> ModuleType:
    """A module of kernels, and a cache without any."""
    monkeypatch.setenv("KINBOARD_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(config, "CACHE_DIR", "")
    name = f"kernels_of_{abs(hash(request.node.name))}"
    (tmp_path / f"{name}.py").write_text(KERNEL)
    monkeypatch.syspath_prepend(tmp_path)
    invalidate_caches()
    return import_module(name)


def test_a_process_compiles_what_its_lines_name_and_another_one_loads_it(module, helper, monkeypatch, capsys):
    line = elsewhere.line_of(module.outer, FLOAT)
    compile_elsewhere(None)
    monkeypatch.setattr(sys, "stdin", io.StringIO(f"{line}\n"))
    serve()
    assert capsys.readouterr().out == f"{DONE}\n"
    timers = [each for each in threading.enumerate() if isinstance(each, threading.Timer)]
    assert not any(each.function is os._exit and not each.finished.is_set() for each in timers), (
        "no end hangs over"
    )
    compile_elsewhere(helper)
    again = jit(module.outer.py_func)  # as another process has it: with the same cache, and nothing loaded
    monkeypatch.setattr(module, "outer", again)
    assert again(3.0) == 7.0
    assert helper.asked == []
    assert (again.stats.cache_hits, again.stats.cache_misses) == ({FLOAT: 1}, {})


def test_a_missing_kernel_is_asked_for_once_and_what_it_calls_is_not(module, helper):
    helper.works = False  # so that it is compiled here
    assert module.outer(3.0) == 7.0
    assert module.outer(4.0) == 9.0
    assert helper.asked == ["outer"] * TRIES


def test_where_the_cache_keeps_nothing_only_a_few_kernels_are_compiled_in_vain(module, helper):
    """The helper says that it has compiled them."""
    assert module.outer(3.0) == 7.0
    assert helper.asked == ["outer"]
    for _ in range(VAIN):
        module.other = jit(module.other.py_func)
        module.other._cache.load_overload = lambda *_: None
        assert module.other(3.0) == 3.0
    assert helper.asked == ["outer", *["other"] * (VAIN - 1)]


def test_an_exception_of_the_helper_reaches_the_caller_and_nothing_is_compiled(module, helper):
    def refuse(_: str) -> bool:
        raise InterruptedError

    compile_elsewhere(refuse)
    with pytest.raises(InterruptedError):
        module.outer(3.0)
    assert not module.outer.overloads
    compile_elsewhere(helper)
    assert module.outer(3.0) == 7.0


def test_a_kernel_without_a_name_in_its_module_is_compiled_where_it_is_called(helper):
    def local(x: float) -> float:
        return x + 1.0

    assert jit(local)(1.0) == 2.0
    assert helper.asked == []


def test_types_that_belong_to_this_process_are_named_in_no_line(module, helper, monkeypatch):
    def fail(_: object) -> bytes:
        raise pickle.PicklingError

    monkeypatch.setattr(elsewhere.pickle, "dumps", fail)
    assert module.outer(3.0) == 7.0
    assert helper.asked == []


@pytest.mark.parametrize("gain", [CACHE, CALLS])
def test_without_names_of_numba_kernels_are_compiled_where_they_are_called(module, helper, monkeypatch, gain):
    compile_elsewhere(None)
    monkeypatch.setitem(MISSING, gain, "a name")
    compile_elsewhere(helper)
    assert module.outer(3.0) == 7.0
    assert helper.asked == []
