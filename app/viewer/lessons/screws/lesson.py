"""The lesson "Screws": the joint axes as six numbers each, and the tool pose as a product of their exponentials.

The axes are drawn where they are with all joints at zero, which is where the formula takes them, or where they are
now: then they are the columns of the Jacobian. A ghost shows the arm after the first factors of the product.
"""

from __future__ import annotations

import time
from collections.abc import Hashable
from itertools import count

import numpy as np
import viser

import kin
from app.viewer.feature import Stage
from app.viewer.lessons.axes import axes_at
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.screws import views
from app.viewer.lessons.screws.drawing import Drawing
from app.viewer.lessons.screws.product import Form, origin_of, partial, seen
from app.viewer.lessons.screws.questions import far_joint, outline
from app.viewer.panel import assign, listen, update_html
from app.viewer.scene.camera import round_points
from kin import InputError, Screws
from kin.transforms import Array

LABELS = 1.15  # room for the labels beyond the ends of the axes
INTERVAL = 0.05  # s between two updates of the numbers
FORMS: dict[str, Form] = {"Space (world frame)": "space", "Body (tool frame)": "body"}
PLACES = {"All joints at zero": "zero", "Where they are now": "now"}
FORM_HINT = "The frame in which the six numbers of each screw are given"
PLACE_HINT = "The formula takes the screws at zero; where they are now, they are the columns of the Jacobian"
JOINT_HINT = "Shows how the six numbers of this joint's screw follow from its axis"
FACTORS_HINT = "How many factors of the product act, those next to M first; the ghost shows the arm they give"
_NUMBERS = count(1)


