"""One visitor's session: the arm's controller, the page, the worker thread and its inbox, and saved state."""
