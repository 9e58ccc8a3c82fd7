"""The state of a page as a short text: the page's URL holds it, and a reload restores it.

The text is JSON in base64url, so that any URL may carry it; a long one is compressed. It contains only what
differs from a fresh page; everything else takes the defaults of the page that opens it. The text may come from an
old version of this program, truncated by a mail client, or from somebody with bad intentions. So `decode` never
raises; it ignores what it cannot use.

``static/viewer.js`` stores the text for its own tab, and sends it as the first message of the page's channel.
"""

from __future__ import annotations

import base64
import json
import math
import re
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple, get_args

import numpy as np

from app.viewer import frames, own_arm
from app.viewer.activity.review import FARTHEST_ZONE
from app.viewer.frames import Frames
from app.viewer.labels import TEXT_SIZES
from app.viewer.obstacles import placed
from app.viewer.obstacles.placed import Obstacles
from app.viewer.own_arm import OwnArm
from app.viewer.panel.script import read_page_json
from app.viewer.scene.viewpoints import UP
from app.viewer.session.choices import ViewState
from kin import KinematicsError, Robot, branch_names, robot_to_dict
from kin.ik import Task
from kin.poses import FARTHEST
from kin.transforms import Array, pose_from_position_wxyz, wxyz_from_rotation
from kin.units import DEFAULT_UNITS, LENGTHS, Units

VERSION = 1
# Names of the notices that have a state. For one under `KEY`, the page adds an entry to the browser's history;
# under the next two, it replaces the present entry (another viewpoint) or returns to the entry with this state.
KEY, KEY_REPLACE, KEY_RETURN = "state", "state-replace", "state-return"
KEY_LAST = "state-last"  # the browser's next page offers it
MAX_TEXT = 16_000  # characters; a message of a page has at most 64 KiB
LONG = 2000  # characters; longer texts are compressed
COMPRESSED = "z"  # begins a compressed text; base64 of JSON never begins with it
MOST_BYTES = 64_000  # of JSON that is unpacked from a text
# Nine digits are a nanometre: a shared configuration is practically exact, in half the text.
DIGITS = 9
CAMERA_DIGITS = 4  # of metres; finer differences are invisible
CAMERA_RANGE = 100.0  # largest ratio of a camera's distance to the arm's reach, and the reverse

EMBEDDED = ("scene", "panel")  # the scene alone, or with a small panel
FRESH: Final = ViewState()
_ADDRESS = re.compile(r"https?://[A-Za-z0-9._:%\[\]-]+/[A-Za-z0-9._~%/-]*")


@dataclass(frozen=True, eq=False)
class PageState:
    """The state that a shared URL restores; None and empty: as on a fresh page.

    Attributes:
        robot: id of the robot, which may be that of `own`.
        q: configuration ``(n,)`` within the limits.
        target: target pose ``(4, 4)`` that the tool does not have yet, else None.
        branch: requested branch, as `kin.solve_ik` takes it.
        lesson: key of the open lesson.
        units: of angles and lengths.
        features: `Feature.state` of each feature by its key; not validated here.
        locks: indices of the locked joints; each is locked at its value in `q`.
        camera: viewpoint ``(3, 3)`` as `VisitorCamera.chosen`; None: the default view.
        own: the visitor's own arm, whether or not it is on show.
        frames: the workpieces, and the frame in which poses are shown.
        obstacles: bodies around the arm.
        missing: the requested robot's id, if this service does not have that robot.
        unreadable: whether there was a text that is not a state.
        ignored: names of entries that were invalid.
        refused: why the visitor's own arm is invalid.
    """

    robot: str | None = None
    q: Array | None = None
    target: Array | None = None
    task: Task | None = None
    branch: str | None = None
    lesson: str | None = None
    units: Units = DEFAULT_UNITS
    view: ViewState = FRESH
    features: dict[str, dict[str, object]] = field(default_factory=dict)
    locks: tuple[int, ...] = ()
    camera: Array | None = None
    own: OwnArm | None = None
    frames: Frames = field(default_factory=Frames)
    obstacles: Obstacles = ()
    missing: str = ""
    unreadable: bool = False
    ignored: tuple[str, ...] = ()
    refused: str = ""


