"""A safe XML parser: no DOCTYPE, no entities, bounded size, depth and number of elements."""

from __future__ import annotations

from typing import NamedTuple
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from kin.errors import RobotFileError

MAX_BYTES = 1_000_000
MAX_DEPTH = 64
MAX_ELEMENTS = 100_000


class MalformedXmlError(RobotFileError):
    """A text is no well-formed XML."""


class TagPosition(NamedTuple):
    """Where an element is in a text.

    Attributes:
        line: of its start tag, from 1.
        start, end: bytes of its start tag, and of the end of its end tag or of a tag that is both.
    """

    line: int
    start: int
    end: int


def parse_xml(text: bytes | str, file: str, places: dict[Element, TagPosition] | None = None) -> Element:
    """The root element; raises `RobotFileError`. A `str` is decoded already, whatever encoding it declares.

    Args:
        places: gets the place of each element, in the text as UTF-8.
    """
    encoding = None
    if isinstance(text, str):
        text, encoding = text.encode("utf-8", "replace"), "utf-8"
    if len(text) > MAX_BYTES:
        raise RobotFileError(file, "file", f"{len(text)} bytes", f"at most {MAX_BYTES} bytes")
    builder = TreeBuilder()
    parser = expat.ParserCreate(encoding)
    count = depth = 0
    begun: list[tuple[Element, int, int]] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count, depth
        count, depth = count + 1, depth + 1
        if count > MAX_ELEMENTS:
            raise RobotFileError(file, "file", f"more than {MAX_ELEMENTS} elements", "fewer elements")
        if depth > MAX_DEPTH:
            raise RobotFileError(file, f"<{tag}>", f"nested more than {MAX_DEPTH} deep", "less nesting")
        element = builder.start(tag, attributes)
        if places is not None:
            begun.append((element, parser.CurrentLineNumber, parser.CurrentByteIndex))

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)
        if places is not None:
            element, line, first = begun.pop()
            last = parser.CurrentByteIndex  # of an end tag its beginning, else the end of the only tag
            if text[last : last + 2] == b"</":
                last = text.index(b">", last) + 1
            places[element] = TagPosition(line, first, last)

    def doctype(name: str, *_: object) -> None:
        page = "; this is a web page: the button Raw leads to the file itself" if name.lower() == "html" else ""
        raise RobotFileError(file, "DOCTYPE", name, f"a file without DOCTYPE and entities{page}")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise MalformedXmlError(file, "file", str(error), "well-formed XML") from None
    except (LookupError, ValueError) as error:  # an unknown encoding
        if isinstance(error, RobotFileError):
            raise
        raise RobotFileError(file, "file", str(error), "XML in UTF-8") from None
    return builder.close()
