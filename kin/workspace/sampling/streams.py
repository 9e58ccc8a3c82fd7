"""Counter-based random numbers: (seed, joint, index) → [0, 1).

A generator with a state has to be run to reach its millionth number. These numbers depend on their index alone, so
any slice of a cloud can be computed by itself, in any thread, with the same bits. The stream of a joint is
``x = key + index · step`` in 64-bit integers, read as fractions of 2⁶⁴:

- **Quasi-random.** The step is an irrational fraction of 2⁶⁴: the additive recurrence on the generalised golden
  ratio φ, φ^(d+1) = φ + 1, where joint j advances by φ^−j (Roberts, The unreasonable effectiveness of quasirandom
  sequences, 2018). The key is an offset that depends on the seed. Integers keep it exact at any index.
- **Pseudo-random.** The step is odd and x is scrambled: splitmix64 (Steele, Lea and Flood, Fast splittable
  pseudorandom number generators, OOPSLA 2014), one stream per joint.
"""

from __future__ import annotations

from typing import Any, NamedTuple

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


class Streams(NamedTuple):
    """One stream of numbers per joint.

    Attributes:
        key, step: ``(n,)`` uint64; number i of joint j is ``key[j] + i · step[j]``.
        quasi: whether these are the numbers themselves (quasi-random) or have to be scrambled (pseudo-random).
    """

    key: Words
    step: Words
    quasi: bool


@inlined
def scrambled(x: Any) -> Any:
    """splitmix64's finaliser: every bit of the result depends on every bit of the 64-bit x."""
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


def joint_streams(seed: int, movable: NDArray[np.bool_], quasi: bool) -> Streams:
    """The joints' streams; a locked joint (False in `movable` ``(n,)``) takes no dimension of the recurrence."""
    n, dimension = len(movable), int(movable.sum())
    key, step = np.zeros(n, dtype=np.uint64), np.full(n, _GAMMA, dtype=np.uint64)
    steps = _recurrence(dimension)
    rank = 0
    for j in range(n):
        key[j] = stream_key(seed, j)
        if quasi and movable[j]:
            step[j] = steps[rank]
            rank += 1
    return Streams(key, step, quasi)


def stream_key(seed: int, stream: int) -> int:
    """The 64-bit key of a stream; neighbouring seeds and streams have unrelated keys."""
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
