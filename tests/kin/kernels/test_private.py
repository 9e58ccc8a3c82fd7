"""Names of numba that may be gone in its next release: each is taken away, and kernels work without it."""

from __future__ import annotations

import ast
import importlib
import inspect
import json
import os
import re
import runpy
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import pytest

import kin
from kin.kernels import private

CORE = Path(kin.__file__).parent
GAINS = {"CACHE": private.CACHE, "CALLS": private.CALLS}
# Modules of numba that it documents for others.
PUBLIC = {"numba", "numba.extending"}


def names() -> list[tuple[str, str, str, str]]:
    """The gain, module, name and member of everything that the module looks up; no member: the name itself."""
    found = []
    for node in ast.walk(ast.parse(Path(private.__file__).read_text("utf-8"))):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "_find":
            gain, *words = (
                word
                for each in node.args
                for word in (each.value.elts if isinstance(each, ast.Starred) else [each])
            )
            module, name, *members = (word.value for word in words)
            found += [(GAINS[gain.id], module, name, member) for member in ("", *members)]
    return found


NAMES = names()


def take_away(monkeypatch: pytest.MonkeyPatch, module: str, name: str, member: str) -> None:
    owners: list[Any] = [importlib.import_module(module)]
    if member:
        found = getattr(owners[0], name)
        owners = (
            [found] if inspect.ismodule(found) else [*(found if inspect.isclass(found) else type(found)).__mro__]
        )
    for owner in owners:
        if (member or name) in vars(owner):
            monkeypatch.delattr(owner, member or name)


def imported_again() -> tuple[dict[str, Any], list[str]]:
    """What an import of the module finds, and its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        return runpy.run_path(private.__file__), [str(each.message) for each in caught]


def test_nothing_is_missing_today():
    found, messages = imported_again()
    assert (found["MISSING"], messages, private.MISSING) == ({}, [], {})
    assert {gain for gain, *_ in NAMES} == set(private.WITHOUT)
    assert len(NAMES) > 30


@pytest.mark.parametrize(("gain", "module", "name", "member"), NAMES)
def test_a_name_that_is_missing_costs_its_gain_and_is_said_once(monkeypatch, gain, module, name, member):
    take_away(monkeypatch, module, name, member)
    found, messages = imported_again()
    assert gain in found["MISSING"]
    assert all((member or name) in said for said in found["MISSING"].values())
    assert len(messages) == len(found["MISSING"])
    assert all("Answers stay" in said for said in messages)


def test_a_module_that_is_missing_costs_the_gain(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba.core.runtime.nrt", None)
    found, (message,) = imported_again()
    assert set(found["MISSING"]) == {private.CACHE}
    assert "numba.core.runtime.nrt" in message


KERNEL = """
import numpy as np

from kin.kernels.compile import MODEL, direct, jit

@jit
def scaled(values, factor):
    total = 0.0
    for i in range(values.shape[0]):
        total += factor * values[i]
    return total

@jit
def both(model, values, out):
    out[0] = scaled(values, 2.0) + scaled(model, 3.0)
    return values.size
"""

PROGRAM = """
import json, sys, types, warnings
kin = sys.modules["kin"] = types.ModuleType("kin")  # without its other modules, whose kernels are not needed here
kin.__path__ = sys.argv[1:]
import numba.core.codegen, numba.extending
del numba.core.codegen.JITCodeLibrary, numba.extending.lower_cast
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    import numpy as np
    import kernel
    from kin.kernels.arguments import READABLE
    from kin.kernels.cache import is_cached
    model, out = np.array([1.0, 2.0]), np.zeros(1)
    model.flags.writeable = False
    call = kernel.direct(kernel.both, kernel.MODEL, (3,), 1)
    size = call(model, np.arange(3.0), out)
    refused = 0
    for wrong in (np.arange(4.0), [0.0, 1.0, 2.0]):
        try:
            call(model, wrong, out)
        except TypeError:
            refused += 1
hits = sum(kernel.both.stats.cache_hits.values())
warned = [str(each.message) for each in caught]
print(json.dumps([size, out[0], refused, hits, READABLE, is_cached(kernel.both), warned]))
"""


def test_kernels_work_without_any_gain(tmp_path):
    """The second process has them from numba's own cache."""
    (tmp_path / "kernel.py").write_text(KERNEL)
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    environment |= {"PYTHONPATH": str(tmp_path), "KINBOARD_CACHE": str(tmp_path / "cache")}
    for hits in (0, 1):
        command = [sys.executable, "-c", PROGRAM, str(CORE)]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300, check=True)
        *answers, warned = json.loads(done.stdout)
        assert answers == [3, 15.0, 2, hits, False, True]
        assert len(warned) == len(private.WITHOUT)
        for name in ("JITCodeLibrary", "lower_cast"):
            assert name in "".join(warned)
    assert list((tmp_path / "cache" / "kernels").glob("*/*/kernel.both*.nbc"))
    assert not list((tmp_path / "__pycache__").glob("*.nb?")), "not beside the source"


def test_only_this_module_knows_private_names():
    for file in CORE.rglob("*.py"):
        imported = re.findall(r"^\s*(?:from|import) (numba[\w.]*)", file.read_text("utf-8"), re.MULTILINE)
        assert set(imported) <= PUBLIC, file
