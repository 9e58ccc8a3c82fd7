"""One visitor's session: the arm's controller, the page, the worker thread and its inbox, saved state,
what the visitor does, typed values, and undo and redo."""