@dataclass(frozen=True)
class StoredPage:
    """What a page remembers when it connects.

    Attributes:
        address: the service's address as the visitor sees it.
        state: the encoded state.
        dark: whether the visitor's system is dark.
        text_size: the name of the text size.
        shown: key in the address: of an arm that is moved from outside of the page (`app.viewer.shown`), or of the
            code that is reserved for the page (`app.live.reserved`).
        zone: minutes by which the visitor's clock is ahead of UTC.
        embedded: how the page is embedded in another: ``"scene"``, ``"panel"`` or not at all.
        robot: id of an arm in the address, which a page without a state begins with.
    """

    address: str = ""
    state: str = ""
    dark: bool = False
    text_size: str = "Normal"
    embedded: str = ""
    shown: str = ""
    zone: int = 0
    robot: str = ""


def opened_with(stored: StoredPage, known: Iterable[Robot]) -> PageState:
    """The state with which a page opens: its own, or else a fresh one with the arm that its address names."""
    robots = tuple(known)
    if stored.state or not stored.robot:
        return decode(stored.state, robots)
    found = next((robot.id for robot in robots if robot.id == stored.robot), None)
    return PageState(missing=stored.robot) if found is None else PageState(robot=found)


def with_arm(robot: Robot, q: Array | None, known: Iterable[Robot]) -> PageState:
    """A fresh page with this arm: by its id if it is one of the `known`, else as the visitor's own."""
    if any(each.id == robot.id and each == robot for each in known):
        return PageState(robot=robot.id, q=q)
    own = own_arm.own_arm(robot_to_dict(robot))
    return PageState(robot=own.robot.id, own=own, q=q)


class Written(NamedTuple):
    """A state as a text, and the keys of the features, or "obstacles", that it had no room for."""

    text: str
    left_out: tuple[str, ...] = ()


def encode(state: PageState) -> str:
    """The state as a text of letters, digits, ``-`` and ``_``, as far as there is room: see `write`."""
    return write(state).text


def encode_features(features: dict[str, dict[str, object]], lesson: str) -> str:
    """A state with nothing but these states of features, at this lesson, as text."""
    return encode(PageState(lesson=lesson, features=features))


def write(state: PageState) -> Written:
    """The state as a text of letters, digits, ``-`` and ``_``.

    While the text would be longer than `decode` accepts, the longest state of a feature is left out; then the
    obstacles are.
    """
    data = _data(state)
    text, left_out = _pack(data), list[str]()
    for key in sorted(state.features, key=lambda key: -len(json.dumps(state.features[key]))):
        if len(text) > MAX_TEXT:
            left_out.append(key)
            data["features"] = {other: one for other, one in data["features"].items() if other != key}
            text = _pack(data)
    if len(text) > MAX_TEXT and data.pop("obstacles", None) is not None:
        left_out.append("obstacles")
        text = _pack(data)
    return Written(text, tuple(left_out))


def equal(a: PageState, b: PageState) -> bool:
    """Whether the texts of two states would be the same if there were room for everything."""
    return _json(_data(a)) == _json(_data(b))


