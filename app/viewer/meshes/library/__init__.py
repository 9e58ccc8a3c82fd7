"""Detailed bodies of built-in arms, from installed packages of robot descriptions."""
