"""The HTTP edge: static pages, access control, observation, path prefix and viewer proxy."""
