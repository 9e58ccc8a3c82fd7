"""What a page remembers of itself, and what it offers to share: told whenever the visitor rests.

The memory is the page's own: its address, and its tab's storage. The service forgets a visitor who leaves. So it
asks when the page connects, whether for the first time or after a lost connection, and from then on has the page
remember each state in which the visitor pauses. What is remembered is a `PageState` and nothing else.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import Protocol

import kin
from app.exports.snippets import LOCAL, Moment
from app.viewer.feature import Feature, Stage
from app.viewer.panel.lessons import LessonChoice
from app.viewer.panel.share import SharePanel
from app.viewer.panel.status import Notice
from app.viewer.panel.view import ViewState
from app.viewer.scene.camera import VisitorCamera
from app.viewer.session.posture import Posture
from app.viewer.session.state import KEY, PageMemory, PageState, decode, encode, read_memory
from kin.transforms import Array

log = logging.getLogger(__name__)

KEEP_AFTER = 0.5  # seconds of rest before the page is told what to remember
ANSWER_WITHIN = 10.0  # seconds for the page to tell what it remembers; it may still be busy starting


class Page(Stage, Protocol):
    """What is remembered, beside what features may know of it."""

    camera: VisitorCamera
    view: ViewState
    posture: Posture
    lessons: LessonChoice | None
    locks: list[bool]

    @property
    def features(self) -> list[Feature]:
        """The tabs, and the lesson on show."""

    def lock(self, locks: Sequence[bool]) -> None:
        """Have exactly these joints ``(n,)`` locked."""

    def ask_again(self, T_base_tool: Array, q: Array | None) -> None:
        """Ask for a pose ``(4, 4)``, and answer with this configuration ``(n,)`` if it is as near to it."""


class Memory:
    """The memory of one page. For the visitor's worker only.

    Args:
        token: whether programs have to send one.
        guard: runs what may fail; the rest is restored all the same.

    Attributes:
        due: when the visitor will have rested long enough, if nothing more happens (`time.perf_counter`'s); None:
            the page knows everything.
    """

    def __init__(self, page: Page, token: bool, guard: Callable[[Callable[[], None]], None]) -> None:
        self._page = page
        self._token = token
        self._guard = guard
        self._address = LOCAL
        self._kept = ""
        self._share: SharePanel
        self.due: float | None = None

    def recall(self) -> PageState:
        """Ask the page. One that does not answer begins afresh."""
        client = self._page.client
        try:
            memory = read_memory(client.local_storage.get_item(KEY, timeout=ANSWER_WITHIN))
        except (RuntimeError, TimeoutError) as error:  # storage forbidden, page gone, no answer
            log.debug("visitor %s remembers nothing: %s", client.client_id, error)
            memory = PageMemory()
        self._address = memory.address or LOCAL
        return decode(memory.state, self._page.store.robots)

    def restore(self, saved: PageState) -> None:
        """Set what a page that shows the arm lacks; whatever cannot be set is told."""
        page = self._page
        if saved.locks:
            page.lock([i in saved.locks for i in range(page.robot.n)])
        if saved.task not in (None, page.task):
            page.require(saved.task)
        if saved.branch is not None:
            page.posture.choose(saved.branch)
        target, lessons, lesson, camera = saved.target, page.lessons, saved.lesson, saved.camera
        if target is not None:
            self._guard(lambda: page.ask_again(target, saved.q))
        if lessons is not None and lesson is not None:
            self._guard(lambda: lessons.open(lesson))
        for feature in page.features:
            if feature.key in saved.features:
                told = saved.features[feature.key]
                self._guard(lambda feature=feature, told=told: feature.restore(told))  # type: ignore[misc]
        if camera is not None:  # after the lessons, which may aim it too
            self._guard(lambda: page.camera.restore(camera))
        if saved.missing:
            detail = f"There is no robot “{saved.missing}” here."
            page.tell(Notice("error", "The link asks for another robot", detail))

    def begin(self, share: SharePanel) -> None:
        """Take the present state for known; from now on `share` offers what is remembered."""
        self._share = share
        self._kept = encode(self._snapshot())
        self._offer()

    def touch(self, now: float) -> None:
        """The visitor did something: nothing is kept for a while."""
        self.due = now + KEEP_AFTER

    def rested(self, now: float) -> bool:
        """Whether it is time to `keep`; once after each rest."""
        if self.due is None or now < self.due:
            return False
        self.due = None
        return True

    def keep(self) -> None:
        """Have the page remember how it is now; nothing is sent if that is what it remembers."""
        self._page.camera.look()
        text = encode(self._snapshot())
        if text != self._kept:
            self._kept = text
            self._page.client.local_storage.set_item(KEY, text)
            self._offer()
            self._page.client.flush()

    def _snapshot(self) -> PageState:
        page = self._page
        lesson = page.lessons.shown if page.lessons is not None else None
        told = {feature.key: feature.state() for feature in page.features}
        return PageState(
            robot=page.robot.id,
            q=page.goal,
            target=page.target,
            task=page.task,
            branch=page.branch,
            lesson=None if lesson is None else lesson.key,
            units=page.units,
            view=page.view,
            features={key: state for key, state in told.items() if state},
            locks=tuple(i for i, shut in enumerate(page.locks) if shut),
            camera=page.camera.chosen,
        )

    def _offer(self) -> None:
        page = self._page
        target = kin.fk(page.robot, page.goal) if page.target is None else page.target
        moment = Moment(page.robot, page.goal, target, page.task, self._address, self._token)
        self._share.show(f"{self._address}viewer/#s={self._kept}", moment)
