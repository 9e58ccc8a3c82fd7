"""Point clouds of tool positions, computed reproducibly slice by slice."""
