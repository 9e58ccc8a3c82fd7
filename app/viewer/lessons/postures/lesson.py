"""The lesson "Postures": all ways to reach a target, and the reason if there is none.

All branches of the target appear in the scene as numbered ghosts; the list gives the distance of each from the
joint limits, and its manipulability. A click on a ghost, or on its number, moves the arm there. If the target is
missed, the reason and possible remedies are shown. For an arm of five joints, the possible approach directions are
drawn.

The list is updated at most ten times a second; remedies are searched only when nothing is moving.
"""

from __future__ import annotations

import time
from collections.abc import Hashable, Iterator
from itertools import count
from typing import Any

import numpy as np
import viser

import kin
from app.viewer.feature import Stage
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.postures import remedies
from app.viewer.lessons.postures.directions import has_cone, patch, reachable, share
from app.viewer.lessons.postures.ghosts import Ghosts
from app.viewer.lessons.postures.questions import outline
from app.viewer.lessons.postures.remedies import Remedy, Request
from app.viewer.lessons.postures.survey import CLOSEST, Posture, html, survey
from app.viewer.panel import assign, listen, listen_click, update_html
from app.viewer.panel.posture import short
from app.viewer.panel.status import Notice
from app.viewer.scene.meshes import body
from app.viewer.views.templates import render
from kin import IKResult, InputError
from kin.transforms import Array
from kin.warmup import ALL

SURVEY_INTERVAL = 0.1
CONE_INTERVAL = 0.2
QUIET = 0.25  # seconds without a new result before remedies are searched
HIDDEN = "\N{WHITE CIRCLE}"
CONE_COLOR = (0, 158, 115)
MOVE_HINT = "Moves the arm to this posture. A click on its ghost does the same."
GHOST_HINT = f"Shows or hides the ghost of one posture: {HIDDEN} marks a hidden one"
ALL_GHOSTS_HINT = "Shows all postures as translucent copies of the arm; grey ones are outside the limits"
CONE_HINT = (
    "The possible directions of the tool's arrow with its tip at the target, within the limits; locks ignored"
)
UNNAMED = "The postures of this arm have no names: the list shows only the closest one."
_NUMBERS = count(1)


