"""The lesson "Trajectories": profiles and their boundary conditions, joints against tool, singularities, jerk."""
