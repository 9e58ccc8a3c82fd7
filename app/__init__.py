"""The service: REST, the viewer, the command line. Installed as the package ``kinboard``.

``import kinboard`` also offers the public names of the core: ``kinboard.fk`` is ``kin.fk``. They are imported when
they are first used: `kinboard --help` needs none of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kin import *  # noqa: F403
    from kin import __version__ as __version__


def __getattr__(name: str) -> object:
    if name in ("__all__", "__version__") or not name.startswith("__"):
        import kin

        if name == "__all__" or name in kin.__all__:
            return getattr(kin, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    import kin

    return sorted({*globals(), *kin.__all__})
