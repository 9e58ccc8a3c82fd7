"""Small kernels, each with one construct: those that the subset has, and those that it refuses."""

# Some are not how one would write Python: that is what they are for.
# ruff: noqa

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

MASKS = np.array([1.0, 2.0, 4.0])
WORD, NUMBERS = "text", [1, 2, 3]
GAMMA, ELEVEN = np.uint64(0x9E3779B97F4A7C15), np.uint64(11)


class Pair(NamedTuple):
    a: float
    b: float


def put(a, i, x):
    a[i] = x
    return x > 0.0


def get(a):
    a[0] = 100.0
    return 1.0


def read(a):
    return a[0] + 2.0 * a[1]


def fresh(a):
    b = np.empty(a.shape[0])
    for i in range(a.shape[0]):
        b[i] = 2.0 * a[i]
    return b


def with_length(a):
    b = fresh(a)
    return b, b.shape[0]


def recursive(x):
    return 1.0 if x < 1.5 else x * recursive(x - 1.0)


def with_default(x, z=2.0):
    return x * z


def sums(a, out):
    out[0], out[1] = a[0] + a[1], a[0] - a[1]


def apply(f, x):
    return f(x)


def doubled(x):
    return 2.0 * x


# ---- what is refused: (kernel, what the error says) ----


def invert(x, y, a):
    return float(~int(x))


def unary_plus(x, y, a):
    return +x


def while_else(x, y, a):
    while x > 5.0:
        x -= 1.0
    else:
        x = 10.0
    return x


def for_else(x, y, a):
    for i in range(2):
        pass
    else:
        return y
    return x


def flag_equals_number(x, y, a):
    flag = x > 0.0
    return 1.0 if flag == 1 else 0.0


def or_of_numbers(x, y, a):
    n = int(x) or int(y)
    return float(n)


def and_of_numbers(x, y, a):
    return float(int(x) and int(y))


def stepped_view(x, y, a):
    v = a[::-1]
    v[0] = 7.0
    return a[3]


def arrays_side_by_side(x, y, a):
    m = a.reshape(2, 2)
    m[0], m[1] = m[0] + m[1], m[0] - m[1]
    return m[1, 0]


def array_augmented(x, y, a):
    b = a.copy()
    b += a
    return b[1]


def array_named(x, y, a):
    b = a + a
    return b[1]


def array_passed(x, y, a):
    return read(x * a)


def overlapping(x, y, a):
    a[1:] = a[:3] + a[:3]
    return a[3]


def overlapping_copy(x, y, a):
    a[1:] = a[:3]
    return a[3]


def aliased_rows(x, y, a):
    m = a.reshape(2, 2)
    sums(m, m)
    return m[1, 0]


def augmented_by_a_writer(x, y, a):
    a[0] += get(a)
    return a[0]


def reads_around_a_writer(x, y, a):
    return a[0] + get(a) + a[0]


def two_writers(x, y, a):
    return get(a) + read(a)


def writer_in_an_index(x, y, a):
    a[int(get(a))] = a[0]
    return a[1]


def array_kept_over_rounds(x, y, a):
    last, total = a, 0.0
    for i in range(3):
        b = np.empty(2)
        b[0] = float(i)
        total += last[0]
        last = b
    return total


def recursion(x, y, a):
    return recursive(x)


def default_left_out(x, y, a):
    return with_default(x)


def keyword(x, y, a):
    return with_default(x, z=y)


def text(x, y, a):
    return 1.0 if WORD == "text" else 0.0


def list_(x, y, a):
    return [x, y][0]


def global_list(x, y, a):
    return float(NUMBERS[0])


def comprehension(x, y, a):
    return sum(v for v in a)


def assertion(x, y, a):
    assert x > 0.0
    return x


def raising(x, y, a):
    if x < 0.0:
        raise ValueError
    return x


def trying(x, y, a):
    try:
        return x
    except Exception:
        return y


def over_an_array(x, y, a):
    total = 0.0
    for v in a:
        total += v
    return total


def enumerated(x, y, a):
    total = 0.0
    for i, v in enumerate(a):
        total += i * v
    return total


