"""The lesson "Numeric IK": iterations from a start to a target, watched one by one.

The arm on show is the start, so dragging it moves the start; "Target here" makes its pose the target. The iterates
appear as ghosts, with error and step length as a chart. For arms with two joints in a plane, a picture shows which
solution each start leads to; other arms get the picture of the built-in one.

Iterations and pictures are computed in slices of some milliseconds, whenever the worker is idle.
"""

from __future__ import annotations

import math
import time
from collections.abc import Hashable, Iterator
from itertools import count

import numpy as np

import kin
from app.viewer.feature import Stage
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.numeric import basins, views
from app.viewer.lessons.numeric.drawing import Drawing
from app.viewer.lessons.numeric.example import example, usual_match
from app.viewer.lessons.numeric.picture import Picture
from app.viewer.lessons.numeric.questions import outline
from app.viewer.panel import assign, listen, listen_click, update_html
from app.viewer.panel.status import Notice
from kin import InputError
from kin.differential.iteration import METHODS, Match, Method, Problem, Run, Settings, iterate
from kin.transforms import Array
from kin.units import Units
from kin.warmup import ALL

INTERVAL = 0.08  # s between two starts of a moving arm
PACE = 0.35  # s between two iterates that are played
MATCHES: dict[str, Match] = {"Point": "point", "Pose": "pose"}
DAMPINGS, GAINS = (0.005, 0.5), (0.1, 2.0)
LIMITS = (math.radians(2.0), math.pi)  # of the longest change of a joint in one iteration; the last one: none
MOVES = ("First", "Back", "Next", "Run")
METHOD_HINT = "How a step is made from the error and the Jacobian"
MATCH_HINT = "What has to agree with the target: the tool point, or point and orientation"
DAMPING_HINT = "λ of the damped least squares, compared with the singular values of J"
GAIN_HINT = "Multiple of the α that is best if the arm were linear"
LIMIT_HINT = "The largest change of a joint in one iteration; at its right end there is no limit"
JOINTS_HINT = "Keeps each joint within its limits after each step"
COMPARE_HINT = "The chart shows all four methods from the same start"
FOLLOW_HINT = "Drag the arm, and the start moves with it. Switched off, the start stays where it is."
TARGET_HINT = "Makes the present pose of the tool, or a target that is missed, the target of the iterations"
MOVE_HINT = "Shows the iterates one by one; Run plays them"
TAKE_HINT = "Moves the arm to the iterate on show; the start stays"
_NUMBERS = count(1)


