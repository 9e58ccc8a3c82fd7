"""A run as a picture: how many times as long as Kinboard the others take, for each task, logarithmic."""

from __future__ import annotations

import math
from dataclasses import dataclass
from html import escape

from app.bench.board.views import LETTERS, Document, Line, Section, TaskView, sections
from app.bench.board.words import ratio_text

R = 8.5  # radius of a mark
STEP = 2 * R + 2  # between marks side by side
HOLLOW = "hollow: misses targets, answers wrongly or exceeds limits"

STYLE = """\
.b-ground{fill:var(--paper,#fff)} .b-grid{stroke:var(--line,#dfe4ea)}
.b-one{stroke:var(--accent,#1f5f8b);stroke-width:2}
.b text{fill:var(--ink,#18212b);font:13px system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans",sans-serif}
.b .b-soft{fill:var(--soft,#55616e);font-size:12px} .b .b-head{font-weight:650;font-size:14px}
.b .b-name{font-weight:560} .b .b-time{font-variant-numeric:tabular-nums}
.b .b-letter{font-size:10.5px;font-weight:700;fill:var(--mark-ink,#fff)}
.b-name,.b-soft,.b-time,.b-head{paint-order:stroke;stroke:var(--paper,#fff);stroke-width:4px}
.b-mark{stroke-width:1.8}
.b-hollow .b-mark{fill:var(--paper,#fff)} .b .b-hollow .b-letter{fill:var(--ink,#18212b)}
.l-kinboard{--c:#1f5f8b}.l-pinocchio{--c:#7a4fb0}.l-eaik{--c:#b3491b}.l-ik-geo{--c:#1c7c54}.l-ssik{--c:#a3245f}
.l-py-opw-kinematics{--c:#6b6a12}.l-roboticstoolbox{--c:#8a5a00}.l-ikpy{--c:#5b6673}.l-numpy{--c:#3f63c8}
.l-ruckig{--c:#b3261e}.l-toppra{--c:#0f7580}.l-roboplan{--c:#86407e}
.b-mark{fill:var(--c,#5b6673);stroke:var(--c,#5b6673)}
@media (prefers-color-scheme:dark){
.l-kinboard{--c:#8cc4ec}.l-pinocchio{--c:#c3a4f0}.l-eaik{--c:#f2a37c}.l-ik-geo{--c:#6fd0a3}.l-ssik{--c:#f092bd}
.l-py-opw-kinematics{--c:#d3d16a}.l-roboticstoolbox{--c:#f0bf6a}.l-ikpy{--c:#a3afbb}.l-numpy{--c:#9db4f7}
.l-ruckig{--c:#ff9d94}.l-toppra{--c:#79d3dc}.l-roboplan{--c:#e0a3d8}
}"""


@dataclass(frozen=True, slots=True)
class _Layout:
    """Lengths in pixels of a picture `width` wide; a narrow one has its labels above the marks."""

    width: int
    left: int
    right: int
    label: int  # height of a label above the marks

    def x(self, ratio: float, low: int, high: int) -> float:
        share = (math.log10(ratio) - low) / (high - low)
        return self.left + share * (self.width - self.left - self.right)


WIDE, NARROW = _Layout(1080, 400, 96, 0), _Layout(366, 30, 26, 36)


def standalone(document: Document) -> str:
    """The picture as a file of its own, light or dark as the viewer prefers."""
    dark = (
        "@media (prefers-color-scheme:dark){svg{--paper:#191f26;--ink:#e8edf2;--soft:#a3afbb;--line:#2b343e;"
        "--accent:#8cc4ec;--mark-ink:#0d1a24}}"
    )
    return picture(sections(document), WIDE, f"<style>{STYLE}{dark}</style>") + "\n"


def picture(found: list[Section], layout: _Layout, style: str = "") -> str:
    """The picture as SVG; an empty one if nothing was measured."""
    ratios = [line.ratio for section in found for task in section.tasks for line in _shown(task)]
    low = math.floor(math.log10(min(ratios, default=1.0) * 0.8))
    high = max(math.ceil(math.log10(max(ratios, default=10.0) * 1.2)), low + 1)
    parts, y = [], 34.0
    for section in found:
        parts.append(f'<text class="b-head" x="14" y="{y + 20:.0f}">{escape(section.title)}</text>')
        y += 34.0
        for task in section.tasks:
            drawn, height = _row(task, layout, y, low, high)
            parts += drawn
            y += height
    grid = _grid(layout, y, low, high)
    legend, bottom = _legend(found, layout, y + 34.0)
    return (
        f'<svg class="b" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {layout.width} {bottom:.0f}" role="img" '
        'aria-label="Time of each library relative to Kinboard, by task; the tables hold the same figures">'
        f'{style}<rect class="b-ground" width="100%" height="100%"/>'
        + "".join([*grid, *parts, *legend])
        + "</svg>"
    )


