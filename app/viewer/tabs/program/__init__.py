"""The tab in which a visitor makes a program of waypoints and plays it."""
