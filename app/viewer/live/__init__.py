"""A program that is connected to a page: the code of the page, what it draws, the arm that it measures."""
