"""Links to a page, and the address of the service, as the visitor's browser has it."""

from __future__ import annotations

from collections.abc import Callable

from app.exports.snippets import LOCAL, Service


class Links:
    """The links of one page.

    Args:
        token: whether programs must send an access token.
        encode: the text of a state with nothing but these states of features, at a lesson.

    Attributes:
        service: where this page has come from, for code that asks the service.
        saved: the text of the state that was saved last.
    """

    def __init__(self, token: bool, encode: Callable[[dict[str, dict[str, object]], str], str]) -> None:
        self._encode = encode
        self.service = Service(LOCAL, token)
        self.saved = ""

    @property
    def page(self) -> str:
        """A link to the page as it was last saved."""
        return self._link(self.saved)

    def to(self, features: dict[str, dict[str, object]], lesson: str) -> str:
        """A link to a page with nothing but these states of features, at this lesson."""
        return self._link(self._encode(features, lesson))

    def _link(self, state: str) -> str:
        return f"{self.service.address}viewer/#s={state}"
