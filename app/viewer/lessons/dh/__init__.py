"""The lesson "DH table step by step"."""
