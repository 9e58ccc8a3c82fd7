"""Rigid transforms as plain arrays.

A transform is a float64 array ``(..., 4, 4)``; there is no pose class. ``T_a_b`` maps coordinates in frame b
to coordinates in frame a, so ``T_a_c = T_a_b @ T_b_c``. Quaternions are ``wxyz`` (scalar first), and they are
used only in the interfaces (REST, screen).
"""

from __future__ import annotations

import math
from numbers import Real
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kin.errors import InputError
from kin.tolerances import TOLERANCES

Array = NDArray[np.float64]
_FLOAT = np.dtype(np.float64)
_UNMOVED = np.eye(4)
_THREE = (float, float, float)


def is_plain(value: object) -> TypeGuard[Array]:
    """Whether compiled functions take it: an array of numpy's own class, float64, C-contiguous and aligned."""
    return type(value) is np.ndarray and value.dtype is _FLOAT and value.flags.c_contiguous and value.flags.aligned


def finite_array(field: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """`value` as a finite array (`is_plain`) whose trailing axes match `shape` (None: any length).

    Raises:
        InputError: naming `field`, for anything that is not numbers of that shape, NaN and infinity included.
    """
    try:
        raw = np.asarray(value)
        # numpy silently converts strings of digits and complex numbers: check before converting.
        if raw.dtype.kind not in "biuf":
            raw = _numbers(field, value, _expected(shape))
        array = np.ascontiguousarray(raw, dtype=np.float64)
        if not is_plain(array):  # numpy keeps an unaligned array, and a data type with metadata
            array = np.array(array, dtype=_FLOAT)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(field, value, _expected(shape)) from None
    tail = array.shape[-len(shape) :] if array.ndim >= len(shape) else ()
    if len(tail) != len(shape) or any(s is not None and s != t for s, t in zip(shape, tail, strict=True)):
        raise InputError(field, f"shape {array.shape}", _expected(shape))
    if not np.isfinite(array).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        where = field + "".join(f"[{i}]" for i in index)
        raise InputError(where, float(array[index]), "a finite number")
    return array


def _expected(shape: tuple[int | None, ...]) -> str:
    return f"finite numbers of shape (…, {', '.join('any' if s is None else str(s) for s in shape)})"


def _numbers(field: str, value: ArrayLike, expected: str) -> Array:
    """Convert a value that numpy does not read as real numbers; raises `InputError` naming the first bad item."""
    items = np.asarray(value, dtype=object)
    if items.ndim == 0 or any(isinstance(item, list | tuple | np.ndarray) for item in items.flat):
        raise InputError(field, value, expected)
    out = np.empty(items.shape)
    for index in np.ndindex(items.shape):
        item = items[index]
        try:
            if not isinstance(item, Real):
                raise TypeError
            out[index] = float(item)
        except (TypeError, OverflowError):
            raise InputError(field + "".join(f"[{i}]" for i in index), item, "a finite number") from None
    return out


def as_transform(value: ArrayLike, field: str = "target") -> Array:
    """One rigid transform ``(4, 4)``, its rotation re-orthonormalised.

    Raises:
        InputError: wrong shape, not finite, last row not ``0 0 0 1``, or a rotation off by more than
            ``TOLERANCES.rotation_matrix`` (reflections included).
    """
    T = finite_array(field, value, (4, 4))
    if T.ndim != 2:
        raise InputError(field, f"shape {T.shape}", "one 4×4 matrix")
    if np.abs(T[3] - (0.0, 0.0, 0.0, 1.0)).max() > TOLERANCES.rotation_matrix:
        raise InputError(f"{field}[3]", T[3].tolist(), "the last row 0, 0, 0, 1")
    R = T[:3, :3]
    if np.abs(R).max() > 2.0 or np.abs(R.T @ R - np.eye(3)).max() > TOLERANCES.rotation_matrix:
        raise InputError(f"{field} rotation", R.tolist(), "an orthonormal rotation matrix (RᵀR = I)")
    if np.linalg.det(R) < 0:
        raise InputError(f"{field} rotation", R.tolist(), "a right-handed rotation (det R = +1)")
    out = np.eye(4)
    # One Newton step of the polar decomposition: quadratic, so 1e-6 becomes 1e-12 and a clean R is unchanged.
    once = 1.5 * R - 0.5 * (R @ (R.T @ R))
    out[:3, :3] = 1.5 * once - 0.5 * (once @ (once.T @ once))
    out[:3, 3] = T[:3, 3]
    return out


def pose_from_position_wxyz(position: ArrayLike, wxyz: ArrayLike | None = None) -> Array:
    """`kin.pose_from_position_wxyz` for a quaternion of any length but zero; raises `InputError`."""
    T = _UNMOVED.copy()
    p = finite_array("position", position, (3,))
    if p.ndim != 1:
        raise InputError("position", f"shape {p.shape}", "three numbers x, y, z in metres")
    T[:3, 3] = p
    if wxyz is not None:
        T[:3, :3] = rotation_from_wxyz(wxyz)
    return T


def rotation_from_wxyz(wxyz: ArrayLike) -> Array:
    """`kin.rotation_from_wxyz` for a quaternion of any length but zero; raises `InputError`."""
    numbers = finite_array("wxyz", wxyz, (4,))
    if numbers.ndim != 1:
        raise InputError("wxyz", f"shape {numbers.shape}", "four numbers w, x, y, z")
    given = numbers.tolist()
    scale = max(map(abs, given))
    if not scale > 1e-12:
        raise InputError("wxyz", given, "a quaternion that is not zero")
    size = math.hypot(*(v / scale for v in given))
    w, x, y, z = (v / scale / size for v in given)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotations_from_wxyz(wxyz: Array) -> Array | None:
    """`rotation_from_wxyz` of each of finite quaternions ``(k, 4)``, bit for bit; None if one of them is zero."""
    unit = _units(wxyz)
    if unit is None:
        return None
    w, x, y, z = unit.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def _units(given: Array) -> Array | None:
    """Finite vectors ``(k, m)`` divided by their lengths; None if one of them is zero."""
    scale = np.abs(given).max(axis=1)
    if not (scale > 1e-12).all():
        return None
    return _units_of_length(given / scale[:, None])


def _units_of_length(given: Array) -> Array:
    """Vectors ``(k, m)`` of moderate lengths divided by these."""
    # As for single vectors: `math.hypot` rounds better than a root of squares.
    scaled: Array = given / np.array([math.hypot(*row) for row in given.tolist()])[:, None]
    return scaled


def wxyz_from_rotation(R: Array) -> Array:
    """Unit quaternions ``(..., 4)`` of rotations ``(..., 3, 3)``; the scalar comes first and is never negative.

    Shepperd's method starts from the largest of the four components, which avoids cancellation.

    Args:
        R: orthonormal; this is not checked.

    Returns:
        The quaternions.

    Examples:
        >>> import kin, numpy as np
        >>> kin.wxyz_from_rotation(np.diag([1.0, -1.0, -1.0]))
        array([0., 1., 0., 0.])
    """
    R = np.asarray(R, dtype=np.float64)
    if R.size == 9 and R.shape[-2:] == (3, 3):
        return np.array(_one_wxyz(*R.ravel().tolist())).reshape(*R.shape[:-2], 4)
    m00, m11, m22 = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    squares = np.stack(
        [1 + m00 + m11 + m22, 1 + m00 - m11 - m22, 1 - m00 + m11 - m22, 1 - m00 - m11 + m22], axis=-1
    )
    a, b, c = R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]
    d, e, f = R[..., 1, 0] + R[..., 0, 1], R[..., 0, 2] + R[..., 2, 0], R[..., 2, 1] + R[..., 1, 2]
    s0, s1, s2, s3 = np.moveaxis(squares, -1, 0)
    rows = np.stack(
        [
            np.stack([s0, a, b, c], axis=-1),
            np.stack([a, s1, d, e], axis=-1),
            np.stack([b, d, s2, f], axis=-1),
            np.stack([c, e, f, s3], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(squares, axis=-1)
    q = np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., :1] < 0, -q, q))


