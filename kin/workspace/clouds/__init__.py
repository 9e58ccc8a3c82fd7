"""Point clouds of tool positions, drawn reproducibly slice by slice."""
