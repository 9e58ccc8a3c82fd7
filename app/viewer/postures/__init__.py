"""The postures of an arm at one target, and translucent copies of the arm in them: for lessons and tabs."""
