"""Arguments of every command, by subject. Imports nothing heavy, so that help and usage errors appear at once."""
