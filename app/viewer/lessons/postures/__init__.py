"""The lesson "Postures": all ways to reach a target, and the reason if there is none."""
