"""What kernels that run as they are written call in place of instructions of LLVM."""

from __future__ import annotations

import struct

_WORD = (1 << 64) - 1


def bits_of(x: float) -> int:
    """The 64 bits of a float as an integer, as `kin.kernels.simd.bits_of`."""
    return int(struct.unpack("<q", struct.pack("<d", x))[0])


def float_of(bits: int) -> float:
    """The float of the lowest 64 bits of an integer, as `kin.kernels.simd.float_of`."""
    return float(struct.unpack("<d", struct.pack("<Q", bits & _WORD))[0])