def _data(state: PageState) -> dict[str, Any]:
    """What differs from a fresh page, as JSON."""
    data: dict[str, Any] = {"v": VERSION}
    if state.own is not None:
        data["own"] = own_arm.pack(state.own)
    if state.robot is not None:
        shown = state.own is not None and state.own.robot.id == state.robot
        data["robot"] = own_arm.KEY if shown else state.robot
    if state.q is not None:
        data["q"] = _rounded(state.q)
    if state.target is not None:
        data["target"] = _rounded(state.target[:3, 3]) + _rounded(wxyz_from_rotation(state.target[:3, :3]))
    for name in ("task", "branch", "lesson"):
        if getattr(state, name) is not None:
            data[name] = getattr(state, name)
    if state.locks:
        data["locks"] = list(state.locks)
    if state.camera is not None:
        position, look_at, up = (_rounded(row, CAMERA_DIGITS) for row in state.camera)
        data["camera"] = position + look_at + (up if up != UP.tolist() else [])
    if state.frames != Frames():
        data["frames"] = frames.pack(state.frames)
    if state.obstacles:
        data["obstacles"] = placed.pack(state.obstacles)
    if not state.units.degrees:
        data["units"] = "rad"
    if state.units.length != DEFAULT_UNITS.length:
        data["length"] = state.units.length
    view = {name: entry for name, entry in state.view.state().items() if entry != FRESH.state()[name]}
    if view:
        data["view"] = view
    if state.features:
        data["features"] = state.features
    return data


def decode(text: str, robots: Sequence[Robot]) -> PageState:
    """The state in a text, as far as it is valid for these robots; never raises.

    Without a valid robot, everything that depends on a robot is ignored. The states of lessons and features
    are not validated here: `Feature.restore` does that.
    """
    data = _unpack(text)
    if data.get("v") != VERSION:
        return PageState(unreadable=bool(text))
    own, refused = _own(data.get("own"))
    requested = data.get("robot", robots[0].id)
    if requested == own_arm.KEY:
        robot = None if own is None else own.robot
    else:
        robot = next((r for r in robots if r.id == requested), None)
    lesson = data.get("lesson")
    features = data.get("features")
    common: dict[str, Any] = {
        "lesson": lesson if isinstance(lesson, str) else None,
        "units": _units(data),
        "view": FRESH.restored(data.get("view"), robots[0]),
        "features": _features(features),
        "own": own,
        "refused": refused,
        "frames": frames.unpack(data.get("frames")),
        "obstacles": placed.unpack(data.get("obstacles")),
    }
    if robot is None:
        return PageState(missing=requested[:80] if isinstance(requested, str) else "", **common)
    task, branch = data.get("task"), data.get("branch")
    valid = ("seed", *branch_names(robot)) if branch_names(robot) else ()
    entries: dict[str, Any] = {
        "q": _configuration(data.get("q"), robot),
        "target": _pose(data.get("target")),
        "task": task if task in _TASKS else None,
        "branch": branch if branch in valid else None,
        "camera": _viewpoint(data.get("camera"), robot),
    }
    ignored = tuple(
        _NAMES[name] for name, value in entries.items() if value is None and data.get(name) is not None
    )
    locks = _joints(data.get("locks"), robot)
    return PageState(robot=robot.id, locks=locks, ignored=ignored, **entries, **common)


def read_stored_page(remembered: object) -> StoredPage:
    """What a page remembers, from a value of JSON; invalid parts are left empty."""
    data: dict[str, Any] = remembered if isinstance(remembered, dict) else {}
    address, state = data.get("address"), data.get("state")
    usable = isinstance(address, str) and len(address) < 500 and _ADDRESS.fullmatch(address)
    state = state if isinstance(state, str) else ""
    text_size = data.get("text")
    size = text_size if isinstance(text_size, str) and text_size in TEXT_SIZES else "Normal"
    embedded = next((mode for mode in EMBEDDED if mode == data.get("embedded")), "")
    shown = data.get("shown")
    shown = shown if isinstance(shown, str) else ""
    zone = data.get("zone")
    zone = zone if type(zone) is int and abs(zone) <= FARTHEST_ZONE else 0
    dark, robot = data.get("dark") is True, data.get("robot")
    robot = robot[:80] if isinstance(robot, str) else ""
    return StoredPage(str(address) if usable else "", state, dark, size, embedded, shown, zone, robot)


