"""The running service: application, start-up, and the processes that compute."""
