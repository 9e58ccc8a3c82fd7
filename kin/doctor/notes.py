"""A pad for the findings of the checks, each with the change of the text that mends it."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from kin.doctor.findings import Rank, Symptom, UrdfFinding
from kin.doctor.source import Edit, SourceText
from kin.files.numbers import number_of
from kin.typed import ReadError, read
from kin.units import PLAIN

_LONGEST = 60  # characters of a name or a text in a sentence


class FindingLog:
    """The findings of one text so far."""

    def __init__(self, source: SourceText) -> None:
        self.source = source
        self.findings: list[UrdfFinding] = []
        self.edits: list[tuple[Edit, ...]] = []  # of each finding

    def add(
        self,
        element: Element | None,
        place: str,
        symptom: Symptom,
        rank: Rank,
        text: str,
        mend: str = "",
        *edits: Edit,
        line: int | None = None,
    ) -> None:
        """A finding; with `edits` it is mended by them. Its line is that of the element, if there is one."""
        line = line if element is None else self.source.line(element)
        self.findings.append(UrdfFinding(line, cut(place), symptom, rank, text, mend, bool(edits)))
        self.edits.append(edits)

    def numbers(self, element: Element, place: str, key: str, count: int = 1) -> list[float] | None:
        """The finite numbers of an attribute; None, and a note, if it has not so many; also None without it.

        A decimal comma, commas between numbers, and expressions such as ``-pi/2`` are mended.
        """
        text = element.get(key)
        if text is None:
            return None
        values = [number_of(part) for part in text.split()]
        if len(values) == count and all(abs(value) < float("inf") for value in values):
            return values
        what = "a finite number" if count == 1 else f"{count} finite numbers with blanks between them"
        split = count > 1 and (len(text.split()) != count or text.split()[0].endswith(","))
        mended = text.replace(",", " " if split else ".")
        parts = [number_of(part) for part in mended.split()]
        words = f"{key} is “{cut(text)}”, not {what}."
        clean = " ".join(mended.split())
        if "$" not in text and len(text) <= _LONGEST and not all(abs(value) < float("inf") for value in parts):
            clean, parts = _evaluated(text, count)
        if clean != text and len(parts) == count and all(abs(value) < float("inf") for value in parts):
            edit = self.source.with_attribute(element, key, clean)
            self.add(element, place, "number", "wrong", words, f"Write “{clean}”.", edit)
            return None
        hint = " Expand xacro first." if "$" in text else ""
        self.add(element, place, "number", "wrong", words, f"Write {what}.{hint}")
        return None


def _evaluated(text: str, count: int) -> tuple[str, list[float]]:
    """An attribute with expressions, as numbers; nothing where it has another count of them."""
    try:
        values = [read(part, PLAIN) for part in (text.split() if count > 1 else [text])]
    except ReadError:
        return text, []
    return spelled(*values), values


def cut(text: str) -> str:
    """The beginning of a text of the file, for a sentence: without line breaks and invisible characters."""
    text = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"


def spelled(*values: float) -> str:
    """Numbers as a URDF has them, to be read back exactly."""
    return " ".join(repr(value + 0.0) for value in values)
