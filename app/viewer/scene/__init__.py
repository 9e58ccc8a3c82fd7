"""The 3-D scene of one visitor: arm, gizmo and camera."""
