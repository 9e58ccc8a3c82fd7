"""A doctor for URDFs: what is read, what is left out and why, what is suspicious, and how it is mended."""
