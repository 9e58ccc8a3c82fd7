"""The controls of the workspace tab. They post what they are set to, in core units, under the name of the wish."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import viser

from app.viewer.panel import Post, assign, listen, listen_click
from app.viewer.tabs.workspace.colours import BY, MAPS
from app.viewer.tabs.workspace.cut import AXES, KEEP, Cut
from app.viewer.tabs.workspace.wishes import LARGEST, MOST, SMALLEST, Wishes
from kin import InputError, Robot
from kin.units import Units
from kin.workspace import Strategy

STRATEGIES: dict[str, Strategy] = {
    "joints at random": "uniform",
    "joints spread evenly": "quasi",
    "even in space": "volume",
    "envelope only": "boundary",
}
PRESETS = {"10 k": 10_000, "100 k": 100_000, "1 M": 1_000_000, "4 M": MOST}
NONE = "none"
FINE = 3  # decimals of a millimetre


class Controls:
    """Everything that can be set. `read` turns what a control has posted into a wish's value."""

    def __init__(
        self,
        gui: viser.GuiApi,
        wishes: Wishes,
        robot: Robot,
        robots: tuple[Robot, ...],
        units: Units,
        post: Post,
    ) -> None:
        self._gui = gui
        self._units = units
        self._post = post
        self._robots = robots
        self._choices: dict[str, Mapping[str, object]] = {
            "strategy": STRATEGIES,
            "by": BY,
            "map": {name: name for name in MAPS},
            "axis": {NONE: None, **AXES},
            "keep": KEEP,
            "compare": self._others(robot),
        }
        self._handles: dict[str, Any] = {}
        self._at: viser.GuiSliderHandle[float] | None = None
        self._build(wishes)

    def read(self, name: str, value: object) -> object:
        """A control's value as a wish takes it; raises `InputError` for what is not on a list."""
        if name in self._choices:
            if value not in self._choices[name]:
                raise InputError(name, value, "one of " + ", ".join(self._choices[name]))
            return self._choices[name][str(value)]
        return value

    def read_length(self, value: object, units: Units) -> object:
        """The same for the sliders that are lengths; None for what comes from one that is gone."""
        if units != self._units:
            return None
        return units.lengths.read(value) if isinstance(value, int | float) else value

    def use(self, units: Units, wishes: Wishes, cut: Cut | None) -> None:
        """Offer lengths in these units."""
        if units == self._units:
            return
        self._units = units
        self._handles["size"].remove()
        self._add_size(wishes.size)
        self.show_cut(cut, wishes.at)

    def show(self, wishes: Wishes) -> None:
        """Set every control."""
        for name, handle in self._handles.items():
            assign(handle, self._written(name, getattr(wishes, name)))

    def of_robot(self, robot: Robot) -> None:
        """Offer the other arms for comparison."""
        self._choices["compare"] = self._others(robot)
        self._handles["compare"].options = tuple(self._choices["compare"])

    def show_cut(self, cut: Cut | None, at: float) -> None:
        """A slider that moves through this cut's slabs, or none."""
        if self._at is not None:
            self._at.remove()
            self._at = None
        self._handles["keep"].visible = cut is not None
        if cut is None:
            return
        unit = self._units.lengths
        with self._folder:
            self._at = self._gui.add_slider(
                f"Cut at ({unit.name})",
                min=unit.shown(cut.low, FINE),
                max=unit.shown(cut.high, FINE),
                step=unit.shown(cut.step, FINE),
                initial_value=unit.shown(at, FINE),
                hint="Where the cut is: how far from the base along the cut's direction",
            )
        listen(self._at, self._post, ("at", self._units))

    def _build(self, wishes: Wishes) -> None:
        gui = self._gui
        self._add("n", gui.add_number("Points", wishes.n, min=1, max=MOST, step=1, hint=f"1 to {MOST:,} points"))
        presets = gui.add_button_group(" ", tuple(PRESETS), hint="Usual numbers of points")
        for label, number in PRESETS.items():
            listen_click(presets, self._post, {label: ("preset", number)})
        self._add(
            "strategy",
            gui.add_dropdown(
                "Drawn",
                tuple(STRATEGIES),
                initial_value=self._written("strategy", wishes.strategy),
                hint="Joints at random: each joint anywhere between its limits. Spread evenly: the same with less "
                "clumping. Even in space: as many points in each cubic centimetre. Envelope only: the outside. "
                "The last two take longer.",
            ),
        )
        self._add("seed", gui.add_number("Seed", wishes.seed, min=0, step=1, hint="Another seed, another draw"))
        group = gui.add_button_group(
            "Cloud",
            ("Start", "Pause", "Cancel"),
            hint="Start: draw, or go on after a pause; joints that are locked stay where they are. Pause: hold. "
            "Cancel: stop and take the points away.",
        )
        listen_click(group, self._post, {"Start": "start", "Pause": "pause", "Cancel": "cancel"})
        self.bar = gui.add_progress_bar(0.0)
        self.line = gui.add_html("")
        self._add(
            "by",
            gui.add_dropdown(
                "Colour by", tuple(BY), initial_value=self._written("by", wishes.by), hint="What a colour tells"
            ),
        )
        self._add(
            "map",
            gui.add_dropdown(
                "Colours",
                tuple(MAPS),
                initial_value=wishes.map,
                hint="All three can be told apart with every common kind of colour vision",
            ),
        )
        self.legend = gui.add_html("")
        with gui.add_folder(None) as self._size_place:
            pass
        self._add_size(wishes.size)
        self._folder = gui.add_folder("Cut open")
        with self._folder:
            self._add(
                "axis",
                gui.add_dropdown(
                    "Cut",
                    (NONE, *AXES),
                    initial_value=NONE,
                    hint="Along the arm: the upright plane the arm is in now. The cut moves in steps.",
                ),
            )
            self._add("keep", gui.add_dropdown("Keep", tuple(KEEP), initial_value="one side", visible=False))
        with gui.add_folder("Look closer"):
            self._add(
                "clicks",
                gui.add_checkbox(
                    "Click on a point",
                    wishes.clicks,
                    hint="The arm moves to the configuration that drew the point",
                ),
            )
            self.picked = gui.add_html("")
            self._add(
                "compare",
                gui.add_dropdown(
                    "Compare with",
                    tuple(self._choices["compare"]),
                    initial_value=NONE,
                    hint="Another arm's cloud in the same picture, each in one colour",
                ),
            )
            self._add(
                "section",
                gui.add_checkbox(
                    "Section plot",
                    wishes.section,
                    hint="The section in (r, z), its boundary, and the tool in it; no joint locked",
                ),
            )
            self._add(
                "sizes",
                gui.add_checkbox(
                    "Sizes", wishes.sizes, hint="Bounding box, reach, holes, volume and surface; no joint locked"
                ),
            )
            self.sizes = gui.add_html("")

    def _add_size(self, size: float) -> None:
        unit = self._units.lengths
        with self._size_place:
            self._handles["size"] = self._gui.add_slider(
                f"Point size ({unit.name})",
                min=unit.shown(SMALLEST, FINE),
                max=unit.shown(LARGEST, FINE),
                step=unit.shown(SMALLEST, FINE),
                initial_value=unit.shown(size, FINE),
                hint="Diameter of a point",
            )
        listen(self._handles["size"], self._post, ("size", self._units))

    def _add(self, name: str, handle: Any) -> None:
        self._handles[name] = handle
        listen(handle, self._post, name)

    def _written(self, name: str, value: object) -> Any:
        if name in self._choices:
            return next(label for label, v in self._choices[name].items() if v == value)
        return self._units.lengths.shown(value, FINE) if name == "size" and isinstance(value, float) else value

    def _others(self, robot: Robot) -> dict[str, str | None]:
        return {NONE: None, **{other.name: other.id for other in self._robots if other != robot}}
