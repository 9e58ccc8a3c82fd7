"""What the translator refuses, and that what it accepts means the same in Python, C and JavaScript."""

from __future__ import annotations

import ast
import subprocess
from pathlib import Path

import numpy as np
import pytest
from constructs import REFUSED, RIGHT, RIGHT_IN_C, fresh
from playwright._impl._driver import compute_driver_executable

import kin
from kin.codegen import c, js
from kin.codegen.rooms import Rooms
from kin.codegen.source import OutsideSubsetError
from kin.codegen.types import FLOAT, ArrayOf
from kin.codegen.typing import Program

KINDS = FLOAT, FLOAT, ArrayOf(FLOAT, 1)
ARGUMENTS = ((3.0, 2.0), (-2.75, 7.75), (0.0, -1.0), (4.5, 0.5))
FIRST = (1.0, 2.0, 3.0, 4.0)


@pytest.mark.parametrize("kernel", REFUSED, ids=lambda kernel: kernel.__name__)
def test_a_construct_outside_the_subset_is_refused_with_its_place_and_what_to_write(kernel):
    with pytest.raises(OutsideSubsetError) as refused:
        Program().add(kernel, *KINDS)
    place, _, rest = str(refused.value).partition(": ")
    what, _, instead = rest.rpartition("; ")
    file, _, line = place.rpartition(":")
    assert file == "constructs.py"
    assert int(line) >= 1
    assert REFUSED[kernel] in what
    assert len(instead.split()) >= 2


def test_an_array_whose_size_does_not_follow_is_refused():
    program = Program()
    made = program.add(fresh, ArrayOf(FLOAT, 1))
    with pytest.raises(OutsideSubsetError, match="size does not follow"):
        Rooms({}).enter(made, ((None,),))


def reference(call):
    with np.errstate(over="ignore"):  # of words
        return [float(call(x, y, np.array(FIRST))) for x, y in ARGUMENTS]


def translated(kernels, heap=False):
    program, rooms = Program(), Rooms({}, heap)
    made = [program.add(kernel, *KINDS) for kernel in kernels]
    for each in made:
        rooms.enter(each, (None, None, (None if heap else 4,)))
    return program, rooms, made


def same_bits(kernels, text):
    """Lines of numbers, one per kernel, as Python reads them."""
    found = [[float(word) for word in line.split()] for line in text.splitlines()]
    assert len(found) == len(kernels)
    wrong = {
        kernel.__name__: (values, expected)
        for kernel, values in zip(kernels, found, strict=True)
        if not np.array_equal(values, expected := reference(kernel), equal_nan=True)
    }
    assert not wrong


@pytest.mark.parametrize("heap", [False, True])
def test_what_is_accepted_means_the_same_in_c(heap, tmp_path):
    kernels = RIGHT + RIGHT_IN_C
    program, rooms, made = translated(kernels, heap)
    calls = "\n".join(
        f"for (int i = 0; i < 4; i++) {{ double a[4] = {{1, 2, 3, 4}}; "
        f'printf("%.17g ", (double){each.name}(x[i], y[i], f1_of(a, 4))); }} printf("\\n");'
        for each in made
    )
    x, y = (", ".join(map(str, column)) for column in zip(*ARGUMENTS, strict=True))
    main = f"int main(void) {{ const double x[4] = {{{x}}}, y[4] = {{{y}}}; {calls} return 0; }}"
    file, program_file = tmp_path / "all.c", tmp_path / "all"
    file.write_text(f"{c.unit(program, rooms)}\n#include <stdio.h>\n{main}\n")
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-Wno-unused-function"]
    subprocess.run(
        ["gcc", "-std=c99", "-O1", "-ffp-contract=off", *strict, file, "-o", program_file, "-lm"], check=True
    )
    same_bits(kernels, subprocess.run([program_file], check=True, capture_output=True, text=True).stdout)


def test_what_is_accepted_means_the_same_in_javascript(tmp_path):
    program, _, made = translated(RIGHT)
    names = ", ".join(each.name for each in made)
    x, y = (list(column) for column in zip(*ARGUMENTS, strict=True))
    run = (
        f"for (const call of [{names}]) console.log({x}.map((x, i) => "
        f"Number(call(x, {y}[i], new A1(constant({list(FIRST)}), 4)))).join(' ').replaceAll('Infinity', 'inf'));"
    )
    file = tmp_path / "all.js"
    file.write_text(f'"use strict";\n{js.unit(program)}\n{run}\n')
    node = compute_driver_executable()[0]
    same_bits(RIGHT, subprocess.run([node, file], check=True, capture_output=True, text=True).stdout)


@pytest.mark.parametrize("kernel", RIGHT_IN_C)
def test_what_javascript_does_not_have_is_refused(kernel):
    program, _, _ = translated([kernel])
    with pytest.raises(OutsideSubsetError, match="JavaScript does not have"):
        js.unit(program)


def test_no_module_loads_the_translator_before_it_is_called():
    root = Path(kin.__file__).parents[1]
    importing = [
        path
        for folder in ("kin", "app")
        for path in (root / folder).rglob("*.py")
        if "codegen" not in path.parts and "kin.codegen" in (text := path.read_text(encoding="utf-8"))
        for node in ast.parse(text).body
        if isinstance(node, ast.Import | ast.ImportFrom) and "kin.codegen" in ast.unparse(node)
    ]
    assert importing == []
    assert "from kin.codegen.files import generate" in (root / "kin/__init__.py").read_text(encoding="utf-8")
