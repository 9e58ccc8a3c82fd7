"""What the lesson "Rotations and frames" teaches and asks."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from app.viewer.lessons.guide.outline import (
    PLAIN,
    Configuration,
    Mistake,
    Number,
    Outline,
    Pose,
    Step,
    apart,
    one_right,
)
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.rotations.check import CHECK
from app.viewer.lessons.rotations.conventions import PAGE, Convention, axis_angle
from app.viewer.lessons.rotations.frames import Motion, as_json
from app.viewer.panel.rotations import RPY
from app.viewer.scene.chain import rotation
from kin import Robot, fk
from kin.axes import inverse
from kin.transforms import Array, wxyz_from_rotation
from kin.units import Units, fixed

GOAL = (
    "You can read a rotation matrix, name the convention of three angles, put rotations in the right order, and "
    "invert a transform."
)
ANGLE, ENTRY, LENGTH = math.radians(2.0), 0.02, 0.002
_SAMPLES = 64
ZYZ = Convention("zyz", False)
FORMS = frozenset({"forms"})
TWO_TURNS = Motion(True, 2, math.pi / 2, True), Motion(True, 0, math.pi / 2, True)
# The 1st and the 3rd axis coincide.
LOCKED = {"chained": False, "convention": PAGE.key, "angles": [0.4, math.pi / 2, 0.0]}


@lru_cache(maxsize=128)
def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    q = example(robot)
    T = fk(robot, q)
    start = as_configuration(q)
    tool = Pose(start, drawing=turned(T[:3, :3], PAGE))
    steps = (
        _columns(T, tool, units),
        _inverse_rotation(T, tool),
        _order(start),
        _same(),
        _pitch(T, tool, units),
        _other(T, start, units),
        _axis(T, tool, units),
        _quaternion(T, tool),
        _lock(start, units),
        _inverse(T, tool, units),
        _chain(start),
    )
    return Outline(GOAL, steps, CHECK, pose=tool)


@lru_cache(maxsize=64)
def example(robot: Robot) -> Array:
    """A configuration near home in which the tool is turned about all axes, if it can be."""
    q = robot.q_home + 0.5 * (robot.random_q(np.random.default_rng(5), _SAMPLES) - robot.q_home)
    R = np.abs(fk(robot, q)[:, :3, :3]).reshape(_SAMPLES, 9)
    return np.asarray(q[int(np.argmax(R.min(axis=1)))])


def _columns(T: Array, pose: Pose, units: Units) -> Step:
    R = T[:3, :3]
    row = int(np.argmax(np.abs(R[:, 2])))
    angle = math.acos(max(-1.0, min(1.0, float(R[row, 2]))))
    shown = units.angles.text(angle, 1)
    return Step(
        "Columns",
        "The columns of R are the axes of the turned frame in coordinates of the fixed one. So each entry is the "
        "scalar product of two unit vectors. At the pose of this step, the tool’s z axis is at an angle of "
        f"{shown} to the fixed {'xyz'[row]} axis.",
        apart(
            Number(
                f"What is the entry of R in row {row + 1} and column 3?",
                float(R[row, 2]),
                PLAIN,
                ENTRY,
                "The scalar product of two unit vectors is the cosine of their angle.",
                (
                    Mistake(float(R[2, row]), "That is the entry of Rᵀ: row and column are exchanged."),
                    Mistake(math.sin(angle), "That is the sine. The scalar product is the cosine."),
                    Mistake(math.cos(math.degrees(angle)), "That is the cosine of so many radians, not degrees."),
                ),
            ),
            ENTRY / 2.0,
        ),
        f"The third column, the tool’s z axis, is ({', '.join(fixed(v) for v in R[:, 2].tolist())}).",
        pose=pose,
        withheld=FORMS,
        practice="The frame beside the arm is turned as the tool is.",
    )


def _inverse_rotation(T: Array, pose: Pose) -> Step:
    R = T[:3, :3]
    row, column = max(((0, 1), (0, 2), (1, 2)), key=lambda at: abs(abs(R[at]) - abs(R[at[::-1]])))
    names = [f"r{'₁₂₃'[i]}{'₁₂₃'[j]}" for i, j in ((row, column), (column, row))]
    return Step(
        "The inverse",
        f"R has orthonormal columns: RᵀR = I. For the tool, {names[0]} = {fixed(float(R[row, column]))} and "
        f"{names[1]} = {fixed(float(R[column, row]))}.",
        apart(
            Number(
                f"What is the entry of R⁻¹ in row {row + 1} and column {column + 1}?",
                float(R[column, row]),
                PLAIN,
                ENTRY,
                "R⁻¹ = Rᵀ: exchange rows and columns.",
                (
                    Mistake(float(R[row, column]), "That is the entry of R itself."),
                    Mistake(-float(R[row, column]), "The inverse has other entries, not other signs: R⁻¹ = Rᵀ."),
                ),
            ),
            ENTRY / 2.0,
        ),
        "To turn back is to exchange rows and columns; nothing has to be solved.",
        pose=pose,
        withheld=FORMS,
    )


def turned(R: Array, convention: Convention) -> dict[str, object]:
    """The drawing of a rotation ``(3, 3)`` beside the arm, with its angles in a convention."""
    return {"chained": False, "convention": convention.key, "angles": list(convention.angles(R))}


def pointing(first: Array, second: Array) -> str:
    """Where the z axis points after two turns, as a name such as ``+x``; `first` is the left factor."""
    z = (first @ second)[:, 2]
    k = int(np.argmax(np.abs(z)))
    return f"{'+' if z[k] > 0 else '−'}{'xyz'[k]}"


def quarter(axis: str) -> Array:
    """A turn by 90° ``(3, 3)``."""
    return rotation("xyz".index(axis), math.pi / 2)[:3, :3]


def _order(start: Configuration) -> Step:
    own, fixed_axes = pointing(quarter("z"), quarter("x")), pointing(quarter("x"), quarter("z"))
    return Step(
        "Order",
        "A frame turns by 90° about z, then by 90° about its own x axis. Turns about own axes "
        "multiply from the right: "
        "R = Rz(90°) Rx(90°).",
        one_right(
            "Where does the z axis of the frame point then?",
            (f"Along {own}", "Rx takes z to −y; Rz takes −y to +x."),
            (
                (
                    f"Along {fixed_axes}",
                    "That is the other order: Rx(90°) Rz(90°), the second turn about the fixed x.",
                ),
                ("Along −x", "Rx takes z to −y, and Rz takes −y to +x, not to −x."),
            ),
            1,
        ),
        "About the fixed x axis, the second turn multiplies from the left, and z ends elsewhere.",
        pose=Pose(start, drawing={"chained": True, "chain": []}),
        end=Pose(start, drawing={"chained": True, "chain": as_json(TWO_TURNS)}),
        practice="Frame {2} beside the arm is turned so. Build the chain with fixed axes too.",
    )


def _same() -> Step:
    return Step(
        "Fixed and moving axes",
        "Turns about moving axes z, y, x by α, β, γ give R = Rz(α) Ry(β) Rx(γ).",
        one_right(
            "Which turns about fixed axes give the same R?",
            (
                "x by γ, then y by β, then z by α",
                "Fixed axes multiply from the left: the last turn stands first. Order and angles are reversed.",
            ),
            (
                ("z by α, then y by β, then x by γ", "That is Rx(γ) Ry(β) Rz(α): the factors in the other order."),
                ("x by α, then y by β, then z by γ", "Each angle stays with its axis."),
            ),
            0,
        ),
        "So 24 conventions make 12 pairs. Roll pitch yaw is such a name: in Kinboard it is X-Y-Z "
        f"fixed, {RPY.definition}.",
    )


def _pitch(T: Array, pose: Pose, units: Units) -> Step:
    R = T[:3, :3]
    _, pitch, _ = PAGE.angles(R)
    return Step(
        "Roll pitch yaw",
        f"In Kinboard’s convention, {RPY.definition}, the entry r₃₁ is −sin(pitch). For the tool, r₃₁ = "
        f"{fixed(float(R[2, 0]))}.",
        apart(
            Number(
                "How large is the pitch?",
                pitch,
                units.angles,
                ANGLE,
                "pitch = −asin(r₃₁).",
                (
                    Mistake(-pitch, "r₃₁ is minus the sine of the pitch."),
                    Mistake(math.acos(max(-1.0, min(1.0, -float(R[2, 0])))), "It is a sine, not a cosine."),
                ),
            ),
            ANGLE / 2.0,
        ),
        "roll = atan2(r₃₂, r₃₃) and yaw = atan2(r₂₁, r₁₁).",
        pose=pose,
        withheld=FORMS | {"angles"},
        practice="The read-out above the tabs shows them.",
    )


def _other(T: Array, start: Configuration, units: Units) -> Step:
    R = T[:3, :3]
    _, beta, _ = ZYZ.angles(R)
    return Step(
        "The same in Z-Y-Z",
        f"With moving axes z, y, z the entry r₃₃ is cos β. For the tool, r₃₃ = {fixed(float(R[2, 2]))}.",
        apart(
            Number(
                "How large is β, from 0 to half a turn?",
                beta,
                units.angles,
                2.0 * ANGLE,
                "β = acos(r₃₃): the angle between the two z axes.",
                (Mistake(math.asin(max(-1.0, min(1.0, float(R[2, 2])))), "It is a cosine, not a sine."),),
            ),
            ANGLE / 2.0,
        ),
        "The same rotation has other numbers in each convention: always say which one it is.",
        pose=Pose(start, drawing=turned(R, ZYZ)),
        withheld=FORMS,
        practice="Try all of them below.",
    )


def _axis(T: Array, pose: Pose, units: Units) -> Step:
    R = T[:3, :3]
    _, angle = axis_angle(R)
    trace = float(np.trace(R))
    cosine = (trace - 1.0) / 2.0
    return Step(
        "Axis and angle",
        "Each rotation is one turn about one axis, with trace R = 1 + 2 cos θ. For the tool, the "
        f"trace is {fixed(trace)}.",
        apart(
            Number(
                "How large is θ, from 0 to half a turn?",
                angle,
                units.angles,
                2.0 * ANGLE,
                "θ = acos((trace − 1) / 2).",
                (
                    Mistake(math.acos(max(-1.0, min(1.0, trace / 2.0))), "Subtract 1 before halving."),
                    Mistake(math.pi - angle, f"The cosine is {fixed(cosine)}: look at its sign."),
                ),
            ),
            ANGLE / 2.0,
        ),
        "The axis is the one direction that R leaves as it is.",
        pose=pose,
        withheld=FORMS | {"quaternion"},
        practice="“From tool” below draws it.",
    )


def _quaternion(T: Array, pose: Pose) -> Step:
    R = T[:3, :3]
    w = float(wxyz_from_rotation(R)[0])
    _, angle = axis_angle(R)
    return Step(
        "Quaternion",
        "The quaternion of a turn by θ about a unit axis is w = cos(θ/2), and (x, y, z) = sin(θ/2) "
        "times the axis. For "
        f"the tool, cos θ = {fixed(math.cos(angle))}.",
        apart(
            Number(
                "How large is w, taken as positive?",
                w,
                PLAIN,
                ENTRY,
                "cos²(θ/2) = (1 + cos θ) / 2.",
                (
                    Mistake(math.cos(angle), "That is cos θ. A quaternion has half the angle."),
                    Mistake((1.0 + math.cos(angle)) / 2.0, "Take the root."),
                ),
            ),
            ENTRY / 2.0,
        ),
        "q and −q are the same rotation: half a turn more of θ/2 is a whole turn more of θ.",
        pose=pose,
        withheld=FORMS | {"quaternion"},
    )


def _lock(start: Configuration, units: Units) -> Step:
    quarter_turn = units.angles.brief(math.pi / 2)
    return Step(
        "Gimbal lock",
        f"In Kinboard’s convention, {RPY.definition}, the 1st and the 3rd axis coincide at a pitch of "
        f"{quarter_turn}.",
        one_right(
            "What is lost there?",
            (
                "The angles lose one axis of small turns: roll and yaw do the same.",
                "The frame can still turn there; only these three angles cannot follow smoothly.",
            ),
            (
                (
                    "The tool can no longer turn about one axis.",
                    "That would be a singularity of the arm, not of the angles.",
                ),
                (
                    "R is no longer a rotation.",
                    "R is as good as any: choose another convention, and the lock is gone.",
                ),
            ),
            2,
        ),
        "Each set of three angles locks somewhere: Tait–Bryan angles where the second one is a "
        "quarter turn, proper "
        "Euler angles where it is zero or half a turn. R, axis with angle, and quaternions do not lock.",
        pose=Pose(start, drawing=LOCKED),
    )


def _inverse(T: Array, pose: Pose, units: Units) -> Step:
    lengths, p = units.lengths, T[:3, 3]
    back = inverse(T)[:3, 3]
    k = int(np.argmax(np.abs(back)))
    column = T[:3, k]
    vectors = [", ".join(fixed(v) for v in column.tolist()), ", ".join(lengths.number(v) for v in p.tolist())]
    return Step(
        "T⁻¹",
        "T = (R, p) is the tool in the base; T⁻¹ = (Rᵀ, −Rᵀp) is the base in the tool. Here column "
        f"{k + 1} of R is "
        f"({vectors[0]}), and p = ({vectors[1]}){lengths.suffix}.",
        apart(
            Number(
                f"What is the {'xyz'[k]} coordinate of the base’s origin, seen from the tool?",
                float(back[k]),
                lengths,
                LENGTH,
                f"Minus the scalar product of p with column {k + 1} of R.",
                (
                    Mistake(-float(p[k]), "That is −p in axes of the base. Turn it into the tool’s axes: −Rᵀp."),
                    Mistake(-float(T[k, :3] @ p), "That is a row of R. Rᵀ has the columns of R as its rows."),
                ),
            )
        ),
        "T⁻¹ needs no matrix inversion: transpose R, and turn −p.",
        pose=pose,
    )


def _chain(start: Configuration) -> Step:
    return Step(
        "A chain of frames",
        "A camera is known in the base, T₀₁, and a workpiece in the camera, T₁₂.",
        one_right(
            "Where is the workpiece in the base?",
            ("T₀₁ T₁₂", "Equal inner indices cancel: 0 1 · 1 2 = 0 2."),
            (
                ("T₁₂ T₀₁", "The inner indices 2 and 0 do not agree."),
                ("T₀₁⁻¹ T₁₂", "The inverse is T₁₀: its second index 0 does not agree with 1."),
            ),
            0,
        ),
        "Motions about own axes multiply from the right, those about fixed axes from the left.",
        pose=Pose(start, drawing={"chained": True, "chain": []}),
        practice="Add motions of both kinds to the chain below.",
    )
