"""A run, as JSON, in the form that the page and the picture show."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from app.bench.board.words import ratio_text, share_text, time_text

Document = dict[str, Any]

# First word of a contestant's name → its letter in the picture. A library that is not among them gets a "?".
LETTERS = {
    "pinocchio": "P",
    "eaik": "E",
    "ik-geo": "G",
    "ssik": "S",
    "py-opw-kinematics": "O",
    "roboticstoolbox": "R",
    "ikpy": "I",
    "numpy": "N",
    "coal": "C",
    "vamp-planner": "V",
    "ruckig": "U",
    "toppra": "T",
    "roboplan": "B",
}
_SECTIONS = {
    "fk": "Forward kinematics",
    "cloud": "Workspace",
    "branches": "All solutions of inverse kinematics",
    "answer": "One verified solution inside the limits",
    "collision": "Collisions",
    "touch": "Collisions",
    "edge": "Collisions",
    "ptp": "Motions",
    "points": "Motions",
    "pace": "Motions",
    "line": "Motions",
}
_MOTIONS = ("ptp", "points", "pace")


@dataclass(frozen=True, slots=True)
class Line:
    """One contestant of a task.

    Attributes:
        library: first word of its name; "kinboard" for ours, "floor" for what solves nothing, "other" for a
            library without a letter.
        ratio: its time relative to the reference of the task.
        whole: whether it answered every target and nothing wrong.
    """

    name: str
    role: str
    library: str
    letter: str
    seconds: float
    ratio: float
    noise: float
    whole: bool
    solved: float | None
    branches: float | None
    recall: float | None
    wrong: float | None
    derivation: float | None

    @property
    def time(self) -> str:
        """Time per pose or target."""
        return time_text(self.seconds)

    @property
    def times(self) -> str:
        """The ratio in words."""
        return ratio_text(self.ratio)

    @property
    def facts(self) -> list[tuple[str, str]]:
        """Names and values of what is said beside the time; an empty value where there is none."""
        return [
            ("solved", share_text(self.solved)),
            ("solutions", "" if self.branches is None else f"{self.branches:.2f}"),
            ("recall", share_text(self.recall)),
            ("wrong", "" if self.wrong is None else f"{self.wrong:.2g}"),
            ("noise", f"{self.noise * 100.0:.2g} %" if self.noise < 1.0 else f"{self.noise * 100.0:.0f} %"),
            ("derivation", "" if self.derivation is None else time_text(self.derivation)),
        ]


@dataclass(frozen=True, slots=True)
class TaskView:
    """A row of the benchmark with its contestants."""

    id: str
    title: str
    robot: str
    reference: str
    motion: bool
    lines: tuple[Line, ...]

    @property
    def facts(self) -> list[str]:
        """Names of the facts that at least one contestant has."""
        names = [name for name, _ in self.lines[0].facts]
        return [name for k, name in enumerate(names) if any(line.facts[k][1] for line in self.lines)]

    @property
    def reference_line(self) -> Line:
        """The call of ours that the others are compared with."""
        return next(line for line in self.lines if line.name == self.reference)

    @property
    def peers(self) -> list[Line]:
        """Other libraries that answer every target, nothing wrong."""
        return [line for line in self.lines if line.role == "peer" and line.whole]

    def bar(self, line: Line) -> float:
        """Length of a line's bar in per cent, on a logarithmic scale of this task's ratios."""
        low = min(math.log10(each.ratio) for each in self.lines) - 0.3
        high = max(math.log10(each.ratio) for each in self.lines)
        return round(100.0 * (math.log10(line.ratio) - low) / (high - low), 1)


@dataclass(frozen=True, slots=True)
class Section:
    """Tasks of a kind."""

    title: str
    tasks: tuple[TaskView, ...]


def sections(document: Document) -> list[Section]:
    """The tasks of a run by kind, in the order of the run."""
    found: dict[str, list[TaskView]] = {}
    for row in document["rows"]:
        found.setdefault(_SECTIONS[row["kind"]], []).append(_task(row))
    return [Section(title, tuple(tasks)) for title, tasks in found.items()]


def _task(row: Document) -> TaskView:
    ratio = "to_array" if row["reference"] == "kinboard" else "to_solve"
    lines = tuple(_line(entry, ratio) for entry in row["contestants"])
    motion = row["kind"] in _MOTIONS
    return TaskView(row["id"], row["title"], row["robot_name"], row["reference"], motion, lines)


def _line(entry: Document, ratio: str) -> Line:
    name, role = entry["name"], entry["role"]
    library = {"floor": "floor", "ours": "kinboard"}.get(role) or name.replace(",", " ").partition(" ")[0]
    if role == "peer" and library not in LETTERS:
        library = "other"
    solved, wrong = entry.get("success"), entry.get("wrong")
    return Line(
        name=name.removeprefix("floor: "),
        role=role,
        library=library,
        letter="K" if role == "ours" else LETTERS.get(library, "?"),
        seconds=entry["median"],
        ratio=entry[ratio],
        noise=entry["noise"],
        whole=solved == 1.0 and not wrong,
        solved=solved,
        branches=entry.get("branches"),
        recall=entry.get("recall"),
        wrong=wrong,
        derivation=entry["derivation"],
    )


@dataclass(frozen=True, slots=True)
class Summary:
    """What a run says as a whole.

    Attributes:
        compared: tasks at which another library answers every target, nothing wrong.
        ahead: those of them at which none of these is faster than the reference.
        faster: the others, with the fastest library.
    """

    compared: int
    ahead: int
    faster: tuple[tuple[TaskView, Line], ...]


def summary(found: list[Section]) -> Summary:
    """Who is faster where. Libraries that miss targets or answer wrongly do not count."""
    tasks = [task for section in found for task in section.tasks if task.peers]
    best = [(task, min(task.peers, key=lambda line: line.ratio)) for task in tasks]
    faster = tuple((task, line) for task, line in best if line.ratio < 1.0)
    return Summary(len(tasks), len(tasks) - len(faster), faster)


def facts(document: Document) -> list[tuple[str, str]]:
    """Machine, versions, date and settings of a run."""
    machine = document["machine"]
    cores = f"{machine['cores']} cores" + (f", load {machine['load']}" if machine.get("load") else "")
    own = ("kinboard", "numpy", "numba")
    versions = [f"{name} {machine[name]}" for name in own if name in machine]  # older runs: numba
    versions += [f"{name} {value}" for name, value in document["versions"].items() if name not in own]
    found = [
        ("Date", machine["time"]),
        ("Machine", f"{machine['processor']}, {cores}, {machine['system']}, Python {machine['python']}"),
        ("Command", document["command"]),
        (
            "Method",
            f"{document['clock']}, {document['rounds']} rounds in turns, {document['targets']} targets, "
            f"{document['batch']} in a batch, seed {document['seed']}"
            + (", interrupted" if document["interrupted"] else ""),
        ),
        ("Versions", ", ".join(versions)),
    ]
    if document["not_installed"]:
        found.append(("Not installed", ", ".join(document["not_installed"])))
    refused = [f"{item['peer']} in {item['row']} ({item['error']})" for item in document["refused"]]
    if refused:
        found.append(("Could not take part", "; ".join(refused)))
    return found


def busy(document: Document) -> bool:
    """Whether the machine had other work during the run."""
    load = document["machine"].get("load")
    return bool(load) and float(load) > 1.5
