"""The wall: the arms of all students of a class as small copies in the teacher's scene.

All pieces of all arms are instances of one cylinder in one node, and the pads below them are another: a tick sends
two lists of poses, however many students there are. The arms float in a plane that faces the default view. So each
looks as it does when it is the only arm. They and their names share the picture as evenly as its shape allows;
names have a size in the scene, so that they keep to their cells in every window.
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
from app.viewer.scene.camera import DIRECTION
from app.viewer.scene.meshes import Body, body
from app.viewer.skeleton import cylinder, places, skeleton
from kin import Robot
from kin.transforms import Array

State = Progress | Literal["away", "none"]


def _lit(*color: int) -> tuple[int, int, int]:
    """What the scene must be given to show an sRGB colour: it takes colours of instances as amounts of light."""
    r, g, b = (
        round(255 * (c / 12.92 if (c := each / 255) <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4))
        for each in color
    )
    return r, g, b


# Colour of the pad, and symbol before the words.
PADS: dict[State, tuple[int, int, int]] = {
    "none": _lit(118, 142, 166),
    "not begun": _lit(118, 142, 166),
    "at it": _lit(86, 140, 190),
    "stuck": _lit(213, 94, 0),
    "gave up": _lit(204, 121, 167),
    "solved": _lit(0, 158, 115),
    "away": _lit(150, 150, 150),
}
SYMBOLS: dict[State, str] = {
    "none": "",
    "not begun": "○ ",
    "at it": "✎ ",
    "stuck": "! ",
    "gave up": "⚑ ",
    "solved": "✓ ",
    "away": "… ",
}
HAND, RAISED = "☝ ", _lit(240, 190, 0)  # before the name, and colour of the pad's column
DRIVES, DRIVEN = "● ", _lit(200, 30, 30)  # before what is driven, and colour of the pad: that of the page's frame
LINK, JOINT, AWAY = (86, 140, 190), (44, 62, 80), (165, 170, 175)
MOST = 40  # arms on the wall
WIDTH = 4.4  # of the wall, in radii of the sphere around the arm on show, which the picture shows as well
HEIGHT = 2.4  # of the wall at least, in the same
SIZE = 0.56  # radius of a small arm, in sides of the square for it: an arm seldom reaches as far as it could
SMALLEST, LARGEST = 0.0255, 0.042  # height of a line of a name, in heights of the wall: 24 pixels or more of 1080
LETTER = 0.55  # width of a letter, in these lines
NARROW = 0.75  # of the width, instead of the height, in a narrow picture
WORDS = 6.65  # width of a state in words, in these lines
LINES = 2.6  # height of name and state with some space, in these lines
PAD = (0.26, 0.03)  # radius and thickness of a pad, in sides of that square
COLUMN = 0.05  # radius of the column below a base, in the same
NAME = "/wall-"  # what the names of the nodes begin with
_WALLS = itertools.count(1)


@dataclass(frozen=True, eq=False)
class SmallArm:
    """One student's arm: the seat, the name shown, robot, configuration ``(n,)``, and how the student is doing.

    Attributes:
        hand: whether it is up, whatever the state is.
        driven: what a program drives with the arm, or empty: more urgent than how the student is doing.
    """

    seat: str
    name: str
    robot: Robot
    q: Array
    state: State
    hand: bool = False
    driven: str = ""

    def label(self, letters: int) -> str:
        """The name, cut to so many letters, and below it how the student is doing, in a symbol and words."""
        words = "" if self.state == "none" else f"{SYMBOLS[self.state]}{self.state}"
        if self.driven:
            words = _cut(f"{DRIVES}drives {self.driven}", letters)
        return f"{HAND if self.hand else ''}{_cut(self.name, letters)}\n{words}".rstrip()

    @property
    def pad(self) -> tuple[int, int, int]:
        """The colour of the pad below it."""
        return DRIVEN if self.driven else PADS[self.state]


def _cut(text: str, letters: int) -> str:
    return text if len(text) <= letters else f"{text[: letters - 1]}…"


@dataclass(frozen=True)
class Layout:
    """Cells of a wall, row by row from the top left, in one unit of length.

    Attributes:
        count, columns: number of cells, and how many of them stand in a row.
        width, height: of a cell.
        line: height of a line of text.
        side: of the square for the arm, which stands above two lines of text.
    """

    count: int
    columns: int
    width: float
    height: float
    line: float

    @property
    def rows(self) -> int:
        return math.ceil(self.count / self.columns)

    @property
    def side(self) -> float:
        return min(self.width, self.height - LINES * self.line)

    @property
    def letters(self) -> int:
        """How many letters of a name fit into a cell."""
        return max(1, int(self.width / (LETTER * self.line)) - 1)

    def middles(self) -> Array:
        """Middles ``(count, 2)`` of the squares for the arms, to the right and up from the middle of the wall."""
        places = np.arange(self.count)
        x, y = places % self.columns - (self.columns - 1) / 2, (self.rows - 1) / 2 - places // self.columns
        found: Array = np.column_stack([self.width * x, self.height * y + 0.5 * LINES * self.line])
        return found


def layout_of(count: int, width: float, height: float) -> Layout:
    """The layout in which the arms are as large as they can be, names being legible, for 1 or more arms."""

    size = min(height, NARROW * width)
    smallest, largest = SMALLEST * size, LARGEST * size

    def with_columns(columns: int) -> Layout:
        cell = width / columns
        line = min(max(cell / (1.5 * WORDS), smallest), largest, cell / WORDS)
        return Layout(count, columns, cell, height / math.ceil(count / columns), line)

    def worth(layout: Layout) -> tuple[bool, float]:
        return layout.line >= smallest, layout.side

    return max(map(with_columns, range(1, count + 1)), key=worth)


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
        self._arms: tuple[tuple[str, Robot], ...] | None = None  # seats and robots, by cell
        self._shown: list[bytes] = []
        self._states: tuple[tuple[State, bool, bool], ...] = ()
        self._root: viser.SceneNodeHandle | None = None
        self._nodes: list[viser.BatchedMeshHandle] = []
        self._labels: list[viser.LabelHandle] = []
        self._owners: list[list[int]] = [[], []]  # index of the arm of each instance, by node
        self._layout = Layout(1, 1, 1.0, 1.0, 0.03)
        self._cells = np.zeros((0, 3))
        self.corners = np.zeros((0, 3))

    def show(self, arms: Sequence[SmallArm]) -> bool:
        """Draw these arms; returns whether their places are other ones. Unchanged arms are not computed again."""
        arms = arms[:MOST]
        shown = tuple((arm.seat, arm.robot) for arm in arms)
        fresh = shown != self._arms
        if fresh:
            self._build(arms, shown)
        self._pose(arms)
        states = tuple((arm.state, arm.hand, bool(arm.driven)) for arm in arms)
        if self._nodes and (fresh or states != self._states):
            self._states = states
            self._nodes[0].batched_colors = _colors(arms)
            pads = [arm.pad for arm in arms]
            columns = [RAISED if arm.hand else arm.pad for arm in arms]
            self._nodes[1].batched_colors = np.array(pads + columns, np.uint8)
        for label, arm in zip(self._labels, arms, strict=True):
            if label.text != (text := arm.label(self._layout.letters)):
                label.text = text
        return fresh

    def remove(self) -> None:
        """Remove everything from the scene."""
        if self._root is not None:
            self._root.remove()
        self._nodes, self._labels, self._arms, self._root = [], [], None, None

    def _build(self, arms: Sequence[SmallArm], shown: tuple[tuple[str, Robot], ...]) -> None:
        self.remove()
        self._arms, self._shown = shown, [b""] * len(arms)
        count = len(arms)
        if not count:
            return
        width = max(WIDTH, HEIGHT * self._aspect) * self._around.radius
        height = width / self._aspect
        self._layout = layout = layout_of(count, width, height)
        plane, center = _plane()[:2], self._around.center
        middles = layout.middles()
        self._cells = center + middles @ plane
        self.corners = center + 0.5 * np.array([*itertools.product((-width, width), (-height, height))]) @ plane
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
        # Below the pad, but within the cell.
        low = (feet[:count] - center) @ plane[1] - 0.5 * PAD[0] * layout.side
        low = np.maximum(low, middles[:, 1] - 0.5 * layout.side)
        tops = center + np.column_stack([middles[:, 0], low]) @ plane
        self._labels = [
            self._scene.add_label(
                f"{root}/name/{i}",
                arm.label(layout.letters),
                font_size_mode="scene",
                font_scene_height=layout.line,
                position=top,
                anchor="top-center",
            )
            for i, (arm, top) in enumerate(zip(arms, tops, strict=True))
        ]

    def _pads(self, arms: Sequence[SmallArm]) -> tuple[Array, Array]:
        """Scales and positions ``(2 * count, 3)`` of the pads, and of the columns below the arms' bases."""
        bases = [arm.robot.T_world_base[:3, 3] for arm in arms]
        feet = [body(arm.robot).mount.foot for arm in arms]
        placed = np.array(
            [self._place(i, arm.robot, foot) for i, (arm, foot) in enumerate(zip(arms, feet, strict=True))]
        )
        heights = [
            self._scale(arm.robot) * max(base[2] - foot[2], 0.0) * body(arm.robot).mount.stands
            for arm, base, foot in zip(arms, bases, feet, strict=True)
        ]
        side = self._layout.side
        pads = np.tile(side * np.array([PAD[0], PAD[0], PAD[1]]), (len(arms), 1))
        columns = np.array([[COLUMN * side, COLUMN * side, max(height, 1e-6)] for height in heights])
        return np.vstack([pads, columns]), np.vstack([placed - [0.0, 0.0, side * PAD[1]], placed])

    def _add(self, name: str, positions: Array, scales: Array, index: int) -> viser.BatchedMeshHandle:
        vertices, faces = cylinder()
        node = self._scene.add_batched_meshes_simple(
            name,
            vertices,
            faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(positions), 1)),
            batched_positions=positions,
            batched_scales=scales,
            batched_colors=np.zeros((len(positions), 3), np.uint8),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        owners, seats = self._owners[index], [seat for seat, _ in self._arms or ()]

        @node.on_click
        async def _(event: viser.SceneNodePointerEvent[viser.BatchedMeshHandle]) -> None:
            at = event.instance_index
            if at is not None and 0 <= at < len(owners):
                self._clicked(seats[owners[at]])

        return node

    def _scale(self, robot: Robot) -> float:
        return SIZE * self._layout.side / body(robot).radius

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
