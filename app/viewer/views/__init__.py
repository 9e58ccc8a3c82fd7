"""HTML of the panel."""
