"""Obstacles in the panel and the scene: added, chosen, dragged, typed, removed.

The obstacles themselves belong to the page: `Arm.obstacles`, which `stage.arm` keeps. What is pressed and typed
is sent by ``static/lesson.js``.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, memory
from app.viewer.declared.panel import Html
from app.viewer.declared.scene import Lazy, Node
from app.viewer.obstacles import nodes, placed
from app.viewer.obstacles.placed import Obstacles
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import Sphere
from app.viewer.scene.gizmo import DragEvent, travel
from app.viewer.scene.meshes import body
from app.viewer.views.templates import render
from kin.collision import Contact
from kin.collision.obstacles import KINDS, MOST_OBSTACLES
from kin.transforms import Array, pose_from_position_wxyz
from kin.typed import EntryError
from kin.units import Units

_ORDER = sorted(KINDS, key=lambda shape: not KINDS[shape].topped)  # what others stand on comes first


class Refused(NamedTuple):
    """What was typed into a field and is not used."""

    field: str
    text: str
    why: str


@dataclass(frozen=True)
class ObstacleSettings(Settings):
    """What is done with the obstacles.

    Attributes:
        chosen: the one whose fields are open.
        refused: what was typed last, if it is not used.
        touched: those that the arm touches.
        grabbed: pose ``(4, 4)`` of the chosen one when it was grabbed; None: it is not held.
    """

    chosen: int | None = memory(renew=False)
    refused: Refused | None = memory(renew=False)
    touched: frozenset[int] = memory(frozenset(), renew=False)
    grabbed: Array | None = memory()


class ObstacleFacts(Facts[ObstacleSettings]):
    """The obstacles of the page."""

    @property
    def items(self) -> Obstacles:
        """All."""
        return self.arm.obstacles

    @property
    def chosen(self) -> int | None:
        """The one whose fields are open; a program or undo may have taken it away."""
        found = self.settings.chosen
        return found if found is not None and found < len(self.items) else None


class ObstaclesFeature(DeclaredFeature[ObstacleSettings, ObstacleFacts]):
    """The obstacles of one page."""

    key = "obstacles"
    title = "Obstacles"
    settings_of, facts_of = ObstacleSettings, ObstacleFacts
    messages = frozenset({"add", "choose", "set", "remove", "close"})

    # Declared

    def panel(self) -> Sequence[Html]:
        f, s = self.read, self.settings
        return [Html(panel_html, (f.items, f.chosen, s.touched, s.refused, self.stage.display.units))]

    def scene(self) -> Sequence[Node | Lazy]:
        f, s = self.facts, self.settings
        radius, chosen = body(f.robot).radius, f.chosen
        found: list[Node | Lazy] = []
        for i, each in enumerate(f.items):
            red = i in s.touched
            args = i, each, radius, red, red or i == chosen, self.event(self.on_click, i)
            found.append(Lazy(str(i), nodes.nodes, args))
        if chosen is not None:
            T = placed.pose(f.items[chosen])
            found.append(nodes.gizmo(T, radius, ("on_drag",)))
            if s.grabbed is not None:
                found.append(nodes.travel(travel(s.grabbed, T, self.stage.display.units), T, radius))
        return found

    def on_contacts(self, contacts: Sequence[Contact]) -> None:
        touched = frozenset(each.obstacle for each in contacts if each.obstacle is not None)
        if touched != self.settings.touched:
            self.change(touched=touched)
            self.refresh()

    def extents(self) -> Sequence[Sphere]:
        return [(each.T[:3, 3], float(each.row[16])) for each in self.stage.arm.now.obstacles]

    # Events

    def heard(self, key: Hashable, value: object) -> None:
        items, chosen = self.facts.items, self.facts.chosen
        match key, value:
            case (("add", str(shape), int()), _):
                self._add(shape)
            case (("choose", int()), int(index)) if 0 <= index < len(items):
                self.on_click(index)
            case (("close", int()), _):
                self._open(None)
            case ((("remove" | "set"), *_), _) if chosen is None:
                pass  # a late click
            case (("remove", int()), _):
                assert chosen is not None
                self._open(None)
                self.stage.status.show(Notice("hand", f"Removed: {items[chosen].label}", "Undo brings it back."))
                self._use(placed.removed(items, chosen))
            case (("set", str(field), int()), str(text)):
                assert chosen is not None
                self._type(chosen, field, text)
            case _:
                super().heard(key, value)

    def step_name(self, key: Hashable) -> str:
        match key:
            case ("add", str(shape), *_):
                return f"Add a {shape}"
            case ("remove", *_):
                return "Remove an obstacle"
            case ("drag", *_):
                return "Drag of an obstacle"
        return "Change of an obstacle"

    def on_click(self, index: int) -> None:
        """Open the fields of one, or close them."""
        self._open(None if index == self.facts.chosen else index)

    def on_drag(self, pull: DragEvent) -> None:
        """One event of the gizmo. Obstacles do not avoid the arm: it may avoid them. What touches is red."""
        items, index = self.facts.items, self.facts.chosen
        if index is None:
            return
        start = placed.pose(items[index]) if self.settings.grabbed is None else self.settings.grabbed
        self.change(grabbed=None if pull.phase == "end" else start)
        if pull.phase != "start":
            self.change(refused=None)
            self._use(placed.moved(items, index, pose_from_position_wxyz(pull.position, pull.wxyz)))

    def _open(self, index: int | None) -> None:
        self.change(chosen=index, refused=None, grabbed=None)

    def _add(self, shape: str) -> None:
        arm, stage = self.stage.arm.now, self.stage
        if len(arm.obstacles) >= MOST_OBSTACLES:
            detail = f"A page has at most {MOST_OBSTACLES}. Remove one first."
            stage.status.show(Notice("error", "No obstacle was added", detail))
            return
        items = placed.added(arm.obstacles, shape, arm.robot, arm.goal)
        self._open(len(items) - 1)
        detail = "Drag its arrows, or type its place and size in the tab Move."
        stage.status.show(Notice("hand", f"Added: {items[-1].label}", detail))
        self._use(items)

    def _type(self, index: int, field: str, text: str) -> None:
        try:
            items = placed.typed(self.facts.items, index, field, text, self.stage.display.units)
        except EntryError as error:
            refused = Refused(field, text[:60], f"{field.capitalize()}: {error.detail}")
            self.change(refused=refused)
            self.stage.status.show(Notice("error", "The obstacle stays as it was", refused.why))
        else:
            self.change(refused=None)
            self._use(items)

    def _use(self, items: Obstacles) -> None:
        """Take what the visitor has made of the obstacles; an arm that avoids them is solved again."""
        before = self.stage.arm.now.obstacles
        self.stage.arm.use_obstacles(items)
        if self.stage.arm.now.avoid and items != before:
            self.stage.arm.solve_again(self.stage.status.shows_result)


def panel_html(
    items: Obstacles, chosen: int | None, touched: frozenset[int], refused: Refused | None, units: Units
) -> str:
    """Buttons to add one, all obstacles, and the fields of the chosen one."""
    wrong = {} if refused is None else {refused.field: refused.text}
    groups = []
    for title, fields in [] if chosen is None else placed.fields_of(items[chosen]):
        cells = [one.cell(name, value, units, wrong.get(name)) for name, (one, value) in fields.items()]
        groups.append((title, cells[0]["unit"], [cell | {"unit": ""} for cell in cells]))
    return render(
        "obstacles/panel",
        shapes=_ORDER,
        rows=[{"name": each.label, "touched": i in touched} for i, each in enumerate(items)],
        chosen=chosen,
        groups=groups,
        name="" if chosen is None else items[chosen].label,
        full=len(items) >= MOST_OBSTACLES,
        most=MOST_OBSTACLES,
        wrong="" if refused is None else refused.why,
    )
