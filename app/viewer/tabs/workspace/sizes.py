"""The sizes of a workspace: bounding box, reach, holes, volume and surface, computed in the background."""

from __future__ import annotations

import math

from markupsafe import Markup

from app.shared.computations import Subscription
from app.viewer.feature import Stage
from app.viewer.panel import Post
from app.viewer.tabs.workspace.background import run_in_background
from app.viewer.tabs.workspace.said import Said
from app.viewer.views.templates import render
from kin import Robot
from kin.units import Unit, Units
from kin.workspace import Estimate, Span, WorkspaceFacts

SMALLEST_HOLE = 5e-4  # m; smaller holes are not reported


class Sizes:
    """The table of sizes. Posts ``"facts"`` to itself; `post` returns it to `take`."""

    def __init__(self, stage: Stage, said: Said, post: Post) -> None:
        self._stage = stage
        self._said = said
        self._post = post
        self._visible = False
        self._found: tuple[WorkspaceFacts, bool] | None = None  # sizes, and whether they are complete
        self._computations: tuple[Subscription[WorkspaceFacts], ...] = ()

    def show(self, visible: bool) -> None:
        """Compute and show the sizes of the selected robot, or hide them."""
        self.leave()
        self._visible, self._found = visible, None
        self._said.sizes = render("panel/note", text="Computing…") if visible else ""
        if not visible:
            return
        robot, summaries = self._stage.now.robot, self._stage.summaries
        # Volume and surface take longer than the rest.
        rest, whole = summaries.facts(robot, effort=None), summaries.facts(robot)
        self._computations = rest, whole

        def work() -> None:
            self._post("facts", (robot, rest.future.result(), False))
            self._post("facts", (robot, whole.future.result(), True))

        run_in_background(work, "sizes", self._post)

    def leave(self) -> None:
        """Do not wait for the sizes any more."""
        for computation in self._computations:
            computation.leave()
        self._computations = ()

    def take(self, robot: Robot, found: WorkspaceFacts, complete: bool) -> None:
        """Take computed sizes, unless they are of a robot that is no longer selected."""
        if self._visible and robot == self._stage.now.robot:
            self._found = (found, complete)
            self.refresh()

    def refresh(self) -> None:
        """Show the sizes in the present units."""
        if self._found is not None:
            found, complete = self._found
            self._said.sizes = html(found, not complete, self._stage.units)


def html(facts: WorkspaceFacts, waiting: bool, units: Units) -> str:
    """The sizes as a table; `waiting`: volume and surface are still being computed."""
    unit = units.lengths
    rows = [
        *((name, _span(span, unit), unit.name) for name, span in (("x", facts.x), ("y", facts.y), ("z", facts.z))),
        ("reach from the shoulder", unit.number(facts.reach.largest.value), unit.name),
        ("hole around the shoulder", *_hole(facts.reach, unit)),
        ("reach from joint 1's axis", unit.number(facts.radius.largest.value), unit.name),
        ("hole around the axis", *_hole(facts.radius, unit)),
        ("volume", _estimate(facts.volume, waiting), "m³"),
        ("surface", _estimate(facts.surface, waiting), "m²"),
    ]
    return render("panel/facts", label="sizes of the workspace", rows=rows, note="")


def _span(span: Span, unit: Unit) -> str:
    return f"{unit.number(span.least.value)} … {unit.number(span.largest.value)}"


def _hole(span: Span, unit: Unit) -> tuple[str, str]:
    """The radius of a hole and its unit."""
    if span.least.value < SMALLEST_HOLE:
        return "none", ""
    return f"radius {unit.number(span.least.value)}", unit.name


def _estimate(estimate: Estimate | None, waiting: bool) -> str:
    """A number with its error, without digits that the error makes meaningless."""
    if estimate is None:
        return "computing…" if waiting else "unknown"
    error = max(estimate.error, 1e-12)
    digits = min(max(1 - math.floor(math.log10(error)), 0), 6)
    return Markup('<span title="{}">{} ± {}</span>').format(
        estimate.method, f"{estimate.value:.{digits}f}", f"{error:.{digits}f}"
    )
