"""Machine code from the cache: what loading leaves out, and that callers can be compiled all the same."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import kin

KERNELS = '''
import numpy as np

from kin.kernels.compile import jit

@jit
def inner(rows):
    """It allocates, calls kernels of numba itself, and raises an error with a constant."""
    if rows.shape[0] > 3:
        raise ValueError("more than three")
    out = np.zeros(rows.shape[0])
    for i in range(rows.shape[0]):
        out[i] = np.sum(rows[i]) + np.max(rows[i])
    return np.sort(out)

@jit
def outer(rows):
    return inner(rows)[::-1].copy()
'''

PROGRAM = """
import json, sys
import numpy as np
import kernels

def run(kernel):
    rows = np.array([[1.0, 2.0], [4.0, 1.0], [0.5, 0.5]])
    try:
        kernel(np.zeros((4, 2)))
        error = None
    except ValueError as raised:
        error = str(raised)
    return [kernel(rows).tolist(), error, sum(kernel.stats.cache_hits.values())]

inner = run(kernels.inner)
prepared = [name for name in ("numba.np.arraymath", "numba.cpython.unicode") if name in sys.modules]
print(json.dumps({"inner": inner, "prepared": prepared, "outer": run(kernels.outer)}))
"""
ROWS, ERROR = [1.5, 5.0, 9.0], "more than three"


def run(folder: Path) -> dict[str, object]:
    (folder / "kernels.py").write_text(KERNELS)
    path = f"{Path(kin.__file__).parents[1]}{os.pathsep}{folder}"
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    environment |= {"PYTHONPATH": path, "KINBOARD_CACHE": str(folder / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True, timeout=240, env=environment
    )
    answer: dict[str, object] = json.loads(done.stdout)
    return answer


@pytest.mark.full
def test_loaded_machine_code_works_without_the_compiler_and_callers_can_be_compiled(tmp_path: Path) -> None:
    first = run(tmp_path)
    assert (first["inner"], first["outer"]) == ([ROWS, ERROR, 0], [ROWS[::-1], ERROR, 0])
    assert first["prepared"], "names of modules have changed: the next assertion would say nothing"

    for file in (tmp_path / "cache" / "kernels").glob("kernels.outer-*"):
        file.unlink()
    second = run(tmp_path)
    assert (second["inner"], second["prepared"]) == ([ROWS, ERROR, 1], [])
    assert second["outer"] == [ROWS[::-1], ERROR, 0], "compiled from the bitcode of `inner`"

    third = run(tmp_path)
    assert (third["inner"], third["outer"], third["prepared"]) == ([ROWS, ERROR, 1], [ROWS[::-1], ERROR, 1], [])
