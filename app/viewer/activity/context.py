"""Where exercises are done: a course, or a seat in a room. A secret of the service makes their numbers."""

from __future__ import annotations

import hmac
from dataclasses import dataclass

LABEL = 12  # letters
_PROOF = 20  # letters
_SEED = 6  # bytes: also exact as a number of JSON


@dataclass(frozen=True)
class ExerciseContext:
    """One place.

    Attributes:
        name: tells it from others.
        key: a secret of the service.
        seat: whether it is a student's seat in a room; otherwise it is a course.
    """

    name: str
    key: bytes
    seat: bool = False

    @property
    def label(self) -> str:
        """Names the place in the page's state."""
        return self._digest("label").hex()[:LABEL]

    def seed(self, *parts: object) -> int:
        """The seed of numbers, of any parts without a colon."""
        return int.from_bytes(self._digest("seed", *parts)[:_SEED])

    def proof(self, claim: str) -> str:
        """Shows later that this service has made a text in this place."""
        return self._digest("proof", claim).hex()[:_PROOF]

    def has_proven(self, claim: str, proof: object) -> bool:
        """Whether a proof is that of a text."""
        return isinstance(proof, str) and hmac.compare_digest(proof.encode(), self.proof(claim).encode())

    def _digest(self, *parts: object) -> bytes:
        text = ":".join(map(str, ("kinboard.place", self.name, *parts)))
        return hmac.digest(self.key, text.encode(errors="surrogatepass"), "sha256")
