"""The report about the URDF that was opened last: what is wrong in it, line by line, and the file mended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from app.shared.answers.examination import TITLES, outcome
from app.viewer.meshes.archive import MB, Archive, MeshError
from app.viewer.tabs.robot.files import Source, is_mjcf, is_urdf
from app.viewer.views.templates import render
from kin import InputError, RobotFileError
from kin.doctor import UrdfExamination, examine_urdf
from kin.doctor.findings import RANKS, Symptom, UrdfFinding
from kin.doctor.meshes import extent_of
from kin.transforms import Array

MOST_LISTED = 40  # findings of one rank
MOST_MEASURED = 60 * MB  # of meshes whose size is looked at
MOST_OF_TEXT = 2 * MB  # of a mesh that is text, which takes longer


class MeshesSent:
    """The meshes of a zip, as `kin.doctor.examine_urdf` takes them; the size of a few is looked at."""

    def __init__(self, archive: Archive, urdf: str) -> None:
        self._archive, self._urdf, self._left = archive, urdf, MOST_MEASURED
        self._known: dict[str, Array | None] = {}

    def extent(self, path: str) -> Array | None:
        """The sides of a mesh, None if they are not looked at; raises `LookupError` with the reason."""
        try:
            name = self._archive.find(path, self._urdf)
            if name in self._known:
                return self._known[name]
            if self._left <= 0:
                return None
            data = self._archive.read(name)
        except MeshError as error:
            raise LookupError(f"{error.value}; what helps is {error.expected}") from None
        self._left -= len(data)
        is_text = name.lower().endswith(".obj") or np.frombuffer(data[:200], np.uint8).max(initial=0) < 128
        found = None if is_text and len(data) > MOST_OF_TEXT else extent_of(name, data)
        self._known[name] = found
        return found

    def elsewhere(self, path: str) -> str | None:
        """None: a file of the same name anywhere in the zip is found already."""
        return None


_Key = tuple[str, Symptom, str]


def _key(each: UrdfFinding) -> _Key:
    """What a finding is known by after other mends."""
    return each.place, each.symptom, each.text


class Doctor:
    """The report of one page.

    Each finding that needs no decision is mended, unless the visitor has left it as it is.

    Attributes:
        found: about the URDF that was opened last; None if there is none, or it was closed.
    """

    def __init__(self) -> None:
        self.found: UrdfExamination | None = None
        self._source: Source | None = None
        self._tip: str | None = None
        self._left: set[_Key] = set()

    def look(self, source: Source, tip: str | None = None) -> None:
        """Examine a file; one that is no URDF has none. The same one, mended in part, keeps what was left."""
        left = self._left if self.found is not None and self.found.file == (source.urdf or source.name) else set()
        self.close()
        if not is_urdf(source.text) or is_mjcf(source.text):
            return
        self._source, self._tip = source, tip
        try:
            self.found = self._examined(None)
        except RobotFileError:
            self.close()  # opening the file reports it
            return
        self._left = left & {_key(each) for each in self.found.findings if each.automatic}
        if self._left:
            self._examine()

    def _examined(self, mends: list[int] | None) -> UrdfExamination:
        source = self._source
        assert source is not None
        meshes = None if source.archive is None else MeshesSent(source.archive, source.urdf)
        return examine_urdf(source.text, tip=self._tip, file=source.urdf or source.name, files=meshes, mends=mends)

    def _examine(self) -> None:
        """Mend what is not left."""
        assert self.found is not None
        several = enumerate(self.found.findings)
        chosen = [i for i, each in several if each.automatic and _key(each) not in self._left]
        self.found = self._examined(chosen if self._left else None)

    def choose(self, what: str) -> None:
        """Mend all, none, or one more or less.

        Args:
            what: ``"all"``, ``"none"`` or the index of a finding.

        Raises:
            InputError: neither, or a finding that cannot be mended.
        """
        findings = () if self.found is None else self.found.findings
        possible = {str(i): _key(each) for i, each in enumerate(findings) if each.automatic}
        if what == "all":
            self._left = set()
        elif what == "none":
            self._left = set(possible.values())
        elif what in possible:
            self._left ^= {possible[what]}
        else:
            raise InputError("mended", what, ", ".join(["save, open, close, all, none", *possible]))
        if possible:
            self._examine()

    def close(self) -> None:
        """Forget the report."""
        self.found = self._source = self._tip = None
        self._left = set()

    @property
    def mended(self) -> Source:
        """The file mended; raises `InputError` if nothing in it can be."""
        if self.found is None or self.found.mended is None or self._source is None:
            raise InputError("mended", None, "a URDF that was opened and can be mended")
        return replace(self._source, text=self.found.mended, tips=())

    @property
    def file_name(self) -> str:
        """The name of the mended file."""
        name = "" if self.found is None else self.found.file.rpartition("/")[2]
        return f"{name.removesuffix('.urdf').removesuffix('.xml') or 'robot'}-mended.urdf"

    def html(self) -> str:
        """The report; empty if there is none."""
        found = self.found
        if found is None:
            return ""
        groups = []
        for rank in RANKS:
            several = [(i, each) for i, each in enumerate(found.findings) if each.rank == rank]
            if several:
                more = max(0, len(several) - MOST_LISTED)
                groups.append(
                    {"rank": rank, "title": TITLES[rank], "findings": several[:MOST_LISTED], "more": more}
                )
        wrong, suspicious = found.count("wrong"), found.count("suspicious")
        colour, symbol = ("kb-green", "✓") if not wrong + suspicious else ("kb-amber", "!")
        if found.refusal:
            colour, symbol = "kb-vermilion", "✕"
        return render(
            "robot/doctor",
            file=found.file,
            words=outcome(found),
            colour=colour,
            symbol=symbol,
            read=found.read,
            refusal=found.refusal,
            groups=groups,
            mends=found.mends if found.mended is not None else 0,
            mendable=found.mendable,
        )
