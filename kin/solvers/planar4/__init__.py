"""Planar arms with four parallel revolute axes: a pose leaves the direction φ of the third link free.

Seen along the axes, the target fixes the last axis and the sum ψ of the joint angles. Three links lead to the last
axis, so their last direction φ is the redundancy parameter: the other two links close a triangle, with the elbow
left or right, and θ4 = ψ − φ. The φ that reach and limits allow are exact arcs (:mod:`kin.solvers.planar`).

As for :mod:`kin.solvers.scara4`, only rotations about the axes are reachable; for any other orientation, ψ is the
nearest angle and the tool's point is kept, but for its height.
"""

from kin.solvers.planar4.closed_form import Planar4 as Planar4
from kin.solvers.planar4.closed_form import match as match
