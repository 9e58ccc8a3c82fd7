"""Why a text is no well-formed XML, in words, and the text without the fault if only one thing can be meant."""

from __future__ import annotations

import codecs
import re
from typing import NamedTuple
from xml.etree.ElementTree import Element

from kin.errors import RobotFileError, shorten
from kin.files.urdf.xml import MAX_BYTES, MalformedXmlError, TagPosition, parse_xml

_FAULTS = 4  # that one text has: an encoding, a header, ampersands, and a last look
LFS = "version https://git-lfs.github.com/spec/"
_HEADER = re.compile(r"<\?xml\s[^>]{0,200}\?>[ \t]*\r?\n?")
_MARKER = re.compile(r"^(?:<{7}|>{7}) .*$", re.MULTILINE)
_ROOT = re.compile(r"<(robot|mujoco)\b")
# An ampersand that begins no reference, outside of CDATA, comments and processing instructions. One that is not
# closed goes to the end of the text, which so is passed once.
_AMPERSAND = re.compile(
    r"<!\[CDATA\[.*?(?:\]\]>|\Z)|<!--.*?(?:-->|\Z)|<\?.*?(?:\?>|\Z)|(&)(?!#?\w{1,60};)", re.DOTALL
)


class Cause(NamedTuple):
    """What is wrong with a text.

    Attributes:
        line: where, from 1.
        what, expected: in words, as `kin.RobotFileError` has them.
        mended: the same text without it; None where several things may be meant.
    """

    line: int
    what: str
    expected: str
    mended: str | None = None


_DECLARED = re.compile(r"""(<\?xml\b[^>]*?\bencoding\s*=\s*)(["'])([\w.:-]+)\2""")
_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
_UTF8 = Cause(1, "bytes that are no UTF-8", "UTF-8, or the encoding that the file declares")


def decoded(content: bytes, file: str) -> tuple[str, tuple[Cause, ...]]:
    """The text of a file in the encoding that it declares, and why it is read in another one.

    What should be UTF-8 and is not is read as Latin-1, in which every byte is a character: only names and
    comments depend on it.

    Raises:
        RobotFileError: an encoding that does not exist, or in which the file is not written.
    """
    encoding = next((name for mark, name in _MARKS if content.startswith(mark)), "")
    if not encoding:
        declared = _DECLARED.search(content[:200].decode("ascii", "replace"))
        encoding = declared[3] if declared else "utf-8"
    try:
        return content.decode(encoding), ()
    except (LookupError, UnicodeError) as error:
        if encoding.lower() in ("utf-8", "utf8"):
            line = content.count(b"\n", 0, error.start) + 1 if isinstance(error, UnicodeDecodeError) else 1
            text = content.decode("latin-1")
            return text, (_UTF8._replace(line=line, mended=with_utf8(text)),)
        expected = "XML in UTF-8, or in the encoding that it declares"
        raise RobotFileError(file, "file", str(error), expected) from None


def with_utf8(text: str) -> str:
    """The same text, which declares UTF-8 if it declares an encoding."""
    return _DECLARED.sub(r'\1"utf-8"', text, count=1)


def parse_mended(
    source: bytes | str, file: str, places: dict[Element, TagPosition] | None = None
) -> tuple[Element, str | None, tuple[Cause, ...]]:
    """The root element of a text, which is mended where only one thing can be meant.

    Returns:
        The root; the mended text, None if nothing was wrong; and the causes that were mended.

    Raises:
        RobotFileError: with the cause, where several things may be meant or none is known.
    """
    try:
        return parse_xml(source, file, places), None, ()
    except MalformedXmlError as error:
        if isinstance(source, str):
            text, causes = source, []
        else:
            text, known = decoded(source, file)
            causes = list(known)
        failed: RobotFileError = error
    for _ in range(_FAULTS):
        if causes and places is not None:
            places.clear()
        if causes:
            try:
                return parse_xml(text, file, places), text, tuple(causes)
            except MalformedXmlError as error:
                failed = error
        cause = cause_of(text)
        if cause is None:
            break
        if cause.mended is None or len(cause.mended) > MAX_BYTES:
            raise RobotFileError(file, "file", cause.what, cause.expected) from None
        causes.append(cause)
        text = cause.mended
    raise failed


def cause_of(text: str) -> Cause | None:
    """The cause that a text shows by itself; None if none of the known ones."""
    if text.lstrip("\ufeff").startswith(LFS):
        what = "a pointer of Git LFS, which stands for the file"
        return Cause(1, what, "the file itself: `git lfs pull` fetches it")
    if not text.strip("\ufeff \t\r\n"):
        return Cause(1, "nothing: the file is empty", "a URDF or MJCF file")
    if marker := _MARKER.search(text):
        what = f"a conflict marker of Git, {marker[0][:7]}, in line {_line(text, marker.start())}"
        return Cause(
            _line(text, marker.start()), what, "a file in which the conflict is resolved: one of both versions"
        )
    header = _HEADER.search(text)
    begins = text.lstrip("\ufeff \t\r\n")
    if not begins.startswith("<") and header is None:
        what = f"no XML: it begins with {shorten(begins[:40])}"
        return Cause(1, what, "a URDF or MJCF file itself, not an archive, a list or the answer of a web site")
    if header and text[: header.start()].strip("\ufeff"):
        line = _line(text, header.start())
        what = f"<?xml …?> in line {line}, with something before it"
        mended = header[0].rstrip() + "\n" + text[: header.start()].lstrip("\ufeff") + text[header.end() :]
        return Cause(line, what, "<?xml …?> as the first characters of the file, or none", mended)
    plain = next((match for match in _AMPERSAND.finditer(text) if match[1]), None)
    if plain:
        line = _line(text, plain.start())
        mended = _AMPERSAND.sub(lambda match: "&amp;" if match[1] else match[0], text)
        return Cause(line, f"an ampersand in line {line} that stands for itself", "&amp; in its place", mended)
    opened = _ROOT.search(text)
    if opened and f"</{opened[1]}" not in text:
        line = _line(text, len(text.rstrip()))
        return Cause(line, f"an end in line {line} before </{opened[1]}>", "the whole file: this one breaks off")
    return None


def _line(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1
