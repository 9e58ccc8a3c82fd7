"""What a compiled kernel depends on: its file, and what that imports of the core."""

from __future__ import annotations

import pytest

from kin.codegen import fingerprint as sources

FILES = {
    "kin/kernel.py": "from kin.solver import solve\nfrom kin import constants\n",
    "kin/solver/__init__.py": "from kin.solver.steps import (\n    solve as solve,\n)\n",
    "kin/solver/steps.py": "from kin.kernel import nothing  # a circle\n",
    "kin/constants.py": "LIMIT = 1.0\nif True:\n    from kin.chosen import (\n        x,\n    )\n",
    "kin/chosen.py": "x = 1\n",
    "kin/other.py": "from kin.kernel import solve\n",
}
KERNEL = "kin/kernel.py"


def forget() -> None:
    for found in (sources.fingerprint, sources._read, sources.file_of):
        found.cache_clear()


@pytest.fixture
def changed(tmp_path, monkeypatch):
    """A function that writes `FILES` with one changed, and returns the fingerprint of the kernel's file."""
    monkeypatch.setattr(sources, "_ROOT", str(tmp_path))

    def fingerprint(changed: str | None = None) -> str:
        for name, text in FILES.items():
            file = tmp_path / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text + "# changed\n" * (name == changed))
        forget()
        return sources.fingerprint(str(tmp_path / KERNEL))

    yield fingerprint
    forget()


@pytest.mark.parametrize(
    "name",
    [KERNEL, "kin/solver/__init__.py", "kin/solver/steps.py", "kin/constants.py", "kin/chosen.py"],
)
def test_a_change_of_what_is_imported_recompiles_the_kernel(changed, name):
    assert changed() != changed(name)


def test_another_change_does_not(changed):
    assert changed() == changed("kin/other.py")
