"""Self-motions of arms with seven joints: curves of configurations that meet one target, and how to follow them.

:mod:`kin.solvers.selfmotion.points` has the exact steps: onto a curve, to a value of a joint, to a fold.
:mod:`kin.solvers.selfmotion.tracing` follows curves from such a point, to the first end of a motion or all round.
"""
