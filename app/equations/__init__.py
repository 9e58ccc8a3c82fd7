"""An arm's forward kinematics as equations for people: typeset, evaluated, and compared with the arm itself.

The chapter's two arms have the equations it prints; any other gets a closed form derived from its DH table. Both
doors, REST and the viewer, read them from a `Book`.
"""

from app.equations.books import Book, DerivationError, Equation, Values, book, book_later, check
from app.equations.derive import Line
from app.equations.symbols import Symbol

__all__ = ["Book", "DerivationError", "Equation", "Line", "Symbol", "Values", "book", "book_later", "check"]
