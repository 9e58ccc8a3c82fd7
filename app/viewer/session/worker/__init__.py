"""A visitor's worker and its inbox."""
