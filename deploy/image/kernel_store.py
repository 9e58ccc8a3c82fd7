"""numba's cache folder in a container.

The image contains compiled kernels in a folder that belongs to root and may be on a read-only filesystem, but
numba uses a cache folder only if it can write to it. Each process therefore gets its own writable folder with
links to the kernels of the image: nothing is copied, and further kernels are compiled into it.

``NUMBA_CACHE_LOCATOR_CLASSES`` names the class below.
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
    """Replaces ``NUMBA_CACHE_DIR`` by the folder of links of this process."""

    def __init__(self, py_func: FunctionType, py_file: str) -> None:
        super().__init__(py_func, py_file)
        self._cache_path = str(_links(Path(config.CACHE_DIR)) / Path(self._cache_path).name)


@functools.cache
def _links(compiled: Path) -> Path:
    """A writable folder of links to the files in `compiled`; deleted when the process ends."""
    own = _writable_folder()
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    for file in compiled.glob("*/*"):
        link = own / file.relative_to(compiled)
        link.parent.mkdir(exist_ok=True)
        link.symlink_to(file)
    return own


def _writable_folder() -> Path:
    try:
        return Path(tempfile.mkdtemp(prefix="kernels-"))
    except OSError:  # a read-only root without /tmp; shared memory is always available
        return Path(tempfile.mkdtemp(prefix="kernels-", dir="/dev/shm"))
