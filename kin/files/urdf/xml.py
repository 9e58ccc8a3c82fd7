"""A safe XML parser: no DOCTYPE, no entities, bounded size, depth and number of elements."""

from __future__ import annotations

from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from kin.errors import RobotFileError

MAX_BYTES = 1_000_000
MAX_DEPTH = 64
MAX_ELEMENTS = 100_000


def parse_xml(text: bytes | str, file: str) -> Element:
    """The root element; raises `RobotFileError`. A `str` is decoded already, whatever encoding it declares."""
    encoding = None
    if isinstance(text, str):
        text, encoding = text.encode("utf-8", "replace"), "utf-8"
    if len(text) > MAX_BYTES:
        raise RobotFileError(file, "file", f"{len(text)} bytes", f"at most {MAX_BYTES} bytes")
    builder = TreeBuilder()
    parser = expat.ParserCreate(encoding)
    count = depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count, depth
        count, depth = count + 1, depth + 1
        if count > MAX_ELEMENTS:
            raise RobotFileError(file, "file", f"more than {MAX_ELEMENTS} elements", "fewer elements")
        if depth > MAX_DEPTH:
            raise RobotFileError(file, f"<{tag}>", f"nested more than {MAX_DEPTH} deep", "less nesting")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def doctype(name: str, *_: object) -> None:
        raise RobotFileError(file, "DOCTYPE", name, "a file without DOCTYPE and entities")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise RobotFileError(file, "file", str(error), "well-formed XML") from None
    except (LookupError, ValueError) as error:  # an unknown encoding
        if isinstance(error, RobotFileError):
            raise
        raise RobotFileError(file, "file", str(error), "XML in UTF-8") from None
    return builder.close()
