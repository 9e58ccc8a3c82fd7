"""Memory of this process: what it holds for answers, and what it gives back to the system."""
