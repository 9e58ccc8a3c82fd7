"""The text of a URDF with the place of each element, and changes that leave everything else as it is written."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple
from xml.etree.ElementTree import Element
from xml.sax.saxutils import quoteattr

from kin.files.urdf.causes import parse_mended, with_utf8
from kin.files.urdf.xml import TagPosition

_ATTRIBUTE = re.compile(rb"\s+([^\s=<>/]+)\s*=\s*(\"[^\"]*\"|'[^']*')")
_TAG = re.compile(rb"<[^\s<>/]+")


class Edit(NamedTuple):
    """Bytes of the text that others take the place of."""

    start: int
    end: int
    new: bytes


class SourceText:
    """A URDF as it is written.

    Args:
        text: of the file.
        file: its name, for messages.

    Raises:
        RobotFileError: no well-formed XML, or beyond the limits of `parse_xml`.

    Attributes:
        root: the root element.
        causes: why it was no well-formed XML, if only one thing can be meant; edits begin from the mended text.
    """

    def __init__(self, text: str, file: str) -> None:
        self._places: dict[Element, TagPosition] = {}
        self.root, mended, self.causes = parse_mended(text, file, self._places)
        self._bytes = (text if mended is None else mended).encode("utf-8", "replace")

    def unchanged(self) -> Edit:
        """The text as it is parsed, which mends the causes."""
        return Edit(0, 0, b"")

    def line(self, element: Element) -> int:
        """The line of an element, from 1."""
        return self._places[element].line

    def with_attribute(self, element: Element, key: str, value: str) -> Edit:
        """An attribute with another value; it is added if there is none."""
        start = self._places[element].start
        tag = _TAG.match(self._bytes, start)
        assert tag is not None
        at = tag.end()
        while match := _ATTRIBUTE.match(self._bytes, at):
            if match[1].decode("utf-8", "replace") == key:
                return Edit(*match.span(2), quoteattr(value).encode())
            at = match.end()
        return Edit(at, at, f" {key}={quoteattr(value)}".encode())

    def without(self, element: Element) -> Edit:
        """No such element, nor the blanks before it."""
        place = self._places[element]
        before = self._bytes[: place.start].rstrip(b" \t")
        alone = before.endswith(b"\n") and self._bytes[place.end : place.end + 1] in (b"\n", b"\r")
        return Edit(len(before) - alone if alone else place.start, place.end, b"")

    def with_child(self, parent: Element, child: str) -> Edit:
        """One more child, as XML, before its other children."""
        place = self._places[parent]
        at = place.start
        tag = _TAG.match(self._bytes, at)
        assert tag is not None
        at = tag.end()
        while match := _ATTRIBUTE.match(self._bytes, at):
            at = match.end()
        rest = self._bytes[at : place.end]
        close = rest.index(b">") + 1
        if b"/" in rest[:close]:  # a tag without children
            return Edit(at, at + close, f">{child}</{parent.tag}>".encode())
        return Edit(at + close, at + close, child.encode())

    def changed(self, edits: Iterable[Edit]) -> str:
        """The text with these changes, declared as UTF-8. What is inside a removed element is not changed."""
        parts, at = [], 0
        for edit in sorted(edits, key=lambda edit: (edit.start, -edit.end)):
            if edit.start < at:
                continue
            parts += [self._bytes[at : edit.start], edit.new]
            at = edit.end
        text = b"".join([*parts, self._bytes[at:]]).decode("utf-8")
        return with_utf8(text)
