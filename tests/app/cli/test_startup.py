"""What makes a start fast."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from app.cli.startup import hidden


def test_a_hidden_package_cannot_be_imported_and_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "this", raising=False)
    with hidden("this"), pytest.raises(ImportError):
        importlib.import_module("this")
    assert "this" not in sys.modules


def test_a_package_that_has_been_imported_stays() -> None:
    with hidden("json"):
        assert importlib.import_module("json") is sys.modules["json"] is not None


def test_the_first_arm_moves_without_scipy_and_trimesh() -> None:
    """Their imports would take a quarter of the time until a service is ready."""
    program = (
        "import sys; from app.cli.startup import hidden\n"
        "with hidden('scipy'):\n    import numba.np.arraymath\n"
        "import app.viewer.server; from kin.warmup import warm_up_first; warm_up_first()\n"
        "print(sorted({'scipy', 'trimesh'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
