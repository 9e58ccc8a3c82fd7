"""Shows the state of another member's page in this one, live: only what has changed.

A teacher who drags sends up to twenty states a second. Of these, only the configuration and the target change,
which costs this page as much as a drag of its own without the solving. The rest is what a link restores.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from app.viewer.activity.activity import AUTHOR, EXERCISES, REVIEW
from app.viewer.feature import Feature
from app.viewer.lessons.guide.feature import Guide
from app.viewer.own_arm import OwnArm
from app.viewer.room.member_page import MemberPage
from app.viewer.session.history import without_results
from app.viewer.session.state import PageState, decode
from kin import Obstacle, Robot
from kin.transforms import Array

SAME_VIEW = 1e-3  # tolerance of viewpoints, metres
OWN = (EXERCISES, REVIEW, AUTHOR)  # what is everybody's own


@lru_cache(maxsize=128)
def _decoded(text: str, robots: tuple[Robot, ...]) -> PageState:
    """A state in a text; all pages of a process that show it share one object."""
    return decode(text, robots)


def decoded(text: str, robots: Sequence[Robot]) -> PageState:
    """The state in a text, as far as it is valid for these robots."""
    return _decoded(text, tuple(robots))


def shared(state: PageState, features: Iterable[Feature]) -> PageState:
    """What followers see of the leader's page, which has these features.

    The draft of an exercise has its answer, and what the leader has missed is nobody's business.
    """
    open_here = state.lesson if state.lesson not in (AUTHOR, REVIEW) else None
    names = {feature.key for feature in features if feature.shared or feature.key == open_here}
    return replace(state, features={key: value for key, value in state.features.items() if key in names})


class Follower:
    """Lets one page show the states of another. Not thread-safe: the page's worker calls it.

    Args:
        compute: whether lessons and other features are shown too, which may compute.

    Attributes:
        began: when the present leader began to lead (`time.perf_counter`).
        moving: whether the target has moved since it was last solved here.
        moved_at: when it did last.
        turned: whether the visitor has moved the camera since; then the other's viewpoint is not shown.
    """

    def __init__(self, page: MemberPage, compute: bool) -> None:
        self._page = page
        self._compute = compute
        self._text = ""
        self._shown: PageState | None = None
        self._aimed: Array | None = None
        self._obstacles: tuple[Obstacle, ...] | None = None  # those of who was followed last
        self._own_obstacles: tuple[Obstacle, ...] = ()
        self.moving = self.turned = False
        self.began = self.moved_at = 0.0

    def begin(self) -> None:
        """The next state is shown whole, with its viewpoint."""
        self._text, self._shown, self.moving, self.turned = "", None, False, False
        self.began = time.perf_counter()

    def settle(self) -> None:
        """The other arm rests: solve its target here too, so that this page's words and numbers are about it."""
        state, self.moving = self._shown, False
        if self._compute and state is not None and state.target is not None:
            self._page.arm.restore_target(state.target, state.q)

    def show(self, text: str) -> None:
        """Show a packed state; a text that is not a state changes nothing."""
        if text == self._text:
            return
        self._text = text
        state = decoded(text, self._page.services.store.robots)
        if state.unreadable or state.refused or state.q is None or state.robot is None:
            return
        last, self._shown = self._shown, state
        if self._page.arm.obstacles != self._obstacles:
            self._own_obstacles = self._page.arm.obstacles
        self._obstacles = state.obstacles
        self._page.arm.use_obstacles(state.obstacles)
        if last is None or _differs(last, state, "robot", "own", "task", "branch", "locks"):
            self._page.adopt(replace(state, own=self._own(state)))
        elif not np.array_equal(state.q, self._page.arm.goal) or not _equal(state.target, last.target):
            self._page.arm.follow(state.q, state.target)
            self.moving, self.moved_at = True, time.perf_counter()
        if state.target is None and (last is None or last.target is not None):
            self._page.status.show(self._page.status.ready)  # what it said was about another target
        if self._compute:
            self._show_view(state)
            self._show_lesson(last, state)
        self._show_camera(last, state)

    def drop_obstacles(self) -> None:
        """Return to the visitor's own obstacles, unless the visitor has changed those that were shown."""
        if self._page.arm.obstacles == self._obstacles:
            self._page.arm.use_obstacles(self._own_obstacles)

    def _own(self, state: PageState) -> OwnArm | None:
        """The leader's own arm if it is on show; otherwise the visitor's stays."""
        return state.own if state.own is not None and state.own.robot.id == state.robot else self._page.robots.own

    def _show_view(self, state: PageState) -> None:
        page = self._page
        own = page.view
        view = replace(state.view, dark=own.dark, detailed=own.detailed, language=own.language)
        if view != page.view:
            page.looks.use_view(view)
        if state.frames != page.display.frames:
            page.display.use_frames(state.frames)

    def _show_lesson(self, last: PageState | None, state: PageState) -> None:
        """Open the leader's lesson, and show the states of what the leader sees. Exercises are everybody's own."""
        page = self._page
        lesson = None if state.lesson in OWN else state.lesson
        before = None if last is None or last.lesson in OWN else last.lesson
        if lesson != before:
            page.guard(lambda: page.lessons.open(lesson, state.features.get(Guide.key)))
        for feature in page.features:
            if feature.key != lesson and not feature.shared:
                continue
            wanted = without_results(state.features.get(feature.key, {}))
            had = {} if last is None else without_results(last.features.get(feature.key, {}))
            if wanted != had:
                page.guard(lambda feature=feature, wanted=wanted: feature.restore(wanted))  # type: ignore[misc]

    def _show_camera(self, last: PageState | None, state: PageState) -> None:
        camera = self._page.camera
        camera.look()
        if last is not None and not self.turned:
            self.turned = not _close(camera.chosen, self._aimed)
        if self.turned or (last is not None and _equal(state.camera, last.camera)):
            return
        self._aimed = state.camera
        if state.camera is not None:
            camera.restore(state.camera)
        elif camera.chosen is not None:
            camera.aim(self._page.arm.scene.body, glide=True)


def _differs(a: PageState, b: PageState, *names: str) -> bool:
    return any(getattr(a, name) != getattr(b, name) for name in names)


def _equal(a: Array | None, b: Array | None) -> bool:
    return (a is None) == (b is None) and (a is None or b is None or np.array_equal(a, b))


def _close(a: Array | None, b: Array | None) -> bool:
    return (a is None) == (b is None) and (a is None or b is None or bool(np.allclose(a, b, atol=SAME_VIEW)))
