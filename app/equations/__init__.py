"""Forward kinematics of an arm as equations: typeset, evaluated, and compared with the DH product.

The two arms of the chapter have its printed equations; any other arm gets a closed form derived from its DH table.
REST and the viewer read them from a `Book`.
"""

from app.equations.books import (
    Book,
    DerivationError,
    NotDerivedError,
    Values,
    book,
    book_later,
    check,
)
from app.equations.compare import Compared, compared, gram, suspects
from app.equations.derive import Line
from app.equations.equation import Equation
from app.equations.symbols import Symbol

__all__ = [
    "Book",
    "Compared",
    "DerivationError",
    "Equation",
    "Line",
    "NotDerivedError",
    "Symbol",
    "Values",
    "book",
    "book_later",
    "check",
    "compared",
    "gram",
    "suspects",
]
