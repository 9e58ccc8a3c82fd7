"""The search for the picture of the basins, in slices whenever the worker is idle."""

from __future__ import annotations

from collections.abc import Iterator

from app.viewer.lessons.numeric import basins
from app.viewer.lessons.numeric.basins import Basins
from kin.differential.iteration import Problem, Settings


class Picture:
    """One picture at a time.

    Attributes:
        found: the picture, when it is complete.
    """

    def __init__(self) -> None:
        self.found: Basins | None = None
        self._key: tuple[Problem, Settings] | None = None
        self._search: Iterator[Basins | None] | None = None

    def use(self, problem: Problem | None, settings: Settings) -> None:
        """Search for the basins of this target and these settings; None: there is nothing to show."""
        key = None if problem is None else (problem, settings)
        if key != self._key:
            self._key, self.found = key, None
            self._search = None if key is None else basins.search(*key)

    def work(self) -> bool:
        """Continue the search; whether it went on."""
        if self._search is None:
            return False
        self.found = next(self._search)
        if self.found is not None:
            self._search = None
        return True
