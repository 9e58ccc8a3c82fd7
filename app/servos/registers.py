"""Registers of Feetech's STS servos: one byte each, or two little-endian.

Feetech, *memory table of the magnetic encoder STS servos*.
"""

from __future__ import annotations

from typing import Final

MODEL: Final = 3
LEAST, MOST = 9, 11  # limits of the goal
HOTTEST: Final = 13  # °C; behind it the highest and the lowest supply, 0.1 V
OFFSET: Final = 31
TORQUE: Final = 40
GOAL, PRESENT = 42, 56
VOLTAGE: Final = 62  # 0.1 V; behind it the temperature, °C
TURN: Final = 4096  # ticks; the encoder begins again after them
BAUD: Final = 1_000_000
