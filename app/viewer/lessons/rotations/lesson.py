"""The lesson "Rotations and frames": one rotation in all its forms, and a chain of frames that students build.

Frames are drawn beside the arm. The rotation is set by three angles in one of 24 conventions, typed as a
quaternion or a matrix, or taken from the tool.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

from app.exports.worksheet import Left
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Buttons, Control, Folder, Html, Node
from app.viewer.declared.scene import Lazy
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Sweep
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.rotations import views
from app.viewer.lessons.rotations.drawing import frames, room
from app.viewer.lessons.rotations.facts import BY_KEY, RotationsFacts
from app.viewer.lessons.rotations.frames import MOST, Motion, swapped
from app.viewer.lessons.rotations.questions import facts
from app.viewer.lessons.rotations.settings import MOTIONS, RotationsSettings
from app.viewer.lessons.rotations.turning import FRAME, Turning
from app.viewer.lessons.rotations.typed import read_rotation
from app.viewer.panel.status import Notice
from app.viewer.scene.meshes import body
from kin.transforms import Array
from kin.typed import EntryError

ACT_HINT = "Set: take the typed numbers. From tool: the orientation of the tool. To target: turn the target so."
TURN_HINT = "Shows this turn of the frame beside the arm, or all three. A click on the frame shows all."
TURNS = {"1st": (0, 0), "2nd": (1, 1), "3rd": (2, 2), "All": (0, 2)}
CHAIN_HINT = "Add: append the motion. Remove: the last one. Swap: the last two. Clear: all."


class RotationsLesson(DeclaredFeature[RotationsSettings, RotationsFacts], Lesson):
    """See the module."""

    key = "rotations"
    title = "Rotations and frames"
    about = "A rotation in all its forms, gimbal lock, and a chain of frames that you build."
    asked_of = staticmethod(facts)
    settings_of, facts_of = RotationsSettings, RotationsFacts
    left: ClassVar[Left] = "pose"
    undo: ClassVar[dict[str, str]] = dict.fromkeys(
        ("on_add", "on_remove", "on_swap", "on_clear"), "Chain of frames"
    )

    def started(self) -> None:
        self._figure = FigureNodes(body(self.stage.arm.now.robot).size)
        self.stage.camera.fit([room(self.stage.arm.now.robot)])

    def restore(self, state: dict[str, object]) -> None:
        self.change(turning=None)
        super().restore(state)

    def remove(self) -> None:
        super().remove()
        self.stage.camera.fit([])

    # What is shown

    def panel(self) -> Sequence[Node]:
        f, s, units = self.read, self.settings, self.stage.display.units
        uses = {"Set": self.on_set, "From tool": self.on_from_tool, "To target": self.on_to_target}
        turned = {name: self.event(self.on_turn, *which) for name, which in TURNS.items()}
        at = None if s.turning is None else s.turning.turn
        changes = {"Add": self.on_add, "Remove": self.on_remove, "Swap": self.on_swap, "Clear": self.on_clear}
        turns = MOTIONS[s.motion][0]
        return [
            Control("chained"),
            Folder(
                "One rotation",
                self.unless_asked(
                    "forms",
                    Control("convention"),
                    Html(views.convention_html, (f.convention,)),
                    *(self._angle(k) for k in range(3)),
                    Buttons("Turn", turned, TURN_HINT),
                    Html(views.turning_html, (f.convention, at)),
                    Control("axes"),
                    Html(views.lock_html, (f.convention, s.angles, units)),
                    Html(views.rotation_html, (f.convention, s.angles, units)),
                    Control("typed"),
                    Buttons("Use", {name: self.event(method) for name, method in uses.items()}, ACT_HINT),
                    Html(views.error_html, (s.error,)),
                ),
                visible=not s.chained,
            ),
            Folder(
                "Chain of frames",
                [
                    Control("motion"),
                    Control("turn", visible=turns),
                    Control("shift", visible=not turns),
                    Control("own"),
                    Buttons("Chain", {name: self.event(method) for name, method in changes.items()}, CHAIN_HINT),
                    Html(views.chain_html, (s.chain, units)),
                ],
                visible=s.chained,
            ),
        ]

    def _angle(self, k: int) -> Control:
        convention = self.read.convention
        return Control(f"angles.{k}", label=views.turn_name(convention, k), of=convention)

    def scene(self) -> Sequence[Lazy]:
        shown = self.settings
        if shown.turning is not None:
            shown = replace(shown, angles=shown.turning.angles(shown.angles))
        return [Lazy("frames", self._frames, (shown,))]

    def _frames(self, shown: RotationsSettings) -> list[SceneNode]:
        return frames(RotationsFacts(shown, self.stage.arm.now), self._figure, self.event(self.on_turn, 0, 2))

    # Events

    def changed(self, path: str) -> None:
        self.change(turning=None)
        if path == "convention":  # the same rotation in another convention
            self._turn_to(self.facts.R)
            self.on_turn(0, 2)

    def on_turn(self, first: int, last: int) -> None:
        """Show how these turns of the convention turn the frame, unless they are asked for; nothing changes."""
        if self.hides("forms") or self.settings.chained:
            return
        self.change(turning=Turning(first, last))

    def running(self) -> Sequence[Sweep]:
        return [] if self.settings.turning is None else [Sweep(self._turn, FRAME)]

    def _turn(self, seconds: float) -> None:
        assert self.settings.turning is not None
        after = replace(self.settings.turning, passed=self.settings.turning.passed + seconds)
        self.change(turning=None if after.turn > after.last else after)

    def on_from_tool(self) -> None:
        self.change(error="")
        self._turn_to(self.stage.arm.now.T_goal[:3, :3])

    def on_to_target(self) -> None:
        self.change(error="")
        T = self.stage.arm.now.aim.copy()
        T[:3, :3] = self.facts.R
        self.stage.arm.set_target(T)

    def on_set(self) -> None:
        self.change(error="")
        try:
            self._turn_to(read_rotation(self.settings.typed, self.facts.convention, self.stage.display.units))
        except EntryError as error:
            self.change(error=f"{error.title}: {error.detail}")

    def on_add(self) -> None:
        s = self.settings
        if len(s.chain) == MOST:
            self.stage.status.show(Notice("error", "The chain is full", f"It has room for {MOST} motions."))
            return
        turns, axis = MOTIONS[s.motion]
        self._chain((*s.chain, Motion(turns, axis, s.turn if turns else s.shift, s.own)))

    def on_remove(self) -> None:
        self._chain(self.settings.chain[:-1])

    def on_swap(self) -> None:
        self._chain(swapped(self.settings.chain))

    def on_clear(self) -> None:
        self._chain(())

    def _chain(self, chain: tuple[Motion, ...]) -> None:
        self.change(chain=chain, chained=True)

    def _turn_to(self, R: Array) -> None:
        self.change(angles=BY_KEY[self.settings.convention].angles(R))
