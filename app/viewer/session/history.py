"""The states of a page to which its visitor can return: undo and redo."""

from __future__ import annotations

from dataclasses import dataclass, replace

from app.viewer.session.state import KEY, KEY_REPLACE, KEY_RETURN, PageState, equal

LIMIT = 100  # steps; older ones are forgotten
# The part of a feature's state that is a result and not a setting: undo neither repeats nor clears it.
RESULT = "drawn"


@dataclass(frozen=True)
class Step:
    """A change: what changed, and the state of the page on its other side."""

    label: str
    state: PageState


class History:
    """The steps that can be undone, oldest first, and those that can be redone, next one last."""

    def __init__(self) -> None:
        self._past: list[Step] = []
        self._future: list[Step] = []
        self._news: set[str] = set()  # since `take_key`

    @property
    def labels(self) -> tuple[str, str]:
        """What would be undone and what would be redone next; empty: nothing."""
        return self._past[-1].label if self._past else "", self._future[-1].label if self._future else ""

    def record(self, label: str, before: PageState) -> None:
        """Add a step that led away from the state `before`; what was undone can no longer be redone."""
        self._past = [*self._past[1 - LIMIT :], Step(label, before)]
        self._future.clear()
        self._news.add(KEY)

    def proceed(self) -> None:
        """The last step goes on."""
        self._news.add(KEY_REPLACE)

    def arrive(self) -> None:
        """Another state of the history is shown."""
        self._news.add(KEY_RETURN)

    def take_key(self) -> str:
        """The key under which the page is stored now, given the events since the last call.

        The browser's history has the same steps as undo. A step that only went on replaces its entry there.
        """
        news, self._news = self._news, set()
        return next((key for key in (KEY_RETURN, KEY, KEY_REPLACE) if key in news), KEY)

    def undo(self, present: PageState) -> Step | None:
        """Go back one step from the present state; None: there is none that changes anything."""
        return _travel(self._past, self._future, present)

    def redo(self, present: PageState) -> Step | None:
        """Go forward one step that was undone."""
        return _travel(self._future, self._past, present)

    def travel(self, wanted: PageState, present: PageState) -> PageState:
        """Go back or forward to a state, or to a new one; returns the state to restore."""
        for source, sink in ((self._past, self._future), (self._future, self._past)):
            if not any(same(step.state, wanted) for step in source):
                continue
            while (step := _travel(source, sink, present)) is not None:
                present = step.state
                if same(present, wanted):
                    return present
        self.record("Browser history", present)
        return wanted


def _travel(source: list[Step], sink: list[Step], present: PageState) -> Step | None:
    while source:
        step = source.pop()
        if same(step.state, present):
            continue
        sink.append(Step(step.label, present))
        return step
    return None


def same(a: PageState, b: PageState) -> bool:
    """Whether two states differ in nothing that undo restores: viewpoints and drawn results do not count."""
    return equal(_settings(a), _settings(b))


def _settings(state: PageState) -> PageState:
    features = {key: without_results(values) for key, values in state.features.items()}
    return replace(state, camera=None, features=features)


def without_results(values: dict[str, object]) -> dict[str, object]:
    """A feature's state without the entries that say whether something is drawn."""
    return {
        key: without_results(value) if isinstance(value, dict) else value
        for key, value in values.items()
        if key != RESULT
    }
