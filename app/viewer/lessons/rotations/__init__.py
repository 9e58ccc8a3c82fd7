"""The lesson "Rotations and frames": one rotation in all its forms, and a chain of frames that students build."""
