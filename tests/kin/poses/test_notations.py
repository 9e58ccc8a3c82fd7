"""Notations of rotations: compared with SciPy, and read back."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kin.poses import ANGLES, QUATERNIONS, Notation

RANDOM = Rotation.random(200, rng=np.random.default_rng(7)).as_matrix()
SINGULAR = (
    *(("XYZ", (20, -90, 0)), ("XYZ", (20, 90, 0)), ("ZYX", (30, 90, 0)), ("ZYX", (0, 0, 180))),
    *(("ZYZ", (40, 0, 0)), ("ZYZ", (40, 180, 0)), ("X", 0)),
)
SPECIAL = np.array([Rotation.from_euler(axes, angles, degrees=True).as_matrix() for axes, angles in SINGULAR])
SCIPY = {
    "roll pitch yaw": lambda v: Rotation.from_euler("xyz", v),
    "Euler Z-Y-Z": lambda v: Rotation.from_euler("ZYZ", v),
    "axis and angle": lambda v: Rotation.from_rotvec(np.array(v[:3]) * v[3]),
    "rotation vector": Rotation.from_rotvec,
    "A B C (KUKA)": lambda v: Rotation.from_euler("ZYX", v),
    "W P R (FANUC)": lambda v: Rotation.from_euler("xyz", v),
    "Rx Ry Rz (Yaskawa, Denso)": lambda v: Rotation.from_euler("xyz", v),
    "Rx Ry Rz (Stäubli)": lambda v: Rotation.from_euler("XYZ", v),
    "A B C (Mitsubishi)": lambda v: Rotation.from_euler("xyz", v),
    "A B C (Doosan)": lambda v: Rotation.from_euler("ZYZ", v),
    "O A T (Kawasaki)": lambda v: Rotation.from_euler("ZYZ", v),
    "w x y z": lambda v: Rotation.from_quat(v, scalar_first=True),
    "x y z w": Rotation.from_quat,
}
NOTATIONS = [*ANGLES.values(), *QUATERNIONS.values()]
each_notation = pytest.mark.parametrize("notation", NOTATIONS, ids=[each.title for each in NOTATIONS])


@each_notation
def test_the_numbers_are_those_of_scipy_and_are_read_back(notation: Notation) -> None:
    for R in (*RANDOM, *SPECIAL):
        values = notation.values(R)
        assert len(values) == len(notation.turns) == len(notation.names.split())
        assert np.allclose(SCIPY[notation.title](values).as_matrix(), R, atol=1e-12)
        assert np.allclose(notation.matrix(values), R, atol=1e-12)


@each_notation
def test_no_rotation_is_typed_as_none(notation: Notation) -> None:
    assert np.allclose(notation.matrix([float(word) for word in notation.none.split()]), np.eye(3), atol=1e-15)
