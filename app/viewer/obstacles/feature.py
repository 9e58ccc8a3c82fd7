"""Obstacles in the panel and the scene: added, chosen, dragged, typed, removed.

The obstacles themselves belong to the page: `Stage.obstacles` and `Stage.use_obstacles`. What is pressed and typed
is sent by ``static/lesson.js``.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np

from app.viewer.feature import Feature, Stage
from app.viewer.obstacles import placed
from app.viewer.obstacles.nodes import ObstacleNodes
from app.viewer.obstacles.placed import PLACE, TURN
from app.viewer.panel import update_html
from app.viewer.panel.entry import read_cell
from app.viewer.panel.part import add_html
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import Sphere
from app.viewer.scene.gizmo import DragEvent, travel
from app.viewer.scene.meshes import body
from app.viewer.tabs.robot.views import text_of
from app.viewer.views.templates import render
from kin import InputError, Obstacle
from kin.collision import Contact
from kin.collision.obstacles import KINDS, MOST_OBSTACLES
from kin.collision.solids import SPHERE
from kin.transforms import pose_from_position_wxyz
from kin.typed import ReadError, cut

_ORDER = sorted(KINDS, key=lambda shape: not KINDS[shape].topped)  # what others stand on comes first


class ObstaclesFeature(Feature):
    """The obstacles of one page."""

    key = "obstacles"
    title = "Obstacles"
    messages = frozenset({"add", "choose", "set", "remove", "close"})

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._chosen: int | None = None
        self._wrong: tuple[str, str, str] | None = None  # field, what was typed, and what is wrong with it
        self._touched: frozenset[int] = frozenset()
        self._held = False
        self._start = np.eye(4)  # pose of the chosen one when it was grabbed
        self._nodes = ObstacleNodes(stage.client.scene, self.post)
        self._html = add_html(stage.client.gui)
        self._show()

    def handle(self, key: Hashable, value: object) -> None:
        match key, value:
            case (("add", str(shape), int()), _):
                self._add(shape)
            case ((("choose", int()) | "choose"), int(index)):
                self._choose(index)
            case (("close", int()), _):
                self._choose(None)
            case (("remove", int()), _):
                self._remove()
            case (("set", str(field), int()), str(text)):
                self._type(field, text)
            case ("grab" | "gizmo", DragEvent()):
                self._pull(value)
            case _:
                raise InputError("obstacles", key, "the key of a button or a field, with its value")

    def step_name(self, key: Hashable) -> str:
        match key:
            case ("add", str(shape), *_):
                return f"Add a {shape}"
            case ("remove", *_):
                return "Remove an obstacle"
            case "grab" | "gizmo":
                return "Drag of an obstacle"
        return "Change of an obstacle"

    # Reports of the session

    def on_obstacles(self) -> None:
        if self._chosen is not None and self._chosen >= len(self.stage.now.obstacles):
            self._chosen, self._held = None, False
        self._show()

    def on_contacts(self, contacts: Sequence[Contact]) -> None:
        touched = frozenset(each.obstacle for each in contacts if each.obstacle is not None)
        if touched != self._touched:
            self._touched = touched
            self._show_panel()
            self._nodes.mark(self._touched, self._chosen)

    def on_robot(self) -> None:
        self._show()

    def on_style(self) -> None:
        self._show_panel()

    def extents(self) -> Sequence[Sphere]:
        return [(each.T[:3, 3], float(each.row[16])) for each in self.stage.now.obstacles]

    def remove(self) -> None:
        self._nodes.remove()

    # Changes

    def _add(self, shape: str) -> None:
        arm = self.stage.now
        stage = self.stage
        if len(arm.obstacles) >= MOST_OBSTACLES:
            detail = f"A page has at most {MOST_OBSTACLES}. Remove one first."
            stage.notify(Notice("error", "No obstacle was added", detail))
            return
        items = placed.added(arm.obstacles, shape, arm.robot, arm.goal)
        self._choose(len(items) - 1, False)
        detail = "Drag its arrows, or type its place and size in the tab Move."
        stage.notify(Notice("hand", f"Added: {items[-1].label}", detail))
        self._use(items)

    def _choose(self, index: int | None, show: bool = True) -> None:
        if index is not None and not 0 <= index < len(self.stage.now.obstacles) + (not show):
            raise InputError("obstacle", index, f"0 to {len(self.stage.now.obstacles) - 1}")
        self._chosen = None if index == self._chosen and show else index
        self._wrong, self._held = None, False
        if show:
            self._show()

    def _remove(self) -> None:
        index = self._chosen
        if index is None:
            return
        gone = self.stage.now.obstacles[index].label
        self._choose(None, False)
        self.stage.notify(Notice("hand", f"Removed: {gone}", "Undo brings it back."))
        self._use(placed.removed(self.stage.now.obstacles, index))

    def _pull(self, pull: DragEvent) -> None:
        """One event of the gizmo. Obstacles do not avoid the arm: it may avoid them. What touches is red."""
        if self._chosen is None:
            return
        self._held = pull.phase != "end"
        if pull.phase == "start":
            self._start = placed.pose(self.stage.now.obstacles[self._chosen])
        else:
            T = pose_from_position_wxyz(pull.position, pull.wxyz)
            self._wrong = None
            self._use(placed.moved(self.stage.now.obstacles, self._chosen, T))
        if self._held:
            T = placed.pose(self.stage.now.obstacles[self._chosen])
            radius = body(self.stage.now.robot).radius
            self._nodes.travel.show(travel(self._start, T, self.stage.units), T[:3, 3], radius)
        else:
            self._show()

    def _type(self, field: str, text: str) -> None:
        if self._chosen is None:
            return
        try:
            value = read_cell(text, self.stage.units.of(field in TURN))
            items = placed.changed(self.stage.now.obstacles, self._chosen, field, value)
        except ReadError as error:
            self._refuse(field, text, str(error))
        except InputError as error:
            if error.field == "field":
                raise
            self._refuse(field, text, f"“{cut(text)}” is not valid; valid: {error.expected}")
        else:
            self._wrong = None
            self._use(items)
            self._show()

    def _use(self, items: tuple[Obstacle, ...]) -> None:
        """Take what the visitor has made of the obstacles; an arm that avoids them is solved again."""
        before = self.stage.now.obstacles
        self.stage.use_obstacles(items)
        if self.stage.now.avoid and items != before:
            self.stage.solve_again()

    def _refuse(self, field: str, text: str, why: str) -> None:
        self._wrong = field, text[:60], f"{field.capitalize()}: {why}."
        self.stage.notify(Notice("error", "The obstacle stays as it was", self._wrong[2]))
        self._show_panel()

    # Drawing

    def _show(self) -> None:
        items, radius = self.stage.now.obstacles, body(self.stage.now.robot).radius
        self._nodes.show(items, radius)
        self._nodes.mark(self._touched, self._chosen)
        if not self._held:
            self._nodes.travel.hide()
            T = None if self._chosen is None else placed.pose(items[self._chosen])
            self._nodes.place_gizmo(T, radius)
        self._show_panel()

    def _show_panel(self) -> None:
        items, chosen = self.stage.now.obstacles, self._chosen
        rows = [{"name": each.label, "touched": i in self._touched} for i, each in enumerate(items)]
        update_html(
            self._html,
            render(
                "obstacles/panel",
                shapes=_ORDER,
                rows=rows,
                chosen=chosen,
                groups=self._groups(),
                name="" if chosen is None else items[chosen].label,
                full=len(items) >= MOST_OBSTACLES,
                most=MOST_OBSTACLES,
                wrong="" if self._wrong is None else self._wrong[2],
            ),
        )

    def _groups(self) -> list[tuple[str, list[dict[str, object]]]]:
        """The fields of the one that is chosen, by groups."""
        if self._chosen is None:
            return []
        each = self.stage.now.obstacles[self._chosen]
        place = "Middle of the top" if each.kind.topped else "Centre"
        found = [(place, PLACE, each.xyz, False), ("Size", each.kind.names, each.sizes, False)]
        if each.kind.solid != SPHERE:
            found.insert(1, ("Rotation", TURN, each.rpy, True))
        return [
            (title, [self._field(*pair, angle) for pair in zip(names, values, strict=True)])
            for title, names, values, angle in found
        ]

    def _field(self, key: str, value: float, angle: bool) -> dict[str, object]:
        unit = self.stage.units.of(angle)
        wrong = self._wrong is not None and self._wrong[0] == key
        shown = self._wrong[1] if wrong and self._wrong is not None else text_of(value, unit)
        return {"key": key, "value": shown, "unit": unit.name, "wrong": wrong}
