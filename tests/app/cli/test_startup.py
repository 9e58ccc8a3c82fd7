"""What makes a start fast."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from app.cli.startup import hidden
from kin.warmup import warm_up_first


def test_a_hidden_package_cannot_be_imported_and_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "this", raising=False)
    with hidden("this"), pytest.raises(ImportError):
        importlib.import_module("this")
    assert "this" not in sys.modules


def test_a_package_that_has_been_imported_stays() -> None:
    with hidden("json"):
        assert importlib.import_module("json") is sys.modules["json"] is not None


@pytest.mark.full
def test_a_service_moves_its_first_arm_without_what_it_does_not_need() -> None:
    """These imports would take a third of the time until a service is ready."""
    warm_up_first()  # what is not in the cache yet is compiled here
    unneeded = {
        "scipy",
        "trimesh",
        "cffi",
        "numba.np.arraymath",
        "numba.cpython.unicode",
        "numba.typed.typedlist",
        "mcp",
    }
    program = (
        "import sys; from app.cli.serve import import_service; import_service()\n"
        "import app.viewer.server; from kin.warmup import warm_up_first; warm_up_first()\n"
        f"print(sorted({unneeded} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
