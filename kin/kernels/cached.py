"""Which kernels the disk cache has; apart from `compile`, whose text all machine code depends on."""

from __future__ import annotations

import os
from typing import Any

from kin.kernels import compile as compiling


def is_cached(kernel: Any) -> bool:
    """Whether the cache has machine code of a kernel as its text is today; True without a cache to write to."""
    cache = getattr(kernel, "_cache", None)
    if isinstance(cache, compiling.LaterCache):
        cache = cache.opened
    if not isinstance(cache, compiling._Cache) or not os.access(cache.cache_path, os.W_OK):
        return True
    file: Any = cache._cache_file
    try:
        return bool(file._load_index())
    except Exception:  # noqa: BLE001 - unpickling a damaged file may raise anything, and it is compiled again
        return False
