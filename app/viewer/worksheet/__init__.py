"""Worksheets of the tab *Learn*: the lesson on show, or the arm alone, for print and as files."""
