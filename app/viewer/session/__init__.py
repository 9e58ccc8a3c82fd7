"""One visitor: the controller, its worker thread and inbox, and what a link restores."""
