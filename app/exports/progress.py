"""A progress bar on standard error, by tqdm."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

INTERVAL = 0.1  # s between two updates of the bar


@contextmanager
def progress_bar(total: int, unit: str, show: bool) -> Iterator[Callable[[int], object]]:
    """A bar for as long as the context lasts; call what it yields with the number of units that are newly done.

    Args:
        total: how many units there are.
        unit: what is counted, such as "points"; large numbers are shown in thousands and millions of it.
        show: if false, nothing is shown.
    """
    if not show:
        yield lambda _: None
        return
    from tqdm import tqdm  # no command needs it without a terminal

    with tqdm(total=total, unit=f" {unit}", unit_scale=True, mininterval=INTERVAL, file=sys.stderr) as bar:
        yield bar.update


@contextmanager
def percent_bar(show: bool) -> Iterator[Callable[[float], None]]:
    """The same for work that says which share of it is done."""
    done = 0
    with progress_bar(100, "%", show) as advance:

        def progress(share: float) -> None:
            nonlocal done
            advance(int(100 * share) - done)
            done = int(100 * share)

        yield progress
