"""Many configurations or targets from a file or standard input, and their answers to a file or standard output."""
