"""The form of the workspace tab: which controls there are, in their order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from app.viewer.declared.panel import Buttons, Control, Event, Folder, Html, Node, Progress
from app.viewer.tabs.workspace import colours, views
from app.viewer.tabs.workspace.facts import WorkspaceFacts
from app.viewer.tabs.workspace.settings import FINE, MAX_POINTS, MIN_SIZE, NONE, WorkspaceSettings
from app.viewer.views.templates import render
from kin import Robot
from kin.units import grouped

SMOOTH = 200_000  # points: a picture of them takes some tenths of a second without a graphics card
PRESETS = {"10 k": 10_000, "100 k": 100_000, "1 M": 1_000_000, "4 M": MAX_POINTS}
# The workspaces that the source chapter shows, and their arms.
FIGURES = {"Figure 8": "pioneer5", "Figure 10": "redundant7"}
CLOUD_HINT = (
    "Start: sample points; locked joints keep their values. Pause: stop for now. Stop: end sampling, the points "
    "stay. Clear: remove the points. Restart: sample again with the present settings."
)


def spec(path: str) -> Any:
    """What a field declares."""
    return WorkspaceSettings.spec(path)


def form(f: WorkspaceFacts, others: tuple[Robot, ...], picked: Html, sizes: Html) -> list[Node]:
    """Everything between cloud and tools, but for what has events of its own; `others`: robots to compare with."""
    settings, robot, unit, cut = f.settings, f.robot, f.units.lengths, f.settings.cut
    point = replace(spec("size"), step=unit.shown(MIN_SIZE, FINE))
    closed = [Control("axis"), Control("keep", visible=cut is not None)]
    if cut is not None:
        ends = cut.low, cut.high
        at = replace(spec("at"), limits=ends, slider=ends, step=unit.shown(cut.step, FINE))
        label = f"Cut at ({unit.name})"
        closed.append(Control("at", spec=at, label=label, of=(robot.id, settings.axis, settings.compare, *ends)))
    names = {NONE: None, **{other.name: other.id for other in others}}
    return [
        Control("by"),
        Control("map"),
        _legend(f),
        Control("size", spec=point, label=f"Point size ({unit.name})"),
        Folder("Cut open", closed),
        Folder(
            "Look closer",
            [
                Control("clicks"),
                picked,
                Control("compare", spec=spec("compare").narrowed(names)),
                Control("section"),
                Control("axes"),
                Control("sizes"),
                sizes,
            ],
        ),
    ]


def _legend(f: WorkspaceFacts) -> Html:
    """The meaning of the colours. None without points, because it needs sampled data, and for an old cloud."""
    if f.old or not any(one.parts for one in f.clouds):
        return Html(str, key="legend")
    if f.other is None and f.settings.by != "one":
        scale = colours.scale_of(f.robot, f.settings.by)
        return Html(colours.legend, (scale, f.settings.map, f.units), key="legend")
    names = [(one.look.colour, one.cloud.robot.name) for one in f.wanted]
    return Html(colours.names_legend, (names,), key="legend")


def cloud(f: WorkspaceFacts, actions: Mapping[str, Event]) -> list[Node]:
    """The controls of the cloud itself."""
    n, drawn = f.settings.n, f.stream.points
    line = f.state, drawn, f.total or n, f.speed, f.locked, f.old
    return [
        Html(heavy, (n,), key="heavy"),
        Control("strategy"),
        Control("seed"),
        Buttons("Cloud", actions, CLOUD_HINT, views.buttons(f.state, f.old)),
        Progress(f.percent),
        Html(views.progress, line, key="line"),
    ]


def is_in_the_book(robot: Robot, robots: tuple[Robot, ...]) -> bool:
    """Whether the source chapter shows the workspace of this arm; it may be an arm of the service only."""
    return robot in robots and robot.id in FIGURES.values() and set(FIGURES.values()) <= {r.id for r in robots}


def figures_hint(robot: Robot) -> str:
    """What the buttons of the figures do; `robot`: the arm on show, whose source is named."""
    return (
        "The two workspaces that the source chapter shows as still pictures: figure 8 of the Pioneer arm, figure "
        f"10 of the redundant arm. Shows that arm, and its cloud with axes. The arm on show: {robot.source}."
    )


def heavy(points: int) -> str:
    """A warning of many points. ``static/page.js`` shows it where the browser draws without a graphics card."""
    if points <= SMOOTH:
        return ""
    text = (
        f"This browser draws without a graphics card: with {grouped(points)} points the page may freeze for "
        f"seconds. Up to {grouped(SMOOTH)} points draw smoothly."
    )
    return render("workspace/heavy", text=text)