class NumericLesson(Lesson):
    """See the module."""

    key = "numeric"
    title = "Numeric IK"
    kernels = (ALL,)
    about = "Newton, transpose and damping from a start that you drag: iterates, failures, basins."
    outline = staticmethod(outline)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._settings = Settings()
        self._longest = LIMITS[1]
        self._match: Match
        self._follows, self._compares = True, False
        self._at: int | None = None  # the iterate on show; None: the last one
        self._plays = False
        self._restarted = 0.0
        self._due = 0.0  # when the next iterate is played
        self._runs: dict[Method, Run] = {}
        self._work: Iterator[None] | None = None
        self._solutions: Array | None
        self._problem: Problem
        self._start: Array
        self._build()
        self._use_robot()

    # Controls

    def _build(self) -> None:
        gui, post = self.stage.client.gui, self.post
        self._outcome = gui.add_html("")
        self._moves = gui.add_button_group("Iterate", MOVES, hint=MOVE_HINT)
        listen_click(self._moves, post, {name: ("move", name) for name in MOVES})
        self._methods = gui.add_dropdown("Method", tuple(views.NAMES.values()), hint=METHOD_HINT)
        listen(self._methods, post, "method")
        self._formula = gui.add_html("")
        with gui.add_folder(None) as self._settings_folder:
            self._build_settings()
        self._limits_box = gui.add_checkbox("Joint limits", self._settings.limits, hint=JOINTS_HINT)
        listen(self._limits_box, post, "limits")
        self._matches = gui.add_dropdown("Match", tuple(MATCHES), hint=MATCH_HINT)
        listen(self._matches, post, "match")
        target = gui.add_button_group("Aim", ("Target here",), hint=TARGET_HINT)
        listen_click(target, post, {"Target here": "target"})
        self._follow_box = gui.add_checkbox("Start follows the arm", self._follows, hint=FOLLOW_HINT)
        listen(self._follow_box, post, "follow")
        take = gui.add_button_group("Arm", ("To this iterate",), hint=TAKE_HINT)
        listen_click(take, post, {"To this iterate": "take"})
        with gui.add_folder("Error and step"):
            self._compare_box = gui.add_checkbox("Compare all methods", self._compares, hint=COMPARE_HINT)
            listen(self._compare_box, post, "compare")
            self._chart = gui.add_html("")
            self._table = gui.add_html("")
        self._picture = Picture(gui, post)

    def _build_settings(self) -> None:
        """The sliders of the method, in the present units."""
        gui, unit = self.stage.client.gui, self.stage.units.angles
        self._units = self.stage.units
        low, high = (unit.shown(value) for value in LIMITS)
        self._damping = gui.add_slider("λ", *DAMPINGS, 0.005, self._settings.damping, hint=DAMPING_HINT)
        listen(self._damping, self.post, "damping")
        self._gain = gui.add_slider("Gain", *GAINS, 0.1, self._settings.gain, hint=GAIN_HINT)
        listen(self._gain, self.post, "gain")
        self._limit = gui.add_slider(
            f"Step limit, {unit.name}", low, high, unit.step(0), unit.shown(self._longest), hint=LIMIT_HINT
        )
        listen(self._limit, self.post, ("longest", self._units))
        self._show_settings()

    def _show_settings(self) -> None:
        """Only the sliders that the method has."""
        self._damping.visible = self._settings.method == "damped"
        self._gain.visible = self._settings.method == "transpose"

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case ("move", str(name)) if name in MOVES:
                self._move(name)
                return
            case "method":
                method = next((method for method, name in views.NAMES.items() if name == value), None)
                if method is None:
                    raise InputError("method", value, "one of " + ", ".join(views.NAMES.values()))
                self._settings = self._settings._replace(method=method)
            case "damping":
                self._settings = self._settings._replace(damping=_within("λ", value, DAMPINGS))
            case "gain":
                self._settings = self._settings._replace(gain=_within("gain", value, GAINS))
            case ("longest", Units() as units):
                if units == self.stage.units:
                    low, high = (units.angles.shown(limit) for limit in LIMITS)
                    self._longest = units.angles.read(_within("step limit", value, (low, high)))
            case "limits":
                self._settings = self._settings._replace(limits=bool(value))
            case "match":
                if value not in MATCHES:
                    raise InputError("match", value, "one of " + ", ".join(MATCHES))
                self._match = MATCHES[str(value)]
                self._aim(self._problem.T)
            case "target":
                self._aim(self.stage.now.aim)
            case "follow":
                self._follows = bool(value)
            case "take":
                self._take()
                return
            case "compare":
                self._compares = bool(value)
            case "picture":
                self._picture.on = bool(value)
            case _:
                raise InputError("numeric", key, "a control of this lesson")
        self._again()

    def step_name(self, key: Hashable) -> str:
        return "Iterate" if key == "take" else self.title

    def on_robot(self) -> None:
        self._drawing.remove()
        self._use_robot()

    def on_pose(self, T_base_tool: Array) -> None:
        if self._follows:
            self._wake()

    def on_style(self) -> None:
        if self.stage.units != self._units:
            for slider in (self._damping, self._gain, self._limit):
                slider.remove()
            with self._settings_folder:
                self._build_settings()
        self._show()

    def tick(self, now: float) -> None:
        self.due = None
        if self._follows and self._work is None and not np.array_equal(self._start, self.stage.now.q):
            if now - self._restarted < INTERVAL:
                self._wake(INTERVAL - (now - self._restarted))
            else:
                self._start = self.stage.now.q.copy()
                self._restart()
        if self._work is not None:
            if next(self._work, self) is self:
                self._work = None
                self._show()
            self._wake()
        elif self._picture.work(self._start, self.stage.units):
            self._wake()
        if self._plays and self._work is None:
            if now >= self._due:
                self._due = now + PACE
                self._move("Next")
            self._wake(max(0.0, self._due - now))

    def state(self) -> dict[str, object]:
        settings = self._settings
        return {
            "method": settings.method,
            "damping": settings.damping,
            "gain": settings.gain,
            "longest": self._longest,
            "limits": settings.limits,
            "match": self._match,
            "target": self._problem.T.ravel().tolist(),
            "start": None if self._follows else self._start.tolist(),
            "at": self._at,
            "compare": self._compares,
            "picture": self._picture.on,
        }

    def restore(self, state: dict[str, object]) -> None:
        self._settings = _settings_of(state, self._settings)
        self._longest = _kept(state.get("longest"), LIMITS, self._longest)
        self._match = (
            "point" if state.get("match") == "point" else "pose" if state.get("match") == "pose" else self._match
        )
        self._compares, self._picture.on = state.get("compare") is True, state.get("picture") is True
        target, start = _numbers(state.get("target"), 16), _numbers(state.get("start"), self.stage.now.robot.n)
        try:
            T = self._problem.T if target is None else kin.transforms.as_transform(target.reshape(4, 4))
        except InputError:
            T = self._problem.T
        self._follows = start is None
        if start is not None:
            self._start = start
        unit = self.stage.units.angles
        for control, value in (
            (self._methods, views.NAMES[self._settings.method]),
            (self._damping, self._settings.damping),
            (self._gain, self._settings.gain),
            (self._limit, unit.shown(self._longest)),
            (self._limits_box, self._settings.limits),
            (self._follow_box, self._follows),
            (self._compare_box, self._compares),
            (self._picture.box, self._picture.on),
        ):
            assign(control, value)
        at = state.get("at")
        self._aim(T)
        self._again()
        self._at = at if type(at) is int and at >= 0 else None

    def remove(self) -> None:
        self._drawing.remove()
        self.stage.fit_view(())

    def _wake(self, seconds: float = 0.0) -> None:
        self.due = seconds if self.due is None else min(self.due, seconds)

    # Iterating

    def _use_robot(self) -> None:
        robot = self.stage.now.robot
        self._drawing = Drawing(self.stage.client.scene, robot, f"/numeric-{next(_NUMBERS)}")
        self._match = usual_match(robot)
        self._start = self.stage.now.q.copy()
        self._at, self._plays, self._in_view = None, False, False
        self._aim(example(robot).problem.T)
        self._again()

    def _aim(self, T: Array) -> None:
        """Take a target pose ``(4, 4)``, and solve it exactly if it has finitely many solutions."""
        self._problem = Problem(self.stage.now.robot, np.array(T), self._match)
        assign(self._matches, next(name for name, match in MATCHES.items() if match == self._match))
        finite = self._problem.is_finite
        self._solutions = basins.exact(self._problem) if finite else None

    def _again(self) -> None:
        """Iterate anew, with other settings or another target."""
        longest = math.inf if self._longest >= LIMITS[1] - 1e-4 else self._longest
        self._settings = self._settings._replace(longest=longest)
        update_html(self._formula, views.method_html(self._settings.method, self._problem))
        self._show_settings()
        self._restart()
        self._picture.use(self._problem, self._settings)
        self._picture.show(self._start, self.stage.units)

    def _restart(self) -> None:
        self._restarted = time.perf_counter()
        self._work = self._iterations()
        self._wake()

    def _iterations(self) -> Iterator[None]:
        """Run the chosen method, then the others if they are compared."""
        chosen = self._settings.method
        found = {}
        for method in (chosen, *(m for m in METHODS if self._compares and m != chosen)):
            for run in iterate(self._problem, self._settings._replace(method=method), self._start):
                if run is not None:
                    found[method] = run
                yield
        self._runs = found
        if self._at is not None:
            self._at = min(self._at, found[chosen].count)

    # What is shown

    def _move(self, name: str) -> None:
        run = self._runs.get(self._settings.method)
        if run is None:  # still being computed
            self._at = 0 if name in ("First", "Run") else self._at
            self._plays = name == "Run"
            return
        at = run.count if self._at is None else self._at
        if name == "Run":
            self._plays = not self._plays
            self._at = 0 if self._plays and at == run.count else at
            self._due = 0.0
        elif name == "Next":
            self._at = min(at + 1, run.count)
            self._plays = self._plays and self._at < run.count
        else:
            self._plays = False
            self._at = 0 if name == "First" else max(0, at - 1)
        self._wake()
        self._show()

    def _take(self) -> None:
        """Move the arm to the iterate on show."""
        run = self._runs.get(self._settings.method)
        if run is None:
            return
        at = run.count if self._at is None else self._at
        q = basins.within(self.stage.now.robot, run.q[at])
        if q is None:
            self.stage.notify(
                Notice("limits", f"Iterate {at} is outside the limits", "The arm stays where it is.")
            )
            return
        self._follows = False
        assign(self._follow_box, False)
        self.stage.move_to(q, Notice("hand", f"Iterate {at}", "The start stays where it was."))

    def _show(self) -> None:
        run, units = self._runs.get(self._settings.method), self.stage.units
        if run is None:
            return
        at = run.count if self._at is None else min(self._at, run.count)
        self._drawing.show(self._problem.T, run.q[: at + 1])
        if not self._in_view:  # once for each arm: the view does not follow the iterates
            self._in_view = True
            self.stage.fit_view((), kin.link_frames(self.stage.now.robot, run.q)[..., :3, 3].reshape(-1, 3))
        update_html(self._outcome, views.outcome_html(self._problem, run, self._solutions, units))
        update_html(self._chart, views.chart_html(self._problem, list(self._runs.items()), units))
        update_html(self._table, views.table_html(self._problem, run, at, units))
        self._picture.show(self._start, units)


def _within(field: str, value: object, limits: tuple[float, float]) -> float:
    low, high = limits
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise InputError(field, value, f"a number from {low:g} to {high:g}")
    return float(value)


def _kept(value: object, limits: tuple[float, float], otherwise: float) -> float:
    return float(value) if type(value) in (int, float) and limits[0] <= value <= limits[1] else otherwise  # type: ignore[operator, arg-type]


def _settings_of(state: dict[str, object], present: Settings) -> Settings:
    method, limits = state.get("method"), state.get("limits")
    return present._replace(
        method=method if method in METHODS else present.method,
        damping=_kept(state.get("damping"), DAMPINGS, present.damping),
        gain=_kept(state.get("gain"), GAINS, present.gain),
        limits=limits if isinstance(limits, bool) else present.limits,
    )


def _numbers(value: object, length: int) -> Array | None:
    """A list of so many finite numbers as an array."""
    if not isinstance(value, list) or len(value) != length or any(type(v) not in (int, float) for v in value):
        return None
    found = np.array(value, dtype=np.float64)
    return found if bool(np.isfinite(found).all()) else None
