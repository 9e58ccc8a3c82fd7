"""Planar sections through a workspace and their boundary curves."""
