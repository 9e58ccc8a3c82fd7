"""Random configurations inside joint limits, and the tool points they reach: reproducible and compiled."""
