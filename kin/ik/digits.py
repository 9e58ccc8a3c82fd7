"""Which rotations look as if digits were left out when they were written down.

A rotation with few digits is no exact pose, and arms with few joints reach few poses exactly. How many digits
there are tells how closely such a target can be met. What decides is the form of the numbers: decimals (or
significant digits) of a matrix, or 32-bit floats. A quaternion leaves no trace in the size of the matrix, since it
is normalised, but in its entries: times one factor close to 1 all of them have few digits. Errors of another form,
a common factor, shear or drift, say nothing about digits. So many digits that what was left out is below the
tolerances of exact targets do not count either.
"""

from __future__ import annotations

import math

import numpy as np

from kin.transforms import Array, wxyz_from_rotation

SINGLE = float(np.finfo(np.float32).eps)
EXACT = 1e-11  # largest entry of RᵀR − I of a rotation that has more digits than count
_COMPUTED = 1e-14  # the same of one whose entries are as exact as doubles are
_ROUNDING = 8e-16  # of an entry of a computed quaternion
# Digits of a matrix, and of a quaternion, that count as few: a quaternion of two has no more than ratios.
_MATRIX, _WXYZ = range(2, 10), range(3, 10)
_LEADING = (0.1, 0.01, 0.001)  # an entry below has a leading zero, and may have one more decimal
_SINGLE_DEVIATION = 4.0  # largest entry of RᵀR − I of a matrix of 32-bit numbers, in units of their rounding
_RATIO = 20  # entries of a quaternion in the ratio of smaller whole numbers have no digits of their own
_FRACTION = 2.0**40  # the smallest part of a 32-bit entry that counts, inverted


def missing_digits(R: Array) -> float:
    """The unit of the last digit of a rotation ``(3, 3)``, if it looks as if others were left out, else 0.0.

    Of 32-bit floats it is their rounding at 1.0.
    """
    deviation = float(np.abs(R.T @ R - np.eye(3)).max())
    return _of_matrix(R, deviation) if deviation > _COMPUTED else _of_quaternion(R)


def _of_matrix(R: Array, deviation: float) -> float:
    """`missing_digits` of a matrix that is no exact rotation; deviation: the largest entry of RᵀR − I."""
    sizes = np.abs(R)
    entries = sizes.ravel().tolist()
    if max(entries) > 1.0:
        return 0.0
    for digits in _MATRIX:
        if None not in (_whole(x, digits, 1e-15) for x in entries):
            # What rounding of all entries of two columns can make of their product.
            unit, columns = 10.0**-digits, sizes.sum(axis=0)
            most = 0.5 * unit * (columns[:, None] + columns) + 0.75 * unit * unit
            return unit if (np.abs(R.T @ R - np.eye(3)) <= most * (1.0 + 1e-6)).all() else 0.0
    single = deviation <= _SINGLE_DEVIATION * SINGLE and np.array_equal(R, R.astype(np.float32))
    return SINGLE if single else 0.0


def _whole(x: float, digits: int, slack: float) -> int | None:
    """x ≥ 0 in thousandths of the unit of its last digit; None if it has more decimals behind leading zeros."""
    zeros = sum(x < least for least in _LEADING)
    scale = 10.0 ** (digits + zeros)
    whole = round(x * scale)
    return whole * 10 ** (len(_LEADING) - zeros) if abs(x - whole / scale) <= slack else None


def _of_quaternion(R: Array) -> float:
    """`missing_digits` of a rotation that may have been given as a quaternion, which was then normalised."""
    entries = np.abs(wxyz_from_rotation(R)).tolist()
    largest = max(entries)
    for digits in _WXYZ:
        scale = 10.0**digits
        for step in (0, -1, 1):
            factor = (round(largest * scale) + step) / (scale * largest)
            # Not more than rounding of all entries can change the length.
            if abs(factor - 1.0) * scale <= 0.5 * sum(entries) + 1.0 / scale:
                whole = [n for x in entries if (n := _whole(factor * x, digits, _ROUNDING)) is not None]
                if len(whole) == len(entries):
                    return 1.0 / scale if _ratio(whole) >= _RATIO else 0.0
    for step in (0, -1, 1, -2, 2):
        factor = (float(np.float32(largest)) + 0.5 * step * SINGLE) / largest
        singles = [float(np.float32(factor * x)) for x in entries]
        if all(abs(single - factor * x) <= _ROUNDING for single, x in zip(singles, entries, strict=True)):
            return SINGLE if _ratio([round(single * _FRACTION) for single in singles]) >= _RATIO else 0.0
    return 0.0


def _ratio(whole: list[int]) -> float:
    """The largest of some whole numbers divided by their greatest common divisor."""
    return max(whole) / math.gcd(*whole)
