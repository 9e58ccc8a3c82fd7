"""The running service: application, start-up, and processes that compute and compile."""
