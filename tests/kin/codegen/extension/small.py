"""Small kernels for an extension: every kind of argument and of result, and nothing else."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kin.codegen.types import BOOL, COMPLEX, FLOAT, INT, SINGLE, WORD, ArrayOf, TupleOf
from kin.codegen.units import Entry
from kin.kernels import simd


class Box(NamedTuple):
    low: np.ndarray
    high: np.ndarray
    side: float


def numbers(x, k, flag, z):
    return 2.0 * x, k + 1, not flag, z * z


def nothing(x):
    pass


def scaled(a, x, out):
    for i in range(a.shape[0]):
        out[i] = a[i] * x
    return a.shape[0]


def last(a):
    return a[a.shape[0] - 1, a.shape[1] - 1]


def counts(a, flags, words, singles, out):
    for i in range(a.shape[0]):
        if flags[i]:
            out[i] = a[i]
            words[i] = words[i] + np.uint64(1)
            singles[i] = np.float32(2.0)


def inside(box, q, notes):
    low, high, side = box
    for i in range(q.shape[0]):
        notes[i] = low[i] - side <= q[i] and q[i] <= high[i] + side


def ramp(n, x):
    found = np.empty((n, 2))
    for i in range(n):
        found[i, 0], found[i, 1] = x, 1.0 * i
    return found


def pair(a):
    other = a.copy()
    other[0] = -1.0
    return other, a.shape[0]


def picked(table, which, k):
    return table[which[k], int(table[0, 1])]


def folded(a, n, out):
    for i in range(a.shape[0]):
        out[i // n] = a[i]


def turned(model, q):
    return model[27 + 6] + q[0]


def wait(a, n):
    k = 0
    while k < n and a[0] == 0.0:
        k += 1
    return k


def sines(x, s, c):
    for i in range(x.shape[0]):
        s[i], c[i] = simd.sin_cos(x[i])


def quarters(x, s, c):
    for i in range(x.shape[0]):
        s[i], c[i] = simd.sin_cos_quarters(x[i])


def angles(y, x, out):
    for i in range(x.shape[0]):
        out[i] = simd.atan2(y[i], x[i])


F1, F2 = ArrayOf(FLOAT, 1), ArrayOf(FLOAT, 2)
KINDS = {
    numbers: (FLOAT, INT, BOOL, COMPLEX),
    nothing: (FLOAT,),
    scaled: (F1, FLOAT, F1),
    last: (F2,),
    counts: (ArrayOf(INT, 1), ArrayOf(BOOL, 1), ArrayOf(WORD, 1), ArrayOf(SINGLE, 1), ArrayOf(INT, 1)),
    inside: (TupleOf((F1, F1, FLOAT), Box._fields), F1, ArrayOf(BOOL, 1)),
    ramp: (INT, FLOAT),
    pair: (F1,),
    picked: (F2, ArrayOf(INT, 1), INT),
    folded: (F1, INT, F1),
    turned: (F1, F1),
    wait: (F1, INT),
    sines: (F1, F1, F1),
    quarters: (F1, F1, F1),
    angles: (F1, F1, F1),
}
for _kernel in KINDS:
    _kernel.__module__ = "kin.small"  # names in C are those of modules of the core
WANTED = {
    scaled: ("[n]", "", "[n|n+1]"),
    last: ("[0<a,0<b]",),
    counts: ("[n]",) * 5,
    inside: ("[n]", "[n]", "", "[n]", "[n]"),
    pair: ("[0<n]",),
    picked: ("[0<a,1<b]{1@:b}", "[n]{:a}", "{:n}"),
    folded: ("[m*n]", "[n]{1:}", "[m]"),
    turned: ("[2+arm:n]", "[n]"),
    wait: ("[0<n]", ""),
    sines: ("[n]",) * 3,
    quarters: ("[n]",) * 3,
    angles: ("[n]",) * 3,
}
ENTRIES = [Entry(kernel, kinds, WANTED.get(kernel, ())) for kernel, kinds in KINDS.items()]
