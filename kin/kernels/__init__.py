"""Compiled loops: compilation and caching, vectorised trigonometry, forward kinematics, input checks."""
