"""What the lesson "Velocity" knows of a robot at a configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

import kin
from app.viewer.declared.facts import Facts
from app.viewer.lessons.velocity.along import controllable
from app.viewer.lessons.velocity.ellipsoids import (
    Axes,
    Ellipsoid,
    TaskRates,
    axes_of,
    lost,
    part_of,
    semi_axes,
    task_rates,
)
from app.viewer.lessons.velocity.settings import SPEEDS, VelocitySettings
from app.viewer.lessons.velocity.views import SAMPLE, State, lost_words, nice, real, state_of
from app.viewer.null_space import NullSpace, margin, measure, null_space, secondary
from app.viewer.scene.meshes import body
from kin import Robot
from kin.ik import Singularity, Task
from kin.transforms import Array

STILL = 1e-6  # m/s or rad/s along a direction that is lost, at unit speeds of the joints
SIZE = 0.42  # of the usual ellipsoid, in radii of the sphere around the arm


@dataclass(frozen=True, eq=False)
class VelocityFacts(Facts[VelocitySettings]):
    """See the module."""

    @cached_property
    def J(self) -> Array:
        """The Jacobian ``(6, n)`` in the base frame."""
        return kin.jacobian(self.robot, self.q)

    @cached_property
    def rows(self) -> Array:
        """The Jacobian ``(6, n)`` in the chosen frame."""
        R = self.T[:3, :3]
        return self.J if self.settings.frame == "base" else np.vstack([R.T @ self.J[:3], R.T @ self.J[3:]])

    @cached_property
    def axes(self) -> Axes:
        """The axes of the ellipsoid on show; without one, those of velocities."""
        return axes_of(part_of(self.J, self.settings.ellipsoid or "velocity"))

    @cached_property
    def semi(self) -> Array:
        """The semi-axes ``(3,)`` of the ellipsoid on show."""
        return semi_axes(self.axes.values, self.settings.ellipsoid or "velocity")

    @cached_property
    def found(self) -> tuple[Singularity, ...]:
        """All singularities, the nearest first."""
        return kin.singularities(self.robot, self.q)

    @cached_property
    def state(self) -> State:
        """Whether the arm is near a singularity that costs it a motion."""
        nearest = real(self.found)
        return state_of(nearest[0], self.robot.reach) if nearest else "far"

    @cached_property
    def rates(self) -> TaskRates:
        """Singular values of the arm's task."""
        return task_rates(self.robot, self.q)

    @cached_property
    def twists(self) -> Array:
        """The directions ``(k, 6)`` that are lost, or the slowest one near a singularity."""
        if self.state == "far":
            return np.empty((0, 6))
        if self.state == "near":
            return self.rates.twists[-1:]
        found = lost(self.rates)
        if float(np.abs(found[-1] @ self.J).max()) < STILL:
            return found
        # The task loses nothing, but the pose does: a stretched planar arm of three joints.
        ever = motions(self.robot)
        U, s, _ = np.linalg.svd(ever @ self.J)
        return lost(TaskRates(s[: len(ever)], U.T @ ever))

    @cached_property
    def lost_words(self) -> Sequence[str]:
        """These directions in words."""
        return [lost_words(twist, self.T[:3, :3], slowest=self.state == "near") for twist in self.twists]

    @cached_property
    def least(self) -> tuple[Array, float]:
        """The direction ``(3,)`` whose force takes the least torque, and its torque per newton."""
        axes = axes_of(self.J[:3])
        return axes.R[:, 2], float(axes.values[2])

    @cached_property
    def torques(self) -> Array:
        """Of the joints ``(n,)``, for the force at the tool."""
        return torques(self.J, np.array(self.settings.statics.force))

    @cached_property
    def task(self) -> Task:
        """The task as far as the joints control it."""
        return controllable(self.robot, self.arm.task)

    @cached_property
    def space(self) -> NullSpace:
        """The null space of the task."""
        return null_space(self.robot, self.q, self.task)

    @cached_property
    def speeds(self) -> tuple[Array, Array, Array]:
        """z, J⁺v and (I − J⁺J) z ``(n,)``; v is zero in the rows of the rotation."""
        v = np.zeros(len(self.space.J))
        v[:3] = SPEEDS[self.settings.speed]
        z = secondary(self.robot, self.q, self.task, self.settings.goal)
        return z, self.space.pinv @ v, self.space.project(z)

    @cached_property
    def measure(self) -> float:
        """The manipulability of the task."""
        return float(measure(self.robot, self.q, self.task, self.space.rank))

    @cached_property
    def margin(self) -> float:
        """How far the nearest joint limit is, as a share of half its range."""
        return margin(self.robot, self.q)


@lru_cache(maxsize=128)
def motions(robot: Robot) -> Array:
    """The motions of the tool that the arm has anywhere: orthonormal twists ``(k, 6)``."""
    every = kin.jacobian(robot, robot.random_q(np.random.default_rng(2), 8))
    U, s, _ = np.linalg.svd(np.concatenate(list(every), axis=1))
    return np.asarray(U[:, s > 1e-9 * s[0]].T)


@lru_cache(maxsize=128)
def scale_of(robot: Robot, kind: Ellipsoid) -> float:
    """The value that `SAMPLE` represents in the scene: the ellipsoid at home then has a fitting size."""
    semi = semi_axes(axes_of(part_of(kin.jacobian(robot, robot.q_home), kind)).values, kind)
    usual = semi[np.isfinite(semi) & (semi > 1e-6) & (semi < 1e6)]
    longest = float(usual.max()) if len(usual) else 1.0
    return nice(SAMPLE * longest / (SIZE * body(robot).radius))


def torques(J: Array, force: Array) -> Array:
    """τ = JᵀF ``(n,)`` for a force ``(3,)`` at the tool point: N·m of joints that turn, N of those that slide."""
    return np.asarray(J[:3].T @ force)
