"""What a visitor has set, as a short text: what the page's address holds, and what a reload restores.

The text is JSON in base64url, so that any address may carry it. It names only what differs from a fresh page: what
a visitor never touched is whatever the page that opens it begins with. It comes back from anywhere: from an old
version of this program, cut off by a mail client, or written by somebody with bad intentions. So `decode` never
raises; what it cannot use, it leaves out.

The page keeps the text for its own tab (``static/viewer.js``): viser's calls that read and write a browser's
`localStorage` reach it there.
"""

from __future__ import annotations

import base64
import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np

from app.viewer.panel.view import ViewState
from app.viewer.scene.camera import UP
from kin import Robot, Task, branch_names
from kin.transforms import Array, from_position_wxyz, wxyz_from_rotation
from kin.units import DEFAULT_UNITS, LENGTHS, Units

VERSION = 1
KEY = "kinboard"  # of the item of the page's storage
MAX_TEXT = 16_000  # characters; the bridge refuses messages of 64 KiB
FARTHEST = 1000.0  # metres of a target from the base, or of a camera
# Nine digits are a nanometre: a shared configuration is the same for every purpose, in half the text.
DIGITS = 9
CAMERA_DIGITS = 4  # of metres: nobody sees the difference
CAMERA_ROOM = 100.0  # how much nearer or farther than an arm's reach a camera may be

FRESH = ViewState()
_ADDRESS = re.compile(r"https?://[A-Za-z0-9._:%\[\]-]+/[A-Za-z0-9._~%/-]*")


@dataclass(frozen=True, eq=False)
class PageState:
    """What a shared address restores; None and empty: as on a fresh page.

    Attributes:
        robot: id of the arm.
        q: configuration ``(n,)`` inside the limits.
        target: pose ``(4, 4)`` that was asked for and is not reached, else None.
        branch: as `kin.solve_ik` takes it.
        lesson: key of the lesson on show.
        units: of angles and lengths.
        features: `Feature.state` of each feature by its key, unread.
        locks: indices of the joints that are locked, each at its value in `q`.
        camera: viewpoint ``(3, 3)`` as `VisitorCamera.chosen`; None: the default view.
        missing: the arm that was asked for, if there is none of that id here.
    """

    robot: str | None = None
    q: Array | None = None
    target: Array | None = None
    task: Task | None = None
    branch: str | None = None
    lesson: str | None = None
    units: Units = DEFAULT_UNITS
    view: ViewState = field(default_factory=ViewState)
    features: dict[str, dict[str, object]] = field(default_factory=dict)
    locks: tuple[int, ...] = ()
    camera: Array | None = None
    missing: str = ""


@dataclass(frozen=True)
class PageMemory:
    """What a page knows of itself: the address of the service as its visitor sees it, and the state it kept."""

    address: str = ""
    state: str = ""


def encode(state: PageState) -> str:
    """The state as a text of letters, digits, ``-`` and ``_``.

    What the features tell is left out when the text would be longer than `decode` reads.
    """
    said: dict[str, Any] = {"v": VERSION}
    if state.robot is not None:
        said["robot"] = state.robot
    if state.q is not None:
        said["q"] = _rounded(state.q)
    if state.target is not None:
        said["target"] = _rounded(state.target[:3, 3]) + _rounded(wxyz_from_rotation(state.target[:3, :3]))
    for name in ("task", "branch", "lesson"):
        if getattr(state, name) is not None:
            said[name] = getattr(state, name)
    if state.locks:
        said["locks"] = list(state.locks)
    if state.camera is not None:
        position, look_at, up = (_rounded(row, CAMERA_DIGITS) for row in state.camera)
        said["camera"] = position + look_at + (up if up != UP.tolist() else [])
    if not state.units.degrees:
        said["units"] = "rad"
    if state.units.length != DEFAULT_UNITS.length:
        said["length"] = state.units.length
    view = {name: value for name, value in vars(state.view).items() if value != getattr(FRESH, name)}
    if view:
        said["view"] = view
    if state.features:
        said["features"] = state.features
    text = _pack(said)
    if len(text) > MAX_TEXT:
        said.pop("features", None)
        text = _pack(said)
    return text


