"""The blocks of a capability map, computed by threads of this process or by the workers of a Dask cluster.

Map and reduce in the plainest sense: each block is a pure function of the grid and its number, and
`kin.capability_join` does not mind in which order blocks come. Hence both ways give the same bits (on one kind of
processor and with one version of Kinboard), and a block whose worker died is simply computed again by another.

Blocks are handed out as they are finished; closing the iterator cancels those that have not begun. The grid
carries the whole arm: a worker needs Kinboard, but not the operator's robot files. Dask sends code as pickles: use
no cluster and no network that you do not trust.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import partial
from typing import Any

from kin import CapabilityBlock, CapabilityGrid, InputError, capability_block

_CONNECT = 10.0  # s to find the scheduler
_WORKER = 60.0  # s for the first worker to show up
_RETRIES = 3  # of a block that failed; one whose worker died is not counted here


def run_local(
    grid: CapabilityGrid, threads: int | None = None, begin: Callable[[], None] | None = None
) -> Generator[CapabilityBlock]:
    """The blocks of a grid as they are finished, by so many threads, or as many as there are processors.

    Each thread calls `begin` first, which may lower its priority.
    """
    pool = ThreadPoolExecutor(threads or _processors(), thread_name_prefix="capability", initializer=begin)
    try:
        futures = [pool.submit(capability_block, grid, number) for number in range(len(grid.blocks))]
        for future in as_completed(futures):
            yield future.result()
    finally:
        pool.shutdown(cancel_futures=True)


def run_dask(grid: CapabilityGrid, address: str) -> Iterator[CapabilityBlock]:
    """The blocks of a grid as they are finished by the workers of the Dask scheduler at `address`.

    A worker that dies takes nothing along: what it had not delivered is computed by the others, or by those that
    join while the run lasts. (Dask gives up on a block that was being computed on four workers that died.)

    Raises:
        InputError: the extra ``cluster`` is not installed, there is no scheduler, no worker, none that has
            Kinboard, a block lost one worker after another, or the scheduler was lost.
    """
    try:
        import distributed as untyped
    except ImportError:
        raise InputError("dask", address, "the extra cluster installed: pip install 'kinboard[cluster]'") from None
    distributed: Any = untyped
    running = "the address of a running scheduler, like tcp://host:8786"
    if not re.fullmatch(r"(tcp|tls)://.+:\d+", address):  # a client that cannot read it would linger
        raise InputError("dask", address, running)
    try:
        client = distributed.Client(address, timeout=_CONNECT, set_as_default=False)
    except OSError:  # nobody listens, or no answer in time
        raise InputError("dask", address, running) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_WORKER)
        except TimeoutError:
            raise InputError("dask", address, "a scheduler with at least one worker") from None
        futures = client.map(
            partial(capability_block, grid), range(len(grid.blocks)), pure=False, retries=_RETRIES
        )
        try:
            for _, block in distributed.as_completed(futures, loop=client.loop, with_results=True):
                if not isinstance(block, CapabilityBlock):  # without a scheduler every block is "cancelled"
                    raise InputError("dask", address, f"a scheduler that stays alive ({block!r})")
                yield block
        except (ModuleNotFoundError, distributed.KilledWorker) as error:
            raise InputError("dask", address, f"workers that have Kinboard and stay alive ({error})") from None
        finally:
            client.cancel(futures)


def _processors() -> int:
    """How many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on Linux
        return os.cpu_count() or 1
