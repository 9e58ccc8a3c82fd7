"""The lesson "Numeric IK": iterations from a start to a target, watched one by one."""
