"""An extension that compares indices with lengths: what it finds, and that it computes the same."""

from __future__ import annotations

import inspect
import subprocess

import fuzz
import numpy as np
import pytest
import small

from kin.codegen.extension import build, wrappers
from kin.codegen.extension.wanted import DEMAND
from kin.codegen.source import plain
from kin.codegen.types import FLOAT, INT, ArrayOf
from kin.codegen.units import Entry, entry_of, units
from kin.ik import candidates
from kin.kernels import ahead
from kin.motion.geometry import splines, tables
from kin.solvers.general6 import batch
from kin.workspace.search import cells

F1, F2 = ArrayOf(FLOAT, 1), ArrayOf(FLOAT, 2)


def reads(a, k):
    return a[k]  # here


def reads_from_the_end(a, k):
    return a[-1 - k]  # a constant


def writes(a, k):
    total = 0.0
    if k > 0:
        total = 1.0
    elif a[k, 0] == 0.0 and a[k + 1, 1] > 1.0:  # here
        total = 2.0
    a[0, k] = total


def shows(a, k):
    row = a[k]  # here
    return row[0]


def cuts(a, k):
    part = a[1:k]
    return part[2]  # here


def folds(a, k):
    table = a.reshape(2, k)  # here
    return table[0, 0]


def adds(a, b):
    a[:] = b + 1.0  # here


def names(a, k):
    pair = (a[0], a[1])
    return pair[k]  # here


OVERRUNS = [
    (reads, (F1, INT), (np.zeros(3), 3), "3 of 3"),
    (reads, (F1, INT), (np.zeros(3), -4), "-1 of 3"),
    (reads, (F1, INT), (np.zeros(0), 0), "0 of 0"),
    (writes, (F2, INT), (np.zeros((1, 2)), 0), "1 of 1"),
    (shows, (F2, INT), (np.zeros((2, 1)), 2), "2 of 2"),
    (shows, (F2, INT), (np.zeros((2, 0)), 1), "0 of 0"),
    (cuts, (F1, INT), (np.zeros(9), 3), "2 of 2"),
    (cuts, (F1, INT), (np.zeros(3), 9), "2 of 2"),
    (folds, (F1, INT), (np.zeros(5), 3), "6 of 5"),
    (adds, (F1, F1), (np.zeros(3), np.zeros(2)), "2 of 2"),
    (names, (F1, INT), (np.zeros(3), 2), "2 of 2"),
]
for _kernel, *_ in OVERRUNS:
    _kernel.__module__ = "kin.overruns"
KINDS = {kernel: Entry(kernel, kinds) for kernel, kinds, *_ in OVERRUNS}


def loaded(folder, entries):
    """An extension that looks at indices."""
    (folder / "all.c").write_text(wrappers.unit("some", entries, checked=True))
    (folder / "module.c").write_text(build.module_of(["some"]))
    flags = ("-std=c11", "-O0", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function")
    subprocess.run(["gcc", *flags, "all.c", "module.c", "-o", "_kernels.so", "-lm"], cwd=folder, check=True)
    return ahead.loaded(folder / "_kernels.so")


@pytest.fixture(scope="module")
def module(tmp_path_factory):
    return loaded(tmp_path_factory.mktemp("checked"), KINDS.values())


@pytest.mark.parametrize(("kernel", "kinds", "arguments", "index"), OVERRUNS)
def test_an_index_outside_its_axis_is_an_error_that_names_the_line(module, kernel, kinds, arguments, index):
    text, first = inspect.getsourcelines(kernel)
    line = first + next(k for k, each in enumerate(text) if "# here" in each)
    if kernel is shows and index == "0 of 0":
        line += 1
    place = list(KINDS).index(kernel)
    with pytest.raises(
        IndexError, match=f"^kin.overruns.{kernel.__name__}: kin/overruns.py, line {line}: index {index}$"
    ):
        module.entry(place)(*arguments)


def test_indices_inside_are_no_error(module):
    values = np.arange(6.0)
    for kernel, arguments, found in (
        (reads, (values, -1), 5.0),
        (shows, (values.reshape(3, 2), 2), 4.0),
        (cuts, (values, 4), 3.0),
        (folds, (values, 3), 0.0),
        (names, (values, -1), 1.0),
    ):
        assert module.entry(list(KINDS).index(kernel))(*arguments) == found


def test_all_that_fits_what_small_kernels_want_is_inside(tmp_path):
    assert fuzz.refused(loaded(tmp_path, small.ENTRIES), fuzz.wanted_of(small.ENTRIES)) > 500


def test_each_array_has_a_length_for_each_axis():
    looked_at = {
        "kin.kernels.fk.all_finite",
        "kin.ik.candidates.accept",
    }  # by the kernel, or arrays that it leaves
    for line in (each for lines in units().values() for each in lines):
        entry = entry_of(line)
        demands = [DEMAND.fullmatch(each)[1] for each in entry.wanted]
        axes = [0 if each is None else each.count(",") + 1 for each in demands]
        kinds = list(_flat(entry.kinds))
        assert len(axes) == len(kinds), line
        expected = [kind.ndim if isinstance(kind, ArrayOf) else own for kind, own in zip(kinds, axes, strict=True)]
        assert axes == expected or line.split()[0] in looked_at, line


def _flat(kinds):
    for kind in kinds:
        yield from _flat(kind.items) if hasattr(kind, "items") else (kind,)


CORNERS, SPLINES = np.zeros((1, 30)), np.zeros((1, 30))
CORNERS[0, :4], SPLINES[0, :4] = (tables.CORNER, 1.0, 7.0, -7.0), (tables.THROUGH, 1.0, 7.0, 9.0)
FAR = [
    (splines._part, (np.arange(3.0), np.zeros((2, 1, 4)), np.array([5, 5]), np.zeros(4), np.zeros((3, 1, 4)))),
    (batch.loop_of, (np.full(117, 9.0), np.eye(4), np.zeros((6, 3, 4)))),
    (
        cells._first_in_each,
        (np.full((1, 3), -5.0), cells._Grid(np.zeros(3), np.ones(3), (2, 2, 2)), np.zeros((2, 2, 2, 1), int)),
    ),
    (
        candidates.ranges,
        (np.array([[0, 0, 1], [0, 2, 3]]), np.array([0, 0]), np.array([True]), False, np.empty((3, 3))),
    ),
    *(
        (tables.poses_into, ((rows, *spline), np.zeros(1, int), *np.zeros((3, 1)), np.zeros((1, 4, 4))))
        for rows in (CORNERS, SPLINES)
        for spline in ((np.zeros(0), np.zeros((0, 7, 4))), (np.zeros(2), np.ones((2, 7, 4))))
    ),
]


@pytest.mark.parametrize(("kernel", "arguments"), FAR)
def test_what_a_kernel_finds_in_an_array_is_no_index_outside(kernel, arguments):
    """Where entries cannot say which values there are: as Python runs it, an index outside is an error."""
    plain(kernel)(*arguments)
