"""*Calibrate by touching* of the tab *Robot*: postures to touch in, what was read in them, the arm found."""
