"""What users see, word for word: answers of REST and of the command line, kept in ``tests/data/snapshots``.

The tables below list every request, one file of answers each. Words must be the same; numbers may differ by 1e-7
of their value or by 1e-9 (`FREE` ones by more), so that another order of additions is no change. An answer without
a request is an error, too. After a change that is meant::

    pytest tests/test_snapshot.py --snapshot-update

writes the files anew; ``git diff`` then shows what users will notice.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from app.cli import parser as cli
from app.service.main import create_app
from app.shared.settings import Settings

ROOT = Path(__file__).parents[1]
FOLDER = Path(__file__).parent / "data" / "snapshots"
API = "/api/v1/robots"
RELATIVE, ABSOLUTE, DIGITS = 1e-7, 1e-9, 10
# Where the question leaves joints free, a descent stops anywhere near the best place: such answers are compared by
# `SLACK`. An orientation that comes nearest is had in many ways, of which rounding chooses one: only its errors
# count.
FREE = re.compile(r"position|point|mask|a gap|^panda")
SLACK = 1e-4
ERRORS = ("position_error", "rotation_error", "in_limits", "compromise")
# Branches that break the limits by the same amount: in which order they are reported is left to rounding.
TIED = {"redundant7: beyond a stop", "stanford: in front, tool down"}
VOLATILE = {"version", "pid", "date", "x-request-id", "content-length"}  # fields that may change at any time
HEADERS = ("content-type", "content-disposition", "x-cloud-count", "x-cloud-columns", "allow", "retry-after")
WIDTH = 115


# -- the parts of the tables -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class At:
    """The pose that forward kinematics gives for these joint values (radians, metres), as a target.

    Rounded, so that the last bit of forward kinematics does not make another question; moved by `shift` metres and
    turned about the tool's z axis by `roll` radians. `form` is what is sent of it.
    """

    q: tuple[float, ...]
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roll: float = 0.0
    form: str = "matrix"


@dataclass(frozen=True)
class Rest:
    """A request: `body` is sent as JSON, unless `content` holds what is sent as it stands."""

    method: str
    path: str
    body: dict[str, Any] | None = None
    content: bytes | None = None
    headers: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Command:
    """Words of a command line; ``{robots}`` stands for the folder of the built-in arms.

    Args:
        files: what is in the working directory, by name.
        writes: a file that is read back afterwards.
    """

    words: str
    files: dict[str, str] = field(default_factory=dict)
    writes: str | None = None


Request = Rest | Command


def post(robot: str, what: str, **body: Any) -> Rest:
    return Rest("POST", f"{API}/{robot}/{what}", body)


def ik(robot: str, target: Any, **options: Any) -> Rest:
    return post(robot, "ik", target=target, **options)


def path(robot: str, *targets: Any, **options: Any) -> Rest:
    return post(robot, "ik/path", targets=list(targets), **options)


def get(address: str = "") -> Rest:
    return Rest("GET", f"{API}{address}")


def raw(address: str, content: str, kind: str = "application/json") -> Rest:
    return Rest("POST", f"{API}/{address}", content=content.encode(), headers={"content-type": kind})


def point(x: float, y: float, z: float) -> dict[str, Any]:
    return {"position": [x, y, z]}


def pose(x: float, y: float, z: float, *wxyz: float) -> dict[str, Any]:
    """A target; a quaternion of another length than about 1 is normalised."""
    length = math.hypot(*wxyz)
    scale = 1.0 if abs(length - 1.0) <= 0.1 or not length else length
    return {"position": [x, y, z], "wxyz": [part / scale for part in wxyz]}


def along(x: float, y: float, z: float, *approach: float) -> dict[str, Any]:
    return {"position": [x, y, z], "approach": list(approach)}


def only(n: int, **values: Any) -> list[Any]:
    """One entry per joint, None but for those given as ``j1``, ``j2``, …"""
    return [values.get(f"j{i + 1}") for i in range(n)]


def line(start: tuple[float, ...], *step: float, count: int) -> list[At]:
    """Poses along an even motion of the joints."""
    return [At(tuple(round(a + k * b, 9) for a, b in zip(start, step, strict=True))) for k in range(count)]


# Every built-in arm somewhere inside its limits, and where it is singular. Radians; metres for what slides.
SOMEWHERE: dict[str, tuple[float, ...]] = {
    "pioneer5": (1.4, 0.5, 0.9, 0.5, 0.45),
    "redundant7": (0.2, 0.5, 0.4, 0.9, 0.3, 0.7, 0.6),
    "redundant7-craig": (0.2, 0.5, 0.4, 0.9, 0.3, 0.7, 0.6),
    "puma560": (0.3, 0.8, -2.8, 0.4, 0.7, 0.5),
    "ur5": (2.9, -1.8, 1.7, -1.4, -1.3, 0.4),
    "irb120": (0.4, 0.2, 0.1, 0.5, 0.8, 0.3),
    "stanford": (0.3, 1.2, 0.6, 0.4, 0.9, 0.5),
    "scara": (-0.6, 1.1, 0.12, 0.4),
    "iiwa14": (0.3, 0.5, 0.2, -1.1, 0.4, 1.2, 0.6),
    "panda": (0.2, -0.6, 0.3, -2.1, 0.2, 1.7, 0.9),
}
SINGULAR: dict[str, tuple[float, ...]] = {
    "pioneer5": (1.4, 0.5, 0.0, 0.5, 0.45),
    "redundant7": (0.2, 0.5, 0.4, 0.9, 0.3, 0.0, 0.6),
    "redundant7-craig": (0.2, 0.5, 0.4, 0.0, 0.3, 0.7, 0.6),
    "puma560": (0.3, 0.8, -2.8, 0.4, 0.0, 0.5),
    "ur5": (2.9, -1.8, 1.7, -1.4, 0.0, 0.4),
    "irb120": (0.4, 0.2, 0.1, 0.5, 0.0, 0.3),
    "stanford": (0.3, 1.2, 0.6, 0.4, 0.0, 0.5),
    "scara": (-0.6, 0.0, 0.12, 0.4),
    "iiwa14": (0.3, 0.5, 0.2, -1.1, 0.4, 0.0, 0.6),
    "panda": (0.2, 0.0, 0.3, -2.1, 0.0, 1.7, 0.9),
}
# Configurations with a joint beyond its stop; the UR5 turns so far that none of its poses needs that.
BEYOND: dict[str, tuple[float, ...]] = {
    "pioneer5": (1.5, 0.6, 0.8, 0.5, 1.3),
    "redundant7": (0.2, 0.5, 0.4, 2.1, 0.3, 0.7, 0.6),
    "redundant7-craig": (0.0, 0.52, 0.0, 2.06, 0.0, 0.7, 0.0),
    "puma560": (0.3, 0.8, -2.8, 0.4, 1.9, 0.5),
    "irb120": (0.4, 1.0, 1.0, 0.2, 2.3, 0.3),
    "stanford": (0.3, 1.2, 1.4, 0.4, 0.9, 0.5),
    "scara": (-0.6, 1.1, 0.25, 0.4),
    "iiwa14": (0.3, 0.5, 0.2, -2.3, 0.4, 1.2, 0.6),
    "panda": (0.2, -0.6, 0.3, -3.2, 0.2, 1.7, 0.9),
}
SIZES = {arm: len(q) for arm, q in SOMEWHERE.items()}
TASK = {arm: "approach" if n == 5 else "pose" for arm, n in SIZES.items()}
# Joints 5 and 6 of a hand that passes the forearm's line at one degree.
NEARLY_STRAIGHT = [
    (round(math.atan2(0.0175, 0.07 * k), 9), round(math.hypot(0.0175, 0.07 * k), 9)) for k in range(-3, 4)
]
GAPS = {"scara": "position"}  # the task of paths that leave the workspace
# Points in the hole around the first axis, near the shoulder, below, above, far away.
PLACES = {
    "on the axis": (0.0, 0.0, 0.3),
    "beside the axis": (0.05, 0.0, 0.3),
    "above the shoulder": (0.0, 0.1, 0.412),
    "in the foot": (0.02, 0.0, 0.0),
    "in front": (0.4, 0.1, 0.15),
    "behind": (-0.3, 0.0, 0.1),
    "below": (0.3, 0.1, -0.4),
    "on top": (0.0, 0.0, 1.0),
    "far away": (5.0, 0.0, 0.0),
}
# Positions that are reached, and quaternions that are not had there. The SCARA keeps the point instead.
UNTURNABLE: dict[str, tuple[float, ...]] = {
    "pioneer5": (0.11, -0.18, -0.12, -0.3, 1.5, 2.0, 1.8),
    "redundant7": (-0.26, 0.24, 0.57, 0.4, -2.0, 0.5, 2.1),
    "redundant7-craig": (1.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0),
    "puma560": (0.42, -0.34, -0.06, 0.9, -0.9, 0.1, 0.2),
    "ur5": (0.55, 0.15, 0.83, -0.2, 1.1, -1.3, 1.2),
    "irb120": (0.64, 0.02, 0.39, -0.4, 0.6, 0.6, -0.7),
    "stanford": (-0.25, -0.18, -0.81, -0.8, 0.1, 0.9, -1.4),
    "scara": (0.5, -0.12, 0.36, -1.8, 0.1, 0.1, -1.9),
    "iiwa14": (-0.51, -0.57, -0.12, 0.0, 0.2, 0.4, 0.3),
    "panda": (0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0),
}
# Sentences that rounding decides: out of reach by 26.85 mm, and two branches beyond a stop by the same angle.
UNDECIDED = {("ur5", "on the axis"), ("redundant7", "behind")}
DOWN = (0.0, 1.0, 0.0, 0.0)
TILTED = (0.4, 0.8, 0.3, -0.2)
XYZ, Z_AND_TURN = [True, True, True, False, False, False], [False, False, True, False, False, True]
LEVEL = [True, True, True, True, True, False]


# -- the tables ------------------------------------------------------------------------------------------------

IK: dict[str, Request] = {
    **{f"{arm}: its task, all solutions": ik(arm, At(q), task=TASK[arm]) for arm, q in SOMEWHERE.items()},
    **{f"{arm}: position and wxyz": ik(arm, At(q, form="wxyz"), max_solutions=1) for arm, q in SOMEWHERE.items()},
    **{f"{arm}: approach": ik(arm, At(q, form="approach"), max_solutions=2) for arm, q in SOMEWHERE.items()},
    **{f"{arm}: position": ik(arm, At(q, form="position"), max_solutions=2) for arm, q in SOMEWHERE.items()},
    **{f"{arm}: rolled": ik(arm, At(q, roll=0.2), max_solutions=2) for arm, q in SOMEWHERE.items()},
    **{
        f"{arm}: mask of height and turn": ik(arm, At(q), mask=Z_AND_TURN, mask_frame="base", max_solutions=1)
        for arm, q in SOMEWHERE.items()
    },
    **{f"{arm}: mask without a turn": ik(arm, At(q), mask=LEVEL, max_solutions=1) for arm, q in SOMEWHERE.items()},
    **{
        f"{arm}: first joint near its value": ik(
            arm, At(q), task=TASK[arm], limits=only(SIZES[arm], j1=[q[0] - 0.1, q[0] + 0.1]), max_solutions=2
        )
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: second joint kept from its value": ik(
            arm, At(q), task=TASK[arm], limits=only(SIZES[arm], j2=[q[1] + 0.2, q[1] + 0.25]), max_solutions=2
        )
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: last joint locked where it is": ik(
            arm, At(q), task=TASK[arm], locked=[*[None] * (len(q) - 1), q[-1]], max_solutions=2
        )
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: last joint locked elsewhere": ik(
            arm, At(q), task=TASK[arm], locked=[*[None] * (len(q) - 1), q[-1] - 0.1], max_solutions=2
        )
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: two joints locked, a point": ik(
            arm, At(q, form="position"), locked=[q[0], *[None] * (len(q) - 2), q[-1]], max_solutions=2
        )
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: on the branch of the seed": ik(arm, At(q), task=TASK[arm], branch="seed", q_seed=list(q))
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: every whole turn": ik(arm, At(q), task=TASK[arm], images="all", max_solutions=12)
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: far from the limits": ik(arm, At(q), task=TASK[arm], prefer="limits", max_solutions=2)
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: most manipulable": ik(arm, At(q), task=TASK[arm], prefer="manipulability", max_solutions=2)
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: a bare value for what is free": ik(arm, At(q), task=TASK[arm], redundancy=0.2, max_solutions=2)
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: numeric": ik(arm, At(q), task=TASK[arm], solver="numeric", max_solutions=1, q_seed=list(q))
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: singular": ik(arm, At(q), task=TASK[arm], q_seed=list(q), max_solutions=2)
        for arm, q in SINGULAR.items()
    },
    **{f"{arm}: beyond a stop": ik(arm, At(q), task=TASK[arm]) for arm, q in BEYOND.items()},
    **{
        f"{arm}: beyond a stop, limits ignored": ik(
            arm, At(q), task=TASK[arm], respect_limits=False, max_solutions=2
        )
        for arm, q in BEYOND.items()
    },
    **{
        f"{arm}: {place}, a point": ik(arm, point(*xyz), max_solutions=1)
        for arm in SOMEWHERE
        for place, xyz in PLACES.items()
        if (arm, place) not in UNDECIDED
    },
    **{
        f"{arm}: {place}, tool down": ik(arm, pose(*xyz, *DOWN), max_solutions=1)
        for arm in SOMEWHERE
        for place, xyz in PLACES.items()
        if (arm, place) not in UNDECIDED
    },
    **{
        f"{arm}: {place}, tilted": ik(arm, pose(*xyz, *TILTED), max_solutions=1)
        for arm in SOMEWHERE
        for place, xyz in PLACES.items()
        if place in ("in front", "behind", "on top") and (arm, place) not in UNDECIDED
    },
    **{
        f"{arm}: not with this orientation": ik(arm, pose(*where), task=TASK[arm])
        for arm, where in UNTURNABLE.items()
    },
    # What only some arms can do.
    "pioneer5: too near for this direction": ik(
        "pioneer5", pose(-0.2, 0.25, -0.02, -1.7, -0.1, 0.3, -0.8), task="approach"
    ),
    "redundant7: above the stop of a joint": ik("redundant7", pose(0.15, -0.1, 0.11, 0.0, -0.1, -1.2, -1.4)),
    "pioneer5: example of the page": ik("pioneer5", along(0.045, 0.191, -0.211, -0.31, -0.164, -0.936)),
    "pioneer5: point and direction, not the roll": ik(
        "pioneer5", pose(0.045, 0.191, -0.211, 0.0243, 0.9252, 0.3348, -0.1767)
    ),
    "pioneer5: a quaternion of three digits": ik(
        "pioneer5", pose(0.045, 0.191, -0.211, 0.022, 0.921, 0.347, -0.177)
    ),
    "pioneer5: point and direction, a large roll": ik("pioneer5", pose(0.045, 0.191, -0.211, 0.0, 0.9, 0.4, -0.2)),
    "pioneer5: direction beyond a stop": ik("pioneer5", along(0.045, 0.191, 0.1, 0.0, 0.0, 1.0)),
    "pioneer5: elbow positive, locked, narrowed": ik(
        "pioneer5",
        point(-0.03, 0.157, -0.194),
        branch="elbow positive",
        locked=only(5, j5=0.5),
        limits=only(5, j3=[0.0, 2.0]),
    ),
    "pioneer5: a branch that does not fit": ik(
        "pioneer5", along(0.045, 0.191, -0.211, -0.31, -0.164, -0.936), branch="shoulder back"
    ),
    "pioneer5: a branch beyond its stops": ik("pioneer5", point(0.4, 0.1, 0.15), branch="wrist flip"),
    "pioneer5: mask that is a point": ik("pioneer5", point(-0.018, 0.31, -0.181), mask=XYZ, max_solutions=1),
    "pioneer5: mask out of reach": ik(
        "pioneer5", pose(0.3, 0.2, 2.0, *DOWN), mask=[True, True, True, False, False, True]
    ),
    "pioneer5: values for both free joints": ik(
        "pioneer5", point(-0.018, 0.31, -0.181), redundancy={"theta4": 0.4, "theta5": 0.5}, max_solutions=2
    ),
    "pioneer5: a value for one free joint": ik(
        "pioneer5", point(-0.018, 0.31, -0.181), redundancy={"theta4": 1.4}
    ),
    "pioneer5: several targets, a seed each": ik(
        "pioneer5",
        [point(0.045, 0.191, -0.211), point(-0.018, 0.31, -0.181), point(2.0, 0.0, 0.0)],
        q_seed=[[1.2, 0.5, 0.5, 0.5, 0.5], [1.5, 0.5, 1.0, 0.5, 0.5], [0.5, 0.5, 0.5, 0.5, 0.5]],
        max_solutions=1,
    ),
    "redundant7-craig: elbow swung": ik(
        "redundant7-craig", At(SOMEWHERE["redundant7-craig"]), redundancy={"psi": 0.3}, max_solutions=2
    ),
    "redundant7-craig: elbow swung into a stop": ik(
        "redundant7-craig", At((1.0, 1.2, 0.4, 1.5, 0.3, 1.4, 0.6)), redundancy={"psi": 2.5}
    ),
    "redundant7-craig: two free values": ik(
        "redundant7-craig",
        At(SOMEWHERE["redundant7-craig"], form="approach"),
        redundancy={"psi": 0.3, "theta7": 1.0},
        max_solutions=2,
    ),
    "redundant7-craig: two branches": ik(
        "redundant7-craig",
        At(SOMEWHERE["redundant7-craig"]),
        branch=["shoulder front · elbow negative · wrist flip", "seed"],
    ),
    "redundant7-craig: a joint narrowed, swinging on": ik(
        "redundant7-craig",
        At(SOMEWHERE["redundant7-craig"]),
        limits=only(7, j2=[-1.0, 0.3], j5=[-2.0, 2.0]),
        max_solutions=2,
    ),
    "redundant7-craig: arm straight up": ik(
        "redundant7-craig", pose(0.0, 0.0, 1.38, 1.0, 0.0, 0.0, 0.0), max_solutions=2
    ),
    "redundant7-craig: a point with everything free": ik(
        "redundant7-craig", point(0.4, 0.2, 0.6), prefer="manipulability", max_solutions=1
    ),
    "redundant7: sum of two joints": ik(
        "redundant7", At(SOMEWHERE["redundant7"]), redundancy={"theta1": -0.5}, max_solutions=2
    ),
    "iiwa14: elbow positive, swung": ik(
        "iiwa14", At(SOMEWHERE["iiwa14"]), branch="elbow positive", redundancy={"psi": -0.4}, max_solutions=2
    ),
    "iiwa14: a joint narrowed away": ik("iiwa14", At(SOMEWHERE["iiwa14"]), limits=only(7, j4=[0.2, 0.3])),
    "ur5: elbow narrowed away": ik("ur5", At(SOMEWHERE["ur5"]), limits=only(6, j3=[0.2, 0.3])),
    "ur5: elbow positive": ik("ur5", At(SOMEWHERE["ur5"]), branch="elbow positive"),
    "ur5: elbow positive alone is narrowed away": ik(
        "ur5", At(SOMEWHERE["ur5"]), branch="elbow positive", limits=only(6, j3=[0.2, 0.3])
    ),
    "puma560: on another branch": ik(
        "puma560", At(SOMEWHERE["puma560"]), branch="shoulder front", limits=only(6, j1=[0.2, 0.4])
    ),
    "puma560: wrist through its axis": ik(
        "puma560", At((0.3, 0.8, -2.8, 0.4, 0.0, 0.5)), q_seed=[0.1, 0.7, -2.7, 0.0, 0.1, 0.3]
    ),
    "irb120: flipped": ik("irb120", At(SOMEWHERE["irb120"]), branch="wrist flip", images="all"),
    "stanford: through the shoulder": ik("stanford", At(SOMEWHERE["stanford"]), branch="slide through"),
    "scara: tilted by little": ik("scara", pose(0.3, 0.2, 0.2, 0.02, 1.0, 0.0, 0.0)),
    "scara: other elbow": ik("scara", At(SOMEWHERE["scara"]), branch="elbow right"),
    "scara: stretched": ik("scara", point(0.6, 0.0, 0.3), max_solutions=2),
    "scara: hair too far": ik("scara", point(0.601, 0.0, 0.3)),
    "scara: turn of the tool": ik(
        "scara", At(SOMEWHERE["scara"], form="position"), redundancy={"psi": 0.5}, max_solutions=2
    ),
    "panda: limits ignored": ik("panda", At(SOMEWHERE["panda"]), respect_limits=False, max_solutions=1),
}

MOTION: dict[str, Request] = {
    **{f"{arm}: fk, frames": post(arm, "fk", q=list(q), frames=True) for arm, q in SOMEWHERE.items()},
    **{f"{arm}: fk, several": post(arm, "fk", q=[list(q), [0.0] * len(q)]) for arm, q in SINGULAR.items()},
    **{f"{arm}: fk beyond a stop": post(arm, "fk", q=list(q)) for arm, q in BEYOND.items()},
    **{f"{arm}: jacobian": post(arm, "jacobian", q=list(q)) for arm, q in SOMEWHERE.items()},
    **{f"{arm}: jacobian, tool": post(arm, "jacobian", q=list(q), frame="tool") for arm, q in SOMEWHERE.items()},
    **{f"{arm}: jacobian, singular": post(arm, "jacobian", q=[list(q)]) for arm, q in SINGULAR.items()},
    **{
        f"{arm}: path, even motion": path(
            arm, *line(q, *[0.02] * len(q), count=5), task=TASK[arm], q_start=list(q)
        )
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: path, points": path(
            arm, *(At(at.q, form="position") for at in line(q, *[0.02] * len(q), count=4))
        )
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: path, a leap": path(arm, At(q), At(tuple(x * 0.6 for x in q)), task=TASK[arm], max_step=0.1)
        for arm, q in SOMEWHERE.items()
    },
    **{
        f"{arm}: path, a gap": path(arm, At(q), At(q, shift=(3.0, 0.0, 0.0)), At(q), task=GAPS.get(arm, TASK[arm]))
        for arm, q in SOMEWHERE.items()
    },
    "pioneer5: path, one waypoint": path("pioneer5", point(-0.018, 0.31, -0.181)),
    "pioneer5: path, example of the page": path(
        "pioneer5",
        *(along(-0.03, 0.157, z, -0.25, -0.433, -0.866) for z in (-0.194, -0.204, -0.214)),
        q_start=[1.5708, 0.5236, 1.0472, 0.5236, 0.5236],
    ),
    "pioneer5: path, poses with a wrong roll": path(
        "pioneer5",
        *(At(at.q, roll=0.1) for at in line(SOMEWHERE["pioneer5"], 0.05, 0.02, 0.02, 0.0, 0.0, count=4)),
    ),
    "pioneer5: path into a stop": path(
        "pioneer5", *line((1.4, 0.5, 0.9, 0.5, 0.7), 0.0, 0.0, 0.0, 0.05, 0.06, count=6), task="approach"
    ),
    "pioneer5: path, locked": path(
        "pioneer5",
        *(At(at.q, form="position") for at in line(SOMEWHERE["pioneer5"], 0.05, 0.02, 0.02, 0.0, 0.0, count=4)),
        locked=only(5, j4=0.5),
    ),
    "pioneer5: path, nothing within reach": path("pioneer5", point(2.0, 0.0, 0.0), point(2.0, 0.1, 0.0)),
    "puma560: path through the wrist's singularity": path(
        "puma560", *line((0.3, 0.8, -2.8, 0.4, 0.3, 0.5), 0.0, 0.0, 0.0, 0.3, -0.1, 0.0, count=6)
    ),
    "puma560: path on one branch": path(
        "puma560",
        *line(SOMEWHERE["puma560"], 0.05, 0.02, 0.02, 0.0, 0.0, 0.0, count=4),
        branch="seed",
        limits=only(6, j6=[-3.0, 3.0]),
    ),
    "ur5: path out of reach": path(
        "ur5",
        *(At(SOMEWHERE["ur5"], shift=(0.0, 0.12 * k, 0.0)) for k in range(8)),
        branch="shoulder left",
        q_start=list(SOMEWHERE["ur5"]),
    ),
    "ur5: path, turns of the last joint": path(
        "ur5",
        *line((2.9, -1.8, 1.7, -1.4, -1.3, 5.4), 0.0, 0.0, 0.0, 0.0, 0.0, 0.4, count=6),
        limits=only(6, j6=[-0.5, 6.0]),
    ),
    "puma560: path, a mask": path(
        "puma560", *line(SOMEWHERE["puma560"], 0.05, 0.02, 0.02, 0.0, 0.0, 0.03, count=4), mask=LEVEL
    ),
    "redundant7-craig: path stopped by a lock": path(
        "redundant7-craig",
        *line(SOMEWHERE["redundant7-craig"], 0.1, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, count=5),
        locked=only(7, j4=1.0),
    ),
    "redundant7-craig: path that turns too far": path(
        "redundant7-craig",
        *(At((0.0, 0.5, 0.0, 1.0, 0.0, 0.7, 0.0), roll=-0.4363 * k) for k in range(25)),
        locked=only(7, j3=0.0, j5=0.0),
        branch="seed",
    ),
    "redundant7: path close to a singularity": path(
        "redundant7",
        *(At((0.2, 0.5, 0.5, 1.0, a, b, -a)) for a, b in NEARLY_STRAIGHT),
        q_start=[0.2, 0.5, 0.5, 1.0, *NEARLY_STRAIGHT[0], -NEARLY_STRAIGHT[0][0]],
        branch="seed",
    ),
    "stanford: path, the slide": path(
        "stanford", *line(SOMEWHERE["stanford"], 0.0, 0.0, 0.05, 0.0, 0.0, 0.0, count=4), max_step=0.1
    ),
}

WORKSPACE: dict[str, Request] = {
    **{f"{arm}: sizes": get(f"/{arm}/workspace/summary?volume=false") for arm in SOMEWHERE},
    "pioneer5: volume": get("/pioneer5/workspace/summary?effort=2"),
    "scara: volume, locked, narrowed": get("/scara/workspace/summary?effort=2&lock=1:0.5&limit=3:0:0.1"),
    "pioneer5: section": get("/pioneer5/workspace/summary?volume=false&section=true&resolution=12"),
    "irb120: section, narrowed": get(
        "/irb120/workspace/summary?volume=false&section=true&resolution=8&limit=2:0:0.5"
    ),
    "pioneer5: plane": get("/pioneer5/workspace/summary?volume=false&plane=0:0:0.1:0:0:1&resolution=12"),
    "pioneer5: map of directions": get("/pioneer5/capability?resolution=5&directions=12&approachable=true"),
    "pioneer5: map, locked": get("/pioneer5/capability?resolution=5&directions=24&lock=1:0.25&limit=2:0:1"),
    "scara: map of directions": get("/scara/capability?resolution=4&directions=12"),
    "ur5: postures": post("ur5", "postures", resolution=8),
    "scara: postures, two joints": post("scara", "postures", joints=[0, 1], resolution=8),
    "ur5: cuspidal": get("/ur5/cuspidal"),
    "panda: cuspidal, locked": get("/panda/cuspidal?lock=7:0.8"),
    "rpp: cuspidal": get("/rpp/cuspidal?poses=32"),
    "ur5: map of directions": get("/ur5/capability?resolution=4&directions=12"),
    **{
        f"{arm}: reachable": post(
            arm,
            "reachable",
            target=[At(q), At(q, shift=(0.1, 0.0, 0.0)), pose(0.0, 0.0, 0.3, *DOWN)],
            task=TASK[arm],
        )
        for arm, q in SOMEWHERE.items()
    },
    "pioneer5: reachable, one point": post("pioneer5", "reachable", target=point(-0.018, 0.31, -0.181)),
    "pioneer5: reachable, too far": post("pioneer5", "reachable", target=point(2.0, 0.0, 0.0)),
    "pioneer5: reachable, locked and narrowed": post(
        "pioneer5",
        "reachable",
        target=point(-0.03, 0.157, -0.194),
        locked=only(5, j5=0.5),
        limits=only(5, j3=[0.0, 2.0]),
    ),
    "pioneer5: reachable, a branch beyond its stops": post(
        "pioneer5", "reachable", target=point(0.4, 0.1, 0.15), branch="wrist flip"
    ),
    **{f"{arm}: cloud": get(f"/{arm}/workspace?n=50&format=csv") for arm in SOMEWHERE},
    **{
        f"pioneer5: cloud as {kind}": get(
            f"/pioneer5/workspace?n=50&format={kind}&seed=3&measure=limits&measure=manipulability&q=true"
        )
        for kind in ("ndjson", "csv", "bin", "ply", "npz")
    },
    "scara: cloud, quasi, locked": get("/scara/workspace?n=50&strategy=quasi&lock=1:0.5&limit=3:0:0.1&q=true"),
    "pioneer5: cloud, volume": get("/pioneer5/workspace?n=20&strategy=volume&format=csv"),
    "pioneer5: cloud, boundary": get("/pioneer5/workspace?n=20&strategy=boundary&format=csv"),
}

ROBOTS: dict[str, Request] = {
    "so101: motors, one of which counts backwards": post(
        "so101",
        "motors/match",
        q=[[0.0] * 5, [0.7, 0.8, 0.9, 1.0, 1.1]],
        readings=[[0, 91.4, 0, 0, 0], [40.1, 45.6, 51.6, 57.3, 0]],
    ),
    "so101: motors that it has not": post(
        "so101", "motors/match", q=[[0.0] * 5] * 2, readings=[[1]] * 2, motors=[]
    ),
    "list": get(),
    **{arm: get(f"/{arm}") for arm in SOMEWHERE},
    "pioneer5: equations": get("/pioneer5/equations"),
    "scara: equations": get("/scara/equations"),
    "pioneer5: values of the equations": post("pioneer5", "equations", q=list(SOMEWHERE["pioneer5"])),
    "pioneer5: values where (6) is worst": post("pioneer5", "equations", q=[0.0, 1.2741, 0.2967, 0.0, 0.2618]),
    "redundant7: values of the equations": post("redundant7", "equations", q=list(SOMEWHERE["redundant7"])),
    "scara: values of the equations": post("scara", "equations", q=[list(SOMEWHERE["scara"])]),
}

P = point(-0.018, 0.31, -0.181)
PROBLEMS: dict[str, Request] = {
    "no such robot": get("/puma"),
    "no such robot to ask": ik("puma", P),
    "nothing there": Rest("GET", "/api/v1/robot"),
    "wrong method": Rest("GET", f"{API}/pioneer5/fk"),
    "wrong method, a list": Rest("DELETE", API),
    "not JSON": raw("pioneer5/fk", '{"q": [1, 2'),
    "empty body": raw("pioneer5/fk", ""),
    "a list for a body": raw("pioneer5/fk", "[1, 2, 3]"),
    "a string for a body": raw("pioneer5/ik", '"home"'),
    "not said to be JSON": raw("pioneer5/fk", '{"q": [1, 2, 3, 4, 5]}', "text/plain"),
    "body too large": raw("pioneer5/fk", '{"q": [' + "1, " * 40_000 + "1]}"),
    "NaN": raw("pioneer5/fk", '{"q": [1, 2, NaN, 4, 5]}'),
    "infinite": raw("pioneer5/fk", '{"q": [1, 2, 3, -Infinity, 5]}'),
    "1e999": raw("pioneer5/ik", '{"target": {"position": [1e999, 0, 0]}}'),
    "NaN in a matrix": raw("pioneer5/ik", '{"target": {"matrix": [[NaN,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}}'),
    "NaN in a path": raw("pioneer5/ik/path", '{"targets": [{"position": [0, 0, NaN]}]}'),
    "too large a number": post("pioneer5", "fk", q=[1e7, 0, 0, 0, 0]),
    "a word for a number": post("pioneer5", "fk", q=[1, 2, "ninety", 4, 5]),
    "true for a number": post("pioneer5", "fk", q=[1, 2, True, 4, 5]),
    "q is missing": post("pioneer5", "fk"),
    "q is empty": post("pioneer5", "fk", q=[]),
    "q is null": post("pioneer5", "fk", q=None),
    "too few values": post("pioneer5", "fk", q=[1, 2]),
    "too many values": post("pioneer5", "jacobian", q=[1.0] * 12),
    "one row too short": post("pioneer5", "fk", q=[[0.0] * 5, [0.0] * 4]),
    "unknown field": post("pioneer5", "fk", q=[0.0] * 5, frame="tool"),
    "unknown frame": post("pioneer5", "jacobian", q=[0.0] * 5, frame="flange"),
    "frames is no boolean": post("pioneer5", "fk", q=[0.0] * 5, frames="yes"),
    "batch too large": post("pioneer5", "fk", q=[[0.0] * 5] * 60),
    "too many targets": ik("pioneer5", [P] * 60),
    "too many waypoints": path("pioneer5", *[P] * 60),
    "no target": post("pioneer5", "ik"),
    "empty target": ik("pioneer5", {}),
    "no targets": ik("pioneer5", []),
    "no waypoints": path("pioneer5"),
    "unknown field of a target": ik("pioneer5", {"positions": [0, 0, 0]}),
    "position of two": ik("pioneer5", {"position": [0.0, 0.0]}),
    "quaternion of zeros": ik("pioneer5", pose(0.1, 0.1, 0.1, 0, 0, 0, 0)),
    "approach of zeros": ik("pioneer5", along(0.1, 0.1, 0.1, 0, 0, 0)),
    "matrix of two rows": ik("pioneer5", {"matrix": [[1, 0, 0, 0], [0, 1, 0, 0]]}),
    "matrix that is no rotation": ik(
        "pioneer5", {"matrix": [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}
    ),
    "matrix that mirrors": ik("pioneer5", {"matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]}),
    "matrix with a wrong last row": ik(
        "pioneer5", {"matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]}
    ),
    "matrix and another position": ik(
        "pioneer5",
        {"matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "position": [1.0, 0.0, 0.0]},
    ),
    "matrix and another turn": ik(
        "pioneer5", {"matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "wxyz": list(DOWN)}
    ),
    "approach and a quaternion": ik("pioneer5", {**P, "approach": [0, 0, 1], "wxyz": list(DOWN)}),
    "pose from a point": ik("pioneer5", P, task="pose"),
    "approach from a point": ik("pioneer5", P, task="approach"),
    "second target unusable": ik("pioneer5", [P, {"approach": [0, 0, 1]}]),
    "unknown task": ik("pioneer5", P, task="grasp"),
    "mask of five": ik("pioneer5", P, mask=[True] * 5),
    "mask of numbers": ik("pioneer5", P, mask=[1, 1, 1, 0, 0, 0]),
    "mask of nothing": ik("pioneer5", P, mask=[False] * 6),
    "mask with a turn, a point": ik("pioneer5", P, mask=[True, True, True, False, False, True]),
    "mask and a task": ik("pioneer5", P, mask=XYZ, task="position"),
    "seed too short": ik("pioneer5", P, q_seed=[1.0, 2.0]),
    "seeds of another number": ik("pioneer5", [P, P], q_seed=[[0.0] * 5] * 3),
    "limits of another number": ik("pioneer5", P, limits=[[0.0, 1.0]]),
    "limits upside down": ik("pioneer5", P, limits=only(5, j2=[1.0, 0.0])),
    "limits beyond the arm's": ik("pioneer5", P, limits=only(5, j2=[-1.0, 1.0])),
    "lock beyond the limits": ik("pioneer5", P, locked=only(5, j2=-1.0)),
    "locks of another number": ik("pioneer5", P, locked=[0.0]),
    "unknown branch": ik("pioneer5", P, branch="sideways"),
    "branch of parts that do not go together": ik("pioneer5", P, branch="elbow positive · elbow negative"),
    "no branches": ik("pioneer5", P, branch=[]),
    "part of a name of another arm": ik("panda", At(SOMEWHERE["panda"]), branch="elbow up"),
    "nothing free": ik("ur5", At(SOMEWHERE["ur5"]), redundancy=0.1),
    "unknown free value": ik("redundant7-craig", At(SOMEWHERE["redundant7-craig"]), redundancy={"phi": 0.1}),
    "no solutions wanted": ik("pioneer5", P, max_solutions=0),
    "half a solution wanted": ik("pioneer5", P, max_solutions=1.5),
    "unknown preference": ik("pioneer5", P, prefer="fast"),
    "unknown solver": ik("pioneer5", P, solver="analytic"),
    "unknown images": ik("pioneer5", P, images="some"),
    "tasks that differ along a path": path("pioneer5", P, along(0.1, 0.1, 0.1, 0, 0, 1)),
    "step of nothing": path("pioneer5", P, max_step=0),
    "start of two paths": path("pioneer5", P, q_start=[[0.0] * 5]),
    "start too short": path("pioneer5", P, q_start=[0.0]),
    "reachable: unknown field": post("pioneer5", "reachable", target=P, q_seed=[0.0] * 5),
    "equations: too few values": post("pioneer5", "equations", q=[1.0]),
    "cloud of nothing": get("/pioneer5/workspace?n=0"),
    "cloud too large": get("/pioneer5/workspace?n=1000000000000"),
    "cloud: unknown format": get("/pioneer5/workspace?format=stl"),
    "cloud: unknown strategy": get("/pioneer5/workspace?strategy=even"),
    "cloud: unknown measure": get("/pioneer5/workspace?measure=speed"),
    "cloud: seed below zero": get("/pioneer5/workspace?seed=-1"),
    "cloud: unknown parameter": get("/pioneer5/workspace?points=5"),
    "cloud: lock of no joint": get("/pioneer5/workspace?lock=9:1"),
    "cloud: lock beyond the limits": get("/pioneer5/workspace?lock=1:1&lock=2:-1"),
    "cloud: lock twice": get("/pioneer5/workspace?lock=1:1&lock=1:1"),
    "cloud: limit of one value": get("/pioneer5/workspace?limit=1:1"),
    "cloud: limit upside down": get("/pioneer5/workspace?limit=1:1:0"),
    "sizes: no effort": get("/pioneer5/workspace/summary?effort=1"),
    "sizes: plane without a normal": get("/pioneer5/workspace/summary?plane=0:0:0:0:0:0"),
    "sizes: plane of words": get("/pioneer5/workspace/summary?plane=flat"),
    "postures: seven joints": post("panda", "postures"),
    "postures: one joint twice": post("ur5", "postures", joints=[1, 1]),
    "cuspidal: seven joints": get("/panda/cuspidal"),
    "cuspidal: no poses": get("/ur5/cuspidal?poses=0"),
    "map: too fine": get("/pioneer5/capability?resolution=100"),
    "map: directions": get("/pioneer5/capability?directions=13"),
}

SLIDER = """\
id = "slider"
name = "Slider"
source = "a test"
convention = "standard"
units = { length = "mm", angle = "deg" }
[[rows]]
name = "turn"
a = 100
[[rows]]
name = "slide"
kind = "prismatic"
limits = [0, 250]
"""
ODD = """\
id = "ur5"
name = "Odd"
source = "a test"
convention = "standard"
units = { length = "m", angle = "rad" }
[[rows]]
name = "around"
alpha = 1.5708
limits = [-7, 7]
[[rows]]
name = "up"
d = 300
[[rows]]
name = "nothing"
kind = "fixed"
[[rows]]
name = "again"
a = 200
[[rows]]
name = "last"
a = 200
[home]
q = [0, 0, 0, 0]
"""
WHERE = "--position 45 191 -211 --approach -0.31 -0.164 -0.936"
HAND = "--position 300 200 700 --wxyz 0.4 0.8 0.3 -0.2"
CLI: dict[str, Request] = {
    "motors: poses": Command("motors so101"),
    "motors: found": Command(
        "motors so101 --pose 0 0 0 0 0 --read 0 91.4 0 0 0 --pose 40 50 45 60 70 --read 40 41.4 45 60 0"
    ),
    "motors: none": Command("motors ur5"),
    **{
        f"{arm}: fk": Command(f"fk {arm} " + " ".join(["10", "20", "30", "40", "30", "20", "10"][: len(q)]))
        for arm, q in SOMEWHERE.items()
    },
    **{f"{arm}: described": Command(f"robots {arm}") for arm in SOMEWHERE},
    **{f"{arm}: checked": Command(f"check {{robots}}/{arm}.toml") for arm in SOMEWHERE},
    **{f"{arm}: ik": Command(f"ik {arm} {HAND} --all") for arm in SOMEWHERE},
    **{f"{arm}: ik of a point": Command(f"ik {arm} --position 200 100 250") for arm in SOMEWHERE},
    **{f"{arm}: ik too far": Command(f"ik {arm} --position 5 0 0 --rad") for arm in SOMEWHERE},
    "fk, frames": Command("fk pioneer5 90 30 60 30 30 --frames"),
    "fk, radians": Command("fk pioneer5 1.5 0.5 1 0.5 0.5 --rad --frames"),
    "fk, JSON": Command("fk pioneer5 90 30 60 30 30 --json"),
    "fk, negative numbers": Command("fk pioneer5 -90 -.5 -1e-3 −10 +5"),
    "fk of a further arm": Command("fk slider 90 120 --robots .", files={"slider.toml": SLIDER}),
    "fk of a further arm, metres": Command("fk slider 1.5 0.12 --rad --robots .", files={"slider.toml": SLIDER}),
    "ik": Command(f"ik pioneer5 {WHERE}"),
    "ik, radians": Command("ik pioneer5 --position 0.045 0.191 -0.211 --approach -0.31 -0.164 -0.936 --rad --all"),
    "ik, JSON": Command(f"ik pioneer5 {WHERE} --json"),
    "ik, JSON, radians": Command("ik scara --position 0.3 0.2 0.25 --rad --json"),
    "ik, blocked": Command("ik pioneer5 --position 45 191 100 --approach 0 0 1"),
    "ik, blocked, radians": Command("ik pioneer5 --position 0.045 0.191 0.1 --approach 0 0 1 --rad"),
    "ik, blocked, limits ignored": Command(
        "ik pioneer5 --position 45 191 100 --approach 0 0 1 --ignore-limits --all"
    ),
    "ik, not the roll": Command("ik pioneer5 --position 45 191 -211 --wxyz 0 0.9 0.4 -0.2"),
    "ik, metres typed": Command("ik pioneer5 --position 0.045 0.191 -0.211"),
    "ik, branch, limit, lock": Command(
        "ik pioneer5 --position -30 157 -194 --branch elbow~positive --limit 3=0:115 --lock 5=28 --all"
    ),
    "ik, no such branch here": Command(f"ik pioneer5 {WHERE} --branch shoulder~back"),
    "ik, seed and free value": Command(
        f"ik redundant7-craig {HAND} --seed 10 20 0 60 0 40 -90 --redundancy -20 --all --ignore-limits"
    ),
    "ik, free value by name": Command(f"ik redundant7-craig {HAND} --redundancy psi=20 --prefer limits --all"),
    "ik, whole turns": Command("ik scara --position 300 200 250 --wxyz 0 1 0 0 --images all --all"),
    "ik, numeric": Command(f"ik ur5 {HAND} --solver numeric"),
    "ik, mask": Command(f"ik ur5 {HAND} --mask x y z rz --mask-frame base"),
    "ik, this orientation not": Command("ik redundant7-craig --position 1000 0 300 --wxyz 1 0 0 0"),
    "robots": Command("robots"),
    "robots, JSON": Command("robots pioneer5 --json"),
    "robots, radians": Command("robots scara --rad"),
    "robots, further": Command("robots --robots .", files={"slider.toml": SLIDER}),
    "check, radians": Command("check {robots}/scara.toml --rad"),
    "check, JSON": Command("check {robots}/puma560.toml --json"),
    "check, odd": Command("check odd.toml", files={"odd.toml": ODD}),
    "check, a wrong value": Command("check bad.toml", files={"bad.toml": ODD.replace("a = 200", 'a = "long"', 1)}),
    "check, no TOML": Command("check bad.toml", files={"bad.toml": "id = \n"}),
    "check, an unknown key": Command("check bad.toml", files={"bad.toml": SLIDER + "speed = 3\n"}),
    "check, no such file": Command("check none.toml"),
    "workspace": Command("workspace pioneer5 --effort 2"),
    "workspace, radians, locked": Command("workspace scara --effort 2 --rad --lock 1=0.5 --limit 3=0:0.1"),
    "workspace, JSON": Command("workspace scara --effort 2 --lock 1=45 --limit 3=0:100 --json"),
    "workspace, to standard output": Command("workspace pioneer5 -n 20 -o - --format csv --measure limits --q"),
    "workspace, a file": Command("workspace pioneer5 -n 1e2 --seed 5 -o cloud.csv", writes="cloud.csv"),
    "workspace, a file by its format": Command("workspace scara -n 30 -o cloud --format ndjson", writes="cloud"),
    "workspace, a picture": Command("workspace scara -n 200 --effort 2 --picture a.svg"),
    "workspace, a hull": Command("workspace pioneer5 -n 2000 --hull a.stl"),
    "postures": Command("postures scara --joints 1 2 --resolution 12"),
    "postures, a table": Command("postures ur5 --resolution 8 -o map.csv", writes="map.csv"),
    "postures, an unknown ending": Command("postures ur5 -o map.gif"),
    "cuspidal": Command("cuspidal panda --lock 7=45"),
    "cuspidal, JSON": Command("cuspidal ur5 --json"),
    "capability": Command("capability pioneer5 --resolution 6 --directions 12"),
    "capability, radians": Command("capability scara --voxel 0.25 --directions 12 --rad"),
    "capability, JSON": Command("capability pioneer5 --voxel 150 --directions 12 --limit 1=0:90 --json"),
    "capability, a file": Command("capability scara --resolution 4 --directions 12 -o map.csv", writes="map.csv"),
    "no such robot": Command("fk puma 1"),
    "too few values": Command("fk pioneer5 1 2"),
    "no quaternion": Command("ik pioneer5 --position 1 2 3 --wxyz 0 0 0 0"),
    "no direction": Command("ik pioneer5 --position 1 2 3 --approach 0 0 0"),
    "pose without a turn": Command("ik pioneer5 --position 1 2 3 --task pose"),
    "approach without a direction": Command("ik pioneer5 --position 1 2 3 --task approach"),
    "seed too short": Command("ik pioneer5 --position 1 2 3 --seed 1"),
    "lock of no joint": Command("ik pioneer5 --position 1 2 3 --lock 9=1"),
    "lock of two values": Command("ik pioneer5 --position 1 2 3 --lock 1=1:2"),
    "lock beyond the limits": Command("ik pioneer5 --position 1 2 3 --lock 2=-10"),
    "limit of one value": Command("ik pioneer5 --position 1 2 3 --limit 1=5"),
    "limit beyond the arm's": Command("ik pioneer5 --position 1 2 3 --limit 2=-5:5"),
    "unknown branch": Command("ik pioneer5 --position 1 2 3 --branch sideways"),
    "mask without a turn": Command("ik pioneer5 --position 1 2 3 --mask rx"),
    "mask and a task": Command("ik pioneer5 --position 1 2 3 --mask x --task pose"),
    "free values without names": Command("ik pioneer5 --position 1 2 3 --redundancy 1 --redundancy 2"),
    "nothing free": Command(f"ik ur5 {HAND} --redundancy 5"),
    "no such folder": Command("robots --robots /no/such/folder"),
    "cloud without a format": Command("workspace pioneer5 -o cloud.xyz"),
    "cloud nowhere": Command("workspace pioneer5 -n 10 -o /no/such/folder/cloud.ply"),
    "cloud of nothing": Command("workspace pioneer5 -n 0 -o cloud.ply"),
    "no effort": Command("workspace pioneer5 --effort 1"),
    "picture of another kind": Command("workspace pioneer5 --picture a.png"),
    "hull of another kind": Command("workspace pioneer5 --hull hull.doc"),
    "hull of three points": Command("workspace pioneer5 --hull a.stl -n 3"),
    "map of no directions": Command("capability pioneer5 --directions 13"),
    "map nowhere": Command("capability pioneer5 -o /no/such/folder/map.csv"),
    **{f"help: {name or 'all'}": Command(f"{name} --help") for name in ("", "serve", "fk", "ik", "robots")},
    **{f"help: {name}": Command(f"{name} --help") for name in ("workspace", "bench", "check", "capability")},
}

TABLES: dict[str, dict[str, Request]] = {
    "ik": IK,
    "motion": MOTION,
    "workspace": WORKSPACE,
    "robots": ROBOTS,
    "problems": PROBLEMS,
    "cli": CLI,
    "openapi": {"document": Rest("GET", "/openapi.json")},
}
# Kinds of answers that `ik` must have in the table, with the cause.
KINDS = {
    "solved": {""},
    "approximate": {"roll", "rotation"},
    "limits": {"joint limits"},
    "orientation": {"orientation"},
    "unreachable": {"too far", "too near", "around the axis", "outside", "branch"},
}


# -- asking ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def client() -> TestClient:
    settings = Settings(max_batch=50, max_path=50, max_body=100_000, time_budget=300)
    return TestClient(create_app(settings), raise_server_exceptions=False)


def ask_rest(client: TestClient, request: Rest) -> dict[str, Any]:
    body = request.body
    if body is not None:
        robot = request.path.removeprefix(API + "/").partition("/")[0]
        body = {name: _resolved(client, robot, value) for name, value in body.items()}
    response = client.request(
        request.method, request.path, json=body, content=request.content, headers=request.headers
    )
    reported = {name: response.headers[name] for name in HEADERS if name in response.headers}
    return {
        "status": response.status_code,
        **reported,
        "body": _readable(response.content, reported["content-type"]),
    }


def _resolved(client: TestClient, robot: str, value: Any) -> Any:
    """A field of a request, with poses in place of `At`."""
    if isinstance(value, list):
        return [_resolved(client, robot, item) for item in value]
    if not isinstance(value, At):
        return value
    answer = client.post(f"{API}/{robot}/fk", json={"q": list(value.q)})
    T = np.array(answer.json()["pose"]["matrix"])
    c, s = math.cos(value.roll), math.sin(value.roll)
    T[:3, :3] = T[:3, :3] @ [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
    T[:3, 3] += value.shift
    T = T.round(12) + 0.0
    position = T[:3, 3].tolist()
    if value.form == "matrix":
        return {"matrix": T.tolist()}
    if value.form == "wxyz":
        return {"position": position, "wxyz": [round(x, 12) for x in answer.json()["pose"]["wxyz"]]}
    return {"position": position} | ({"approach": T[:3, 2].tolist()} if value.form == "approach" else {})


def ask_command(command: Command, folder: Path, capsys: Any) -> dict[str, Any]:
    """Exit code and what is printed; the working directory is `folder`."""
    for name, text in command.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    words = [
        word.replace("~", " ").replace("{robots}", str(ROOT / "kin" / "robots")) for word in command.words.split()
    ]
    code = cli.main(words)
    out, err = capsys.readouterr()
    answer: dict[str, Any] = {"code": code, "out": _printed(out, "--json" in words), "err": err.splitlines()}
    if "--help" in words:  # where lines are broken, and how often metavars are reported, is Python's own affair
        answer["out"] = re.sub(r"(-\w) [A-Z]+, (--\w)", r"\1, \2", " ".join(out.split()))
    if command.writes is not None:
        answer["file"] = (folder / command.writes).read_text(encoding="ascii").splitlines()[:8]
        answer["file"] = [_cells(row) for row in answer["file"]]
    return answer


def _printed(out: str, is_json: bool) -> Any:
    if is_json:
        return json.loads(out) if out else None
    lines = out.splitlines()
    if any(line.startswith("nearest orientation") for line in lines):  # its joint values, and all columns' widths
        return [line.split("  ")[0] for line in lines]
    # A cloud is numbers, which are compared as such.
    return [_cells(row) for row in lines] if lines and lines[0].startswith("x,y,z") else lines


def _cells(row: str) -> Any:
    if row.startswith("{"):
        return json.loads(row)
    return [float(cell) if re.fullmatch(r"-?[0-9.]+(e[+-][0-9]+)?", cell) else cell for cell in row.split(",")]


def _readable(content: bytes, kind: str) -> Any:
    """The body of a response; of a cloud the head, the size and the first points."""
    if "json" in kind and "ndjson" not in kind:
        return json.loads(content)
    if "ndjson" in kind:
        rows = [json.loads(row) for row in content.splitlines()]
        return {"rows": len(rows), "first": rows[:4]}
    if "csv" in kind:
        table = list(csv.reader(io.StringIO(content.decode())))
        return {"rows": len(table) - 1, "head": table[0], "first": [[float(x) for x in row] for row in table[1:5]]}
    if content.startswith(b"KINCLOUD"):
        magic, *head = struct.unpack_from("<8sHHIQ", content)
        values = np.frombuffer(content, "<f4", offset=head[2]).reshape(head[3], head[1])
        names = content[24 : head[2]].decode().strip()
        return {"magic": magic.decode(), "numbers": head, "names": names, "first": values[:4].tolist()}
    if content.startswith(b"ply"):
        head, _, data = content.partition(b"end_header\n")
        lines = head.decode().splitlines()
        kinds = [line.split()[1:] for line in lines if line.startswith("property")]
        row = np.dtype([(name, "<f4" if size == "float" else "<f8") for size, name in kinds])
        return {"head": lines, "first": [list(item) for item in np.frombuffer(data, row)[:4].tolist()]}
    if content.startswith(b"PK"):
        with np.load(io.BytesIO(content)) as arrays:
            return {
                name: {"shape": list(array.shape), "first": array[:4].tolist()} for name, array in arrays.items()
            }
    return content.decode().splitlines()


# -- keeping and comparing -------------------------------------------------------------------------------------


def lasting(value: Any, tied: bool = False) -> Any:
    """An answer as it is kept: without what may change at any time, numbers rounded; `tied`: see `TIED`."""
    if isinstance(value, dict):
        value = dict(value)
        nearest = value.get("nearest_orientation")
        if isinstance(nearest, dict) and "q" in nearest:
            value["nearest_orientation"] = {name: nearest[name] for name in ERRORS}
        if tied and "blocked" in value:
            value["blocked"] = sorted(value["blocked"], key=lambda branch: str(branch["branch"]))
        return {name: lasting(item, tied) for name, item in value.items() if name not in VOLATILE}
    if isinstance(value, list | tuple):
        return [lasting(item, tied) for item in value]
    if isinstance(value, float) and math.isfinite(value):
        return 0.0 if abs(value) < 1e-12 else float(f"{value:.{DIGITS}g}")
    return value


def differences(old: Any, new: Any, where: str = "", free: bool = False) -> Iterator[str]:
    """Where two answers differ: the place, what was kept, what there is now; `free`: see `FREE`."""
    if isinstance(old, dict) and isinstance(new, dict):
        for name in [*old, *(name for name in new if name not in old)]:
            here = f"{where}.{name}" if where else name
            if name not in new:
                yield f"{here}: {_short(old[name])} → nothing"
            elif name not in old:
                yield f"{here}: nothing → {_short(new[name])}"
            else:
                yield from differences(old[name], new[name], here, free)
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield f"{where}: {len(old)} entries → {len(new)}"
        for i, (a, b) in enumerate(zip(old, new, strict=False)):
            yield from differences(a, b, f"{where}[{i}]", free)
    elif not _alike(old, new, free):
        yield f"{where}: {_short(old)} → {_short(new)}"


def _alike(old: Any, new: Any, free: bool) -> bool:
    if isinstance(old, float) and isinstance(new, int | float) and not isinstance(new, bool):
        relative, absolute = (SLACK, SLACK) if free else (RELATIVE, ABSOLUTE)
        return math.isclose(old, new, rel_tol=relative, abs_tol=absolute)
    return type(old) is type(new) and bool(old == new)


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 300 else text[:299] + "…"


def pretty(value: Any, indent: str = "") -> str:
    """JSON in which a list or object stays on one line where it fits."""
    flat = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if len(indent) + len(flat) <= WIDTH or not isinstance(value, dict | list):
        return flat
    inner = indent + " "
    if isinstance(value, dict):
        parts = [f"{json.dumps(name, ensure_ascii=False)}: {pretty(item, inner)}" for name, item in value.items()]
        return "{\n" + ",\n".join(inner + part for part in parts) + f"\n{indent}}}"
    return "[\n" + ",\n".join(inner + pretty(item, inner) for item in value) + f"\n{indent}]"


def read(area: str) -> dict[str, Any]:
    file = FOLDER / f"{area}.json"
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}


@pytest.fixture(scope="session")
def kept() -> dict[str, dict[str, Any]]:
    """What is in the files, by area and request."""
    return {area: read(area) for area in TABLES}


@pytest.fixture(scope="session")
def renewed(request: pytest.FixtureRequest) -> Iterator[dict[str, dict[str, Any]] | None]:
    """What is to be written when the run is over; None if the run compares."""
    if not request.config.getoption("--snapshot-update"):
        yield None
        return
    if hasattr(request.config, "workerinput"):
        pytest.fail("--snapshot-update works in one process: -n 0")
    found: dict[str, dict[str, Any]] = {area: {} for area in TABLES}
    yield found
    FOLDER.mkdir(exist_ok=True)
    for area, table in TABLES.items():
        answers = read(area) | found[area]
        ordered = {name: answers[name] for name in table if name in answers}
        (FOLDER / f"{area}.json").write_text(pretty(ordered) + "\n", encoding="utf-8")


@pytest.mark.parametrize(("area", "name"), [(area, name) for area, table in TABLES.items() for name in table])
def test_users_see_the_same(
    client: TestClient,
    kept: dict[str, dict[str, Any]],
    renewed: dict[str, dict[str, Any]] | None,
    area: str,
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    request = TABLES[area][name]
    reported = ask_rest(client, request) if isinstance(request, Rest) else ask_command(request, tmp_path, capsys)
    answer = lasting(reported, name in TIED)
    if renewed is not None:
        renewed[area][name] = answer
        return
    assert name in kept[area], f"{area}.json has no answer to {name!r}: run with --snapshot-update"
    free = area in ("ik", "motion") and FREE.search(name) is not None
    found = list(differences(kept[area][name], answer, free=free))
    if found:
        more = [f"… and {len(found) - 20} more"] if len(found) > 20 else []
        pytest.fail("\n".join([f"{area}.json, {name!r}: kept → now", *found[:20], *more]), pytrace=False)


@pytest.mark.parametrize("area", TABLES)
def test_no_answer_is_stale(kept: dict[str, dict[str, Any]], renewed: Any, area: str) -> None:
    """Each answer that is kept belongs to a request of the table."""
    if renewed is None:
        assert [name for name in kept[area] if name not in TABLES[area]] == []


def test_no_file_is_stale() -> None:
    assert {file.stem for file in FOLDER.iterdir()} <= set(TABLES)


def test_every_kind_of_answer_is_kept(kept: dict[str, dict[str, Any]], renewed: Any) -> None:
    """Each status of `ik`, and each cause, is in the table."""
    if renewed is not None:
        return
    found: dict[str, set[str]] = {}
    for answer in kept["ik"].values():
        if "cause" in answer["body"]:
            found.setdefault(answer["body"]["status"], set()).add(answer["body"]["cause"])
    assert found == KINDS


def test_no_failure_is_kept(kept: dict[str, dict[str, Any]], renewed: Any) -> None:
    """An internal error is nothing to hold on to."""
    if renewed is None:
        assert [
            name for table in kept.values() for name, reported in table.items() if reported.get("status") == 500
        ] == []


def test_a_difference_names_its_place() -> None:
    old = {"a": [1.0, 1e-17, {"b": "far"}], "c": 1, "d": None}
    assert list(differences(old, {"a": [1.0 + 1e-9, 0, {"b": "far"}], "c": 1, "d": None})) == []
    new = {"a": [1.001, 0.0, {"b": "near"}], "c": True, "e": 2}
    assert list(differences(old, new)) == [
        "a[0]: 1.0 → 1.001",
        'a[2].b: "far" → "near"',
        "c: 1 → true",
        "d: null → nothing",
        "e: nothing → 2",
    ]
