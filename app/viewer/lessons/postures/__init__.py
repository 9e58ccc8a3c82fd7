"""The lesson "Postures": every way to take a target, and why not if there is none.

All branches of the target stand in the picture as numbered ghosts; the list tells how far each is from a stop and
how freely it moves. A click on a ghost, or on its number, sends the arm there. With a target that is missed stand
the reason and what would help. For an arm of five joints, the approach directions it can have there are drawn.

Surveys are made at most ten times a second, remedies only once nothing is moving.
"""

from __future__ import annotations

import time
from collections.abc import Hashable, Iterator
from itertools import count
from typing import Any

import numpy as np
import viser

import kin
from app.viewer.feature import Feature, Stage
from app.viewer.lessons.postures import fixes
from app.viewer.lessons.postures.directions import has_cone, patch, reachable, share
from app.viewer.lessons.postures.fixes import Fix, remedies
from app.viewer.lessons.postures.ghosts import Ghosts
from app.viewer.lessons.postures.listing import Posture, html, survey
from app.viewer.panel import assign, listen, listen_click
from app.viewer.panel.posture import short
from app.viewer.panel.status import Notice
from app.viewer.scene.meshes import body
from kin import IKResult, InputError
from kin.transforms import Array

SURVEY_INTERVAL = 0.1
CONE_INTERVAL = 0.2
QUIET = 0.25  # seconds without an answer, after which remedies are looked for
HIDDEN = "\N{WHITE CIRCLE}"
CONE_COLOR = (0, 158, 115)
GO_HINT = "Send the arm to this posture. A click on its ghost does the same."
GHOST_HINT = f"Show or hide the ghost of one posture: {HIDDEN} marks what is hidden"
MASTER_HINT = "All postures of the target as translucent doubles of the arm; grey ones lie beyond a stop"
CONE_HINT = "Where the tool's arrow may point with its tip at the target, inside the limits; padlocks do not count"
UNNAMED = (
    "The branches of this arm have no names: it has no closed form, and only the nearest posture is looked for."
)
_NUMBERS = count(1)


