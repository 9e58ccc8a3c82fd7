"""The compiled kernels of this tree, for copies of its core, which are no checkouts that compile their own."""

from pathlib import Path

from kin.kernels import ahead


def lend_kernels(core: Path) -> None:
    """Let the copy of the core in a folder call them."""
    kernels = ahead._file()
    if not (core / kernels.name).exists():
        (core / kernels.name).symlink_to(kernels)
