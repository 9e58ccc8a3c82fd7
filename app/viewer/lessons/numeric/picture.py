"""The picture of the basins in the panel, searched for in slices whenever the worker is idle."""

from __future__ import annotations

from collections.abc import Iterator

import viser

from app.viewer.lessons.numeric import basins, views
from app.viewer.lessons.numeric.basins import Basins
from app.viewer.panel import Post, listen, update_html
from kin import fk, get_robot
from kin.differential.iteration import Problem, Settings
from kin.transforms import Array
from kin.units import Units

HINT = "Which solution each start (θ₁, θ₂) leads to, for the method and the settings above"


class Picture:
    """A folder with a checkbox, which posts ``"picture"``, and the picture.

    Attributes:
        box: the checkbox.
        on: whether the picture is on show.
    """

    def __init__(self, gui: viser.GuiApi, post: Post) -> None:
        self.on = False
        self._found: Basins | None = None
        self._key: tuple[object, ...] = ()
        self._search: Iterator[Basins | None] | None = None
        self._problem: Problem
        self._mine = False
        with gui.add_folder("Basins"):
            self.box = gui.add_checkbox("Basins of attraction", False, hint=HINT)
            listen(self.box, post, "picture")
            self._image, self._mark, self._legend = (gui.add_html("") for _ in range(3))

    def use(self, problem: Problem, settings: Settings) -> None:
        """Draw this arm if it has two joints, else the built-in one, with its pose at home as the target."""
        self._mine = is_pictured(problem)
        if not self._mine:
            robot = get_robot("planar2r")
            problem = Problem(robot, fk(robot, robot.q_home), "point")
        self._problem = problem
        if not self.on:
            self._key, self._found, self._search = (), None, None
            return
        key = (settings, problem.robot, problem.match, problem.T.tobytes())
        if key != self._key:
            self._key, self._found = key, None
            self._search = basins.search(problem, settings)

    def work(self, start: Array, units: Units) -> bool:
        """Continue the search; whether it went on."""
        if self._search is None:
            return False
        self._found = next(self._search)
        if self._found is not None:
            self._search = None
            self.show(start, units)
        return True

    def show(self, start: Array, units: Units) -> None:
        """Show the picture, or what stands in its place, and the present start."""
        found, name = self._found, self._problem.robot.name
        if found is None:
            update_html(self._image, views.waiting_html(self.on))
            update_html(self._legend, "")
        else:
            update_html(self._image, views.basins_html(found, name, units))
            update_html(self._legend, views.key_html(found, self._mine, units))
        # A layer of its own: the picture is not sent again while the arm moves.
        update_html(self._mark, "" if found is None or not self._mine else views.mark_html(found, start))


def is_pictured(problem: Problem) -> bool:
    """Whether the basins of this arm can be drawn: two revolute joints that the target decides."""
    return problem.robot.n == 2 and bool(problem.robot.revolute.all()) and problem.is_finite
