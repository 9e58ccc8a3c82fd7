"""Workspaces and arms as files and text: cloud formats, pictures, hulls, code snippets."""
