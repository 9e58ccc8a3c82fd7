"""The blocks of a capability map, computed by threads of this process or by the workers of a Dask cluster.

This is a plain map-reduce: each block is a pure function of the grid and its number, and
`kin.workspace.capability_join` accepts blocks in any order. So both ways give the same bits (on one kind of
processor and with one version of Kinboard), and a block whose worker died is simply computed again by another.

Blocks are yielded as they are finished; closing the iterator cancels those that have not begun. The grid contains
the whole arm: a worker needs Kinboard, but not the operator's robot files. Dask sends code as pickles: use only
clusters and networks that you trust.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from functools import partial
from typing import Any

from app.shared.threads import processors
from kin import InputError
from kin.workspace import CapabilityBlock, CapabilityGrid, capability_block

_CONNECT = 10.0  # s to find the scheduler
_WORKER = 60.0  # s to wait for the first worker
_RETRIES = 3  # of a block that failed; a worker's death does not count


def run_local(
    grid: CapabilityGrid, threads: int | None = None, begin: Callable[[], None] | None = None
) -> Generator[CapabilityBlock]:
    """The blocks of a grid as they are finished, computed by threads of this process.

    Args:
        threads: how many; by default one per available processor.
        begin: called by each thread first, for instance to lower its priority.
    """
    pool = ThreadPoolExecutor(threads or processors(), "capability", begin)
    try:
        futures = [pool.submit(capability_block, grid, number) for number in range(len(grid.blocks))]
        for future in as_completed(futures):
            yield future.result()
    finally:
        pool.shutdown(cancel_futures=True)


def run_dask(grid: CapabilityGrid, address: str) -> Iterator[CapabilityBlock]:
    """The blocks of a grid as they are finished by the workers of the Dask scheduler at `address`.

    If a worker dies, the others compute its unfinished blocks. So do workers that join during the run. (Dask gives
    up on a block after four workers have died computing it.)

    Raises:
        InputError: the extra ``cluster`` is not installed, there is no scheduler, no worker, none that has
            Kinboard, a block lost one worker after another, or the scheduler was lost.
    """
    with dask_client(address) as client:
        import distributed as untyped

        distributed: Any = untyped
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


@contextmanager
def dask_client(address: str, field: str = "dask") -> Iterator[Any]:
    """A client of the Dask scheduler at `address` that has a worker, for as long as the context lasts.

    Raises:
        InputError: naming `field`: the extra ``cluster`` is not installed, there is no scheduler or no worker.
    """
    try:
        import distributed as untyped
    except ImportError:
        raise InputError(field, address, "the extra cluster installed: pip install 'kinboard[cluster]'") from None
    distributed: Any = untyped
    running = "the address of a running scheduler, like tcp://host:8786"
    if not re.fullmatch(r"(tcp|tls)://.+:[0-9]+", address):  # a client that cannot read it would linger
        raise InputError(field, address, running)
    try:
        client = distributed.Client(address, timeout=_CONNECT, set_as_default=False)
    except OSError:  # nobody listens, or no answer in time
        raise InputError(field, address, running) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_WORKER)
        except TimeoutError:
            raise InputError(field, address, "a scheduler with at least one worker") from None
        yield client
