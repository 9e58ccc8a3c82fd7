"""Where the files of the pages are."""

from __future__ import annotations

from pathlib import Path


def static_folder() -> Path:
    """The folder of static files: next to the package in a checkout, inside it when installed."""
    package = Path(__file__).parents[1]
    installed = package / "_static"
    return installed if installed.is_dir() else package.parent / "static"
