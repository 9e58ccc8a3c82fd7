"""Which Python `scripts/venv.sh` takes among those of a machine, and what it says if there is none."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from versions import needs_ompl

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CLASSIFIERS = [each.rpartition(" ")[2] for each in PROJECT["classifiers"] if " Python :: 3." in each]


def find_python(folder: Path, versions: dict[str, str], named: str = "") -> subprocess.CompletedProcess[str]:
    """What `find_python` does where only these programs are, such as ``{"python3": "3.12"}``.

    A minus behind the version: it lacks the module venv.
    """
    for name, version in versions.items():
        major, minor = version.removesuffix("-").split(".")
        lines = [f"import sys; sys.version_info = ({major}, {minor}, 0, 'final', 0)"]
        if version.endswith("-"):
            lines.append("sys.modules['venv'] = None")
        lines.append("del sys.argv[:1]; exec(sys.argv[0])")
        program = folder / name
        code = shlex.quote("\n".join(lines))
        program.write_text(f'#!/bin/sh\nshift\nexec {sys.executable} -SEc {code} "$@"\n')
        program.chmod(0o755)
    script = f"root={folder}; . {ROOT}/scripts/venv.sh; find_python"
    variables = {"PATH": str(folder), "PYTHON": named}
    return subprocess.run(["/bin/sh", "-euc", script], env=variables, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize(
    ("versions", "expected"),
    [
        ({"python3": "3.11", "python3.12": "3.12", "python3.14": "3.14"}, "python3.14"),
        ({"python3": "3.15", "python3.15": "3.15", "python3.13": "3.13"}, "python3.13"),
        ({"python3.14": "3.14-", "python3.12": "3.12"}, "python3.12"),
        ({"python3.14": "3.14-", "python3": "3.14-"}, "python3.14"),
        ({"python3": "2.7", "python": "3.11"}, "python"),
    ],
)
def test_the_newest_that_works_is_taken(tmp_path: Path, versions: dict[str, str], expected: str) -> None:
    found = find_python(tmp_path, versions)
    assert (found.stdout, found.stderr, found.returncode) == (f"{expected}\n", "", 0)


def test_where_none_works_the_message_names_those_that_do_not(tmp_path: Path) -> None:
    found = find_python(tmp_path, {"python3": "3.15", "python": "3.10"})
    assert (found.stdout, found.returncode) == ("", 1)
    assert "needs Python 3.11 to 3.14 and found none (python3 is 3.15, python is 3.10)." in found.stderr
    assert "PYTHON=" in found.stderr


def test_one_that_is_named_is_taken_even_if_it_is_newer_and_refused_if_it_is_too_old(tmp_path: Path) -> None:
    assert find_python(tmp_path, {"new": "3.15", "python3.13": "3.13"}, named="new").stdout == "new\n"
    found = find_python(tmp_path, {"old": "3.10", "python3.13": "3.13"}, named="old")
    assert (found.stdout, found.returncode) == ("", 1)
    assert "PYTHON=old is no Python 3.11 or newer" in found.stderr


def test_all_that_names_versions_names_the_same_ones() -> None:
    oldest, newest = CLASSIFIERS[0], CLASSIFIERS[-1]
    assert PROJECT["requires-python"] == f">={oldest}"
    script = (ROOT / "scripts" / "venv.sh").read_text(encoding="utf-8")
    tried = re.search(r"for candidate in (.*);", script).group(1)
    assert re.findall(r"python(3\.\d+)", tried) == CLASSIFIERS[::-1]
    for name in ("README.md", "docs/index.md", "docs/running.md", "scripts/venv.sh"):
        text = (ROOT / name).read_text(encoding="utf-8")
        assert set(re.findall(r"Python (3\.\d+ to 3\.\d+)", text)) == {f"{oldest} to {newest}"}, name


def test_extras_without_wheels_are_left_out_where_the_tests_leave_them_out() -> None:
    (ompl,) = map(Requirement, PROJECT["optional-dependencies"]["ways"])
    wanted = [version for version in CLASSIFIERS if ompl.marker.evaluate({"python_version": version})]
    assert wanted == [version for version in CLASSIFIERS if version != "3.14"]
    here = ".".join(map(str, sys.version_info[:2]))
    assert needs_ompl.args[0] == (here not in wanted)
