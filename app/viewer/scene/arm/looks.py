"""How an arm is drawn of which there is a body."""

from __future__ import annotations

from typing import Literal

Look = Literal["body", "skeleton", "both"]
