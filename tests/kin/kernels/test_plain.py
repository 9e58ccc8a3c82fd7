"""Kernels that run as they are written: the functions that they call in place of instructions of LLVM."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from types import FunctionType

import numpy as np
import pytest

from kin.kernels import plain, simd
from kin.kernels.ahead import CHOSEN, NUMBA


@pytest.mark.parametrize("x", [0.0, -0.0, 1.5, -(2.0**-1074), math.inf, -math.inf, math.pi])
def test_bits_are_those_of_numpy(x):
    bits = int(np.float64(x).view(np.int64))
    assert plain.bits_of(x) == bits
    assert math.copysign(1.0, plain.float_of(bits)) == math.copysign(1.0, x)
    assert plain.float_of(bits) == x
    assert plain.float_of(bits ^ (2 << 62)) == -x


def as_written(kernel):
    functions = {"bits_of": plain.bits_of, "float_of": plain.float_of, "fma": lambda a, b, c: a * b + c}
    return FunctionType(getattr(kernel, "py_func", kernel).__code__, {**vars(simd), **functions})


def test_quarter_turns_as_they_are_written_are_sine_and_cosine():
    sin_cos = as_written(simd.sin_cos_quarters)
    for quarters in np.linspace(-9.0, 9.0, 73).tolist():
        angle = quarters * math.pi / 2.0
        assert sin_cos(quarters) == pytest.approx((math.sin(angle), math.cos(angle)), abs=1e-10)


@pytest.mark.parametrize("chosen", ["c", "python"])
def test_they_stand_in_where_kernels_are_not_compiled_by_numba(chosen):
    program = (
        "from kin.kernels import plain, simd\n"
        "assert (simd.bits_of, simd.float_of) == (plain.bits_of, plain.float_of)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, env=os.environ | {"KINBOARD_KERNELS": chosen})


@pytest.mark.skipif(CHOSEN != NUMBA, reason="kernels are not compiled")
def test_compiled_kernels_keep_their_own():
    assert plain.bits_of not in (simd.bits_of, simd.float_of)
