"""Values that cross on the way: ours to a control of viser's, and the visitor's own from it.

The page shows what came last. Where *Home* was pressed before a slider was moved, the angle of home may come to
the slider after that, and the slider would stay elsewhere than its joint. So a question follows the values that
are sent. What the visitor has changed is heard before the page's answer if it may have crossed them. That is sent
once more, when a whole question and answer have passed without another change: the visitor no longer moves the
control. However slow the line is, in the end both sides show the same.

While a slider is held, the page shows no other value in it than the visitor's (``static/viser_page.js``). So what
it shows is also sent once more when it is released.
"""

from __future__ import annotations

import contextlib
import threading
import time
import weakref
from collections.abc import Callable, Hashable, Iterable
from typing import Final, Generic, TypeVar

import viser

from app.viewer.panel import assign
from app.viewer.viser_patches import show_value

QUESTION: Final = "kinboard"  # a key of the browser's storage that is never set: any answer will do
ANSWER_WITHIN: Final = 30.0  # s; a page in the background does not answer
HELD_BACK: Final = 0.06  # s for which viser may hold back the change of a control, and a bit more

K = TypeVar("K", bound=Hashable)


def wait_for_page(client: viser.ClientHandle) -> None:
    """Wait until the page has all that has been sent to it.

    A missing answer (page gone, asleep, or without storage) counts as one, or nothing would ever go on.
    """
    # viser warns of a question to a page that has gone.
    with contextlib.suppress(TimeoutError, RuntimeError, UserWarning):
        client.local_storage.get_item(QUESTION, timeout=ANSWER_WITHIN)


class Fence:
    """The questions of one page. Its worker uses it.

    Args:
        answered: is called from another thread when a question is answered; `passed` has to be called then.

    Attributes:
        asked, last: the numbers of the last question, and of the last one that was answered.
    """

    def __init__(self, client: viser.ClientHandle, answered: Callable[[], None]) -> None:
        self._client, self._answered = client, answered
        self.asked = self.last = 0
        self._wanted = False
        self._controls = weakref.WeakSet[Crossings[Hashable]]()

    @property
    def next(self) -> int:
        """The number of the first question that follows what is sent now, which will be asked."""
        self._wanted = True
        return self.asked + 1

    def join(self, controls: Crossings[Hashable]) -> None:
        """Have these controls shown again where that is needed."""
        self._controls.add(controls)

    def released(self) -> None:
        """The visitor has released a control."""
        for controls in list(self._controls):
            controls.released()

    def ask(self) -> None:
        """Ask, if something was sent since the last question and that one is answered."""
        if not self._wanted or self.asked != self.last:
            return
        try:
            threading.Thread(target=self._ask, name="fence", daemon=True).start()
        except RuntimeError:  # the machine has no thread left; a later step asks
            return
        self._wanted, self.asked = False, self.asked + 1

    def _ask(self) -> None:
        wait_for_page(self._client)
        time.sleep(HELD_BACK)  # in the page, a change of before the answer may still be held back
        wait_for_page(self._client)
        self._answered()

    def passed(self) -> None:
        """The question is answered."""
        self.last = self.asked
        for controls in list(self._controls):
            controls.show_again()


class Crossings(Generic[K]):
    """Controls whose values may cross.

    Args:
        show: shows the value of a control once more.
    """

    def __init__(self, fence: Fence, show: Callable[[K], None]) -> None:
        self._fence, self._show = fence, show
        self._sent: dict[K, int] = {}  # the question that followed the last value of each
        self._crossed: dict[K, int] = {}  # the question that has to pass before each is shown again
        self._moved: set[K] = set()  # by the visitor, and not released
        fence.join(self)  # type: ignore[arg-type]

    def sent(self, keys: Iterable[K]) -> None:
        """Values go to these controls now."""
        self._sent |= dict.fromkeys(keys, self._fence.next)

    def heard(self, key: K) -> None:
        """The visitor has changed a control."""
        self._moved.add(key)
        if key in self._crossed or self._sent.get(key, 0) > self._fence.last:
            self._crossed[key] = self._fence.next

    def released(self) -> None:
        """The visitor holds none of them any more."""
        while self._moved:
            self._crossed[self._moved.pop()] = self._fence.next

    def show_again(self) -> None:
        """Show what may have crossed and rests by now."""
        found = [key for key, number in self._crossed.items() if number <= self._fence.last]
        for key in found:
            del self._crossed[key]
            self._show(key)
            self.sent([key])

    def clear(self) -> None:
        """The controls are removed."""
        self._sent.clear()
        self._crossed.clear()
        self._moved.clear()


class SliderCrossings(Crossings[K]):
    """Sliders whose values may cross.

    Args:
        slider: the slider of a key.
    """

    def __init__(self, fence: Fence, slider: Callable[[K], viser.GuiSliderHandle[float]]) -> None:
        super().__init__(fence, self._show_again)
        self._slider = slider
        self._meant: dict[K, float] = {}  # what each slider is to show, also while it is held

    def set(self, key: K, value: float, held: bool = False) -> None:
        """Set a slider; one that the visitor holds shows the value when it is released."""
        self._meant[key] = value
        slider = self._slider(key)
        if not held and value != slider.value:
            assign(slider, value)
            self.sent([key])

    def clear(self) -> None:
        """The sliders are removed."""
        super().clear()
        self._meant.clear()

    def _show_again(self, key: K) -> None:
        slider = self._slider(key)
        show_value(slider, self._meant.get(key, slider.value), again=True)
