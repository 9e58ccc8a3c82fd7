"""Names of nodes: browsers keep the poses of removed nodes, so that none is used twice."""

from __future__ import annotations

from itertools import count

_NUMBERS = count(1)


def new_root() -> str:
    """A prefix of node names that was never used before."""
    return f"/workspace-part-{next(_NUMBERS)}"
