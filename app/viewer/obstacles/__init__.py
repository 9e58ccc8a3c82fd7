"""Obstacles that a visitor places around the arm: kept in the page and its link, drawn, dragged, and judged."""
