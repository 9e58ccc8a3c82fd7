"""Results that say in sentences what they are."""

from __future__ import annotations

from kin.units import DEFAULT_UNITS, Units


class Explained:
    """A result with sentences about it, which stand for it in a console."""

    __slots__ = ()

    def __repr__(self) -> str:
        """The sentences."""
        return f"{type(self).__name__}({self.reason!r})"

    @property
    def reason(self) -> str:
        """The result in sentences, in degrees and millimetres."""
        return self.explain()

    def explain(self, units: Units = DEFAULT_UNITS) -> str:
        """The result in sentences, in any units."""
        raise NotImplementedError
