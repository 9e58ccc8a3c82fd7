"""A part of the page with a life of its own: the workspace tab, each lesson.

A feature is made from a :class:`Stage`, which is all that it may know of the visitor's session: the arm on show,
where it is and where it is heading, the visitor's scene and panel, and what a feature may ask for. Its controls
post, as every control does; its methods are called by the visitor's worker, one at a time, inside
``client.atomic()``. So a feature needs no lock, and what it sends arrives as one picture with the arm.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import ClassVar, Protocol

import viser

from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import Sphere
from kin import IKResult, Robot, Task
from kin.transforms import Array
from kin.units import Units


class Stage(Protocol):
    """What the session offers to features."""

    store: Store
    clouds: Clouds
    maps: Maps
    summaries: Summaries

    @property
    def client(self) -> viser.ClientHandle:
        """The visitor's browser tab: its ``gui``, ``scene`` and ``camera``."""

    @property
    def robot(self) -> Robot:
        """The arm on show."""

    @property
    def task(self) -> Task:
        """How much of a target the arm is to match."""

    @property
    def goal(self) -> Array:
        """The configuration ``(n,)`` the arm is heading for, or is at."""

    @property
    def q(self) -> Array:
        """The configuration ``(n,)`` in the picture."""

    @property
    def target(self) -> Array | None:
        """The pose ``(4, 4)`` asked for with the gizmo while it is the arm's task, else None."""

    @property
    def locked(self) -> tuple[float | None, ...] | None:
        """The value each joint is locked at, None for a joint that may move; None if none is locked."""

    @property
    def branch(self) -> str | None:
        """The branch asked for, as `kin.solve_ik` takes it."""

    @property
    def units(self) -> Units:
        """The units angles and lengths are shown in."""

    @property
    def dark(self) -> bool:
        """Whether the page is dark."""

    def post(self, key: Hashable, value: object = None) -> None:
        """Have `Feature.handle` called by the worker; any thread may. The newest value of a key wins."""

    def go(self, q: Array, why: Notice | None = None, at_once: bool = False) -> None:
        """Send the arm to a configuration ``(n,)``, the target following; the status says `why`.

        Eased, unless it is to be there `at_once`: between two configurations easing takes the tool off its target.
        """

    def ask(self, T_base_tool: Array) -> None:
        """Make this pose ``(4, 4)`` the target, as if the gizmo had been put there."""

    def require(self, task: Task) -> None:
        """Ask for this much of the target from now on."""

    def unlock(self, joint: int | None = None) -> None:
        """Unlock a joint; None: all of them."""

    def any_branch(self) -> None:
        """Let any branch take the target."""

    def tell(self, notice: Notice) -> None:
        """Show a notice in the status line."""

    def make_room(self, room: Sequence[Sphere]) -> None:
        """Have the default view show these spheres too, and only these; a view the visitor has chosen stays."""


class Feature:
    """One feature of one visitor. Override what is needed; build controls in ``__init__``.

    Whatever container is open when a feature is made is where its controls go.

    Attributes:
        key: its short name, in messages and in the shared address.
        title: what the visitor reads.
        about: a lesson in a sentence, for who has to choose one.
        due: the worker sleeps at most so many seconds and then calls `tick`; it does so after every other event
            too. None: no ticks.
    """

    key: ClassVar[str]
    title: ClassVar[str]
    about: ClassVar[str] = ""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.due: float | None = None

    def post(self, key: Hashable, value: object = None) -> None:
        """Post to this feature's own `handle`. Give it to controls (`panel.listen`); any thread may call it."""
        self.stage.post(("feature", self.key, key), value)

    def handle(self, key: Hashable, value: object) -> None:
        """Act on what was posted; raises `kin.InputError` for a value that no control of ours sends."""
        raise KeyError(key)

    def on_robot(self) -> None:
        """Another arm is on show. Not called for the first one: that is there when the feature is made."""

    def on_picture(self, T_base_tool: Array) -> None:
        """The picture shows the arm at another ``stage.q``, its tool at this pose ``(4, 4)``."""

    def on_answer(self, result: IKResult) -> None:
        """A target was answered."""

    def on_question(self) -> None:
        """The task, the branch asked for, or what is locked was changed."""

    def on_style(self) -> None:
        """The units, or dark or light, were changed."""

    def tick(self, now: float) -> None:
        """Go on with what takes time, ten milliseconds at most: pictures wait. `now` is `time.perf_counter`'s."""

    def state(self) -> dict[str, object]:
        """What the visitor has set, as JSON: what a shared address restores."""
        return {}

    def restore(self, state: dict[str, object]) -> None:
        """Set what `state` told; what is missing or wrong is left as it is."""

    def on_leave(self) -> None:
        """The visitor has left: let go of what is shared with others. There is no page any more."""

    def remove(self) -> None:
        """Take everything out of scene and panel."""
