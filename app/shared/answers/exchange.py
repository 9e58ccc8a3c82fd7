"""Answers that hold a whole arm: converted to the other convention, or read from a URDF."""

from __future__ import annotations

from typing import Any

from app.shared.answers.answer import Answer
from app.shared.answers.robots import RobotAnswer, robot_answer
from kin import Robot, robot_to_dict, robot_to_toml
from kin.dh import convert_dh
from kin.dh.tables import SAMPLES, largest_difference
from kin.files import UrdfRobot
from kin.robot import Convention


class ConvertAnswer(Answer):
    """The same arm in the other convention, with what a check found."""

    robot: RobotAnswer
    """The arm as a table in the requested convention."""
    description: dict[str, Any]
    """The same as the fields of a robot file, as other requests take it."""
    toml: str
    """The same as the text of a robot file."""
    difference: float
    """Largest difference of any entry of the tool's pose between the two tables, at random configurations."""
    samples: int
    """Number of these configurations."""


class TipAnswer(Answer):
    """A link that can be the tip of an arm."""

    link: str
    """Name of the link."""
    joints: int
    """Number of moving joints between the root and the link."""


class UrdfBodyAnswer(Answer):
    """What stands for a link of the arm in collisions."""

    link: int
    """0 for the base, k for the link that joint k moves."""
    names: list[str]
    """The URDF links whose collision bodies it has."""
    capsules: int
    """Number of capsules around what the file states."""
    missing: list[str]
    """What could not be used of it, and why."""
    assumed: bool
    """Whether a tube is assumed, because something is missing or nothing is stated."""


class UrdfReportAnswer(Answer):
    """What became of a URDF."""

    base: str
    """The link the arm stands on."""
    tip: str
    """The link that is the tool."""
    tips: list[TipAnswer]
    """The links that could have been chosen as the tip, those with the most joints first."""
    joints: list[str]
    """The moving joints, in the order of q."""
    merged: list[str]
    """The fixed joints of the chain, which became part of its constant transforms."""
    ignored: list[str]
    """The joints that are no part of the chain."""
    tilts: list[str]
    """The fixed rows that hold the small angle between two almost parallel axes."""
    notes: list[str]
    """What was assumed, one sentence each."""
    difference: float
    """Largest difference of any entry of the tool's pose from the product of the URDF's transforms, at random
    configurations."""
    samples: int
    """Number of these configurations."""
    bodies: list[UrdfBodyAnswer]
    """What stands for each link in collisions, base first. Meshes are not sent along: for links with one a tube is
    assumed."""
    about_bodies: str
    """The same in words: the rest of a sentence that begins "Collisions: "."""


class ImportAnswer(Answer):
    """An arm read from a URDF."""

    robot: RobotAnswer
    """The arm as a standard DH table."""
    description: dict[str, Any]
    """The same as the fields of a robot file, as other requests take it."""
    toml: str
    """The same as the text of a robot file."""
    report: UrdfReportAnswer
    """What became of the file, and what a check found."""


def convert_answer(robot: Robot, convention: Convention) -> ConvertAnswer:
    """The arm as a table in this convention."""
    other = convert_dh(robot, convention)
    return ConvertAnswer(
        robot=robot_answer(other),
        description=robot_to_dict(other),
        toml=robot_to_toml(other),
        difference=largest_difference(robot, other),
        samples=SAMPLES,
    )


def import_answer(found: UrdfRobot) -> ImportAnswer:
    """The arm, and the report about its file."""
    robot, report = found
    return ImportAnswer(
        robot_answer(robot), robot_to_dict(robot), robot_to_toml(robot), UrdfReportAnswer.of(report)
    )
