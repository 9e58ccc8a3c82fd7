"""What a page tells its program, as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.api.live.messages import MOST_BYTES, MOST_RATE
from app.shared.answers.details import ContactAnswer
from app.shared.answers.ik import ik_answer
from kin import Robot, robot_to_dict
from kin.transforms import wxyz_from_rotation


def robot_answer(robot: Robot) -> dict[str, Any]:
    """The arm on show: its id, its name, its joints, and the fields of a robot file."""
    joints = [
        {
            "name": joint.name,
            "kind": "revolute" if turns else "prismatic",
            "lower": None if joint.limits is None else float(low),
            "upper": None if joint.limits is None else float(high),
        }
        for joint, turns, low, high in zip(robot.joints, robot.revolute, robot.lower, robot.upper, strict=True)
    ]
    return {"id": robot.id, "name": robot.name, "joints": joints, "description": robot_to_dict(robot)}


def welcome(code: str, robot: Robot, most: float) -> dict[str, Any]:
    """The first message."""
    limits = {"bytes": MOST_BYTES, "messages": most, "rate": MOST_RATE}
    return {"type": "welcome", "code": code, "robot": robot_answer(robot), "limits": limits}


def news(values: Mapping[str, object]) -> dict[str, Any]:
    """What has changed in the page."""
    return {"type": "news", **{name: _answer(name, value) for name, value in values.items()}}


def _answer(name: str, value: Any) -> Any:
    if value is None:
        return None
    match name:
        case "robot":
            return robot_answer(value)
        case "target":
            return {"position": value[:3, 3].tolist(), "wxyz": wxyz_from_rotation(value[:3, :3]).tolist()}
        case "q":
            return value.tolist()
        case "result":
            return ik_answer(value)
        case "contacts":
            return [ContactAnswer.of(each) for each in value]
    return value
