"""The classroom in the page."""
