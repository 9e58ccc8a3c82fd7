"""*Compare with…*: whether the table on show is another arm, drawn over each other, and what was mistyped."""
