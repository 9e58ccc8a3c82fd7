"""Which of the built-in arms a test is about, and the random parts of which others are made.

Laws that hold for any arm loop over `kin.builtin_robots()`. What is told of closed forms, equations, singular
curves and golden inverse kinematics is told of the chapter's arms.
"""

import math

import numpy as np

CHAPTER_ARMS = ("pioneer5", "redundant7", "redundant7-craig")


def nested(T):
    """A matrix as a robot has it."""
    return tuple(tuple(row) for row in np.asarray(T).tolist())


class Draw:
    """Random parts of arms: lengths and twists of either sign, any angle, any pose."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def length(self):
        return float(self.rng.uniform(0.1, 0.6) * self.rng.choice([-1, 1]))

    def angle(self):
        return float(self.rng.choice([0, math.pi / 2, -math.pi / 2, math.pi, *self.rng.uniform(-3, 3, 4)]))

    def square(self):
        return float(self.rng.choice([-math.pi / 2, math.pi / 2]))

    def parallel(self):
        return float(self.rng.choice([0.0, math.pi]))

    def pose(self):
        R = np.linalg.qr(self.rng.normal(size=(3, 3)))[0]
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R * np.linalg.det(R), self.rng.uniform(-0.3, 0.3, 3)
        return nested(T)
