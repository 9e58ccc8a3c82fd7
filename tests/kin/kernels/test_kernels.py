"""The disk cache of compiled kernels, and when its entries become invalid."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

import kin


@pytest.mark.full
def test_kernels_are_compiled_again_when_a_kernel_they_call_has_changed(tmp_path):
    """The cache of numba alone depends on the kernel's own file only."""
    package = tmp_path / "kin"
    shutil.copytree(Path(kin.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    program = (
        "import numpy as np; from kin.ik.candidates import select; from kin.kernels.cache import is_cached; "
        "before = is_cached(select); "
        "rows, count = select(np.array([[0.0], [1e-3]]), np.array([1.0, 2.0])); "
        "print(count, sum(select.stats.cache_hits.values()), before, is_cached(select))"
    )

    def run() -> str:
        return subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()

    assert run() == "2 0 False True"
    assert run() == "2 1 True True", "kept"
    angles = package / "angles.py"
    angles.write_text(angles.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    assert run() == "2 0 False True", "compiled anew"
    for file in (tmp_path / "cache").rglob("*.nbc"):
        data = file.read_bytes()
        assert len(data) < 0.6 * len(zlib.decompress(data[:-4])), "compressed"
        file.write_bytes(file.read_bytes()[:-1])
    assert run() == "2 0 False True", "damaged"