def dot(x, y, a):
    return np.dot(a, a)


def matmul(x, y, a):
    return a @ a


def sum_(x, y, a):
    return a.sum()


def in_(x, y, a):
    return 1.0 if int(x) in (1, 3) else 0.0


def is_none(x, y, a):
    b = None
    return 1.0 if b is None else 0.0


def walrus(x, y, a):
    return z if (z := x * 2.0) > 1.0 else x


def lambda_(x, y, a):
    f = lambda v: v + 1.0
    return f(x)


def starred(x, y, a):
    first, *rest = (x, y, 1.0)
    return first


def deleted(x, y, a):
    z = x
    del z
    return y


def nested_function(x, y, a):
    def f(v):
        return v + 1.0

    return f(x)


def unset(x, y, a):
    return z


def fancy_index(x, y, a):
    return a[a > 1.0][0]


def words_and_numbers(x, y, a):
    return float(int(x) + np.uint64(int(y)))


def divided_words(x, y, a):
    return float(np.uint64(int(x)) // GAMMA)


def singles_added(x, y, a):
    return float(np.float32(x) + np.float32(y))


def passed_again(x, y, a):
    b = fresh(a)
    for i in range(2):
        b = fresh(b)
    return b[0]


def pair_under_a_second_name(x, y, a):
    last = a
    for i in range(2):
        x += last[0]
        b, n = with_length(a)
        last = b
    return x


def column(x, y, a):
    return a.reshape(2, 2)[:, 1][0]


def complex_power(x, y, a):
    return (complex(x, y) ** 2).imag


def table_written(x, y, a):
    MASKS[1] = 3.0
    return x


def two_types(x, y, a):
    b = x
    b = (x, y)
    return b[0]


def step_unknown(x, y, a):
    total = 0.0
    for i in range(0, 4, int(x)):
        total += i
    return total


def builtin_round(x, y, a):
    return float(round(x))


def mixed_tuple_index(x, y, a):
    t = (int(x), y)
    return float(t[int(y) - 1])


def negative_power(x, y, a):
    return x**-2


def integer_power(x, y, a):
    return float(int(x) ** int(y))


def float_index(x, y, a):
    return a[x]


def order_of_complex(x, y, a):
    return 1.0 if complex(x, y) < complex(y, x) else 0.0


def large_number(x, y, a):
    return float(9007199254740993 * int(x))


REFUSED = {
    invert: "~ or unary +", unary_plus: "~ or unary +", while_else: "the else of a loop", for_else: "the else of a loop",
    flag_equals_number: "a comparison of", or_of_numbers: "and / or", and_of_numbers: "and / or",
    stepped_view: "a slice with a step", arrays_side_by_side: "arithmetic of arrays stored in one of them",
    array_augmented: "changed as a whole", array_named: "arithmetic of arrays", array_passed: "arithmetic of arrays", overlapping: "stored in one of them",
    overlapping_copy: "stored in one of them", augmented_by_a_writer: "a call that writes",
    reads_around_a_writer: "a call that writes", two_writers: "a call that writes", writer_in_an_index: "a call that writes",
    array_kept_over_rounds: "under a second name", recursion: "calls itself", default_left_out: "other arguments",
    keyword: "keyword", text: "a constant of type str", list_: "a list", global_list: "a constant of type list",
    comprehension: "a comprehension", assertion: "assert", raising: "raise", trying: "try", over_an_array: "a loop over",
    enumerated: "this use of a function", dot: "neither a kernel nor known", matmul: "arithmetic of", sum_: "a method",
    in_: "a comparison of", is_none: "a constant of type NoneType", walrus: ":=", lambda_: "a lambda",
    starred: "variables for", deleted: "del", nested_function: "a function inside", unset: "a variable without a value",
    fancy_index: "a comparison of", column: "no name", complex_power: "a power", table_written: "an array of a module",
    two_types: "one variable of two types", step_unknown: "a step that is no constant", builtin_round: "neither a kernel",
    mixed_tuple_index: "an index of a tuple of several types", negative_power: "a power", integer_power: "a power",
    float_index: "a whole number is needed", order_of_complex: "an order of", large_number: "beyond 2",
    words_and_numbers: "arithmetic of", divided_words: "this operator", singles_added: "this operator",
    passed_again: "passed to it in the next round", pair_under_a_second_name: "under a second name",
}  # fmt: skip


# ---- what is right in every language ----


def negative_index(x, y, a):
    return a[int(abs(x)) % 4 - 4] + a[-2]


def floor_large(x, y, a):
    return float(math.floor(x * 1e12))


def zero_of_whole_numbers(x, y, a):
    n = int(x) - int(x)
    return math.atan2(float(-n), -1.0) + math.atan2(float(n * -3), -1.0) + math.copysign(1.0, float(int(-0.25)))


def shift(x, y, a):
    return float((1 << (abs(int(x)) + 37)) + (-9 >> 1))


def powers(x, y, a):
    return x**2 + y**3 + abs(x) ** 0.5 + a[1] ** 7


def quotients(x, y, a):
    i, j = int(x), abs(int(y)) + 2
    return (
        i / j + float(i // j) + float(i % j) + float(-i // j) + float(-i % 3) + (-x) % 0.7 + (-x) // 0.7 + x % -0.7
    )


def least_and_most(x, y, a):
    n = math.nan
    first = min(n, x)
    return min(x, n) + max(x, n) + (1.0 if math.isnan(first) else 0.0) + min(int(y), 7) + max(x, y, 2.5)


def rounded(x, y, a):
    return float(np.round(x - 0.5)) + 10.0 * float(np.rint(y + 0.5)) + 100.0 * float(np.round(-1.5))


def both_conditions(x, y, a):
    ok = x < -1e9
    ok = ok & put(a, 1, 5.0)
    ok |= put(a, 2, 6.0)
    return a[1] + a[2] + (1.0 if ok ^ True else 0.0)


def loop_variable(x, y, a):
    total = 0.0
    for i in range(5):
        if i == 3:
            break
    for k in range(4):
        total += k
        k = 10
    for m in range(7, 0, -2):
        total += m * m
    return total + float(i) + float(k)


def range_that_changes(x, y, a):
    n, total = 3, 0.0
    for i in range(n):
        n = 10
        total += 1.0
    return total + n


def slices(x, y, a):
    b, e = a[-2:], a[3:1]
    return b[0] + float(e.shape[0]) + float(a[1:99].shape[0]) + a[: int(abs(x)) - 9].shape[0]


def conditions(x, y, a):
    i = int(x)
    chain = 1.0 if -1e6 < x < y * 100.0 + 1e5 < 1e9 else 0.0
    return chain + (1.0 if not i else (2.0 if not x != 3.0 else 3.0)) + (4.0 if i and y < 7.0 else 5.0)


def chosen(x, y, a):
    i = -1 if x > 0.0 else 0
    return a[i] if i >= 0 else y


def truth_in_sums(x, y, a):
    f, g = x > 0.0, y > 0.0
    return float(f + g) + 1.5 * f - (-g)


def tables(x, y, a):
    return MASKS[1] + a[0] + MASKS[int(abs(y)) % 3] + float(MASKS.shape[0])


def signs_and_brackets(x, y, a):
    return x - -y - -1.0 * -(2.0**2) - (x - (y - 1.0)) / (2.0 / (x * y + 7.0)) - -(-x)


def bits_of_words(x, y, a):
    i, j = abs(int(x)), abs(int(y))
    return float(i - (j - 1) & 7 | 8 ^ 3)


def complex_numbers(x, y, a):
    z = complex(x, y)
    w = (z * z + 2.0) / (z - 1j) - -z
    u = w if abs(w) > 1e-3 else z.conjugate()
    return u.real + 3.0 * u.imag + abs(z) + (1.0 if z == complex(x, y) else 0.0)


def arrays_of_all_kinds(x, y, a):
    n, m = np.empty((2, 3)), np.zeros(3, dtype=np.bool_)
    k, z = np.full(2, 7), np.ones(2, dtype=np.complex128)
    n[0] = 1.5
    n[1, :] = x
    m[1], k[1], z[1] = True, int(y), complex(y, x)
    c = n.copy()
    c[0, 0] = 99.0
    order = np.arange(3)
    total = 0.0
    for i in range(3):
        total += n[0, i] + (2.0 if m[i] else 0.0) + order[i]
    return total + n[1, 2] + float(k[0] * k[1]) + (z[0] * z[1]).imag + float(len(order))


def swapped(x, y, a):
    a[0], a[1] = a[1], a[0]
    x, y = y, x
    (p, q), r = (x, a[0]), y
    return p + 10.0 * q + 100.0 * r + 1000.0 * a[1]


def arrays_swapped(x, y, a):
    b, c = np.full(2, x), np.full(2, y)
    for i in range(3):
        b, c = c, b
    return b[0] + 10.0 * c[1]


def chained(x, y, a):
    p = q = a[0] = x + 1.0
    p += y
    a[1] *= p
    a[2] -= q
    return p + q + a[0] + a[1] + a[2]


def named_tuple(x, y, a):
    pair = Pair(x, 2.0 * y)
    t, total = (pair.a, pair.b, 3.0), 0.0
    for v in t:
        total += v
    for p, q in ((1.0, x), (2.0, y)):
        total += p * q
    return total + t[int(abs(y)) % 3] + t[-1]


def returned_array(x, y, a):
    b = fresh(a)
    c = fresh(b[1:])
    return b[3] + c[0] + read(b)


def passed_kernel(x, y, a):
    return apply(doubled, x) + apply(doubled, y)


def whole_arrays(x, y, a):
    b = np.empty((3, 2))
    m = a.reshape(2, 2)
    b[0], b[1], b[2] = m[0] + m[1], 2.0 * m[0], m[0] - m[1] * x
    return b[0, 1] + 10.0 * b[1, 0] + 100.0 * b[2, 1]


def nested_calls(x, y, a):
    put(a, 0, read(a))
    return a[0] + (1.0 if np.isfinite(a).all() else 0.0)


def writers_in_order(x, y, a):
    n = get(a) + (2.0 if put(a, 0, 7.0) else 0.0)
    return n + a[0]


def arrays_of_calls(x, y, a):
    total = 0.0
    for i in range(3):
        b, n = with_length(a)
        c = fresh(b)
        total += c[i] + float(n)
    return total


def library(x, y, a):
    return math.sqrt(abs(x)) + math.floor(-x) + math.ceil(y) + math.fabs(x) + math.pi


def _scaled_by(scale):
    def scaled(x, y, a):
        return scale * x + y

    return scaled


scaled = _scaled_by(2.5)  # a number around the function

RIGHT = (
    negative_index, floor_large, zero_of_whole_numbers, shift, powers, quotients, least_and_most, rounded, both_conditions,
    loop_variable, range_that_changes, slices, conditions, chosen, truth_in_sums, tables, signs_and_brackets,
    bits_of_words, complex_numbers, arrays_of_all_kinds, swapped, arrays_swapped, chained, named_tuple,
    returned_array, passed_kernel, whole_arrays, nested_calls, library, writers_in_order, arrays_of_calls,
    scaled,
)  # fmt: skip


# ---- what is right in C alone ----


def words(x, y, a):
    w = np.empty(2, dtype=np.uint64)
    w[0] = (np.uint64(int(abs(x)) + 3) * GAMMA) ^ (GAMMA >> ELEVEN)
    w[1] = (w[0] | GAMMA) & (w[0] - GAMMA)
    return float(w[0] >> ELEVEN) + (1.0 if w[0] < w[1] else 0.5) * float(w[1])


def singles(x, y, a):
    s = np.empty(2, dtype=np.float32)
    s[0] = np.float32(x / 3.0)
    s[1] = s[0]
    return float(s[1])


RIGHT_IN_C = words, singles
for each in list(globals().values()):
    if callable(each) and getattr(each, "__module__", "") == __name__ and not isinstance(each, type):
        each.__module__ = "kin.constructs"  # only kernels of the core are translated
