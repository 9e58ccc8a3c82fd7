"""Each file of ``tests/data`` has its source and its licence: in the table of its README, and in the file."""

from __future__ import annotations

import json
from fnmatch import fnmatch
from pathlib import Path

import pytest

DATA = Path(__file__).parent / "data"
# Licences under which numbers may stand in a project under the MIT licence.
LICENCES = {"MIT", "BSD-2-Clause", "BSD-3-Clause", "Apache-2.0"}
# Of these nothing but the numbers of a table was taken: facts, which no licence covers.
NUMBERS_ONLY = {"LGPL-3.0-or-later", "none stated"}
OWN = {"ours", "`licence` in each file"}


def rows() -> dict[str, tuple[str, str]]:
    """Patterns of files, with their source and licence."""
    lines = (DATA / "README.md").read_text(encoding="utf-8").splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| `")]
    return {pattern.strip("`"): (source, licence) for pattern, _, source, licence in cells}


FILES = sorted(
    path.relative_to(DATA).as_posix()
    for path in DATA.rglob("*")
    if path.is_file() and "__pycache__" not in path.parts
)


@pytest.mark.parametrize("file", FILES)
def test_a_file_stands_in_one_row_of_the_table(file):
    (found,) = [pattern for pattern in rows() if fnmatch(file, pattern)]
    source, licence = rows()[found]
    assert licence in LICENCES | NUMBERS_ONLY | OWN
    assert source or licence == "ours"
    if licence in NUMBERS_ONLY:
        assert file.startswith("tables/")


def test_no_row_is_left_of_a_file_that_is_gone():
    for pattern in rows():
        assert any(fnmatch(file, pattern) for file in FILES), pattern


@pytest.mark.parametrize("path", sorted((DATA / "library").glob("*.json")), ids=lambda path: path.stem)
def test_a_description_of_the_library_names_its_licence(path):
    about = json.loads(path.read_text(encoding="utf-8"))
    assert about["licence"] in LICENCES
    assert about["source"]


@pytest.mark.parametrize("path", sorted((DATA / "urdf").glob("*.urdf")), ids=lambda path: path.stem)
def test_a_urdf_names_the_licence_of_the_table(path):
    _, licence = rows()[f"urdf/{path.name}"]
    assert licence in path.read_text(encoding="utf-8").splitlines()[1]
