"""The lesson "Equations": each entry of the tool's pose as a formula, its value, and the effect of a misprint."""
