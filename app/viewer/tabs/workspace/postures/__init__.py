"""The folder "Postures": a map of how many there are, those of a place in it, and whether an arm is cuspidal."""
