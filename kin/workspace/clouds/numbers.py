"""Numbers that depend on nothing but where they stand: (seed, joint, index) → [0, 1).

A generator with a state must be run to reach its millionth number. These have none, so any slice of a cloud can be
computed alone, by any thread, and has the same bits. Each joint's stream is ``x = key + index · step`` in 64-bit
integers, read as fractions of 2⁶⁴:

- **Quasi-random.** The step is an irrational part of 2⁶⁴: the additive recurrence on the generalised golden ratio
  φ,
  φ^(d+1) = φ + 1, joint j taking steps of φ^−j (Roberts, The unreasonable effectiveness of quasirandom sequences,
  2018). The key is the offset that the seed makes. Integers keep it exact at any index.
- **Pseudo-random.** The step is odd and x is scrambled: splitmix64 (Steele, Lea and Flood, Fast splittable
  pseudorandom number generators, OOPSLA 2014), a stream per joint.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import inlined

Words = NDArray[np.uint64]

_GAMMA = 0x9E3779B97F4A7C15  # 2⁶⁴ / golden ratio, made odd
_WORD = (1 << 64) - 1
_STEP = np.uint64(_GAMMA)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_30, _27, _31, _11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_PART = 2.0**-53


@inlined
def scrambled(x: Any) -> Any:
    """splitmix64's finaliser: every bit of the 64 depends on every bit."""
    x = (x ^ (x >> _30)) * _FIRST
    x = (x ^ (x >> _27)) * _SECOND
    return x ^ (x >> _31)


@inlined
def fraction(x: Any) -> float:
    """The upper 53 of 64 bits as a number in [0, 1)."""
    return float(x >> _11) * _PART


@inlined
def hashed(key: Any, index: Any) -> Any:
    """Number `index` of the pseudo-random stream `key`, as 64 bits."""
    return scrambled(key + index * _STEP)


def streams(seed: int, free: NDArray[np.bool_], quasi: bool) -> tuple[Words, Words]:
    """Keys and steps ``(n,)`` of the joints' streams; joints that are not free spend no dimension."""
    n, dimension = len(free), int(free.sum())
    key, step = np.zeros(n, dtype=np.uint64), np.full(n, _GAMMA, dtype=np.uint64)
    steps = _recurrence(dimension)
    rank = 0
    for j in range(n):
        key[j] = word(seed, j)
        if quasi and free[j]:
            step[j] = steps[rank]
            rank += 1
    return key, step


def word(seed: int, stream: int) -> int:
    """The 64-bit key of a stream, as different as can be for neighbouring seeds and streams."""
    x = seed & _WORD
    for salt in (stream, 0):
        x = (x + _GAMMA * (salt + 1)) & _WORD
        x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & _WORD
        x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & _WORD
        x ^= x >> 31
    return x


def _recurrence(dimension: int) -> list[int]:
    """φ^−1, φ^−2, … of the generalised golden ratio as fractions of 2⁶⁴, odd."""
    phi = 2.0
    for _ in range(60):
        phi = (1.0 + phi) ** (1.0 / (dimension + 1))
    return [int(phi**-j * 2.0**64) & _WORD | 1 for j in range(1, dimension + 1)]
