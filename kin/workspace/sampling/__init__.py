"""Random configurations inside joint limits, and the tool points they reach: reproducible and compiled."""

from kin.kernels.plain import stand_in

stand_in()
