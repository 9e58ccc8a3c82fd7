"""An SO-100 or SO-101 beside the arm of a page: the bus of its servos, a simulated one, and a session with both.

It is shown only, until its owner has said *enable*.
"""
