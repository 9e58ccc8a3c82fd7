"""Where numba finds compiled kernels in a container, and where it may keep new ones.

The image brings its kernels compiled, in a folder that belongs to root and on a root filesystem that may be
read-only. numba uses a folder only if it can write to it. So every process gets a folder of its own that begins as
links to what the image brought: nothing is copied, and a kernel that was not foreseen is compiled and kept beside.
Where no folder can be written, kernels are read where they are, and none is kept.

numba is told to come here by ``NUMBA_CACHE_LOCATOR_CLASSES``.
"""

from __future__ import annotations

import atexit
import contextlib
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
        self._own = _links(Path(config.CACHE_DIR))
        if self._own is not None:
            self._cache_path = str(self._own / Path(self._cache_path).name)

    def ensure_cache_path(self) -> None:
        """Raises `OSError` if the folder of links cannot be written. That of the image need not be writable."""
        if self._own is not None:
            super().ensure_cache_path()


@functools.cache
def _links(brought: Path) -> Path | None:
    """A writable folder, gone with the process, whose files are links to those in `brought`, or None."""
    own = _writable_folder()
    if own is None:
        return None
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    for file in brought.glob("*/*"):
        link = own / file.relative_to(brought)
        link.parent.mkdir(exist_ok=True)
        link.symlink_to(file)
    return own


def _writable_folder() -> Path | None:
    for place in (None, "/dev/shm"):  # a read-only root without a /tmp may have shared memory
        with contextlib.suppress(OSError):
            return Path(tempfile.mkdtemp(prefix="kernels-", dir=place))
    return None
