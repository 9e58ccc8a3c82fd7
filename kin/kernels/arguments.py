"""Array arguments that compiled functions read straight from the Python object.

numba makes a record for every array that Python passes to compiled code, counts the references to it and frees it
again: some 30 ns for each array, so that three take as long as the kinematics of an arm. A kernel that neither
keeps nor returns an array does not need that, because the caller holds the arrays until the call returns.
`Borrowed` is the type of such an argument: while the GIL is held, address, shape and strides are copied from its
fields, which are part of NumPy's binary interface (``PyArrayObject_fields`` in ``ndarraytypes.h``).

Before that, machine code compares: the object has to be exactly a `numpy.ndarray`, with the data type, number of
axes, shape, order and alignment that the kernel is compiled for. Any other object raises `TypeError`. The
addresses of `numpy.ndarray` and of the data type are symbols, resolved when machine code is loaded, so that code
from the cache is valid in every process.

Where NumPy has the fields elsewhere (:mod:`kin.kernels.layout`), `READABLE` is false: `kin.kernels.compile.direct`
then passes arrays as numba does, and compares them in Python.
"""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np
from llvmlite import binding, ir
from numba import types

from kin.kernels import layout
from kin.kernels.private import CALLS, MISSING, NativeValue, cgutils, lower_cast, models, register_model, unbox

_FLOAT = np.dtype(np.float64)
_CONTIGUOUS_AND_ALIGNED = 0x0001 | 0x0100  # NPY_ARRAY_C_CONTIGUOUS, NPY_ARRAY_ALIGNED
_SYMBOLS = {"kin.ndarray": np.ndarray, "kin.float64": _FLOAT}

for _name, _object in _SYMBOLS.items():
    binding.add_symbol(_name, id(_object))


READABLE = layout.READABLE and CALLS not in MISSING


class Borrowed(types.Array):
    """The type of a C-contiguous float64 array that a compiled function neither keeps nor returns.

    Attributes:
        wanted: its shape, None for an axis of any length.
    """

    def __init__(self, wanted: tuple[int | None, ...], *, readonly: bool = False) -> None:
        self.wanted = wanted
        name = f"{'read-only' if readonly else 'writable'} float64 array {wanted}, borrowed"
        super().__init__(types.float64, len(wanted), "C", readonly=readonly, name=name)

    @property
    def key(self) -> tuple[Any, ...]:
        """What makes two of these types the same."""
        return (*super().key, self.wanted)

    @property
    def mangling_args(self) -> tuple[str, tuple[object, ...]]:
        """What distinguishes the names of compiled functions."""
        return self.name, ()

    def owned(self) -> types.Array:
        """The type that functions called by compiled code have for the same array."""
        return types.Array(self.dtype, self.ndim, "C", readonly=not self.mutable)


def _lend(context: Any, builder: Any, borrowed: Borrowed, owned: types.Array, value: Any) -> Any:
    """The same array for a function that is called by compiled code."""
    return value


def _borrow(kind: Borrowed, array: Any, c: Any) -> NativeValue:
    """Machine code that copies the fields of a Python object if it is the array that is wanted."""
    builder, address = c.builder, cgutils.voidptr_t
    int32, intp = ir.IntType(32), c.context.get_value_type(types.intp)

    def field(offset: int, of: Any) -> Any:
        place = builder.gep(builder.bitcast(array, address), [intp(offset)])
        return builder.load(builder.bitcast(place, of.as_pointer()))

    def numbers(offset: int) -> list[Any]:
        first = field(offset, intp.as_pointer())
        return [builder.load(builder.gep(first, [intp(k)])) for k in range(kind.ndim)]

    def is_symbol(offset: int, name: str) -> Any:
        return builder.icmp_unsigned(
            "==", field(offset, address), c.context.get_c_value(builder, ir.IntType(8), name)
        )

    result = cgutils.alloca_once_value(builder, c.context.get_constant_null(kind))
    failed = cgutils.alloca_once_value(builder, cgutils.true_bit)
    with builder.if_then(is_symbol(layout.TYPE, "kin.ndarray"), likely=True):
        flags = builder.and_(field(layout.FLAGS, int32), int32(_CONTIGUOUS_AND_ALIGNED))
        right = is_symbol(layout.DTYPE, "kin.float64")
        right = builder.and_(right, builder.icmp_signed("==", flags, int32(_CONTIGUOUS_AND_ALIGNED)))
        right = builder.and_(right, builder.icmp_signed("==", field(layout.AXES, int32), int32(kind.ndim)))
        with builder.if_then(right, likely=True):
            shape = numbers(layout.SHAPE)
            for there, wanted in zip(shape, kind.wanted, strict=True):
                if wanted is not None:
                    right = builder.and_(right, builder.icmp_signed("==", there, intp(wanted)))
            with builder.if_then(right, likely=True):
                native = cgutils.create_struct_proxy(kind)(c.context, builder)  # other fields are zero
                native.data = builder.bitcast(field(layout.DATA, address), native.data.type)
                native.itemsize, native.nitems = intp(_FLOAT.itemsize), reduce(builder.mul, shape, intp(1))
                native.shape = cgutils.pack_array(builder, shape, intp)
                native.strides = cgutils.pack_array(builder, numbers(layout.STRIDES), intp)
                builder.store(native._getvalue(), result)
                builder.store(cgutils.false_bit, failed)
    with builder.if_then(builder.load(failed), likely=False):
        c.pyapi.err_set_string("PyExc_TypeError", f"not a {kind}")
    return NativeValue(builder.load(result), is_error=builder.load(failed))


if CALLS not in MISSING:
    register_model(Borrowed)(models.ArrayModel)
    lower_cast(Borrowed, types.Array)(_lend)
    unbox(Borrowed)(_borrow)
