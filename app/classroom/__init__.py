"""The classroom: rooms, courses, results. It knows neither viser nor FastAPI."""
