"""Differential kinematics: what small motions of the joints do to the tool.

Everything here follows from the Jacobian of a task and its singular values: rank and null space, and motions
that keep the tool in place. The answers are for any arm and hold at one configuration; what a closed form knows
exactly is in `kin.solvers`.
"""
