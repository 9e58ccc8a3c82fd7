"""Erases rooms whose time is over, also if nobody comes any more.

What another program keeps from being erased by reading the database is tried again until it is erased.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator

from starlette.concurrency import run_in_threadpool

from app.classroom import ClassroomUnavailable, Hub
from app.classroom.clock import steady

logger = logging.getLogger("kinboard.classroom")

SWEEP_EVERY = 60.0  # seconds
ERASE_EVERY = 2.0  # seconds, while something that was deleted is not erased
NOT_ERASED = "what was deleted is still in the database's files: another program reads them; it is tried again"
ERASED_AT_LAST = "what was deleted is erased from the database's files"


@contextlib.asynccontextmanager
async def sweeping(hub: Hub) -> AsyncIterator[None]:
    """Erase what is over once a minute, while there is a database; makes none."""
    task = asyncio.create_task(_sweep(hub))
    try:
        yield
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
        await run_in_threadpool(hub.close)


async def _sweep(hub: Hub) -> None:
    swept, waits = steady(), False
    await run_in_threadpool(hub.check)
    while True:
        await asyncio.sleep(min(ERASE_EVERY, SWEEP_EVERY))
        if not hub.in_use:
            continue
        due = steady() - swept >= SWEEP_EVERY
        swept = steady() if due else swept
        try:
            if due:
                await run_in_threadpool(lambda: hub.rooms.sweep())
            erased = not hub.opened or await run_in_threadpool(lambda: hub.rooms.erase())
            if waits == erased:
                logger.warning(ERASED_AT_LAST if erased else NOT_ERASED)
                waits = not erased
        except ClassroomUnavailable:
            continue  # it has been logged, and is tried again
        except Exception:
            logger.exception("rooms whose time is over could not be erased; it is tried again")
