"""Sizes and section of an arm's workspace: seconds of work, done once for all visitors, beside them."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import lru_cache

import kin
from kin import Robot, Section, WorkspaceFacts

KEPT = 64  # arms

_one_at_a_time = {"facts": threading.Lock(), "section": threading.Lock()}


@dataclass(frozen=True)
class Cross:
    """The (r, z) section of an arm, or why there is none."""

    section: Section | None
    why_not: str = ""


def facts(robot: Robot, volume: bool) -> WorkspaceFacts:
    """`kin.workspace_facts`; visitors who ask for the same arm wait for one computation."""
    with _one_at_a_time["facts"]:
        return _facts(robot, volume)


def cross(robot: Robot) -> Cross:
    """`kin.section` in (r, z); visitors who ask for the same arm wait for one computation."""
    with _one_at_a_time["section"]:
        return _cross(robot)


@lru_cache(maxsize=KEPT)
def _facts(robot: Robot, volume: bool) -> WorkspaceFacts:
    return kin.workspace_facts(robot, volume=volume)


@lru_cache(maxsize=KEPT)
def _cross(robot: Robot) -> Cross:
    if robot.joints[0].kind != "revolute":
        return Cross(None, "Joint 1 slides: there is no section that it turns.")
    return Cross(kin.section(robot))