def _one_wxyz(
    m00: float, m01: float, m02: float, m10: float, m11: float, m12: float, m20: float, m21: float, m22: float
) -> tuple[float, float, float, float]:
    """The same for one rotation, bit for bit; on plain floats it is ten times faster than on arrays."""
    squares = (1 + m00 + m11 + m22, 1 + m00 - m11 - m22, 1 - m00 + m11 - m22, 1 - m00 - m11 + m22)
    largest = squares.index(max(squares))
    if largest == 0:
        w, x, y, z = squares[0], m21 - m12, m02 - m20, m10 - m01
    elif largest == 1:
        w, x, y, z = m21 - m12, squares[1], m10 + m01, m02 + m20
    elif largest == 2:
        w, x, y, z = m02 - m20, m10 + m01, squares[2], m21 + m12
    else:
        w, x, y, z = m10 - m01, m02 + m20, m21 + m12, squares[3]
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if w < 0.0:
        norm = -norm
    return w / norm, x / norm, y / norm, z / norm


def rotation_about(axis: Array, angle: float) -> Array:
    """The rotation ``(3, 3)`` about an axis ``(3,)`` of any length, by an angle in radians."""
    xyz = math.sin(angle / 2) * axis / np.linalg.norm(axis)
    return rotation_from_wxyz(np.array([math.cos(angle / 2), *xyz]))