class Postures(Lesson):
    """See the module."""

    key = "postures"
    title = "Postures"
    kernels = (ALL,)
    about = "All ways to reach a target, and the reason if there is none."
    outline = staticmethod(outline)

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
        self._search: Iterator[Remedy | None] | None
        self._remedies: dict[int, tuple[Remedy, viser.GuiButtonHandle]]
        self._ghosts_box: viser.GuiCheckboxHandle
        with stage.client.gui.add_folder(None) as self._container:
            pass
        self._build()

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case ("go", int(index)):
                self._go(index)
            case ("ghost", int(index), bool(show)) if 0 <= index < len(self._names):
                (self._hidden.discard if show else self._hidden.add)(self._names[index])
                self._show()
            case "ghosts":
                self._ghosts_on = bool(value)
                self._show()
            case "cone":
                self._cone_on = bool(value)
                self._wake()
            case ("remedy", int(number)):
                # A late click on a button that has been removed is ignored.
                if number in self._remedies:
                    self._apply_remedy(self._remedies[number][0])
            case _:
                raise InputError("posture", key, "a control of this lesson")

    def step_name(self, key: Hashable) -> str:
        moves = {"go": "Posture", "remedy": "Remedy"}
        return moves.get(str(key[0]), self.title) if isinstance(key, tuple) else self.title

    def on_robot(self) -> None:
        self._clear()
        self._hidden.clear()
        self._build()

    def on_pose(self, T_base_tool: Array) -> None:
        self._wake()

    def on_result(self, result: IKResult) -> None:
        self._result = result
        self._answered = time.perf_counter()
        self._drop_remedies()
        self._search = None
        self._show_reason()
        self._wake()

    def on_request(self) -> None:
        self._key = ()
        self._wake()

    def on_obstacles(self) -> None:
        self.on_request()

    def on_style(self) -> None:
        self._key = ()
        if self.stage.units != self._units:
            self._units = self.stage.units
            self._show_reason()
            # The remedies' texts are in the old units: search again.
            self._drop_remedies()
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
        if stage.now.target is None and self._result is not None:
            # The arm has reached the target, or was moved elsewhere.
            self._result, self._search = None, None
            self._drop_remedies()
            self._show_reason()
        if self._result is None or self._result.status == "solved" or self._searched:
            return
        quiet = now - self._answered
        if quiet < QUIET:
            self._wake(QUIET - quiet)
        else:
            self._search_remedies()

    def state(self) -> dict[str, object]:
        return {"ghosts": self._ghosts_on, "cone": self._cone_on, "hidden": sorted(self._hidden)}

    def restore(self, state: dict[str, object]) -> None:
        ghosts, cone, hidden = state.get("ghosts"), state.get("cone"), state.get("hidden")
        if isinstance(ghosts, bool):
            self._ghosts_on = ghosts
            assign(self._ghosts_box, ghosts)
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
        self._container.remove()

    # Controls

    def _build(self) -> None:
        """Build everything that depends on the robot."""
        gui, scene, robot = self.stage.client.gui, self.stage.client.scene, self.stage.now.robot
        self._names = kin.branch_names(robot) or (CLOSEST,)
        self._postures, self._key, self._cone_key = (), (), ()
        self._surveyed = self._drawn = self._answered = 0.0
        self._result, self._search, self._searched, self._remedies = None, None, False, {}
        numbers = tuple(str(i + 1) for i in range(len(self._names)))
        with self._container:
            self._why = gui.add_html(remedies.html(None, None, self.stage.units))
            with gui.add_folder(None) as self._remedy_container:
                pass
            self._to = gui.add_button_group("Go", numbers, hint=MOVE_HINT)
            listen_click(self._to, self.post, {number: ("go", i) for i, number in enumerate(numbers)})
            self._list = gui.add_html("")
            self._ghosts_box = gui.add_checkbox("Ghosts", self._ghosts_on, hint=ALL_GHOSTS_HINT)
            listen(self._ghosts_box, self.post, "ghosts")
            self._ghost_buttons = gui.add_button_group("Show", self._ghost_labels(), hint=GHOST_HINT)
            self._listen_ghost_buttons()
            self._cone_box: viser.GuiCheckboxHandle | None = None
            self._cone_line: viser.GuiHtmlHandle | None = None
            self._note: viser.GuiHtmlHandle | None = None
            if has_cone(robot):
                self._cone_box = gui.add_checkbox("Approach cone", self._cone_on, hint=CONE_HINT)
                listen(self._cone_box, self.post, "cone")
                self._cone_line = gui.add_html("")
            if not kin.branch_names(robot):
                self._note = gui.add_html(render("panel/note", text=UNNAMED))
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
        self._drop_remedies()
        self._top.remove()
        controls: list[Any] = [
            self._why,
            self._remedy_container,
            self._list,
            self._to,
            self._ghosts_box,
            self._ghost_buttons,
        ]
        controls += [c for c in (self._cone_box, self._cone_line, self._note) if c is not None]
        for control in controls:
            control.remove()

    def _clicked(self, index: int) -> None:
        self.post(("go", index))

    def _listen_ghost_buttons(self) -> None:
        @self._ghost_buttons.on_click
        async def _(event: Any) -> None:
            shown = str(event.target.value)
            number = shown.removeprefix(HIDDEN)
            if event.client is not None and number.isdecimal():
                self.post(("ghost", int(number) - 1, shown != number))

    def _ghost_labels(self) -> tuple[str, ...]:
        return tuple(
            f"{HIDDEN}{i + 1}" if name in self._hidden else str(i + 1) for i, name in enumerate(self._names)
        )

    def _wake(self, seconds: float = 0.0) -> None:
        self.due = seconds if self.due is None else min(self.due, seconds)

    # The list and the ghosts

    @property
    def _target(self) -> Array:
        return self.stage.now.aim

    @property
    def _present(self) -> str:
        arm = self.stage.now
        names = kin.branch_names(arm.robot)
        return kin.branch_of(arm.robot, arm.goal) if names else CLOSEST

    def _survey(self, now: float) -> None:
        arm = self.stage.now
        stage, T = self.stage, self._target
        options = arm.options
        key: tuple[object, ...] = (
            T.tobytes(), arm.goal.tobytes(), options.task, options.constraints, stage.units, arm.obstacles,
        )  # fmt: skip
        if key == self._key:
            return
        self._key, self._surveyed = key, now
        self._postures = survey(arm.robot, T, options, arm.goal, stage.units, arm.contacts_at)
        self._show()

    def _show(self) -> None:
        present = self._present
        seen = frozenset(set(self._names) - self._hidden) if self._ghosts_on else frozenset()
        content = html(self.stage.now.robot, self._postures, present, seen, self.stage.units)
        update_html(self._list, content)
        if self._ghost_buttons.options != self._ghost_labels():
            self._ghost_buttons.options = self._ghost_labels()
        # The arm itself is where its own ghost would be.
        self._ghosts.show(self._postures, seen - {present})

    def _go(self, index: int) -> None:
        if not 0 <= index < len(self._postures):
            return
        posture = self._postures[index]
        name = short(posture.name)
        if posture.available and posture.q is not None:
            self.stage.move_to(
                posture.q, Notice("hand", f"Posture {index + 1}: {name}", "The tool stays where it was.")
            )
        else:
            self.stage.notify(Notice("limits", f"Not available: {name}", f"{posture.words.capitalize()}."))

    # Why not

    def _show_reason(self) -> None:
        update_html(self._why, remedies.html(self._result, self.stage.now.branch, self.stage.units))

    def _search_remedies(self) -> None:
        """Run one step of the search; the next one follows as soon as the worker is idle."""
        arm = self.stage.now
        stage = self.stage
        if self._search is None:
            assert self._result is not None
            request = Request(arm.robot, self._target, arm.options, arm.goal, self._result)
            self._search = remedies.remedies(request, stage.units)
        try:
            remedy = next(self._search)
        except StopIteration:
            self._search, self._searched = None, True
            return
        if remedy is not None:
            self._offer(remedy)
        self._wake()

    def _offer(self, remedy: Remedy) -> None:
        number = next(_NUMBERS)
        with self._remedy_container:
            button = self.stage.client.gui.add_button(remedy.label, hint=remedy.hint or None)
        self._remedies[number] = (remedy, button)

        @button.on_click
        async def _(event: Any) -> None:
            if event.client is not None:
                self.post(("remedy", number))

    def _drop_remedies(self) -> None:
        self._searched = False
        for _, button in self._remedies.values():
            button.remove()
        self._remedies.clear()

    def _apply_remedy(self, remedy: Remedy) -> None:
        match remedy.kind:
            case "branch":
                self.stage.allow_any_branch()
            case "unlock":
                self.stage.unlock(remedy.joint)
            case "relax":
                assert remedy.task is not None
                self.stage.set_task(remedy.task)
            case "turn" | "move":
                assert remedy.q is not None
                title = "Target turned" if remedy.kind == "turn" else "Target moved"
                self.stage.move_to(remedy.q, Notice("hand", title, "The tool can reach it there."))
        self._wake()

    # The cone of approach directions

    def _draw_cone(self, now: float) -> None:
        arm = self.stage.now
        assert self._cone is not None
        stage, T = self.stage, self._target
        if self._cone.visible != self._cone_on:
            self._cone.visible = self._cone_on
        key = (arm.robot.id, T[:3, 3].round(4).tobytes(), T[:3, 2].round(3).tobytes())
        if not self._cone_on or key == self._cone_key:
            return
        if now - self._drawn < CONE_INTERVAL:
            self._wake(CONE_INTERVAL - (now - self._drawn))
            return
        moved = self._cone_key[1:2] != key[1:2]
        self._cone_key, self._drawn = key, now
        radius = 0.34 * body(arm.robot).radius
        self._cone.position = T[:3, 3]
        assert self._ray is not None
        self._ray.points = np.array([[np.zeros(3), radius * T[:3, 2]]], dtype=np.float32)
        if not moved:
            return
        mask = reachable(arm.robot, T[:3, 3])
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
        found = share(mask)
        self._cone_line.content = render("postures/cone", share=f"{found:.3f}", percent=f"{100.0 * found:.0f}")
