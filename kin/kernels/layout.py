"""Where NumPy 2 has the fields of its arrays, for code that reads them from the Python object.

NumPy promises these places (``PyArrayObject_fields`` in ``ndarraytypes.h``), and a wrong one would read the memory
of something else. So they are compared with what NumPy says of some arrays when this module is imported. Where
they differ, and without a GIL, `READABLE` is false.
"""

from __future__ import annotations

import ctypes
import sysconfig
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

_WORD = np.dtype(np.intp).itemsize
# Offsets of the fields. The type is the last field of the head that all Python objects have.
DATA = object.__basicsize__
TYPE, AXES, SHAPE, STRIDES, DTYPE, FLAGS = (DATA + k * _WORD for k in (-1, 1, 2, 3, 5, 6))


def _probes() -> Iterator[np.ndarray[Any, Any]]:
    """Arrays of all data types and layouts that matter."""
    block = np.arange(120.0).reshape(2, 3, 4, 5)
    yield from (block, block[0, 0], block[1:, ::2, ::-1], block.T, np.asfortranarray(block), np.array(1.5))
    yield from (block.astype(kind) for kind in ("f4", ">f8", "i4", "i8", "?", "c16", "O", "M8[s]"))
    yield np.ndarray(3, np.float64, np.zeros(25, np.uint8), 1)  # unaligned
    fixed = np.zeros((4, 4))
    fixed.flags.writeable = False
    yield fixed


def _unreadable() -> str:
    """Why the fields of arrays cannot be read in this process; empty if they can."""
    if sysconfig.get_config_var("Py_GIL_DISABLED"):
        return "this Python has no GIL, so that arrays may change while they are read"
    if np.ndarray.__basicsize__ < max(TYPE, AXES, SHAPE, STRIDES, DTYPE, FLAGS) + _WORD:
        return "its arrays are shorter"
    for array in _probes():

        def word(offset: int, of: Any = ctypes.c_size_t, array: Any = array) -> int:
            return int(of.from_address(id(array) + offset).value)

        there = {
            "type": word(TYPE) == id(np.ndarray),
            "address": word(DATA) == array.ctypes.data,
            "number of axes": word(AXES, ctypes.c_int) == array.ndim,
            "data type": word(DTYPE) == id(array.dtype),
            "flags": word(FLAGS, ctypes.c_int) == array.flags.num,
            # NumPy keeps both in one block. Unless this holds, they are not followed: they may lead anywhere.
            "shape": array.ndim == 0 or word(STRIDES) - word(SHAPE) == array.ndim * _WORD,
        }
        if all(there.values()) and array.ndim:
            lengths = ctypes.c_ssize_t * array.ndim
            there["shape"] = tuple(lengths.from_address(word(SHAPE))) == array.shape
            there["strides"] = tuple(lengths.from_address(word(STRIDES))) == array.strides
        if elsewhere := [name for name, is_there in there.items() if not is_there]:
            return f"its arrays have another {elsewhere[0]} where that of NumPy 2 is"
    return ""


if _why := _unreadable():
    warnings.warn(
        f"NumPy {np.__version__}: {_why}. Calls of kernels take longer, with the same answers.", stacklevel=2
    )
READABLE = not _why
