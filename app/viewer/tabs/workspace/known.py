"""Sizes and section of an arm's workspace, from the cache that all visitors and REST share."""

from __future__ import annotations

from dataclasses import dataclass

from app.shared.summaries import Summaries
from kin import Robot, Section, WorkspaceFacts


@dataclass(frozen=True)
class Cross:
    """The (r, z) section of an arm, or why there is none."""

    section: Section | None
    why_not: str = ""


def facts(summaries: Summaries, robot: Robot, volume: bool) -> WorkspaceFacts:
    """Sizes as by `kin.workspace_facts`; waits until they are computed."""
    return (summaries.facts(robot) if volume else summaries.facts(robot, effort=None)).result()


def cross(summaries: Summaries, robot: Robot) -> Cross:
    """The section in (r, z) as by `kin.section`; waits until it is computed."""
    if robot.joints[0].kind != "revolute":
        return Cross(None, "Joint 1 slides: there is no section that it turns.")
    return Cross(summaries.section(robot).result())
