"""Processes that compute for REST beside the process of the service."""
