"""The lesson "Screws": each joint axis as six numbers, and the tool pose as a product of their exponentials."""
