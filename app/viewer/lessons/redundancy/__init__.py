"""The lesson "Redundancy": motions of the arm while the tool stays in place."""
