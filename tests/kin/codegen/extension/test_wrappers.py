"""What the extension's functions take and refuse, and what they return: small kernels, compiled here."""

from __future__ import annotations

import gc
import re
import subprocess
import sys
import threading

import fuzz
import numpy as np
import pytest
import small

from kin.codegen.extension import build, wrappers
from kin.kernels import ahead

# The fused operation is that of the library where the processor has none.
FLAGS = ("-std=c11", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-DFP_FAST_FMA")


def compiled(folder, checked=False):
    """The extension of the small kernels."""
    folder.mkdir()
    source, file = folder / "all.c", folder / "_kernels.so"
    source.write_text(wrappers.unit("small", small.ENTRIES, checked))
    (folder / "module.c").write_text(build.module_of(["small"]))
    command = ["gcc", "-O0", *FLAGS, str(source), str(folder / "module.c"), "-o", str(file), "-lm"]
    subprocess.run(command, check=True)
    return file


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return compiled(tmp_path_factory.mktemp("extension") / "made")


@pytest.fixture(scope="module", params=[True, False], ids=["fields of arrays", "buffers"])
def module(request, file, tmp_path_factory):
    """Each is a module of its own: a file that is loaded twice is loaded once."""
    copy = tmp_path_factory.mktemp("copy") / "_kernels.so"
    copy.write_bytes(file.read_bytes())
    return ahead.loaded(copy, readable=request.param)


def call(module, kernel):
    index = [name for name, *_ in module.entries()].index(f"kin.small.{kernel.__name__}")
    return module.entry(index)


def test_numbers_and_tuples_come_back_as_python_has_them(module):
    found = call(module, small.numbers)(1.5, 2, False, 1j)
    assert found == (3.0, 3, True, -1.0)
    assert [type(each) for each in found] == [float, int, bool, complex]
    assert call(module, small.numbers)(np.float64(1.5), np.int64(2), np.bool_(True), np.complex128(2)) == (
        3.0,
        3,
        False,
        4,
    )
    assert call(module, small.nothing)(1) is None


def test_sines_and_angles_have_the_bits_of_python(module):
    rng = np.random.default_rng(60)
    x = (rng.uniform(-1.0, 1.0, (100, 8)) * 10.0 ** np.arange(-3.0, 5.0)).ravel()
    x = np.concatenate([x, np.arange(-50.0, 50.0) * (np.pi / 2), [0.0, -0.0, 1e-310, np.nan, np.inf, -np.inf]])
    y = rng.permutation(x)
    for kernel, arguments in ((small.sines, (x,)), (small.quarters, (x,)), (small.angles, (y, x))):
        found, wanted = np.empty((2, 3 - len(arguments), len(x)))
        call(module, kernel)(*arguments, *found)
        with np.errstate(invalid="ignore"):
            kernel(*arguments, *wanted)
        assert np.array_equal(found, wanted, equal_nan=True)
        assert np.array_equal(np.signbit(found[found == 0.0]), np.signbit(wanted[wanted == 0.0]))


def test_arrays_of_all_types_are_read_and_written(module):
    a, flags = np.array([3, -4, 5]), np.array([True, False, True])
    words, singles, out = np.full(3, 2**63, np.uint64), np.zeros(3, np.float32), np.zeros(3, int)
    assert call(module, small.counts)(a, flags, words, singles, out) is None
    assert out.tolist() == [3, 0, 5]
    assert words.tolist() == [2**63 + 1, 2**63, 2**63 + 1]
    assert singles.tolist() == [2.0, 0.0, 2.0]


def test_items_of_named_tuples_are_checked_each(module):
    box, notes = small.Box(np.zeros(2), np.ones(2), 0.5), np.zeros(2, bool)
    inside = call(module, small.inside)
    inside(box, np.array([0.0, 2.0]), notes)
    assert notes.tolist() == [True, False]
    for wrong in (list(box), box[:2], (*box, 1.0), box._replace(low=[0.0, 0.0]), box._replace(side="a"), None):
        with pytest.raises(TypeError, match="argument 1"):
            inside(wrong, np.zeros(2), notes)


def test_arrays_that_are_made_belong_to_python(module):
    made = call(module, small.ramp)(3, 0.5)
    assert made.tolist() == [[0.5, 0.0], [0.5, 1.0], [0.5, 2.0]]
    assert made.flags.owndata
    assert call(module, small.ramp)(0, 0.5).shape == (0, 2)
    given = np.arange(3.0)
    other, size = call(module, small.pair)(given)
    assert (other.tolist(), given.tolist(), size) == ([-1.0, 1.0, 2.0], [0.0, 1.0, 2.0], 3)


def test_an_array_that_cannot_be_filled_is_given_up(file, tmp_path):
    copy = tmp_path / "_kernels.so"
    copy.write_bytes(file.read_bytes())
    module, made = ahead.loaded(copy), object()
    types = tuple(map(np.dtype, ahead._DTYPES))
    module.set_up(np.ndarray, np.bool_, lambda shape, dtype: made, types, True)
    before = sys.getrefcount(made)
    with pytest.raises(TypeError):
        call(module, small.ramp)(3, 0.5)
    assert sys.getrefcount(made) == before


@pytest.mark.parametrize("size", [-1, 2**58, 2**60, 2**62 + 1])
def test_an_array_that_does_not_fit_into_memory_is_a_memory_error(module, size):
    with pytest.raises(MemoryError):
        call(module, small.ramp)(size, 0.5)
    assert call(module, small.ramp)(1, 0.5).shape == (1, 2)


def unaligned(values):
    found = np.ndarray(values.shape, np.float64, np.empty(values.nbytes + 1, dtype=np.uint8)[1:])
    found[...] = values
    return found


class Array(np.ndarray):
    """A subclass, which may mean something else by its fields."""


WRONG = {
    "list": np.ndarray.tolist,
    "bytes": bytes,
    "memoryview": memoryview,
    "every second value": lambda x: np.repeat(x, 2)[::2],
    "negative strides": lambda x: x[::-1],
    "other byte order": lambda x: x.astype(">f8"),
    "single": lambda x: x.astype(np.float32),
    "whole numbers": lambda x: x.astype(int),
    "times": lambda x: x.astype("m8[s]"),
    "objects": lambda x: x.astype(object),
    "subclass": lambda x: x.view(Array),
    "unaligned": unaligned,
    "nothing": lambda x: None,
    "no axis": lambda x: np.array(1.0),
    "two axes": lambda x: x[None],
    "empty of another type": lambda x: np.empty(0, np.int8),
}


@pytest.mark.parametrize("form", WRONG)
def test_another_array_never_reaches_the_kernel(module, form):
    scaled, out = call(module, small.scaled), np.zeros(4)
    for arguments in ((WRONG[form](np.arange(4.0)), 2.0, out), (np.arange(4.0), 2.0, WRONG[form](out.copy()))):
        with pytest.raises(
            TypeError,
            match=r"kin.small.scaled: argument [13] is not a C-contiguous .*float64 array of 1 axes: a\[n\] out",
        ):
            scaled(*arguments)
    assert not out.any()


def test_no_wrong_argument_reaches_a_kernel(module):
    assert fuzz.refused(module, fuzz.wanted_of(small.ENTRIES)) > 500


def test_an_array_that_is_only_read_may_be_read_only(module):
    fixed, out = np.arange(3.0), np.zeros(3)
    fixed.flags.writeable = False
    assert call(module, small.scaled)(fixed, 2.0, out) == 3
    assert out.tolist() == [0.0, 2.0, 4.0]
    with pytest.raises(TypeError, match="argument 3 is not a C-contiguous writable"):
        call(module, small.scaled)(out, 2.0, fixed)


def test_there_are_no_other_entries(module):
    with pytest.raises(IndexError, match="no entry 99"):
        module.entry(99)


ARM = np.array([9.0, 9.0, 1.0, 1.0, *np.zeros(31), 0.0, 9.0, 9.0])  # two numbers, and an arm of one joint


def changed(values, place, value):
    found = values.copy()
    found[place] = value
    return found


@pytest.mark.parametrize(
    ("kernel", "arguments", "argument"),
    [
        (small.scaled, (np.zeros(3), 1.0, np.zeros(2)), r"3, out\[n\|n\+1\]"),
        (small.scaled, (np.zeros(3), 1.0, np.zeros(5)), r"3, out\[n\|n\+1\]"),
        (small.last, (np.zeros((2, 0)),), r"1, a\[0<a,0<b\]"),
        (
            small.inside,
            (small.Box(np.zeros(2), np.zeros(3), 1.0), np.zeros(2), np.zeros(2, bool)),
            r"1, box\.high\[n\]",
        ),
        (small.picked, (np.zeros((1, 1)), np.zeros(1, int), 0), "1, table"),
        (small.picked, (np.zeros((1, 2)), np.zeros(1, int), 1), "3, k{:n}"),
        (small.picked, (np.zeros((1, 2)), np.zeros(1, int), -1), "3, k{:n}"),
        (small.picked, (np.zeros((1, 2)), np.array([0, 1]), 0), r"2, which\[n\]{:a}"),
        (small.picked, (np.array([[0.0, 2.0]]), np.zeros(1, int), 0), "1, table"),
        (small.picked, (np.array([[0.0, np.nan]]), np.zeros(1, int), 0), "1, table"),
        (small.folded, (np.zeros(6), 2, np.zeros(2)), "1, a"),
        (small.folded, (np.zeros(0), 0, np.zeros(2)), "2, n"),
        (small.folded, (np.zeros(0), -1, np.zeros(2)), "2, n"),
        (small.turned, (ARM, np.zeros(2)), r"1, model\[2\+arm:n\]"),
        (small.turned, (ARM[:-1], np.zeros(1)), "1, model"),
        (small.turned, (ARM[:3], np.zeros(1)), "1, model"),
        (small.turned, (changed(ARM, 2, 2.0), np.zeros(1)), "1, model"),
        (small.turned, (changed(ARM, 3, 2.0), np.zeros(1)), "1, model"),
        (small.turned, (changed(ARM, 35, 1.0), np.zeros(1)), "1, model"),
        (small.turned, (changed(ARM, 35, np.nan), np.zeros(1)), "1, model"),
    ],
)
def test_lengths_and_indices_that_do_not_fit_are_refused(module, kernel, arguments, argument):
    with pytest.raises(TypeError, match=f"^kin.small.{kernel.__name__}: argument {argument}.*, does not fit: "):
        call(module, kernel)(*arguments)


def test_lengths_that_fit_are_taken(module):
    for out in (np.zeros(3), np.zeros(4)):
        assert call(module, small.scaled)(np.ones(3), 2.0, out) == 3
        assert out[:3].tolist() == [2.0] * 3
    assert call(module, small.picked)(np.array([[5.0, 1.0], [6.0, 1.5]]), np.array([1]), 0) == 1.5
    assert call(module, small.folded)(np.arange(6.0), 3, out := np.zeros(2)) is None
    assert out.tolist() == [2.0, 5.0]
    assert call(module, small.turned)(ARM, np.ones(1)) == 1.0


def test_a_refusal_says_what_is_wanted_and_what_is_given(module):
    box = small.Box(np.zeros(2), np.zeros(3), 1.0)
    wanted = r"box.low[n] box.high[n] q[n] notes[n] is wanted, given is [2] [3] [2] [4]"
    with pytest.raises(TypeError, match=re.escape(wanted)):
        call(module, small.inside)(box, np.zeros(2), np.zeros(4, bool))


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        (1.0,),
        (1.0, 2, False, 1j, 1),
        ("1", 2, False, 1j),
        (1.0, 2.0, False, 1j),
        (1.0, 2, 1, 1j),
        (1.0, 2, False, "j"),
    ],
    ids=str,
)
def test_other_numbers_are_refused(module, arguments):
    with pytest.raises(TypeError):
        call(module, small.numbers)(*arguments)


def test_whole_numbers_have_64_bits(module):
    with pytest.raises(TypeError, match="argument 2 is not an integer of 64 bits"):
        call(module, small.numbers)(1.0, 2**63, False, 1j)


def test_other_threads_go_on_while_a_kernel_computes(module):
    flag, most, found = np.zeros(1), 5 * 10**8, []
    thread = threading.Thread(target=lambda: found.append(call(module, small.wait)(flag, most)))
    thread.start()
    flag[0] = 1.0
    thread.join()
    assert found[0] < most


def test_no_call_keeps_a_reference_or_memory(module):
    a, out, text = np.arange(3.0), np.zeros(3), [0.0]
    everything = (a, out, text, np.ndarray, a.dtype, None)

    def ask(count):
        for _ in range(count):
            scaled = call(module, small.scaled)
            scaled(a, 2.0, out)
            call(module, small.pair)(a)
            with pytest.raises(TypeError):
                scaled(text, 2.0, out)

    def held():
        gc.collect()
        return [sys.getallocatedblocks(), *map(sys.getrefcount, everything)]

    ask(10)
    before = held()
    ask(1000)
    assert all(abs(x - y) < 200 for x, y in zip(held(), before, strict=True))