class Postures(Feature):
    """See the module."""

    key = "postures"
    title = "Postures"
    about = "All the ways to reach one target, and why there is none."

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._ghosts_on = True
        self._cone_on = True
        self._hidden: set[str] = set()
        self._units = stage.units
        self._names: tuple[str, ...]
        self._postures: tuple[Posture, ...]
        self._key: tuple[object, ...]  # what was surveyed
        self._cone_key: tuple[object, ...]
        self._result: IKResult | None
        self._search: Iterator[Fix | None] | None
        self._fixes: dict[int, tuple[Fix, viser.GuiButtonHandle]]
        self._master: viser.GuiCheckboxHandle
        with stage.client.gui.add_folder(None) as self._place:
            pass
        self._build()

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case ("go", int(index)):
                self._go(index)
            case ("eye", int(index), bool(show)) if 0 <= index < len(self._names):
                (self._hidden.discard if show else self._hidden.add)(self._names[index])
                self._show()
            case "ghosts":
                self._ghosts_on = bool(value)
                self._show()
            case "cone":
                self._cone_on = bool(value)
                self._wake()
            case ("fix", int(number)):
                # A late click on a button that has gone means nothing.
                if number in self._fixes:
                    self._mend(self._fixes[number][0])
            case _:
                raise InputError("posture", key, "a control of this lesson")

    def on_robot(self) -> None:
        self._clear()
        self._hidden.clear()
        self._build()

    def on_picture(self, T_base_tool: Array) -> None:
        self._wake()

    def on_answer(self, result: IKResult) -> None:
        self._result = result
        self._answered = time.perf_counter()
        self._drop_fixes()
        self._search = None
        self._say()
        self._wake()

    def on_question(self) -> None:
        self._key = ()
        self._wake()

    def on_style(self) -> None:
        self._key = ()
        if self.stage.units != self._units:
            self._units = self.stage.units
            self._say()
            # What the remedies say is in the old units: they are looked for anew.
            self._drop_fixes()
            self._search = None
        self._wake()

    def tick(self, now: float) -> None:
        stage = self.stage
        self.due = None
        if now - self._surveyed >= SURVEY_INTERVAL:
            self._survey(now)
        else:
            self._wake(SURVEY_INTERVAL - (now - self._surveyed))
        if self._cone is not None:
            self._draw_cone(now)
        if stage.target is None and self._result is not None:
            # The arm has taken the target, or was sent elsewhere.
            self._result, self._search = None, None
            self._drop_fixes()
            self._say()
        if self._result is None or self._result.status == "solved" or self._searched:
            return
        quiet = now - self._answered
        if quiet < QUIET:
            self._wake(QUIET - quiet)
        else:
            self._look_for_fixes()

    def state(self) -> dict[str, object]:
        return {"ghosts": self._ghosts_on, "cone": self._cone_on, "hidden": sorted(self._hidden)}

    def restore(self, state: dict[str, object]) -> None:
        ghosts, cone, hidden = state.get("ghosts"), state.get("cone"), state.get("hidden")
        if isinstance(ghosts, bool):
            self._ghosts_on = ghosts
            assign(self._master, ghosts)
        if isinstance(cone, bool):
            self._cone_on = cone
            if self._cone_box is not None:
                assign(self._cone_box, cone)
        if isinstance(hidden, list):
            self._hidden = {name for name in hidden if name in self._names}
        self._show()
        self._drawn = 0.0
        self._wake()

    def remove(self) -> None:
        self._clear()
        self._place.remove()

    # Controls

    def _build(self) -> None:
        """Everything that depends on the arm."""
        gui, scene, robot = self.stage.client.gui, self.stage.client.scene, self.stage.robot
        self._names = kin.branch_names(robot) or ("nearest",)
        self._postures, self._key, self._cone_key = (), (), ()
        self._surveyed = self._drawn = self._answered = 0.0
        self._result, self._search, self._searched, self._fixes = None, None, False, {}
        numbers = tuple(str(i + 1) for i in range(len(self._names)))
        with self._place:
            self._why = gui.add_html(fixes.html(None, None, self.stage.units))
            with gui.add_folder(None) as self._fix_place:
                pass
            self._to = gui.add_button_group("Take", numbers, hint=GO_HINT)
            listen_click(self._to, self.post, {number: ("go", i) for i, number in enumerate(numbers)})
            self._list = gui.add_html("")
            self._master = gui.add_checkbox("Ghosts", self._ghosts_on, hint=MASTER_HINT)
            listen(self._master, self.post, "ghosts")
            self._eyes = gui.add_button_group("Show", self._eye_labels(), hint=GHOST_HINT)
            self._listen_eyes()
            self._cone_box: viser.GuiCheckboxHandle | None = None
            self._cone_line: viser.GuiHtmlHandle | None = None
            self._note: viser.GuiHtmlHandle | None = None
            if has_cone(robot):
                self._cone_box = gui.add_checkbox("Approach cone", self._cone_on, hint=CONE_HINT)
                listen(self._cone_box, self.post, "cone")
                self._cone_line = gui.add_html("")
            if not kin.branch_names(robot):
                self._note = gui.add_html(
                    f'<div style="margin:0 1em .5em;font-size:.8em;opacity:.8">{UNNAMED}</div>'
                )
        self._root = f"/{self.key}-{next(_NUMBERS)}"
        self._top = scene.add_frame(self._root, show_axes=False)
        self._ghosts = Ghosts(scene, robot, len(self._names), self._root, self._clicked)
        self._cone: viser.SceneNodeHandle | None = None
        self._cone_mesh: viser.MeshHandle | None = None
        self._ray: viser.LineSegmentsHandle | None = None
        if has_cone(robot):
            self._cone = scene.add_frame(f"{self._root}/cone", show_axes=False, visible=False)
            self._ray = scene.add_line_segments(
                f"{self._root}/cone/now", np.zeros((1, 2, 3), np.float32), CONE_COLOR, thickness=2.5,
                thickness_units="screen",
            )  # fmt: skip
        self._wake()

    def _clear(self) -> None:
        self._drop_fixes()
        self._top.remove()
        controls: list[Any] = [self._why, self._fix_place, self._list, self._to, self._master, self._eyes]
        controls += [c for c in (self._cone_box, self._cone_line, self._note) if c is not None]
        for control in controls:
            control.remove()

    def _clicked(self, index: int) -> None:
        self.post(("go", index))

    def _listen_eyes(self) -> None:
        @self._eyes.on_click
        async def _(event: Any) -> None:
            shown = str(event.target.value)
            number = shown.removeprefix(HIDDEN)
            if event.client is not None and number.isdecimal():
                self.post(("eye", int(number) - 1, shown != number))

    def _eye_labels(self) -> tuple[str, ...]:
        return tuple(
            f"{HIDDEN}{i + 1}" if name in self._hidden else str(i + 1) for i, name in enumerate(self._names)
        )

    def _wake(self, seconds: float = 0.0) -> None:
        self.due = seconds if self.due is None else min(self.due, seconds)

    # The list and the ghosts

    @property
    def _target(self) -> Array:
        target = self.stage.target
        return kin.fk(self.stage.robot, self.stage.goal) if target is None else target

    @property
    def _here(self) -> str:
        names = kin.branch_names(self.stage.robot)
        return kin.branch_of(self.stage.robot, self.stage.goal) if names else "nearest"

    def _survey(self, now: float) -> None:
        stage, T = self.stage, self._target
        key: tuple[object, ...] = (T.tobytes(), stage.goal.tobytes(), stage.task, stage.locked, stage.units)
        if key == self._key:
            return
        self._key, self._surveyed = key, now
        self._postures = survey(stage.robot, T, stage.task, stage.goal, stage.locked, stage.units)
        self._show()

    def _show(self) -> None:
        here = self._here
        seen = frozenset(set(self._names) - self._hidden) if self._ghosts_on else frozenset()
        content = html(self.stage.robot, self._postures, here, seen, self.stage.units)
        if content != self._list.content:
            self._list.content = content
        if self._eyes.options != self._eye_labels():
            self._eyes.options = self._eye_labels()
        # The arm itself stands where its own ghost would.
        self._ghosts.show(self._postures, seen - {here})

    def _go(self, index: int) -> None:
        if not 0 <= index < len(self._postures):
            return
        posture = self._postures[index]
        name = short(posture.name)
        if posture.can_be_had and posture.q is not None:
            self.stage.go(
                posture.q, Notice("hand", f"Posture {index + 1}: {name}", "The tool stays where it was.")
            )
        else:
            self.stage.tell(Notice("limits", f"Not to be had: {name}", f"{posture.words.capitalize()}."))

    # Why not

    def _say(self) -> None:
        content = fixes.html(self._result, self.stage.branch, self.stage.units)
        if content != self._why.content:
            self._why.content = content

    def _look_for_fixes(self) -> None:
        """One step of the search, and then another one as soon as nothing else is to be done."""
        stage = self.stage
        if self._search is None:
            assert self._result is not None
            self._search = remedies(
                stage.robot, self._target, stage.task, stage.goal, stage.locked, stage.branch, self._result,
                stage.units,
            )  # fmt: skip
        try:
            fix = next(self._search)
        except StopIteration:
            self._search, self._searched = None, True
            return
        if fix is not None:
            self._offer(fix)
        self._wake()

    def _offer(self, fix: Fix) -> None:
        number = next(_NUMBERS)
        with self._fix_place:
            button = self.stage.client.gui.add_button(fix.label, hint=fix.hint or None)
        self._fixes[number] = (fix, button)

        @button.on_click
        async def _(event: Any) -> None:
            if event.client is not None:
                self.post(("fix", number))

    def _drop_fixes(self) -> None:
        self._searched = False
        for _, button in self._fixes.values():
            button.remove()
        self._fixes.clear()

    def _mend(self, fix: Fix) -> None:
        match fix.kind:
            case "branch":
                self.stage.any_branch()
            case "unlock":
                self.stage.unlock(fix.joint)
            case "relax":
                assert fix.task is not None
                self.stage.require(fix.task)
            case "turn" | "move":
                assert fix.q is not None
                said = "Target turned" if fix.kind == "turn" else "Target moved"
                self.stage.go(fix.q, Notice("hand", said, "It is where the tool can be."))
        self._wake()

    # The cone of approach directions

    def _draw_cone(self, now: float) -> None:
        assert self._cone is not None
        stage, T = self.stage, self._target
        if self._cone.visible != self._cone_on:
            self._cone.visible = self._cone_on
        key = (stage.robot.id, T[:3, 3].round(4).tobytes(), T[:3, 2].round(3).tobytes())
        if not self._cone_on or key == self._cone_key:
            return
        if now - self._drawn < CONE_INTERVAL:
            self._wake(CONE_INTERVAL - (now - self._drawn))
            return
        moved = self._cone_key[1:2] != key[1:2]
        self._cone_key, self._drawn = key, now
        radius = 0.34 * body(stage.robot).radius
        self._cone.position = T[:3, 3]
        assert self._ray is not None
        self._ray.points = np.array([[np.zeros(3), radius * T[:3, 2]]], dtype=np.float32)
        if not moved:
            return
        mask = reachable(stage.robot, T[:3, 3])
        vertices, faces = patch(mask)
        if self._cone_mesh is not None:
            self._cone_mesh.remove()
            self._cone_mesh = None
        if len(faces):
            self._cone_mesh = stage.client.scene.add_mesh_simple(
                f"{self._root}/cone/patch-{next(_NUMBERS)}", radius * vertices, faces, color=CONE_COLOR,
                opacity=0.32, side="double", cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
        assert self._cone_line is not None
        told = f"{100.0 * share(mask):.0f} % of all directions can be had at this point"
        self._cone_line.content = (
            f'<div data-cone="{share(mask):.3f}" style="margin:-.3em 1em .5em;font-size:.78em;opacity:.8;'
            f'font-variant-numeric:tabular-nums">{told}</div>'
        )
