"""The capability map: from which directions each place can be approached, as coloured voxels in the picture."""
