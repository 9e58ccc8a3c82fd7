"""Courses in the tab Learn: chosen, followed, edited, shared; result codes made and checked."""
