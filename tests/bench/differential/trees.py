"""Source trees: folders, and commits, whose core is unpacked into a cache folder where kernels stay compiled."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

BENCH = Path(__file__).parents[1]
ROOT = BENCH.parents[1]


def tree_of(name: str) -> Path:
    """The folder of a source tree, which is a folder that contains `kin`, or a commit of this repository."""
    if (Path(name) / "kin" / "__init__.py").is_file():
        return Path(name).resolve()
    found = _git("rev-parse", "--verify", "--quiet", f"{name}^{{commit}}")
    if found.returncode:
        raise ValueError(f"{name!r} is neither a folder that contains kin/ nor a commit")
    commit = found.stdout.decode().strip()
    folder = _cache() / commit
    if not folder.is_dir():
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as part:
            archive = _git("archive", commit, "kin", "pyproject.toml", check=True).stdout
            with tarfile.open(fileobj=io.BytesIO(archive)) as files:
                files.extractall(part, filter="data")
            # `kin` appears with all its files: another run may look for it.
            folder.mkdir()
            (Path(part) / "pyproject.toml").rename(folder / "pyproject.toml")  # a checkout compiles its kernels
            (Path(part) / "kin").rename(folder / "kin")
    return folder


def start(tree: Path, *arguments: str) -> subprocess.Popen[bytes]:
    """A process with the core of `tree` and the questions of this checkout."""
    path = os.pathsep.join(map(str, (tree, ROOT / "tests", BENCH)))
    code = "import sys; from differential.child import main; sys.exit(main(*sys.argv[1:]))"
    # -P: Python would look for `kin` in the present folder first.
    return subprocess.Popen(
        [sys.executable, "-P", "-c", code, str(tree), *arguments], env={**os.environ, "PYTHONPATH": path}
    )


def _cache() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "kinboard" / "differential"


def _git(*arguments: str, check: bool = False) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, check=check)