_TASKS: tuple[Task, ...] = get_args(Task)
_NAMES = {"q": "joint values", "target": "target", "task": "task", "branch": "posture", "camera": "viewpoint"}


def _pack(data: dict[str, Any]) -> str:
    """The text of these entries; longer than `MAX_TEXT`: there is no room for them."""
    raw = _json(data)
    text = _base64(raw)
    if len(text) > LONG and len(raw) <= MOST_BYTES:
        return COMPRESSED + _base64(zlib.compress(raw, 9))
    return text


def _json(data: dict[str, Any]) -> bytes:
    return json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()


def _base64(raw: bytes) -> str:
    return base64.urlsafe_b64encode(raw).rstrip(b"=").decode()


def _unpack(text: str) -> dict[str, Any]:
    if len(text) > MAX_TEXT:
        return {}
    compressed = text.startswith(COMPRESSED)
    text = text.removeprefix(COMPRESSED)
    try:
        raw = base64.urlsafe_b64decode(text + "=" * (-len(text) % 4))
        return _parse((_unpacked(raw) if compressed else raw).decode())
    except (ValueError, zlib.error):  # not base64, not UTF-8, not ASCII, not compressed
        return {}


def _unpacked(raw: bytes) -> bytes:
    """Compressed bytes as they were; raises `ValueError` where they are too many or not whole."""
    stream = zlib.decompressobj()
    found = stream.decompress(raw, MOST_BYTES + 1)
    if not stream.eof or len(found) > MOST_BYTES:
        raise ValueError(f"more than {MOST_BYTES} bytes, or only a part")
    return found


def _parse(text: str) -> dict[str, Any]:
    try:
        data = read_page_json(text)
    except ValueError:
        return {}
    return data if isinstance(data, dict) else {}


def _rounded(values: Array, digits: int = DIGITS) -> list[float]:
    # Adding zero turns -0.0 into 0.0.
    return [round(value, digits) + 0.0 for value in values.tolist()]


def _own(value: object) -> tuple[OwnArm | None, str]:
    """The visitor's own arm, or why it is none."""
    if value is None:
        return None, ""
    try:
        return own_arm.unpack(value), ""
    except KinematicsError as error:
        return None, str(error)


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
    return pose_from_position_wxyz(numbers[:3], numbers[3:])


def _joints(value: object, robot: Robot) -> tuple[int, ...]:
    items = value if isinstance(value, list) else []
    valid = {item for item in items if type(item) is int and 0 <= item < robot.n}  # True is an int too
    return tuple(sorted(valid))


def _viewpoint(value: object, robot: Robot) -> Array | None:
    numbers = _numbers(value, 6)
    numbers = _numbers(value, 9) if numbers is None else np.append(numbers, UP)
    if numbers is None or np.abs(numbers).max() > FARTHEST:
        return None
    position, look_at, up = numbers.reshape(3, 3)
    nearest, farthest = robot.reach / CAMERA_RANGE, robot.reach * CAMERA_RANGE
    distance = float(np.linalg.norm(position - look_at))
    offset = float(np.linalg.norm(look_at - robot.T_world_base[:3, 3]))
    if not nearest <= distance <= farthest or offset > farthest:
        return None
    if not math.isclose(float(np.linalg.norm(up)), 1.0, abs_tol=1e-3):
        return None
    return numbers.reshape(3, 3)


def _units(data: dict[str, Any]) -> Units:
    length = next((unit for unit in LENGTHS if unit == data.get("length")), DEFAULT_UNITS.length)
    return Units(data.get("units") != "rad", length)


def _features(value: object) -> dict[str, dict[str, object]]:
    states = value if isinstance(value, dict) else {}
    return {key: state for key, state in states.items() if isinstance(state, dict) and _is_finite(state)}


def _is_finite(state: object) -> bool:
    """Whether it can be written into a link: Python reads numbers beyond all floats as infinity."""
    try:
        json.dumps(state, allow_nan=False)
    except ValueError:
        return False
    return True
