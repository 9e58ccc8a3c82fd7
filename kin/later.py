"""Sequences whose elements are computed when something asks for them.

What is slow to compute and seldom needed, such as capsules around the bodies of a URDF, is handed on as a `Later`:
it behaves as the tuple that it becomes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar, overload

T = TypeVar("T")


class Later(Sequence[T]):
    """A tuple with at least one element, computed at the first use of its elements or its length.

    Args:
        compute: gives the elements, and is then forgotten. Threads that ask at the same time each call it, so it
            has to give the same ones.
    """

    def __init__(self, compute: Callable[[], Iterable[T]]) -> None:
        self._compute: Callable[[], Iterable[T]] | None = compute
        self._found: tuple[T, ...] = ()

    @property
    def _elements(self) -> tuple[T, ...]:
        compute = self._compute
        if compute is not None:
            self._found = tuple(compute())
            self._compute = None  # after the elements are there for other threads
        return self._found

    def __bool__(self) -> bool:
        """True, without computing anything: there is at least one element."""
        return True

    def __len__(self) -> int:
        """How many elements there are."""
        return len(self._elements)

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[T, ...]: ...
    def __getitem__(self, index: int | slice) -> T | tuple[T, ...]:
        """As of a tuple."""
        return self._elements[index]

    def __eq__(self, other: object) -> bool:
        """Whether the other one is a tuple, or a `Later`, with equal elements."""
        if isinstance(other, Later):
            return self is other or self._elements == other._elements
        return self._elements == other if isinstance(other, tuple) else NotImplemented

    def __hash__(self) -> int:
        """That of the tuple."""
        return hash(self._elements)

    def __repr__(self) -> str:
        """That of the tuple."""
        return repr(self._elements)

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy or a pickle is the tuple itself."""
        return tuple, (self._elements,)
