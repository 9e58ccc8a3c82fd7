"""Erases rooms whose time is over, also if nobody comes any more."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator

from starlette.concurrency import run_in_threadpool

from app.classroom import ClassroomUnavailable, Hub

logger = logging.getLogger("kinboard.classroom")

SWEEP_EVERY = 60.0  # seconds


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
    while True:
        await asyncio.sleep(SWEEP_EVERY)
        if hub.in_use:
            try:
                await run_in_threadpool(lambda: hub.rooms.sweep())
            except ClassroomUnavailable:
                continue  # it has been logged, and is tried again
            except Exception:
                logger.exception("rooms whose time is over could not be erased; it is tried again")
