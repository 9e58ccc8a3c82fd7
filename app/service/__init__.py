"""The running service: application, start-up and worker processes."""
