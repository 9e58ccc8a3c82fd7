"""Targets and options of ``ik``, ``ik/path`` and ``reachable``.

A target is where the tool should go, in whichever form its sender has it. A pose as this service answers it
(``matrix`` and ``position`` and ``wxyz`` together) is a target as it stands, so an answer of ``fk`` can be sent to
``ik`` unchanged. Options are those of `kin.IKOptions`, of which `takes` makes fields of a request.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import cycle
from typing import Annotated, Any, TypeVar, get_type_hints

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, Tag, create_model

from app.api import schemas
from app.api.arms.frames import FrameName, FramesBody, WorkpiecesBody
from app.api.problems import invalid
from app.api.schemas import Number, OneOf, Vector3, Vector4, integral, numbers
from app.shared.options import declared
from app.shared.problems import FieldError, from_input_error, show
from app.shared.settings import Settings
from kin import IKOptions, InputError, JointConstraints, Robot
from kin.collision.obstacles import KINDS, LONGEST_NAME, MOST_OBSTACLES, Shape, checked_obstacles
from kin.frames import WORLD
from kin.ik import Task
from kin.ik.options import DEFAULTS, PathKeywords
from kin.ik.problem import FAR, read_pose
from kin.kernels.checks import straighten_many
from kin.poses import FORMS as POSES
from kin.poses import far_from_unit
from kin.poses.fields import ORIENTATIONS, orientation, text_target, whole_matrix
from kin.solvers.contract import POSE
from kin.transforms import Array, frame_from_approach, frames_from_approaches, rotations_from_wxyz
from kin.typed import LONGEST_LIST

AGREEMENT = 1e-6  # metres, and matrix entries
_IDENTITY = np.eye(4)
_AT_ONCE = 512  # targets that are read between two offers to other threads
# A task, and what a text gives that is too little for it.
_TOO_LITTLE = {("pose", "position"), ("pose", "approach"), ("approach", "position")}
FORMS = {
    "pose": "`position` and `wxyz` (or `xyzw`, `rpy`, `rotvec`), or `matrix`, or `text`",
    "approach": "`position` and `approach`, or `position` and `wxyz`, or `matrix`, or `text`",
    "position": "`position`, or `matrix`, or `text`",
}


class Target(schemas.Body):
    """A target: `position` with one orientation, `approach` or nothing; or `matrix`; or `text`."""

    frame: FrameName | None = Field(
        None,
        description="The frame in which this target is: world (by default), base (that of the first DH row), the "
        "name of one of `workpieces`, or tool: where the tool is at the present configuration, which is `q_seed` "
        "(`q_start` of a path).",
        examples=["world"],
    )

    position: Vector3 | None = Field(
        None, description="Where the tool's point should be: x, y, z in metres.", examples=[[0.03, 0.154, -0.2]]
    )
    wxyz: Vector4 | None = Field(
        None,
        description="Orientation of the tool as a quaternion w, x, y, z (scalar first), of length 1; it is "
        "normalised where its length differs by 0.1 at most.",
        examples=[[1.0, 0.0, 0.0, 0.0]],
    )
    xyzw: Vector4 | None = Field(
        None,
        description="The same with the scalar last, in the place of `wxyz`.",
        examples=[[0.0, 0.0, 0.0, 1.0]],
    )
    rpy: Vector3 | None = Field(
        None,
        description="Roll, pitch, yaw in radians in the place of `wxyz`: Rz(yaw) Ry(pitch) Rx(roll).",
        examples=[[0.0, 1.5708, 0.0]],
    )
    rotvec: Vector3 | None = Field(
        None,
        description="A rotation vector in the place of `wxyz`: the axis times the angle in radians.",
        examples=[[0.0, 3.1416, 0.0]],
    )
    approach: Vector3 | None = Field(
        None,
        description="Direction the tool's z axis should have; its length does not matter.",
        examples=[[0.0, 0.0, -1.0]],
    )
    matrix: Annotated[list[Vector4], Field(min_length=3, max_length=4, fail_fast=True)] | None = Field(
        None,
        description="4×4 homogeneous transform, row by row; positions in metres. The last row, 0, 0, 0, 1, may be "
        "left out.",
    )
    text: Annotated[str, Field(max_length=LONGEST_LIST)] | None = Field(
        None,
        description="The target as it is typed, or as it stands on a maker's pendant or in its programs; besides "
        "it only `form` and `frame` may be given.",
        examples=["X 600 Y 100 Z 300 A 0 B 90 C 0"],
    )
    form: Annotated[str, OneOf(POSES)] | None = Field(
        None,
        description="How the numbers of `text` are meant: a notation in metres and radians, or a maker's in the "
        "units of its pendants. By default what the text shows.",
    )

    def resolve(self, task: Task | None, field: str, maker: str = "") -> tuple[Task, Array]:
        """The task it asks for, if none is given the one its form implies, and T_frame_tool ``(4, 4)``.

        `maker`: of the arm, which decides what an ambiguous `text` means.

        Raises:
            ProblemError: 422 naming `field` and what is missing, contradicts, or is no rotation.
        """
        try:
            if self.text is not None:
                return self._typed(task, field, maker)
            return self._task(task, field), self._transform(field)
        except InputError as error:
            prefix = "" if error.field.startswith(field) else f"{field}."
            raise invalid(from_input_error(error, prefix)) from None

    def in_world(self, task: Task | None, field: str, maker: str = "") -> tuple[Task, Array]:
        """`resolve` where targets are in the world frame; raises 422 for one that names another frame, too."""
        if self.frame not in (None, WORLD):
            error = FieldError(field=f"{field}.frame", value=show(self.frame), expected=f'"{WORLD}"')
            raise invalid(error, hint="Here poses are in the world frame.")
        return self.resolve(task, field, maker)

    def _given(self) -> list[str]:
        """The fields that say where the tool should be."""
        return [name for name in type(self).model_fields if name != "frame" and getattr(self, name) is not None]

    def _typed(self, task: Task | None, field: str, maker: str) -> tuple[Task, Array]:
        """The task and the pose of a text."""
        others = [name for name in self._given() if name not in ("text", "form")]
        if others:
            raise InputError(f"{field}.{others[0]}", getattr(self, others[0]), "nothing besides `text` and `form`")
        implied, T = text_target(self.text, self.form, field, maker)
        if task is not None and (task, implied) in _TOO_LITTLE:
            raise InputError(f"{field}.text", self.text, f"a whole pose for task {task}")
        return task or implied, T

    def _task(self, task: Task | None, field: str) -> Task:
        """The task, by default the one that the fields imply; raises `InputError` for fields that do not fit."""
        turned = [name for name in ORIENTATIONS if getattr(self, name) is not None]
        if task is None:
            is_point = self.position is not None and not turned and self.matrix is None
            task = "approach" if self.approach is not None else "position" if is_point else "pose"
        usable = self.matrix is not None or (
            self.position is not None
            and (task == "position" or bool(turned) or (task == "approach" and self.approach is not None))
        )
        if not usable:
            given = self._given()
            raise _wrong(
                field, f"only {', '.join(given)}" if given else "nothing", f"{FORMS[task]} for task {task}"
            )
        if self.form is not None:
            raise _wrong(f"{field}.form", self.form, "`text` as well, whose numbers it explains")
        if len(turned) > 1:
            raise _wrong(f"{field}.{turned[1]}", f"{turned[1]} besides {turned[0]}", "one of the two")
        if self.approach is not None and (turned or self.matrix is not None):
            raise _wrong(f"{field}.approach", "an approach besides an orientation", "one of the two")
        return task

    @property
    def kind(self) -> tuple[bool, bool, bool, bool, bool]:
        """Whether position, wxyz, approach, matrix, and one of the other fields are given."""
        others = (self.xyzw, self.rpy, self.rotvec, self.text, self.form)
        other = any(value is not None for value in others)
        position, wxyz = self.position is not None, self.wxyz is not None
        return position, wxyz, self.approach is not None, self.matrix is not None, other

    def _rotation(self) -> tuple[str, Array] | None:
        """The name of the orientation that is given, and its rotation ``(3, 3)``."""
        for name in ORIENTATIONS:
            if (values := getattr(self, name)) is not None:
                return name, orientation(name, values)
        return None

    def _transform(self, field: str) -> Array:
        turned = self._rotation()
        if self.matrix is None:
            assert self.position is not None
            # These numbers have been checked: nothing is left to do for a point.
            T = _IDENTITY.copy()
            T[:3, 3] = self.position
            if turned is not None:
                T[:3, :3] = turned[1]
            elif self.approach is not None:
                T[:3, :3] = frame_from_approach(self.approach)
            return T
        # As it was sent, so that its digits tell how closely it can be met.
        T = np.array(whole_matrix(self.matrix))
        error = read_pose(T, POSE, f"{field}.matrix", always=turned is not None)[1]
        if self.position is not None and np.abs(T[:3, 3] - self.position).max() > AGREEMENT:
            raise _wrong(
                f"{field}.position", str(self.position), "the position the matrix has, or only one of them"
            )
        if turned is not None:
            name, R = turned
            if np.abs(T[:3, :3] - R).max() > max(AGREEMENT, 2.0 * error):
                given = str(getattr(self, name))
                raise _wrong(f"{field}.{name}", given, "the rotation the matrix has, or only one of them")
        return T


def _placed(targets: list[Target], rotations: Array | None) -> Array | None:
    """Poses ``(k, 4, 4)`` at the positions of targets with these rotations ``(k, 3, 3)``; None without them."""
    if rotations is None:
        return None
    T = np.zeros((len(targets), 4, 4))
    T[:, :3, :3], T[:, :3, 3], T[:, 3, 3] = rotations, [each.position for each in targets], 1.0
    return T


def _rotations(wxyz: Array) -> Array | None:
    """The rotations of quaternions ``(k, 4)``; None if the length of one is far from 1."""
    return None if far_from_unit(wxyz).any() else rotations_from_wxyz(wxyz)


def _with_matrices(targets: list[Target]) -> Array | None:
    """The matrices of targets ``(k, 4, 4)`` as they were sent; None if one of them is not exactly a pose."""
    T = np.array([whole_matrix(each.matrix) for each in targets])
    errors = np.empty(len(T))
    straighten_many(T, FAR, np.empty_like(T), errors)
    return T if (errors >= 0.0).all() else None


# By the form of a target: the task it implies, the tasks it can have, and the poses of several.
_TOGETHER: dict[tuple[bool, ...], tuple[Task, tuple[Task, ...], Callable[[list[Target]], Array | None]]] = {
    (True, False, False, False, False): (
        "position",
        ("position",),
        lambda targets: _placed(targets, np.broadcast_to(np.eye(3), (len(targets), 3, 3))),
    ),
    (True, True, False, False, False): (
        "pose",
        ("pose", "approach", "position"),
        lambda targets: _placed(targets, _rotations(np.array([each.wxyz for each in targets]))),
    ),
    (True, False, True, False, False): (
        "approach",
        ("approach", "position"),
        lambda targets: _placed(targets, frames_from_approaches(np.array([each.approach for each in targets]))),
    ),
    (False, False, False, True, False): ("pose", ("pose", "approach", "position"), _with_matrices),
}


def _wrong(field: str, value: str, expected: str) -> Exception:
    return invalid(FieldError(field=field, value=value, expected=expected))


def single_or_list(value: object) -> str:
    """Tag of a value that may be one item or a list of items."""
    return "many" if isinstance(value, list) else "one"


BranchName = Annotated[str, Field(max_length=200)]


@dataclass(frozen=True, slots=True)
class Goal:
    """A target that has been read.

    Attributes:
        task: what it asks for.
        T: pose of the tool in the world frame ``(4, 4)``.
        rounding: how rounded it is besides the entries of `T`: frames of the request, and the target in its own.
    """

    task: Task
    T: Array
    rounding: float = 0.0


def _of(field: str) -> str:
    """Which obstacles have a field, in words."""
    return "Of a " + " or ".join(name for name, kind in KINDS.items() if field in kind.fields)


class ObstacleBody(schemas.Body):
    """A body at rest in the world frame."""

    shape: Shape = Field(
        description=" ".join(f"{name}: {kind.about}." for name, kind in KINDS.items() if kind.about)
    )
    xyz: Vector3 = Field([0.0, 0.0, 0.0], description="Its centre in metres; of a table, the middle of its top.")
    rpy: Vector3 = Field([0.0, 0.0, 0.0], description="Roll, pitch, yaw in radians: Rz(yaw) Ry(pitch) Rx(roll).")
    size: Vector3 | None = Field(None, description=f"{_of('size')}: sides along x, y and z in metres.")
    radius: Number | None = Field(None, description=f"{_of('radius')}, in metres.")
    height: Number | None = Field(None, description=f"{_of('height')}, in metres.")
    name: str = Field("", max_length=LONGEST_NAME, description="For people.")


# Options that are no choice, switch or number: their types in JSON.
_TYPES: dict[str, Any] = {
    "mask": Annotated[list[Annotated[bool, Field(strict=True)]], numbers(6)] | None,
    "limits": list[Annotated[list[Number], numbers(2)] | None] | None,
    "locked": list[Number | None] | None,
    "branch": Annotated[
        Annotated[BranchName, Tag("one")]
        | Annotated[list[BranchName], Field(min_length=1, max_length=16), Tag("many")],
        Discriminator(single_or_list),
    ]
    | None,
    "redundancy": Annotated[
        Annotated[Number, Tag("one")] | Annotated[dict[str, Number], Tag("many")],
        Discriminator(lambda value: "many" if isinstance(value, dict) else "one"),
    ]
    | None,
    "max_solutions": Annotated[int, Field(ge=1, le=10_000, strict=True), BeforeValidator(integral)] | None,
    "obstacles": Annotated[list[ObstacleBody], Field(max_length=MOST_OBSTACLES)],
}

_Body = TypeVar("_Body", bound=schemas.Body)


def takes(names: Iterable[str]) -> Callable[[type[_Body]], type[_Body]]:
    """Decorator: adds to a request body the fields of these options that it does not have yet.

    Type, default, range and description are those of `kin.IKOptions`.
    """

    def add(model: type[_Body]) -> type[_Body]:
        fields: dict[str, Any] = {name: _field(name) for name in names if name not in model.model_fields}
        return create_model(
            model.__name__, __base__=model, __doc__=model.__doc__, __module__=model.__module__, **fields
        )

    return add


def _field(name: str) -> tuple[Any, Any]:
    """Type of an option in JSON, and its default and description."""
    option, default = declared()[name], DEFAULTS[name]
    text = option.sentence.replace("none for", "null for").replace("(lower, upper)", "[lower, upper]")
    given = Field([] if default == () else default, description=text)
    if name in _TYPES:
        return _TYPES[name], given
    kind = (get_type_hints(JointConstraints) | get_type_hints(IKOptions, include_extras=True))[name]
    if option.unit:
        (allowed,) = kind.__metadata__
        return Annotated[float, Field(ge=allowed.least, le=allowed.most, strict=True)] | None, given
    return Annotated[kind, Field(strict=True)] if option.switch else kind, given


@takes(["avoid_self_collision", "obstacles"])
class AvoidingBody(FramesBody):
    """What the arm must not touch."""

    @cached_property
    def keywords(self) -> dict[str, Any]:
        """The options in this request as keywords of the core; raises 422 naming ``obstacles[i]``."""
        fields = type(self).model_fields
        given = {name: getattr(self, name) for name in DEFAULTS if name in fields}
        try:
            given["obstacles"] = checked_obstacles(
                [each.model_dump(exclude_none=True) for each in given["obstacles"]]
            )
        except InputError as error:
            raise invalid(from_input_error(error)) from None
        return given


@lru_cache(maxsize=256)
def _options(given: tuple[tuple[str, Any], ...]) -> IKOptions:
    """Options of the core by their keywords. Most requests give the same ones."""
    return IKOptions.of(None, **dict(given))


@takes(name for name in DEFAULTS if name in PathKeywords.__optional_keys__)
class OptionsBody(AvoidingBody, WorkpiecesBody):
    """Task, joint constraints, branch, errors that count as none, what is avoided."""

    task: Task | None = Field(
        None,
        description=f"{declared()['task'].sentence} By default what each target's form implies: "
        "`approach` given → approach, `position` alone → position, else pose.",
    )

    def options(self, task: Task) -> IKOptions:
        """These fields as options of the core, for a task that the targets may imply."""
        given = tuple({**self.keywords, "task": task}.items())
        try:
            return _options(given)
        except TypeError:  # lists cannot be looked up
            return _options.__wrapped__(given)

    def resolve_all(
        self, robot: Robot, target: Target | list[Target], settings: Settings, q: Sequence[Array | None] = (None,)
    ) -> tuple[list[Goal], bool]:
        """`resolve` of one target or of each in a list, and whether it was one.

        All are read before anything is computed: a mistake in the last one costs nothing. Raises 413 for too many.

        Args:
            robot: the arm, with the base and tool of this request.
            q: present configurations, one per target or one for all; None: not known.
        """
        if isinstance(target, Target):
            return [self.resolve(robot, target, "target", q[0])], True
        schemas.check_batch("target", len(target), settings)
        present = cycle(q) if len(q) == 1 else q
        places = zip(target, present, range(len(target)), strict=False)
        return [self.resolve(robot, each, f"target[{i}]", at) for each, at, i in places], False

    def poses_of_all(self, targets: list[Target]) -> tuple[Task, Array] | None:
        """The task and the poses ``(k, 4, 4)`` of targets of one form in the world frame, all read at once.

        They are those of `resolve_all`. None for others, and if one of them is invalid.
        """
        kind = targets[0].kind
        if kind not in _TOGETHER or self.constant_frames or self.keywords["mask"] is not None:
            return None
        implied, fits, poses = _TOGETHER[kind]
        task: Task = self.task or implied
        if task not in fits or any(each.kind != kind or each.frame not in (None, WORLD) for each in targets):
            return None
        pieces = [poses(targets[k : k + _AT_ONCE]) for k in range(0, len(targets), _AT_ONCE)]
        found = [piece for piece in pieces if piece is not None]
        return (task, np.concatenate(found)) if len(found) == len(pieces) else None

    def resolve(self, robot: Robot, target: Target, field: str, q: Array | None = None) -> Goal:
        """The target in the world frame; raises `ProblemError` naming `field`."""
        task, T = self._in_its_frame(target, field, robot.maker)
        frame = target.frame or WORLD
        if frame == WORLD:
            return Goal(task, T, self.rounding(robot, frame, T) if self.constant_frames else 0.0)
        T_world_frame, own = self.pose_of(robot, frame, f"{field}.frame", q), 0.0
        if target.matrix is not None:
            T, own = read_pose(T, POSE, f"{field}.matrix", always=robot.n < 6)
        return Goal(task, T_world_frame @ T, own + self.rounding(robot, frame, T))

    def _in_its_frame(self, target: Target, field: str, maker: str) -> tuple[Task, Array]:
        """The task, and the target's pose in its own frame.

        With a mask without rotations, a target may be a point alone.
        """
        mask = self.keywords["mask"]
        if mask is None:
            return target.resolve(self.task, field, maker)
        _, T = target.resolve("pose" if any(mask[3:]) else "position", field, maker)
        return self.task or "pose", T
