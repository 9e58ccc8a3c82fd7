"""Arms over REST: those of this service by id, and arms that are sent along with a request."""
