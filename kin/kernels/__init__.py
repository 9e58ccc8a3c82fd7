"""Kernels: how they are called and loaded, vectorised trigonometry, kinematics, small matrices, input checks."""
