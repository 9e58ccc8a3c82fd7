"""Saving and restoring the state of a page, and the links and code that the page offers to share.

The state is stored in the browser: in the page's URL and in the storage of its tab. The service keeps nothing of a
visitor who leaves. When a page connects, for the first time or after a lost connection, the service reads the
stored state; from then on it stores the state at each pause of the visitor, or after a second without one.
Whatever is opened is stored at once. What is stored is a `PageState`.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Hashable, Mapping, Sequence
from concurrent.futures import CancelledError
from dataclasses import replace

from app.exports.snippets import Moment
from app.viewer.lessons.guide.feature import Guide
from app.viewer.panel.share import SharePanel
from app.viewer.panel.status import Notice
from app.viewer.session.history import same
from app.viewer.session.lessons import lesson_with_key
from app.viewer.session.parts import Page
from app.viewer.session.state import (
    KEY_LAST,
    KEY_REPLACE,
    KEY_RETURN,
    PageState,
    StoredPage,
    opened_with,
    read_stored_page,
    write,
)
from app.viewer.shown import SHOWN

log = logging.getLogger(__name__)

SAVE_AFTER = 0.5  # seconds of rest before the state is saved; without a rest, at most twice that
ANSWER_WITHIN = 10.0  # seconds for the page to send its stored state; it may still be starting


class Persistence:
    """Saves and restores one page. Not thread-safe: the visitor's worker calls it.

    Args:
        guard: runs an action that may fail; the rest is restored in any case.

    Attributes:
        stored: what `load` has read.
        system_dark: whether the visitor's system was dark when the page was opened.
        text_size: name of the text size with which it was opened.
        embedded: how the page is embedded, as `StoredPage.embedded`.
        shown: key of an arm that a notebook moves, or what `app.live.reserved` takes; empty: there is none.
        due: when the state is to be saved if nothing more happens (`time.perf_counter`'s); None: it is saved.
        led: whether another page leads this one, which adds no entries to the browser's history then.
    """

    def __init__(self, page: Page, guard: Callable[[Callable[[], None]], None]) -> None:
        self._page = page
        self._guard = guard
        self.stored = PageState()
        self.system_dark = False
        self.text_size = "Normal"
        self.embedded = self.shown = ""
        self._left_out: tuple[str, ...] = ()  # of the saved state
        self._state = PageState()
        self._opened: Hashable = None  # of the saved state, as `LessonChoice.opened`
        self._share: SharePanel
        self.due: float | None = None
        self._since: float | None = None  # when the first act was that is not saved
        self.led = False

    def load(self) -> None:
        """Read the stored state from the browser, and wait for it. A page that does not answer starts fresh."""
        try:
            stored = read_stored_page(self._page.channel.hello(ANSWER_WITHIN))
        except (CancelledError, TimeoutError):  # page gone, no answer
            log.debug("visitor %s has no stored state", self._page.client.client_id)
            stored = StoredPage()
        if stored.address:
            self._page.links.service = replace(self._page.links.service, address=stored.address)
        self.system_dark, self.text_size, self.embedded = stored.dark, stored.text_size, stored.embedded
        self._page.activity.review.zone = stored.zone
        if stored.shown:
            self.shown = stored.shown
            SHOWN.join(stored.shown, self._page.post)
        saved = opened_with(stored, self._page.services.store.robots)
        if self._page.rights.compute:
            self.stored = saved
            return
        lesson = lesson_with_key(saved.lesson)
        shown = None if lesson is None or lesson.computes else lesson.key
        self.stored = replace(saved, target=None, lesson=shown, features={})

    def restore(self, saved: PageState) -> None:
        """Apply the rest of a state to a page that shows its robot; what cannot be applied is reported."""
        page = self._page
        page.arm.use_obstacles(saved.obstacles)
        if saved.locks:
            page.arm.set_locks([i in saved.locks for i in range(page.arm.robot.n)])
        if saved.task not in (None, page.arm.task):
            page.arm.set_task(saved.task)
        if saved.branch is not None:
            page.arm.set_branch(saved.branch)
        target, lesson, camera = saved.target, saved.lesson, saved.camera
        if target is not None:
            self._guard(lambda: page.arm.restore_target(target, saved.q))
        if lesson is not None:
            self._guard(lambda: page.lessons.open(lesson, saved.features.get(Guide.key)))
        for feature in page.features:
            if feature.key in saved.features:
                state = saved.features[feature.key]
                self._guard(lambda feature=feature, state=state: feature.restore(state))  # type: ignore[misc]
        bare = saved.q is None and not saved.features.keys() & {lesson, "guide"}
        if lesson is not None and (bare or page.lessons.misplaced) and self._page.rights.compute:
            self._guard(page.lessons.begin)  # such a link leaves arm and drawing to the step
        if camera is not None:  # after the lessons, which may move it too
            self._guard(lambda: page.camera.restore(camera))
        elif page.arm.target is not None:  # it may be far out of reach
            page.picture.keep_in_view(page.arm.target[:3, 3])
        notice = link_notice(saved)
        if notice is not None:
            page.status.show(notice)

    def begin(self, share: SharePanel) -> str:
        """Take the present state as saved, and return it; from now on `share` offers the saved state."""
        self._share = share
        self._state = self.snapshot()
        self._page.links.saved, self._opened = self._written(self._state), self._page.lessons.opened
        self._update_share()
        return self._page.links.saved

    def postpone(self, now: float) -> bool:
        """The visitor did something: wait for the next rest. Returns whether to `save` before it."""
        self.due = now + SAVE_AFTER
        if self._since is None:
            self._since = now
        return now - self._since >= SAVE_AFTER

    @property
    def urgent(self) -> bool:
        """Whether something else is open than in the saved state, or it has come further."""
        return self._page.lessons.opened != self._opened

    def rested(self, now: float) -> bool:
        """Whether it is time to `save`; True once after each rest."""
        if self.due is None or now < self.due:
            return False
        self.due = None
        return True

    def save(self, key: str) -> None:
        """Store the present state in the browser, unless it is stored already.

        Args:
            key: where to, as `History.take_key`; another viewpoint alone always replaces the present entry, and so
                does every state of a visitor who may only look: that page cannot go back.
        """
        self._since = None
        self._page.camera.look()
        state = self.snapshot()
        text, self._opened = self._written(state), self._page.lessons.opened
        if text != self._page.links.saved:
            stays = key != KEY_RETURN and same(state, self._state)
            replaces = self.led or stays or not self._page.rights.compute
            self._page.links.saved, self._state = text, state
            self._page.channel.notify(KEY_REPLACE if replaces else key, text)
            if state.lesson is not None and not self._page.activity.practice.seated:
                self._page.channel.notify(KEY_LAST, text)
            self._update_share()
            self._page.client.flush()

    def _written(self, state: PageState) -> str:
        """The text of a state; the page says when there is no room for something."""
        text, left_out = write(state)
        if left_out != self._left_out:
            self._left_out = left_out
            if left_out:
                self._page.status.show(too_long(left_out, {one.key: one.title for one in self._page.features}))
        return text

    def snapshot(self) -> PageState:
        """The present state."""
        page = self._page
        states = {feature.key: feature.state() for feature in page.features}
        return PageState(
            robot=page.arm.robot.id,
            own=page.robots.own,
            frames=page.display.frames,
            obstacles=page.arm.obstacles,
            q=page.arm.goal,
            target=page.arm.open_target,
            task=page.arm.task,
            branch=page.arm.branch,
            lesson=page.activity.lesson,
            units=page.display.units,
            view=page.view,
            features={key: state for key, state in states.items() if state},
            locks=tuple(i for i, lock in enumerate(page.arm.locks) if lock),
            camera=page.camera.chosen,
        )

    def _update_share(self) -> None:
        page, arm = self._page, self._page.arm.now
        own = page.robots.own is not None and page.robots.own.robot == arm.robot
        moment = Moment(
            arm.robot,
            arm.goal,
            arm.aim,
            arm.task,
            page.links.service.address,
            page.links.service.token,
            own,
            arm.obstacles,
            page.view.avoid,
        )
        self._share.show(page.links.page, moment, "table" in page.activity.withheld)


def too_long(left_out: Sequence[str], titles: Mapping[str, str]) -> Notice:
    """What the address of a page and a reload leave out.

    Args:
        titles: of features, by key.
    """
    names = ", ".join(titles.get(key, key).lower() for key in left_out)
    detail = (
        f"The address of this page has no room for: {names}. A link or a reload leaves that out. "
        "Save it as a file, or make it shorter."
    )
    return Notice("error", "Too long for a link", detail)


def link_notice(saved: PageState) -> Notice | None:
    """What could not be read in a link; None: everything was."""
    if saved.unreadable:
        detail = "It is incomplete, or another version made it. The page starts from the beginning."
        return Notice("error", "The link cannot be read", detail)
    if saved.refused:
        return Notice("error", "The arm of the link cannot be used", saved.refused)
    if saved.missing:
        return Notice("error", "The link needs another robot", f"This service has no robot “{saved.missing}”.")
    if saved.ignored:
        detail = f"Ignored, because it does not fit this robot: {', '.join(saved.ignored)}."
        return Notice("error", "Part of the link cannot be used", detail)
    return None