def _shown(task: TaskView) -> list[Line]:
    return sorted((line for line in task.lines if line.role != "floor"), key=lambda line: line.ratio)


def _grid(layout: _Layout, bottom: float, low: int, high: int) -> list[str]:
    parts = []
    for power in range(low, high + 1):
        x = layout.x(10.0**power, low, high)
        parts.append(f'<path class="{"b-grid" if power else "b-one"}" d="M{x:.1f} 30V{bottom:.0f}"/>')
        words = ratio_text(10.0**power) if layout is WIDE or power % 2 == 0 else ""
        parts += [
            f'<text class="b-soft" x="{x:.1f}" y="{y:.0f}" text-anchor="middle">{words}</text>'
            for y in (22.0, bottom + 16.0)
        ]
    if layout is WIDE:
        parts.append(f'<text class="b-soft" x="{layout.width - 12}" y="22" text-anchor="end">1 × is</text>')
    return parts


def _row(task: TaskView, layout: _Layout, y: float, low: int, high: int) -> tuple[list[str], float]:
    """The label and marks of a task, and their height; marks that would overlap are below one another."""
    lanes: list[float] = []
    marks = []
    top = y + layout.label + R + 4.0
    for line in _shown(task):
        x = layout.x(line.ratio, low, high)
        lane = next((k for k, last in enumerate(lanes) if x - last >= STEP), len(lanes))
        lanes[lane : lane + 1] = [x]
        marks.append(_mark(line, task, x, top + lane * STEP))
    height = layout.label + max(len(lanes), 1) * STEP + 8.0
    time, end = task.reference_line.time, layout.width - 12
    robot, title = escape(task.robot), escape(task.title)
    if layout is WIDE:
        height = max(height, 44.0)
        words = [
            f'<text class="b-name" x="14" y="{y + 15:.0f}">{robot}</text>',
            f'<text class="b-soft" x="14" y="{y + 31:.0f}">{_cut(title, 62)}</text>',
            f'<text class="b-time" x="{end}" y="{y + 17:.0f}" text-anchor="end">{time}</text>',
        ]
    else:
        words = [
            f'<text class="b-name" x="14" y="{y + 14:.0f}">{robot}</text>',
            f'<text class="b-time" x="{end}" y="{y + 14:.0f}" text-anchor="end">1 × is {time}</text>',
            f'<text class="b-soft" x="14" y="{y + 29:.0f}">{_cut(title, 54)}</text>',
        ]
    rule = f'<path class="b-grid" d="M14 {y + height - 3:.0f}H{end}"/>'
    return [rule, *words, *marks], height


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1].rstrip(" ,") + "…"


def _mark(line: Line, task: TaskView, x: float, y: float) -> str:
    said = f"{line.name}: {line.times} {task.reference}, {line.time}"
    if line.solved is not None:
        said += f", {line.solved:.0%} solved"
    if line.branches is not None:
        said += f", {line.branches:.2f} solutions"
    shape = f'<circle class="b-mark" cx="{x:.1f}" cy="{y:.1f}" r="{R - 1}"/>'
    if line.role == "ours":
        corner, side = f'x="{x - R + 1.5:.1f}" y="{y - R + 1.5:.1f}"', 2 * R - 3.0
        shape = f'<rect class="b-mark" {corner} width="{side}" height="{side}" rx="2"/>'
    hollow = "" if line.whole else " b-hollow"
    return (
        f'<g class="l-{line.library}{hollow}"><title>{escape(said)}</title>{shape}'
        f'<text class="b-letter" x="{x:.1f}" y="{y + 3.8:.1f}" text-anchor="middle">{line.letter}</text></g>'
    )


def _legend(found: list[Section], layout: _Layout, y: float) -> tuple[list[str], float]:
    """Letters and names of the libraries that are in the picture."""
    present = {line.library for section in found for task in section.tasks for line in _shown(task)}
    names = ["kinboard", *(name for name in LETTERS if name in present)]
    parts, x = [], 22.0
    for name in names:
        wide = 36.0 + 7.2 * len(name)
        if x + wide > layout.width:
            x, y = 22.0, y + 22.0
        letter = LETTERS.get(name, "K")
        place = f'x="{x:.0f}" y="{y + 3.8:.1f}" text-anchor="middle"'
        parts += [
            f'<g class="l-{name}"><circle class="b-mark" cx="{x:.0f}" cy="{y:.0f}" r="{R - 1}"/>',
            f'<text class="b-letter" {place}>{letter}</text></g>',
            f'<text class="b-soft" x="{x + 13:.0f}" y="{y + 4:.0f}">{name}</text>',
        ]
        x += wide
    y += 24.0
    parts.append(f'<text class="b-soft" x="14" y="{y + 4:.0f}">{HOLLOW}</text>')
    return parts, y + 18.0
