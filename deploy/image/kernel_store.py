"""Where numba finds compiled kernels in a container, and where it may keep new ones.

The image brings its kernels compiled, in a folder that belongs to root and on a root filesystem that may be
read-only. numba uses a folder only if it can write to it. So every process gets a folder of its own that begins as
links to what the image brought: nothing is copied, and a kernel that was not foreseen is compiled and kept beside.

numba is told to come here by ``NUMBA_CACHE_LOCATOR_CLASSES``.
"""

from __future__ import annotations

import atexit
import functools
import shutil
import tempfile
from pathlib import Path
from types import FunctionType

from numba.core import config
from numba.core.caching import UserProvidedCacheLocator


class LinkedCacheLocator(UserProvidedCacheLocator):
    """numba's own ``NUMBA_CACHE_DIR``, seen through this process's folder of links."""

    def __init__(self, py_func: FunctionType, py_file: str) -> None:
        super().__init__(py_func, py_file)
        self._cache_path = str(_links(Path(config.CACHE_DIR)) / Path(self._cache_path).name)


@functools.cache
def _links(brought: Path) -> Path:
    """A writable folder, gone with the process, whose files are links to those in `brought`."""
    own = _writable_folder()
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    for file in brought.glob("*/*"):
        link = own / file.relative_to(brought)
        link.parent.mkdir(exist_ok=True)
        link.symlink_to(file)
    return own


def _writable_folder() -> Path:
    try:
        return Path(tempfile.mkdtemp(prefix="kernels-"))
    except OSError:  # a read-only root without a /tmp; shared memory is always there
        return Path(tempfile.mkdtemp(prefix="kernels-", dir="/dev/shm"))
