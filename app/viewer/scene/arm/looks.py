"""How an arm is drawn of which there is a body."""

from __future__ import annotations

from typing import Literal

Look = Literal["body", "skeleton", "both"]
AxesShown = bool | Literal["every"]  # of skeletons or of none, or of every arm
