"""The settings of the lesson "Velocity"."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from app.viewer.declared.fields import Number, Settings, choice, flag, joint, memory, number, part, vector
from app.viewer.lessons.velocity.ellipsoids import Ellipsoid
from app.viewer.lessons.velocity.jog import Frame
from app.viewer.null_space import Goal
from kin.transforms import Array

FRAMES: dict[str, Frame] = {"Base": "base", "Tool": "tool"}
ELLIPSOIDS: dict[str, Ellipsoid | None] = {
    "Linear velocity": "velocity",
    "Angular velocity": "turning",
    "Force": "force",
    "Moment": "moment",
    "None": None,
}
STEPS = (1e-4, 0.1)  # m
TURNS = (math.radians(0.1), math.radians(30.0))  # rad
LARGEST = 100.0  # N, of each component of the force
FIRST = (0.0, 0.0, -10.0)  # N
GOALS: dict[str, Goal] = {"Away from limits": "limits", "Higher manipulability": "manipulability"}
SPEED = 0.05  # m/s of the tool
SPEEDS: dict[str, Array] = {
    "At rest": np.zeros(3),
    **{
        f"{sign}{axis} of the base": way * SPEED * np.eye(3)[i]
        for i, axis in enumerate("xyz")
        for sign, way in (("+", 1.0), ("−", -1.0))
    },
}
FORCES = Number(limits=(-LARGEST, LARGEST), digits=2, step=0.1)
FRAME_HINT = "Whose axes the Jacobian's rows and the jog buttons refer to; the reference point is the tool point"
ELLIPSOID_HINT = "Velocities the joints can give the tool, or forces they can resist, largest where it is slowest"
ON_HINT = "A force with which the tool pushes; drag its tip in the scene, or type it"
GOAL_HINT = "z: the joint speeds of the secondary goal, before what would move the tool is taken away"
SPEED_HINT = "v: the velocity of the tool, 50 mm/s"
RUN_HINT = "Moves the arm with these joint speeds, until a limit or the best place is reached"


@dataclass(frozen=True)
class Statics(Settings):
    """A force at the tool, and whether it is on show."""

    on: bool = flag("Force at the tool", hint=ON_HINT)
    force: tuple[float, float, float] = vector(("Fx, N", "Fy, N", "Fz, N"), FIRST, FORCES)


@dataclass(frozen=True)
class VelocitySettings(Settings):
    """See the module; `joint` is that of the column on show.

    Attributes:
        refused: the jog that was refused last: a button held at a limit asks ten times a second.
        start: the configuration ``(n,)`` where the line begins; None: home.
        plot: the plot of the line, as HTML.
        motion: where the motion in the null space has come to: configuration ``(n,)`` and pose ``(4, 4)``.
    """

    frame: Frame = choice("Frame", FRAMES, "base", hint=FRAME_HINT)
    ellipsoid: Ellipsoid | None = choice("Show", ELLIPSOIDS, "velocity", none="none", hint=ELLIPSOID_HINT)
    joint: int | None = joint()
    step: float = number("Step", 0.005, STEPS, "length", hint="Length of one step along an axis")
    turn: float = number("Turn", math.radians(2.0), TURNS, "angle", hint="Angle of one step about an axis")
    statics: Statics = part(Statics)
    goal: Goal = choice("Secondary goal", GOALS, "limits", hint=GOAL_HINT, link=False)
    speed: str = choice("Tool velocity", {name: name for name in SPEEDS}, "At rest", hint=SPEED_HINT, link=False)
    runs: bool = flag("Run", hint=RUN_HINT, link=False, renew=True)
    refused: tuple[object, ...] = memory(())
    start: Array | None = memory()
    plot: str = memory("")
    motion: tuple[Array, Array] | None = memory()
