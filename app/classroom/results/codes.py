"""Result codes: what a student has reached, signed by the service, as letters and digits.

A code is in Crockford's base 32, in groups of five: upper and lower case are equal, O is 0, I and L are 1. It has
what it says, eight bytes of a signature (HMAC-SHA256), and a checksum of two bytes (CRC-16). The checksum finds a
mistyped code. One that was changed, or made by another service, has a wrong signature.
"""

from __future__ import annotations

import hashlib
import hmac
import struct
from binascii import crc_hqx
from dataclasses import dataclass
from datetime import date, timedelta
from typing import Literal

from app.classroom.views import in_one_line
from kin import InputError

LETTERS = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
GROUP = 5
MOST_LETTERS = 400
SEARCHED = 120  # letters of the longest code in which a wrong one is looked for
LONGEST_ALIAS, LONGEST_TITLE = 32, 16  # characters
_VERSION = 1
_EPOCH = date(2026, 1, 1)
_HEAD = struct.Struct(">BHBBBB4sB")  # version and kind, day, score, solved, of, tries, fingerprint, bytes of title
_SIGNATURE, _CHECK = 8, 2  # bytes
_SAME = str.maketrans("OIL", "011")
_KINDS: tuple[Literal["exercise", "course"], ...] = ("exercise", "course")


class CodeError(InputError):
    """A text is no result code of this service."""


class MistypedCodeError(CodeError):
    """The checksum is wrong: a letter is wrong, missing, or in another place."""


class ForgedCodeError(CodeError):
    """The checksum is right, but the signature is not: the code was changed, or another service made it."""


@dataclass(frozen=True)
class Outcome:
    """What a code says.

    Attributes:
        kind: of what: an exercise or a course.
        fingerprint: four bytes that tell the exercise or course from others.
        title: its title, cut.
        alias: of the student.
        score: 0 to 100.
        solved, count: how many of its exercises were solved, of how many.
        tries: answers in all, at most 255.
        day: when the code was made.
    """

    kind: Literal["exercise", "course"]
    fingerprint: bytes
    title: str
    alias: str
    score: int
    solved: int
    count: int
    tries: int
    day: date


def clean_alias(text: str) -> str:
    """An alias in one line without control characters; raises `InputError`."""
    kept = in_one_line(text)
    if not 1 <= len(kept) <= LONGEST_ALIAS:
        raise InputError("alias", text, f"1 to {LONGEST_ALIAS} characters")
    return kept


def write_code(outcome: Outcome, key: bytes) -> str:
    """The code of an outcome, in groups."""
    title = outcome.title[:LONGEST_TITLE].encode()
    head = _HEAD.pack(
        _VERSION << 4 | _KINDS.index(outcome.kind),
        (outcome.day - _EPOCH).days,
        outcome.score,
        outcome.solved,
        outcome.count,
        min(outcome.tries, 255),
        outcome.fingerprint,
        len(title),
    )
    body = head + title + clean_alias(outcome.alias).encode()
    signed = body + _signature(body, key)
    return _grouped(_letters(signed + crc_hqx(signed, 0xFFFF).to_bytes(_CHECK)))


def read_code(text: str, key: bytes) -> Outcome:
    """What a code says.

    Raises:
        MistypedCodeError: the checksum is wrong; the message names the group if one wrong letter explains it.
        ForgedCodeError: this service did not sign it.
    """
    letters = _cleaned(text)
    data = _bytes(letters)
    if data is None or not _sound(data):
        raise MistypedCodeError("code", text, _where(letters, key))
    body, signature = data[: -_SIGNATURE - _CHECK], data[-_SIGNATURE - _CHECK : -_CHECK]
    if not hmac.compare_digest(signature, _signature(body, key)):
        raise ForgedCodeError(
            "code",
            text,
            "a code that this service has signed; its checksum is right, so it is not mistyped: "
            "it was changed, or made by another service",
        )
    return _outcome(body)


def _outcome(body: bytes) -> Outcome:
    first, day, score, solved, count, tries, fingerprint, length = _HEAD.unpack_from(body)
    title, alias = body[_HEAD.size : _HEAD.size + length], body[_HEAD.size + length :]
    return Outcome(
        _KINDS[first & 15],
        fingerprint,
        title.decode(),
        alias.decode(),
        score,
        solved,
        count,
        tries,
        _EPOCH + timedelta(days=day),
    )


def _signature(body: bytes, key: bytes) -> bytes:
    return hmac.digest(key, b"kinboard.result:" + body, hashlib.sha256)[:_SIGNATURE]


def _sound(data: bytes) -> bool:
    """Whether the checksum is right, and the rest can be read."""
    if len(data) <= _HEAD.size + _SIGNATURE + _CHECK or data[0] >> 4 != _VERSION or data[0] & 15 >= len(_KINDS):
        return False
    return crc_hqx(data[:-_CHECK], 0xFFFF) == int.from_bytes(data[-_CHECK:])


def _cleaned(text: str) -> str:
    """The letters of a typed code, without what separates groups."""
    if len(text) > MOST_LETTERS:
        raise MistypedCodeError("code", text, f"at most {MOST_LETTERS} characters")
    letters = "".join(x for x in text.upper() if x.isalnum()).translate(_SAME)
    strange = next((x for x in letters if x not in LETTERS), None)
    if not letters or strange is not None:
        what = f"“{strange}” does not occur in codes" if letters else "the text has none"
        raise MistypedCodeError("code", text, f"letters and digits in groups of {GROUP}; {what}")
    return letters


def _letters(data: bytes) -> str:
    count = -(-8 * len(data) // 5)
    number = int.from_bytes(data) << (5 * count - 8 * len(data))
    return "".join(LETTERS[number >> 5 * (count - 1 - i) & 31] for i in range(count))


def _bytes(letters: str) -> bytes | None:
    """None: no bytes have these letters."""
    size, number = 5 * len(letters) // 8, 0
    for letter in letters:
        number = number << 5 | LETTERS.index(letter)
    spare = 5 * len(letters) - 8 * size
    return None if spare >= 5 or number & (1 << spare) - 1 else (number >> spare).to_bytes(size)


def _grouped(letters: str) -> str:
    return "-".join(letters[i : i + GROUP] for i in range(0, len(letters), GROUP))


def _where(letters: str, key: bytes) -> str:
    """What is valid instead of mistyped letters; names the group if one other letter makes the code right."""
    for i, old in enumerate(letters if len(letters) <= SEARCHED else ""):
        for new in LETTERS.replace(old, ""):
            data = _bytes(letters[:i] + new + letters[i + 1 :])
            if data is not None and _sound(data) and _signed(data, key):
                group = i // GROUP
                given = letters[group * GROUP : (group + 1) * GROUP]
                return f"a code without typing errors; group {group + 1}, {given}, has a wrong letter"
    return "a code without typing errors; letters are wrong, missing or exchanged: copy it again"


def _signed(data: bytes, key: bytes) -> bool:
    body = data[: -_SIGNATURE - _CHECK]
    return hmac.compare_digest(data[-_SIGNATURE - _CHECK : -_CHECK], _signature(body, key))