def decode(text: str, robots: Sequence[Robot]) -> PageState:
    """The state that a text tells, as far as it can be used with these arms; never raises.

    Without a usable arm, whatever belongs to an arm is left out too. Lessons and features know best what they
    can use: their parts are not looked into.
    """
    said = _unpack(text)
    if said.get("v") != VERSION:
        return PageState()
    asked = said.get("robot", robots[0].id)
    robot = next((r for r in robots if r.id == asked), None)
    lesson = said.get("lesson")
    features = said.get("features")
    common: dict[str, Any] = {
        "lesson": lesson if isinstance(lesson, str) else None,
        "units": _units(said),
        "view": _view(said.get("view")),
        "features": _features(features),
    }
    if robot is None:
        return PageState(missing=asked[:80] if isinstance(asked, str) else "", **common)
    task, branch = said.get("task"), said.get("branch")
    known = ("seed", *branch_names(robot)) if branch_names(robot) else ()
    return PageState(
        robot=robot.id,
        q=_configuration(said.get("q"), robot),
        target=_pose(said.get("target")),
        task=task if task in _TASKS else None,
        branch=branch if branch in known else None,
        locks=_joints(said.get("locks"), robot),
        camera=_viewpoint(said.get("camera"), robot),
        **common,
    )


def read_memory(text: str | None) -> PageMemory:
    """What a page answered; what is no address or no text is left empty."""
    said = _parse(text or "")
    address, state = said.get("address"), said.get("state")
    usable = isinstance(address, str) and len(address) < 500 and _ADDRESS.fullmatch(address)
    return PageMemory(str(address) if usable else "", state if isinstance(state, str) else "")


_TASKS: tuple[Task, ...] = get_args(Task)


def _pack(said: dict[str, Any]) -> str:
    text = json.dumps(said, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return base64.urlsafe_b64encode(text.encode()).rstrip(b"=").decode()


def _unpack(text: str) -> dict[str, Any]:
    if len(text) > MAX_TEXT:
        return {}
    try:
        raw = base64.urlsafe_b64decode(text + "=" * (-len(text) % 4)).decode()
    except ValueError:  # not base64, not UTF-8, not ASCII
        return {}
    return _parse(raw)


def _parse(text: str) -> dict[str, Any]:
    try:
        said = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return said if isinstance(said, dict) else {}


def _rounded(values: Array, digits: int = DIGITS) -> list[float]:
    # Adding zero turns -0.0 into 0.0.
    return [round(value, digits) + 0.0 for value in values.tolist()]


def _numbers(value: object, count: int) -> Array | None:
    if not isinstance(value, list) or len(value) != count:
        return None
    if not all(isinstance(item, int | float) and not isinstance(item, bool) for item in value):
        return None
    try:
        numbers = np.array([float(item) for item in value])
    except OverflowError:  # an integer of a thousand digits
        return None
    return numbers if np.isfinite(numbers).all() else None


def _configuration(value: object, robot: Robot) -> Array | None:
    q = _numbers(value, robot.n)
    if q is None or not robot.in_limits(q, slack=1e-6):
        return None
    return robot.clip(q)


def _pose(value: object) -> Array | None:
    numbers = _numbers(value, 7)
    if numbers is None or np.abs(numbers[:3]).max() > FARTHEST:
        return None
    if not math.isclose(math.hypot(*numbers[3:].tolist()), 1.0, abs_tol=1e-3):
        return None
    return from_position_wxyz(numbers[:3], numbers[3:])


def _joints(value: object, robot: Robot) -> tuple[int, ...]:
    told = value if isinstance(value, list) else []
    known = {item for item in told if type(item) is int and 0 <= item < robot.n}  # True is an int too
    return tuple(sorted(known))


def _viewpoint(value: object, robot: Robot) -> Array | None:
    numbers = _numbers(value, 6)
    numbers = _numbers(value, 9) if numbers is None else np.append(numbers, UP)
    if numbers is None or np.abs(numbers).max() > FARTHEST:
        return None
    position, look_at, up = numbers.reshape(3, 3)
    away = float(np.linalg.norm(position - look_at))
    aside = float(np.linalg.norm(look_at - robot.T_world_base[:3, 3]))
    if not robot.reach / CAMERA_ROOM <= away <= robot.reach * CAMERA_ROOM or aside > robot.reach * CAMERA_ROOM:
        return None
    if not math.isclose(float(np.linalg.norm(up)), 1.0, abs_tol=1e-3):
        return None
    return numbers.reshape(3, 3)


def _units(said: dict[str, Any]) -> Units:
    length = next((unit for unit in LENGTHS if unit == said.get("length")), DEFAULT_UNITS.length)
    return Units(said.get("units") != "rad", length)


def _view(value: object) -> ViewState:
    told = value if isinstance(value, dict) else {}
    return ViewState(**{name: told[name] for name in vars(FRESH) if isinstance(told.get(name), bool)})


def _features(value: object) -> dict[str, dict[str, object]]:
    told = value if isinstance(value, dict) else {}
    return {key: state for key, state in told.items() if isinstance(state, dict)}