def rotation_angle(R_a: Array, R_b: Array) -> float:
    """Angle in radians between two rotations ``(3, 3)``, accurate from 0 to π.

    Computed as ``2 atan2(|xyz|, w)`` from the quaternion of the relative rotation: acos of the trace loses half of
    the digits near zero.
    """
    q = wxyz_from_rotation(R_a.T @ R_b)
    return 2.0 * math.atan2(float(np.linalg.norm(q[1:])), float(q[0]))


def rotation_vector(R: Array) -> Array:
    """The rotation vectors ``(..., 3)`` of rotations ``(..., 3, 3)``."""
    q = wxyz_from_rotation(R)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    return np.asarray(q[..., 1:] * np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 1e-12))


def vector_angle(a: Array, b: Array) -> float:
    """Angle in radians between two vectors ``(3,)``, accurate from 0 to π."""
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(np.dot(a, b)))


def frame_from_approach(approach: ArrayLike) -> Array:
    """A rotation ``(3, 3)`` with its z axis along `approach` ``(3,)`` and its x axis horizontal if possible."""
    given: Any = approach
    # Checking an array would take longer than all the rest.
    if not (type(given) is list and tuple(map(type, given)) == _THREE and all(map(math.isfinite, given))):
        z = finite_array("approach", approach, (3,))
        if z.ndim != 1:
            raise InputError("approach", f"shape {z.shape}", "three numbers: the direction of the tool's z axis")
        given = z.tolist()
    scale = max(map(abs, given))
    if not scale > 1e-12:
        raise InputError("approach", given, "a direction that is not zero")
    # Plain floats: ten times faster than arrays of length three, and batches of targets call this per target.
    zx, zy, zz = (v / scale for v in given)
    size = math.hypot(zx, zy, zz)
    zx, zy, zz = zx / size, zy / size, zz / size
    # The cross product (0, 0, 1) × z, or (0, 1, 0) × z near the vertical.
    xx, xy, xz = (-zy, zx, 0.0) if abs(zz) < 0.9 else (zz, 0.0, -zx)
    size = math.hypot(xx, xy, xz)
    xx, xy, xz = xx / size, xy / size, xz / size
    rows = [xx, zy * xz - zz * xy, zx, xy, zz * xx - zx * xz, zy, xz, zx * xy - zy * xx, zz]
    return np.array(rows).reshape(3, 3)


def frames_from_approaches(approaches: Array) -> Array | None:
    """`frame_from_approach` of each of finite directions ``(k, 3)``, bit for bit; None if one of them is zero."""
    z = _units(approaches)
    if z is None:
        return None
    zx, zy, zz = z.T
    zero, leans = np.zeros_like(zx), np.abs(zz) < 0.9
    across = _units_of_length(np.where(leans, [-zy, zx, zero], [zz, zero, -zx]).T)
    xx, xy, xz = across.T
    rows = [[xx, zy * xz - zz * xy, zx], [xy, zz * xx - zx * xz, zy], [xz, zx * xy - zy * xx, zz]]
    return np.moveaxis(np.array(rows), -1, 0)
