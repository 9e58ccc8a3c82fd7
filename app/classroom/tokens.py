"""Join codes, and the signed tokens of teachers and students.

A token is the id of a room, and of a seat if it is a student's, signed with a key that the database keeps: every
process of every machine can check it. The teacher's link holds a token; a browser keeps one in the cookie
`COOKIE`, after the room's code and a dot. By the code, a proxy sends all pages of a room to one of several
containers; it is not signed, and means nothing to us.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets

from itsdangerous import BadSignature, URLSafeSerializer

from app.classroom.views import Ticket

COOKIE = "kinboard_room"
# Without what looks alike: 0 O, 1 I L, 2 Z, 5 S, 8 B, U V.
LETTERS = "ACDEFGHJKMNPQRTWXY34679"
CODE_LENGTH = 8  # 23**8 = 78 billion
_CODE_GROUP = 4
LONGEST_TOKEN = 300
OPENERS = 1000  # numbers for those who open rooms


def new_code() -> str:
    """A random join code."""
    return "".join(secrets.choice(LETTERS) for _ in range(CODE_LENGTH))


def read_code(text: str) -> str:
    """A join code as it is stored, from what a person typed."""
    return "".join(text.split()).replace("-", "").upper()


def show_code(code: str) -> str:
    """A join code in groups, easier to copy."""
    return "-".join(filter(None, (code[:_CODE_GROUP], code[_CODE_GROUP:])))


class Tokens:
    """Signs and reads tokens.

    Args:
        key: from the database.
    """

    def __init__(self, key: str) -> None:
        self._key = key
        self._serializer = self.serializer("ticket")

    def serializer(self, purpose: str) -> URLSafeSerializer:
        """Signs other data; what was signed for one purpose counts for no other."""
        return URLSafeSerializer(
            self._key, salt=f"kinboard.classroom.{purpose}", signer_kwargs={"digest_method": hashlib.sha256}
        )

    def bucket(self, client: str) -> int:
        """A number from 1 that equal clients share: too small to tell which one it was."""
        text = f"kinboard.classroom.opener:{client}"
        return 1 + int.from_bytes(hmac.digest(self._key.encode(), text.encode(), "sha256")[:2]) % OPENERS

    def secret(self, ticket: Ticket) -> bytes:
        """A secret of a seat: the same in all processes, and never sent to anybody."""
        text = f"kinboard.classroom.secret:{ticket.room}:{ticket.seat}"
        return hmac.digest(self._key.encode(), text.encode(), "sha256")

    def sign(self, ticket: Ticket) -> str:
        """The token of a ticket."""
        return str(self._serializer.dumps([ticket.room, ticket.seat]))

    def cookie(self, ticket: Ticket, code: str) -> str:
        """What a browser keeps of a ticket for the room with this code."""
        return f"{code}.{self.sign(ticket)}"

    def read(self, token: str) -> Ticket | None:
        """The ticket of a token or a cookie; None if we did not sign it."""
        if not token or len(token) > LONGEST_TOKEN:
            return None
        try:
            room, seat = self._serializer.loads(".".join(token.split(".")[-2:]))
        except (BadSignature, ValueError, TypeError):
            return None
        return Ticket(str(room), str(seat))
