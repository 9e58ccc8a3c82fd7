"""The lesson "Screws": the joint axes as six numbers each, and the tool pose as a product of their exponentials.

The axes are drawn either with all joints at zero, as in the formula, or at the current configuration. There they
are the columns of the Jacobian. A ghost shows the arm after the first factors of the product.
"""

from __future__ import annotations

from collections.abc import Sequence

from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Control, Folder, Html, Node
from app.viewer.declared.scene import Lazy
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.screws import views
from app.viewer.lessons.screws.drawing import scene, tips
from app.viewer.lessons.screws.facts import ScrewsFacts
from app.viewer.lessons.screws.questions import outline
from app.viewer.lessons.screws.settings import ScrewsSettings
from app.viewer.scene.camera import round_points
from app.viewer.scene.meshes import body

LABELS = 1.15  # room for the labels beyond the ends of the axes


class ScrewsLesson(DeclaredFeature[ScrewsSettings, ScrewsFacts], Lesson):
    """See the module."""

    key = "screws"
    by_rows = True
    through = True
    title = "Screws"
    about = "Each joint axis as six numbers, and the pose of the tool as a product of exponentials."
    outline = staticmethod(outline)
    settings_of, facts_of = ScrewsSettings, ScrewsFacts

    def started(self) -> None:
        self._figure = FigureNodes(body(self.stage.now.robot).size)
        self.stage.see_through(True)
        center, radius = round_points(tips(self.facts))
        self.stage.fit_view([(center, LABELS * radius)])

    def remove(self) -> None:
        super().remove()
        self.stage.see_through(False)
        self.stage.fit_view([])

    def panel(self) -> Sequence[Node]:
        f, s, robot = self.read, self.settings, self.read.robot
        value = float(f.q[f.chosen])
        one = robot, f.chosen, f.columns[:, f.chosen], value, s.form, self.stage.units
        return [
            Control("form"),
            Control("axes"),
            *self.unless_asked("screws", Html(views.table_html, (robot, f.columns, s.form, f.now, f.chosen))),
            Folder(
                "One screw",
                [
                    Control("joint", of=robot.id),
                    *self.unless_asked("screws", Html(views.one_html, one)),
                ],
            ),
            Folder(
                "Product of exponentials",
                [
                    Control("factors", of=robot.id),
                    Html(views.product_html, (robot, f.zero, f.acting, s.factors, s.form)),
                ],
            ),
        ]

    def scene(self) -> Sequence[Lazy]:
        # Axes at zero do not move with the arm.
        facts, units = self.facts if self.facts.now else self.read, self.stage.units
        return [Lazy("screws", scene, (facts, self._figure, units, self.hides("screws")))]

    def legend(self) -> str:
        f, s = self.read, self.settings
        ghost = None if f.ghost is None else s.factors
        return views.legend_html(f.robot, s.form, f.now, ghost, f.chosen, self.hides("screws"))
