"""Differential kinematics: what small motions of the joints do to the tool.

The Jacobian of a task and its rank, for any arm and at one configuration, and distances between configurations in
which turns and slides compare; what a closed form knows exactly is in `kin.solvers`.
"""
