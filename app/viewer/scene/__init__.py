"""The 3-D scene: the arm's meshes, easing, the gizmo and the camera."""
