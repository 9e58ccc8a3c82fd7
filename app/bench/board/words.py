"""Figures of a run as text."""

from __future__ import annotations

_UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


def time_text(seconds: float) -> str:
    """Three digits and a unit."""
    for scale, unit in _UNITS:
        if seconds >= scale * 0.9995:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def ratio_text(ratio: float) -> str:
    """Two digits, and all digits of large ratios."""
    if ratio >= 100.0:
        return f"{float(f'{ratio:.2g}'):,.0f} ×".replace(",", "\N{NARROW NO-BREAK SPACE}")
    return f"{ratio:.2g} ×"


def share_text(share: float | None) -> str:
    """Per cent; nothing where there is no such share. Only a whole share is 100 %."""
    if share is None:
        return ""
    return f"{min(share * 100.0, 99.9 if share < 1.0 else 100.0):.3g} %"
