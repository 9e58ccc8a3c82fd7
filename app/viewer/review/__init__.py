"""What was missed is asked again: in the tab *Learn*, and in the check at the end of lessons and courses."""
