"""Capability maps: from which directions each voxel can be approached."""
