"""Values that cross on the way: ours to a control, and the visitor's own from it.

The page shows what came last. Where *Home* was pressed before a slider was moved, it may get the angle of home
after that, and the slider would stay elsewhere than its joint. So what may have crossed is sent once more when the
visitor rests. That may cross the visitor's next change, in turn.
"""

from __future__ import annotations

import math
import time
from collections.abc import Hashable, Iterable
from typing import Generic, TypeVar

ON_ITS_WAY = 2.0  # s that a value may take to the page, and the page's own back

K = TypeVar("K", bound=Hashable)


class Crossings(Generic[K]):
    """See the module."""

    def __init__(self) -> None:
        self._sent_at: dict[K, float] = {}
        self._crossed: set[K] = set()

    def sent(self, keys: Iterable[K]) -> None:
        """Values go to these controls now."""
        self._sent_at |= dict.fromkeys(keys, time.perf_counter())

    def heard(self, key: K) -> None:
        """The visitor has changed a control."""
        if time.perf_counter() - self._sent_at.get(key, -math.inf) < ON_ITS_WAY:
            self._crossed.add(key)

    def pop(self) -> set[K]:
        """The controls whose values have to be sent once more, which they are now."""
        found, self._crossed = self._crossed, set()
        self.sent(found)
        return found

    def clear(self) -> None:
        """The controls are removed."""
        self._sent_at.clear()
        self._crossed.clear()
