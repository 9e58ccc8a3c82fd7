"""A feature that declares what it shows: the settings, the nodes of panel and scene, and what events do.

Subclasses have a class of settings and one of facts, and override what they need; nothing they override touches
viser::

    class Counter(DeclaredFeature[CounterSettings, Sum]):
        key, title, settings_of, facts_of = "counter", "Counter", CounterSettings, Sum

        def panel(self) -> Sequence[panel.Node]:
            total = Html(views.sum_html, (self.read.sum,))
            return [Control("step"), Button("Add", self.event(self.on_add)), total]

        def on_add(self) -> None:
            self.change(total=self.settings.total + self.settings.step)
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Mapping, Sequence, Set
from dataclasses import replace
from typing import Any, ClassVar, Generic, ParamSpec, TypeVar, cast

import viser

from app.viewer.arm import Arm
from app.viewer.declared.facts import ArmReads, Facts
from app.viewer.declared.fields import Settings
from app.viewer.declared.panel import Event, Html, PanelView
from app.viewer.declared.panel import Node as PanelNode
from app.viewer.declared.scene import Lazy, SceneView
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Runner, Sweep, Work
from app.viewer.feature import Feature, Stage
from app.viewer.views.templates import render
from kin import InputError

S = TypeVar("S", bound=Settings)
F = TypeVar("F", bound=Facts[Any])
D = TypeVar("D", bound="DeclaredFeature[Any, Any]")
P = ParamSpec("P")
# The first parts of keys that `DeclaredFeature.handle` takes itself: they name fields and methods of the feature.
OWN = frozenset({"at", "do", "done", "drag"})


class DeclaredFeature(Feature, Generic[S, F]):
    """See the module.

    Attributes:
        settings_of, facts_of: the classes of settings and facts.
        undo: what undo calls an event, by the method that it calls, if not by the feature's title.
        pace: the panel follows a moving arm at this interval (s), or more seldom where many visitors' arms move:
            nobody reads faster, and HTML is long.
        facts: what is known of settings and arm now; the same object as long as the settings, the results of work,
            and all that was read of the arm are. While an event is handled, they are
            those before it.
        read: the facts that the panel shows. Drawings that change no faster than the panel use these.
        shown_at: when the panel was last made to show them (`time.perf_counter`).

    Args:
        within: the feature that this one is a part of, which gets its events under its key and calls its methods:
            `adopt` has it do so.
    """

    settings_of: ClassVar[type[Settings]]
    facts_of: ClassVar[type[Facts[Any]]]
    undo: ClassVar[dict[str, str]] = {}
    pace: ClassVar[float] = 0.05

    def __init_subclass__(cls) -> None:
        # Otherwise the page's own script could call any method.
        if cls.messages & OWN:
            raise TypeError(f"{cls.__name__}.messages must not contain {', '.join(sorted(cls.messages & OWN))}")

    def __init__(self, stage: Stage, within: Feature | None = None) -> None:
        self._parts: dict[str, DeclaredFeature[Any, Any]] = {}
        super().__init__(stage)
        self._within = within
        self.settings: S = cast(S, self.settings_of.fresh(stage.arm.now.robot))
        self._panel = PanelView(stage.client.gui, self.post, stage.fence)
        self._scene = SceneView(stage.client.scene, self.key, self.post)
        self._runner = Runner(lambda: (within or self).post(("done", ())))
        self.shown_at = 0.0
        self._write = self._stale = self._pressed = False
        self._withheld = stage.activity.withheld
        self._reads = ArmReads(stage.arm.now)
        self.facts: F = self._facts()
        self.read = self._drawn = self.facts
        self.built()
        self.started()
        self._begin()

    @property
    def due(self) -> float | None:
        """See `Feature`: its own, or that of a part, whichever is earlier."""
        due = None if self._due_at is None else max(0.0, self._due_at - time.perf_counter())
        if not self._parts:
            return due
        dues = due, *(part.due for part in self._parts.values())
        return min((due for due in dues if due is not None), default=None)

    @due.setter
    def due(self, seconds: float | None) -> None:
        self._due_at = None if seconds is None else time.perf_counter() + seconds

    # To be overridden

    def built(self) -> None:
        """The feature is in the page: parts that viser shows elsewhere can be made."""

    def started(self) -> None:
        """There is a robot: the first, or another one."""

    def sources(self) -> Mapping[str, Any]:
        """What the facts get besides, by the names of their fields; always the same objects."""
        return {}

    def panel(self) -> Sequence[PanelNode]:
        """What the panel shows; of the arm only what `read` gives, so that it is known what it depends on."""
        return ()

    def scene(self) -> Sequence[SceneNode | Lazy]:
        """What the scene shows; asked for with each frame in which something has changed that was read."""
        return ()

    def legend(self) -> str | None:
        """What is drawn, in words; None: the feature has no legend."""
        return None

    def running(self) -> Sequence[Work | Sweep]:
        """What goes on by itself, for the present facts."""
        return ()

    def changed(self, path: str) -> None:
        """The visitor has set the field at this path."""

    def heard(self, key: Hashable, value: object) -> None:
        """An event of no declared control, such as a message of the page's own script; raises `InputError`."""
        raise InputError(self.key, key, "a control of this feature")

    def worked(self, key: str) -> None:
        """There is something new of the work with this key, in `facts`."""
        if (error := self.facts.work(key).error) is not None:
            raise error

    @property
    def place(self) -> viser.GuiFolderHandle:
        """The folder with its controls."""
        return self._panel.top

    # For subclasses

    def adopt(self, part: D) -> D:
        """Have a part follow from now on; its state is kept under its key."""
        self._parts[part.key] = part
        return part

    def for_parts(self, action: Callable[[DeclaredFeature[Any, Any]], object]) -> None:
        """Call every part."""
        for part in self._parts.values():
            action(part)

    def restore_parts(self, state: dict[str, object]) -> None:
        """Restore every part of which the state of the feature has one."""
        for name, part in self._parts.items():
            if isinstance(saved := state.get(name), dict):
                part.restore(saved)

    def change(self, **values: Any) -> None:
        """Set fields."""
        self.settings = replace(self.settings, **values)

    def rewrite(self) -> None:
        """Let all controls show their settings, those too whose value was refused."""
        self._write = True

    @staticmethod
    def event(method: Callable[P, None], *args: P.args, **_: P.kwargs) -> Event:
        """The event that calls one of the feature's methods; the arguments are hashable."""
        return method.__name__, *args

    def schedule(self, seconds: float = 0.0) -> None:
        """Show what is declared in so many seconds or earlier."""
        self._stale = self._stale or seconds == 0.0
        self.due = seconds if self.due is None else min(self.due, seconds)

    def hides(self, *facts: str) -> bool:
        """Whether an open question asks for one of these facts (`app.viewer.activity.activity.FACTS`)."""
        return not self.stage.activity.withheld.isdisjoint(facts)

    def unless_asked(self, fact: str, *nodes: PanelNode) -> Sequence[PanelNode]:
        """These nodes; while a question asks for the fact, a note in their place."""
        return [Html(render, ("panel/asked",), key=f"asked {fact}")] if self.hides(fact) else nodes

    def spec(self, path: str) -> Any:
        """What the field at this path declares, to be narrowed with `dataclasses.replace` by facts."""
        return self.settings_of.spec(path)

    def refresh(self) -> None:
        """Show what is declared now."""
        self.shown_at, self.due, self._stale, self._pressed = time.perf_counter(), None, False, False
        if self._withheld != self.stage.activity.withheld:
            self._withheld = self.stage.activity.withheld
            self._scene.remove()  # hidden nodes too: the browser has their data
        self.invalidate()
        self.read = self._drawn = self.facts
        stage = self.stage
        self._panel.show(
            self.panel(), self.settings, stage.arm.now.robot, stage.display.units, self._write, self.labels
        )
        self._write = False
        self._scene.show(self.scene())
        if (words := self.legend()) is not None:
            stage.picture.show_legend(words)

    def invalidate(self) -> None:
        """Make `facts` anew if something that they were made of has changed."""
        facts, stage, arm = self.facts, self.stage, self.stage.arm.now
        same = (
            facts.settings is self.settings
            and facts.works is self._runner.results
            and facts.units == stage.display.units
        )
        if not (same and self._reads.follow(arm)):
            self._reads = ArmReads(arm)
            self.facts = self._facts()

    def _facts(self) -> F:
        results, units = self._runner.results, self.stage.display.units
        return cast(F, self.facts_of(self.settings, cast(Arm, self._reads), results, units, **self.sources()))

    def catch_up(self) -> None:
        """Show what has changed with the arm or the settings: the scene at once, the panel at its pace."""
        if self._outdated:
            return
        self.invalidate()
        self._draw()
        if self.facts is not self.read:
            self.schedule(max(0.0, self._interval - (time.perf_counter() - self.shown_at)))

    def _draw(self) -> None:
        """Show the scene that is declared now: a frame of a motion, between two times of the panel."""
        if self.facts is not self._drawn:
            self._drawn = self.facts
            self._scene.show(self.scene())

    @property
    def _outdated(self) -> bool:
        """Whether there is another robot for which `on_robot` has not been called yet."""
        before, now = self.facts.robot, self.stage.arm.now.robot
        return before is not now and before != now  # often the same object: comparing all its fields takes longer

    @property
    def _interval(self) -> float:
        return max(self.pace, self.stage.services.pace.reading)

    def _begin(self) -> None:
        """Show what is declared, and begin what goes on."""
        self.refresh()
        self.due = 0.0

    def _go_on(self, now: float) -> float | None:
        """Carry on work and motions; returns in how many seconds to go on."""
        self.invalidate()
        again, news = self._runner.go_on(self.running(), now)
        self._stale = self._stale or bool(news)
        self.invalidate()
        for key in news:
            self.worked(key)
        return again

    # Feature

    def post(self, key: Hashable, value: object = None) -> None:
        if self._within is None:
            super().post(key, value)
        else:
            self._within.post((self.key, key), value)

    def handle(self, key: Hashable, value: object) -> None:
        self.invalidate()
        self.schedule()  # shown once, after all events that wait, and after errors
        match key:
            case ("at", str(path), int(serial), int()):
                if self._pressed:  # a control that the press has replaced sends nothing more
                    self.refresh()
                    self.schedule()
                if (found := self._panel.received(self.settings, path, serial, value)) is not None:
                    self.settings = found
                    self.changed(path)
            case ("do", (str(name), *arguments), int(serial), int()):
                if self._panel.is_live(serial):
                    self._pressed = True
                    getattr(self, name)(*arguments)
            case ("done", ()):
                self._go_on(time.perf_counter())
                self.for_parts(lambda part: part.handle(key, value))
            case (str(name), inner) if name in self._parts:
                self._parts[name].handle(inner, value)
            case ("drag", (str(name), *arguments), int()):
                getattr(self, name)(*arguments, value)
            case _:
                self.heard(key, value)

    def step_name(self, key: Hashable) -> str:
        match key:
            case ("at", str(path), *_):
                return self.settings_of.spec(path).undo or self.title
            case ("do" | "drag", (str(name), *_), *_):
                return self.undo.get(name, self.title)
        return self.title

    def on_robot(self) -> None:
        self._scene.remove()
        self._runner.end()
        self.settings = self.settings.for_robot(self.stage.arm.now.robot)
        self.invalidate()
        self.started()
        self._begin()
        self.for_parts(lambda part: part.on_robot())

    def on_arm_changed(self, changed: Set[str]) -> None:
        if not self._reads.untouched(changed):
            self.catch_up()
        for part in self._parts.values():
            part.on_arm_changed(changed)

    def on_style(self) -> None:
        self._begin()
        self.for_parts(lambda part: part.on_style())

    def on_activity(self) -> None:
        if self._withheld != self.stage.activity.withheld and not self._outdated:
            self._begin()
        self.for_parts(lambda part: part.on_activity())

    def tick(self, now: float) -> None:
        self.for_parts(lambda part: None if part.due is None else part.tick(now))
        early = self._due_at is not None and self._due_at > max(now, time.perf_counter())
        if early and not self._stale and self.settings is self.read.settings:
            return  # called after a step of something else
        self.due, again = None, None
        self.invalidate()
        if self._stale or (self.facts is not self.read and now - self.shown_at >= self._interval):
            self.refresh()
        try:
            again = self._go_on(now)
        finally:
            if news := self._stale:
                self.refresh()
            self.invalidate()
            self._draw()
            changed = self.facts is not self.read
            wait = max(0.0, self._interval - (now - self.shown_at)) if changed else None
            waits = again, 0.0 if news else wait
            self.due = min((one for one in waits if one is not None), default=None)

    def state(self) -> dict[str, object]:
        return {**self.settings.state(), **{name: part.state() for name, part in self._parts.items()}}

    def restore(self, state: dict[str, object]) -> None:
        self.settings = self.settings.restored(state, self.stage.arm.now.robot)
        self.rewrite()
        self._begin()
        self.restore_parts(state)

    def on_leave(self) -> None:
        self._runner.end()
        self.for_parts(lambda part: part.on_leave())

    def remove(self) -> None:
        self.for_parts(lambda part: part.remove())
        self._runner.end()
        if self.legend() is not None:
            self.stage.picture.show_legend("")
        self._scene.remove()
        self._panel.remove()


class OpenableFeature(DeclaredFeature[S, F]):
    """A feature that lives as long as the page, so that what was done in it is kept while it is hidden.

    Attributes:
        shown: whether it is on show.
    """

    def __init__(self, stage: Stage) -> None:
        self.shown = False
        super().__init__(stage)

    def show(self) -> None:
        """Show it."""
        self.shown = True
        self.refresh()

    def hide(self) -> None:
        """Hide it."""
        if self.shown:
            self.shown = False
            self.refresh()
