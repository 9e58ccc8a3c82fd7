"""When the points of a path are passed: time-optimal speed, and smoothing that limits jerk."""
