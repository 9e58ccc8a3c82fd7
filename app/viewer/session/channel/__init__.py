"""What a page's own scripts and its session send each other, beside viser's connection: messages and files."""
