"""What the parts of the workspace tab say: texts in the form, which the tab shows when they have changed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Said:
    """See the module.

    Attributes:
        line, percent: progress of the cloud.
        buttons: what can be done with the cloud.
        legend: the meaning of its colours.
    """

    line: str = ""
    percent: float = 0.0
    buttons: tuple[str, ...] = ("Start",)
    legend: str = ""
