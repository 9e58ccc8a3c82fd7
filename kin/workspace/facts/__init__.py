"""Sizes of a workspace: bounding box, reach, holes, volume and surface."""
