"""The wall: the arms of all students of a class as small copies in the teacher's scene.

All pieces of all arms are instances of one cylinder in one node, and the pads below them are another: a tick sends
two lists of poses, however many students there are. The arms float in a plane that faces the default view, so that
each is seen as in the view of one arm.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import viser
from numpy.typing import NDArray

from app.classroom.work import Progress
from app.viewer.labels import add_label
from app.viewer.scene.camera import DIRECTION
from app.viewer.scene.meshes import Body, body
from app.viewer.skeleton import cylinder, places, skeleton
from kin import Robot
from kin.transforms import Array

State = Progress | Literal["away", "none"]
# Colour of the pad, and symbol before the name.
PADS: dict[State, tuple[int, int, int]] = {
    "none": (118, 142, 166), "not begun": (118, 142, 166), "at it": (86, 140, 190), "stuck": (213, 94, 0),
    "gave up": (204, 121, 167), "solved": (0, 158, 115), "away": (150, 150, 150),
}  # fmt: skip
SYMBOLS: dict[State, str] = {
    "none": "", "not begun": "○ ", "at it": "✎ ", "stuck": "! ", "gave up": "⚑ ", "solved": "✓ ", "away": "… ",
}  # fmt: skip
HAND, RAISED = "☝ ", (230, 159, 0)  # before the name, and colour of the pad's column
LINK, JOINT, AWAY = (86, 140, 190), (44, 62, 80), (165, 170, 175)
MOST = 40  # arms on the wall
WIDTH = 4.4  # of the wall, in radii of the sphere around the arm on show
SIZE = 0.42  # radius of a small arm, in distances between two of them
LABEL = 0.06  # height of a name below the pad of its arm, in the same
LETTERS = (1.0, 1.8, 9.0)  # smallest and largest size of names, in the usual one, and that size times columns
ROOM = 0.52  # room above and below the middle of an arm, in the same
PAD = (0.26, 0.03)  # radius and thickness of a pad, in the same
COLUMN = 0.05  # radius of the column below a base, in the same
NAME = "/wall-"  # what the names of the nodes begin with
_WALLS = itertools.count(1)


@dataclass(frozen=True, eq=False)
class SmallArm:
    """One student's arm: the seat, the name shown, robot, configuration ``(n,)``, and how the student is doing.

    Attributes:
        hand: whether it is up, whatever the state is.
    """

    seat: str
    name: str
    robot: Robot
    q: Array
    state: State
    hand: bool = False

    @property
    def label(self) -> str:
        """The name, with how the student is doing in a symbol and a word."""
        words = "" if self.state == "none" else f" · {self.state}"
        return f"{HAND if self.hand else ''}{SYMBOLS[self.state]}{self.name}{words}"


def columns_of(count: int, aspect: float) -> int:
    """How many arms stand in a row, in a picture of this aspect ratio."""
    return max(1, min(count, math.ceil(math.sqrt(count * aspect * 0.9))))


def cells(count: int, columns: int, pitch: float, center: Array) -> Array:
    """Middles ``(count, 3)`` of the cells, row by row from the top left. They face the default view."""
    right, up, _ = _plane()
    rows = math.ceil(count / columns)
    places = np.arange(count)
    x, y = places % columns - (columns - 1) / 2, (rows - 1) / 2 - places // columns
    found: Array = center + pitch * (x[:, None] * right + y[:, None] * up)
    return found


def _plane() -> Array:
    """Unit vectors ``(3, 3)``, by rows: to the right and up in the plane of the wall, and out of it."""
    out = DIRECTION / np.linalg.norm(DIRECTION)
    right = np.cross([0.0, 0.0, 1.0], out)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(out, right), out])


class Wall:
    """The wall in a teacher's scene. `clicked` receives a seat's id, in the event loop.

    Args:
        around: the body of the arm in whose place the wall stands.
        aspect: of the picture.
    """

    def __init__(self, scene: viser.SceneApi, around: Body, aspect: float, clicked: Callable[[str], None]) -> None:
        self._scene, self._around, self._aspect, self._clicked = scene, around, aspect, clicked
        self._layout: tuple[tuple[str, Robot], ...] | None = None
        self._shown: list[bytes] = []
        self._states: tuple[tuple[State, bool], ...] = ()
        self._root: viser.SceneNodeHandle | None = None
        self._nodes: list[viser.BatchedMeshHandle] = []
        self._labels: list[viser.LabelHandle] = []
        self._owners: list[list[int]] = [[], []]  # index of the arm of each instance, by node
        self._cells = np.zeros((0, 3))
        self._pitch = 1.0
        self.corners = np.zeros((0, 3))

    def show(self, arms: Sequence[SmallArm]) -> bool:
        """Draw these arms; returns whether their places are other ones. Unchanged arms are not computed again."""
        arms = arms[:MOST]
        layout = tuple((arm.seat, arm.robot) for arm in arms)
        fresh = layout != self._layout
        if fresh:
            self._build(arms, layout)
        self._pose(arms)
        states = tuple((arm.state, arm.hand) for arm in arms)
        if self._nodes and (fresh or states != self._states):
            self._states = states
            self._nodes[0].batched_colors = _colors(arms)
            pads = [PADS[state] for state, _ in states]
            columns = [RAISED if hand else PADS[state] for state, hand in states]
            self._nodes[1].batched_colors = np.array(pads + columns, np.uint8)
        for label, arm in zip(self._labels, arms, strict=True):
            if label.text != arm.label:
                label.text = arm.label
        return fresh

    def remove(self) -> None:
        """Remove everything from the scene."""
        if self._root is not None:
            self._root.remove()
        self._nodes, self._labels, self._layout, self._root = [], [], None, None

    def _build(self, arms: Sequence[SmallArm], layout: tuple[tuple[str, Robot], ...]) -> None:
        self.remove()
        self._layout, self._shown = layout, [b""] * len(arms)
        count = len(arms)
        if not count:
            return
        columns = columns_of(count, self._aspect)
        self._pitch = WIDTH * self._around.radius / max(columns, 2)
        self._cells = cells(count, columns, self._pitch, self._around.center)
        room = self._pitch * np.array([SIZE, ROOM, SIZE])
        self.corners = np.vstack(
            [self._cells + (room * signs) @ _plane() for signs in itertools.product((-1, 1), repeat=3)]
        )
        bones = [skeleton(arm.robot) for arm in arms]
        scales = [self._scale(arm.robot) * bone.scales for arm, bone in zip(arms, bones, strict=True)]
        root = f"{NAME}{next(_WALLS)}"
        self._root = self._scene.add_frame(root, show_axes=False)
        self._owners = [[i for i, bone in enumerate(bones) for _ in bone.links], [*range(count)] * 2]
        pads, feet = self._pads(arms)
        self._nodes = [
            self._add(f"{root}/arms", np.zeros((len(self._owners[0]), 3)), np.vstack(scales), 0),
            self._add(f"{root}/pads", feet, pads, 1),
        ]
        out = 0.3 * self._pitch * DIRECTION / np.linalg.norm(DIRECTION) - [0.0, 0.0, LABEL * self._pitch]
        smallest, largest, share = LETTERS
        scale = float(np.clip(share / columns, smallest, largest))
        self._labels = [
            add_label(
                self._scene, f"{root}/name/{i}", arm.label, scale=scale, position=foot + out, anchor="top-center"
            )
            for i, (arm, foot) in enumerate(zip(arms, feet[:count], strict=True))
        ]

    def _pads(self, arms: Sequence[SmallArm]) -> tuple[Array, Array]:
        """Scales and positions ``(2 * count, 3)`` of the pads, and of the columns below the arms' bases."""
        bases = [arm.robot.T_world_base[:3, 3] for arm in arms]
        feet = [np.array([*base[:2], body(arm.robot).floor]) for base, arm in zip(bases, arms, strict=True)]
        placed = np.array(
            [self._place(i, arm.robot, foot) for i, (arm, foot) in enumerate(zip(arms, feet, strict=True))]
        )
        heights = [
            self._scale(arm.robot) * max(base[2] - foot[2], 0.0)
            for arm, base, foot in zip(arms, bases, feet, strict=True)
        ]
        pads = np.tile(self._pitch * np.array([PAD[0], PAD[0], PAD[1]]), (len(arms), 1))
        columns = np.array([[COLUMN * self._pitch, COLUMN * self._pitch, max(height, 1e-6)] for height in heights])
        return np.vstack([pads, columns]), np.vstack([placed - [0.0, 0.0, self._pitch * PAD[1]], placed])

    def _add(self, name: str, positions: Array, scales: Array, index: int) -> viser.BatchedMeshHandle:
        vertices, faces = cylinder()
        node = self._scene.add_batched_meshes_simple(
            name, vertices, faces, batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(positions), 1)),
            batched_positions=positions, batched_scales=scales,
            batched_colors=np.zeros((len(positions), 3), np.uint8), lod="off", cast_shadow=False,
            receive_shadow=False,
        )  # fmt: skip
        owners, seats = self._owners[index], [seat for seat, _ in self._layout or ()]

        @node.on_click
        async def _(event: viser.SceneNodePointerEvent[viser.BatchedMeshHandle]) -> None:
            at = event.instance_index
            if at is not None and 0 <= at < len(owners):
                self._clicked(seats[owners[at]])

        return node

    def _scale(self, robot: Robot) -> float:
        return SIZE * self._pitch / body(robot).radius

    def _place(self, i: int, robot: Robot, points: Array) -> Array:
        """Points ``(…, 3)`` of an arm where its small copy has them."""
        placed: Array = self._cells[i] + self._scale(robot) * (points - body(robot).center)
        return placed

    def _pose(self, arms: Sequence[SmallArm]) -> None:
        """Send new poses of all pieces if an arm has moved."""
        keys = [arm.q.tobytes() for arm in arms]
        moved = [i for i, key in enumerate(keys) if key != self._shown[i]]
        if not moved:
            return
        self._shown = keys
        node = self._nodes[0]
        owners = np.array(self._owners[0])
        positions, turns = np.array(node.batched_positions), np.array(node.batched_wxyzs)
        groups: dict[Robot, list[int]] = {}
        for i in moved:
            groups.setdefault(arms[i].robot, []).append(i)
        for robot, members in groups.items():
            points, wxyz, _ = places(robot, np.array([arms[i].q for i in members]))
            for k, i in enumerate(members):
                positions[owners == i] = self._place(i, robot, points[k])
                turns[owners == i] = wxyz[k]
        node.batched_positions = positions.astype(np.float32)
        node.batched_wxyzs = turns.astype(np.float32)


def _colors(arms: Sequence[SmallArm]) -> NDArray[np.uint8]:
    """The colours ``(m, 3)`` of all pieces: joints are dark, links light, and all of one who is away pale."""
    found = []
    for arm in arms:
        scales = skeleton(arm.robot).scales
        thick = scales[:, 0].max()
        joints = (scales[:, 0] >= 0.99 * thick)[:, None]
        found.append(
            np.where(joints, JOINT if arm.state != "away" else AWAY, LINK if arm.state != "away" else AWAY)
        )
    return np.vstack(found).astype(np.uint8)
