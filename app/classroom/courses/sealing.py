"""Seals the exercises that a course brings along: what a browser keeps of them can be read by the service alone.

A text is packed and joined with a stream of SHAKE-256, which begins at a digest of the text itself (Rogaway and
Shrimpton, *Deterministic authenticated encryption*, 2006): the same text always gets the same seal, so saving a
page does not change its state. A seal that was changed, or made elsewhere, does not open.
"""

from __future__ import annotations

import hashlib
import hmac
import zlib
from base64 import urlsafe_b64decode, urlsafe_b64encode
from binascii import Error
from collections.abc import Callable

from kin import InputError

TAG = 16  # bytes
LONGEST = 16_000  # bytes of an opened text


class Seal:
    """Seals and opens texts. `secret` is the service's; it raises `KinematicsError` if there is none."""

    def __init__(self, secret: Callable[[], bytes]) -> None:
        self._secret = secret
        self._known: dict[str, str] = {}  # so that a page is saved while the secret is away

    def close(self, text: str) -> str:
        """The text, sealed: letters, digits, ``-`` and ``_``; raises `KinematicsError` without a secret."""
        if text not in self._known:
            data = zlib.compress(text.encode(), 9)
            tag = self._tag(data)
            self._known[text] = urlsafe_b64encode(tag + self._joined(data, tag)).decode().rstrip("=")
        return self._known[text]

    def open(self, sealed: str) -> str:
        """The text.

        Raises:
            InputError: this service has not sealed it.
            KinematicsError: it has no secret.
        """
        refused = InputError("seal", sealed, "an exercise that this service has sealed; elsewhere, open the file")
        try:
            raw = urlsafe_b64decode(sealed.encode("ascii") + b"=" * (-len(sealed) % 4))
        except (Error, ValueError):
            raise refused from None
        tag, data = raw[:TAG], self._joined(raw[TAG:], raw[:TAG])
        if len(tag) < TAG or not hmac.compare_digest(tag, self._tag(data)):
            raise refused
        return zlib.decompressobj().decompress(data, LONGEST).decode()

    def _key(self, purpose: bytes) -> bytes:
        return hmac.digest(self._secret(), b"kinboard.seal " + purpose, "sha256")

    def _tag(self, data: bytes) -> bytes:
        return hmac.digest(self._key(b"tag"), data, "sha256")[:TAG]

    def _joined(self, data: bytes, tag: bytes) -> bytes:
        stream = hashlib.shake_256(self._key(b"stream") + tag).digest(len(data))
        return bytes(a ^ b for a, b in zip(data, stream, strict=True))
