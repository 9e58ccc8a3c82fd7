"""How the segments of a program are planned: their paths, where the arm stops, and their times."""
