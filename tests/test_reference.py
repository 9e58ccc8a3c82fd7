"""The reference of `kin`: every public function says what it takes and gives, and has an example that runs."""

from __future__ import annotations

import doctest
import inspect
import operator
import re
import subprocess
import sys
from pathlib import Path

import griffe
import pytest

import app
import kin
from scripts.reference import OneByOne, one_by_one
from scripts.surface import public

ROOT = Path(__file__).parents[1]
PUBLIC = public()
FUNCTIONS = sorted(name for name, value in PUBLIC.items() if inspect.isfunction(inspect.unwrap(value)))
METHODS = {
    f"{name}.{method}": value
    for name, cls in PUBLIC.items()
    if inspect.isclass(cls) and not issubclass(cls, Exception)
    for method, value in vars(cls).items()
    if not method.startswith("_") and (inspect.isfunction(value) or isinstance(value, classmethod))
    if value.__module__.startswith("kin.")
}
# What has no example that can run here: a notebook.
NO_EXAMPLE = {"connect", "save_page", "show"}
# Nothing that they may be given is refused.
NEVER_RAISES = {
    "builtin_robots",
    "files.classic_robots",
    "workspace.capability_join",
    "wxyz_from_rotation",
}
# Numbers of a parameter with this annotation have units.
NUMBERS = re.compile(r"\b(float|ArrayLike|Array|Limits|Locks|Values|MotionLimits)\b")
UNITS = re.compile(
    r"\b(radians?|metres?|m|mm|m/s|seconds?|kg|samples|quaternion|unit|orthonormal|scalar|share|from 0)\b"
    r"|``\([^`]*4, 4\)``|0 to 1"
)


@pytest.fixture(scope="module")
def read() -> griffe.Module:
    """The core as the site's reference reads it."""
    return griffe.load(
        "kin",
        search_paths=[ROOT],
        extensions=griffe.load_extensions(OneByOne()),
        docstring_parser="google",
        resolve_aliases=True,
    )


@pytest.mark.parametrize("name", [*FUNCTIONS, *METHODS])
def test_every_function_and_method_is_described(read, name):
    function = read["fk.fk" if name == "fk" else name]  # the module `kin.fk` has the name of its function
    function = function.final_target if function.is_alias else function
    sections = {section.kind.value: section.value for section in function.docstring.parsed}
    assert sections["text"].strip()
    wanted = {each.name: each for each in function.parameters if each.name not in ("self", "cls")}
    described = {each.name: each.description for each in sections.get("parameters", ())}
    assert sorted(described) == sorted(wanted)
    for parameter, description in described.items():
        assert description.strip()
        if NUMBERS.search(str(wanted[parameter].annotation)):
            assert UNITS.search(f"{parameter}: {description}"), f"no unit: {parameter}: {description}"
    assert str(function.returns) in ("None", "Any") or "returns" in sections
    assert "raises" in sections or name in NEVER_RAISES or name in METHODS
    assert ("examples" in sections) != (name in NO_EXAMPLE)


@pytest.mark.parametrize("name", [name for name in [*FUNCTIONS, *METHODS] if name not in NO_EXAMPLE])
def test_examples_run_and_give_what_is_shown(name):
    described = operator.attrgetter(name)(kin)
    (test,) = doctest.DocTestFinder(recurse=False).find(inspect.unwrap(described), name)
    assert test.examples
    output: list[str] = []
    result = doctest.DocTestRunner().run(test, out=output.append)
    assert result.failed == 0, "".join(output)


@pytest.mark.parametrize("package", [kin, app])
def test_a_name_that_is_not_there_gives_the_error_of_python(package):
    with pytest.raises(AttributeError, match="has no attribute 'section'"):
        _ = package.section


def test_options_of_a_call_have_the_texts_of_the_class(read):
    described = {
        each.name: each.description
        for each in read["workspace.workspace_facts"].final_target.docstring.parsed[1].value
    }
    assert described["locked"].startswith("joint values to keep, in radians (metres)")


def test_several_parameters_of_one_entry_become_one_entry_each():
    entries = "    a, b: numbers\n        that are added.\n    c: another.\n"
    text = f"Title.\n\nArgs:\n{entries}\nRaises:\n    InputError: never."
    assert one_by_one(text) == (
        "Title.\n\nArgs:\n    a: numbers that are added.\n    b: numbers that are added.\n    c: another.\n\n"
        "Raises:\n    InputError: never."
    )


@pytest.mark.full
def test_a_warning_of_mkdocs_fails_the_build(tmp_path):
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/index.md").write_text("# Start\n\n[nowhere](gone.md)\n", encoding="utf-8")
    (tmp_path / "mkdocs.yml").write_text("site_name: Broken\nstrict: true\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert re.search("WARNING.*gone.md", done.stdout + done.stderr)
