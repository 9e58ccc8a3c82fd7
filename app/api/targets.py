"""Where the tool should go: one target in whichever form its sender has it.

A pose as this service answers it (``matrix`` and ``position`` and ``wxyz`` together) is a target as it stands, so
an answer of ``fk`` can be sent to ``ik`` unchanged.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from app.api import schemas
from app.api.problems import FieldError, from_input_error, invalid
from app.api.schemas import Vector3, Vector4, numbers
from kin import InputError, Task
from kin.transforms import Array, as_transform, frame_from_approach, from_position_wxyz

AGREEMENT = 1e-6  # metres, and matrix entries
FORMS = {
    "pose": "`position` and `wxyz`, or `matrix`",
    "approach": "`position` and `approach`, or `position` and `wxyz`, or `matrix`",
    "position": "`position`, or `matrix`",
}


class Target(schemas.Body):
    """A target in the base frame: `matrix`, or `position` with `wxyz` or `approach`, or `position` alone."""

    position: Vector3 | None = Field(
        None, description="Where the tool's point should be: x, y, z in metres.", examples=[[0.03, 0.154, -0.2]]
    )
    wxyz: Vector4 | None = Field(
        None,
        description="Orientation of the tool as a quaternion w, x, y, z (scalar first), of any length.",
        examples=[[1.0, 0.0, 0.0, 0.0]],
    )
    approach: Vector3 | None = Field(
        None,
        description="Direction the tool's z axis should have; its length does not matter.",
        examples=[[0.0, 0.0, -1.0]],
    )
    matrix: Annotated[list[Vector4], numbers(4)] | None = Field(
        None, description="4×4 homogeneous transform, row by row; positions in metres, last row 0, 0, 0, 1."
    )

    def resolve(self, task: Task | None, field: str) -> tuple[Task, Array]:
        """The task it asks for, if none is given the one its form implies, and T_base_tool ``(4, 4)``.

        Raises:
            ProblemError: 422 naming `field` and what is missing, contradicts, or is no rotation.
        """
        if task is None:
            task = "approach" if self.approach is not None else "position" if self._is_point() else "pose"
        given = ", ".join(name for name in type(self).model_fields if getattr(self, name) is not None) or "nothing"
        usable = self.matrix is not None or (
            self.position is not None
            and (task == "position" or self.wxyz is not None or (task == "approach" and self.approach is not None))
        )
        if not usable:
            raise _wrong(field, f"only {given}" if given != "nothing" else given, f"{FORMS[task]} for task {task}")
        if self.approach is not None and (self.wxyz is not None or self.matrix is not None):
            raise _wrong(f"{field}.approach", "an approach besides an orientation", "one of the two")
        try:
            return task, self._transform(field)
        except InputError as error:
            prefix = "" if error.field.startswith(field) else f"{field}."
            raise invalid(from_input_error(error, prefix)) from None

    def _is_point(self) -> bool:
        return self.position is not None and self.wxyz is None and self.matrix is None

    def _transform(self, field: str) -> Array:
        if self.matrix is None:
            assert self.position is not None
            T = from_position_wxyz(self.position, self.wxyz)
            if self.approach is not None:
                T[:3, :3] = frame_from_approach(self.approach)
            return T
        T = as_transform(self.matrix, f"{field}.matrix")
        if self.position is not None and np.abs(T[:3, 3] - self.position).max() > AGREEMENT:
            raise _wrong(
                f"{field}.position", str(self.position), "the position the matrix has, or only one of them"
            )
        if self.wxyz is not None:
            R = from_position_wxyz([0.0, 0.0, 0.0], self.wxyz)[:3, :3]
            if np.abs(T[:3, :3] - R).max() > AGREEMENT:
                raise _wrong(f"{field}.wxyz", str(self.wxyz), "the rotation the matrix has, or only one of them")
        return T


def _wrong(field: str, value: str, expected: str) -> Exception:
    return invalid(FieldError(field=field, value=value, expected=expected))