class ScrewsLesson(Lesson):
    """See the module."""

    key = "screws"
    title = "Screws"
    about = "Each joint axis as six numbers, and the pose of the tool as a product of exponentials."
    outline = staticmethod(outline)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._form: Form = "space"
        self._now = False
        self._factors = stage.now.robot.n
        self._shown_at = 0.0
        self._chosen: int
        self._drawing: Drawing
        self._zero: Screws
        gui = stage.client.gui
        self._forms = gui.add_dropdown("Form", tuple(FORMS), initial_value=next(iter(FORMS)), hint=FORM_HINT)
        listen(self._forms, self.post, "form")
        self._places = gui.add_dropdown("Axes", tuple(PLACES), initial_value=next(iter(PLACES)), hint=PLACE_HINT)
        listen(self._places, self.post, "axes")
        self._table = gui.add_html("")
        self._slot = gui.add_folder("One screw")
        with self._slot:
            self._one = gui.add_html("", order=2)
        self._product_slot = gui.add_folder("Product of exponentials")
        with self._product_slot:
            self._product = gui.add_html("", order=2)
        self._joint: viser.GuiDropdownHandle[str] | None = None
        self._slider: viser.GuiSliderHandle[int] | None = None
        self._use_robot()

    def handle(self, key: Hashable, value: object) -> None:
        arm = self.stage.now
        n = arm.robot.n
        match key:
            case "form":
                if value not in FORMS:
                    raise InputError("form", value, "one of " + ", ".join(FORMS))
                self._form = FORMS[str(value)]
            case "axes":
                if value not in PLACES:
                    raise InputError("axes", value, "one of " + ", ".join(PLACES))
                self._now = PLACES[str(value)] == "now"
            case ("joint", str(robot_id)):
                names = views.joint_names(arm.robot)
                if robot_id != arm.robot.id:
                    return
                if value not in names:
                    raise InputError("joint", value, "one of " + ", ".join(names))
                self._chosen = names.index(str(value))
            case ("factors", str(robot_id)):
                if robot_id != arm.robot.id:
                    return
                if not isinstance(value, int | float) or not 0 <= value <= n or value != int(value):
                    raise InputError("factors", value, f"a whole number from 0 to {n}")
                self._factors = int(value)
            case _:
                raise InputError("screws", key, "a control of this lesson")
        self._show()

    def on_robot(self) -> None:
        self._drawing.remove()
        self._factors = self.stage.now.robot.n
        self._use_robot()

    def on_pose(self, T_base_tool: Array) -> None:
        if self._now:
            self._draw()
        self.due = max(0.0, INTERVAL - (time.perf_counter() - self._shown_at))

    def on_style(self) -> None:
        self._show()

    def tick(self, now: float) -> None:
        wait = INTERVAL - (now - self._shown_at)
        if wait > 0.0:
            self.due = wait
            return
        self._show()

    def state(self) -> dict[str, object]:
        place = "now" if self._now else "zero"
        return {"form": self._form, "axes": place, "joint": self._chosen + 1, "factors": self._factors}

    def restore(self, state: dict[str, object]) -> None:
        for name, form in FORMS.items():
            if state.get("form") == form:
                self._form = form
                assign(self._forms, name)
        for name, place in PLACES.items():
            if state.get("axes") == place:
                self._now = place == "now"
                assign(self._places, name)
        n, joint, factors = self.stage.now.robot.n, state.get("joint"), state.get("factors")
        if type(joint) is int and 1 <= joint <= n:
            self._chosen = joint - 1
            assign(self._joint, views.joint_names(self.stage.now.robot)[self._chosen])
        if type(factors) is int and 0 <= factors <= n:
            self._factors = factors
            assign(self._slider, factors)
        self._show()

    def remove(self) -> None:
        self._drawing.remove()
        self.stage.show_legend("")
        self.stage.see_through(False)
        self.stage.fit_view([])

    def _use_robot(self) -> None:
        """Create the drawing and the controls of the selected robot."""
        stage, robot = self.stage, self.stage.now.robot
        self._zero = kin.screws(robot)
        self._chosen = max(far_joint(self._zero.S), 0)
        self._drawing = Drawing(stage.client.scene, robot, f"/screws-{next(_NUMBERS)}")
        for handle in (self._joint, self._slider):
            if handle is not None:
                handle.remove()
        gui, names = stage.client.gui, views.joint_names(robot)
        with self._slot:
            self._joint = gui.add_dropdown(
                "Joint", names, initial_value=names[self._chosen], hint=JOINT_HINT, order=1
            )
        listen(self._joint, self.post, ("joint", robot.id))
        with self._product_slot:
            self._slider = gui.add_slider("Factors", 0, robot.n, 1, robot.n, hint=FACTORS_HINT, order=1)
        listen(self._slider, self.post, ("factors", robot.id))
        stage.see_through(True)
        self._show()
        center, radius = round_points(self._drawing.tips)
        stage.fit_view([(center, LABELS * radius)])

    def _screws(self) -> Screws:
        return kin.screws(self.stage.now.robot, self.stage.now.q) if self._now else self._zero

    def _draw(self) -> None:
        """Draw the axes, the chosen screw, and the arm that the factors give."""
        stage, robot = self.stage, self.stage.now.robot
        found = self._screws()
        points, directions = axes_at(robot, stage.now.q if self._now else np.zeros(robot.n))
        self._drawing.show_axes(points, directions)
        self._drawing.show_chosen(
            self._chosen, found.S[:, self._chosen], origin_of(found, self._form), stage.units
        )
        self._drawing.show_ghost(self._ghost())

    def _ghost(self) -> Array | None:
        """The arm after the factors that act; with all of them the arm at zero, if the axes are drawn there."""
        arm = self.stage.now
        if self._factors < arm.robot.n:
            ghost = partial(arm.q, self._factors, self._form)
        else:
            ghost = arm.q if self._now else np.zeros(arm.robot.n)
        return None if np.abs(ghost - arm.q).max() < 1e-9 else ghost

    def _show(self) -> None:
        """Update the scene and the numbers."""
        arm = self.stage.now
        self._shown_at, self.due = time.perf_counter(), None
        stage, robot = self.stage, arm.robot
        self._draw()
        found = self._screws()
        columns = seen(found, self._form)
        update_html(self._table, views.table_html(robot, columns, self._form, self._now, self._chosen))
        value = float(arm.q[self._chosen])
        update_html(
            self._one,
            views.one_html(robot, self._chosen, columns[:, self._chosen], value, self._form, stage.units),
        )
        q = partial(arm.q, self._factors, self._form)
        update_html(self._product, views.product_html(robot, self._zero, q, self._factors, self._form))
        ghost = None if self._ghost() is None else self._factors
        stage.show_legend(views.legend_html(robot, self._form, self._now, ghost, self._chosen))
