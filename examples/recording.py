"""Commanded and measured values over time: the largest error in words, a table (CSV) and a plot (SVG)."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from connecting import forced
from numpy.typing import NDArray

import kin
from kin.notebook.driving import said

MOST = 60_000  # samples: ten minutes at 100 a second
COLOURS = ("#1971c2", "#e8590c", "#2f9e44", "#9c36b5", "#c92a2a", "#0c8599", "#846358", "#5f3dc4")
WIDTH, HEIGHT, LEFT, GAP = 860, 200, 70, 50  # pixels of a panel

Array = NDArray[np.float64]


class Recording:
    """Samples of one arm.

    Args:
        robot: the arm.
        limits: largest torques (forces) ``(n,)``, N·m (N).
    """

    def __init__(self, robot: kin.Robot, limits: Array) -> None:
        self.robot, self.limits = robot, limits
        self._rows: list[tuple[float, Array, Array, Array]] = []

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, t: float, commanded: Array, measured: Array, torque: Array) -> None:
        """Add a sample, each value ``(n,)``; s, rad (m), N·m (N). Beyond `MOST` nothing is added."""
        if len(self._rows) < MOST:
            self._rows.append((t, commanded.copy(), measured.copy(), torque.copy()))

    def columns(self) -> tuple[Array, Array, Array, Array]:
        """Times ``(k,)`` from 0; commanded, measured and torque, each ``(k, n)``."""
        t, *others = (np.array(column) for column in zip(*self._rows, strict=True))
        return t - t[0], others[0], others[1], others[2]

    def summary(self) -> str:
        """The largest error of a joint and of the tool, and the largest share of a torque, in a line."""
        robot = self.robot
        t, commanded, measured, torque = self.columns()
        error = np.abs(commanded - measured)
        k, i = np.unravel_index(int(np.argmax(error)), error.shape)
        off = np.linalg.norm(kin.fk(robot, commanded)[:, :3, 3] - kin.fk(robot, measured)[:, :3, 3], axis=1).max()
        share = np.abs(torque) / self.limits
        m = int(np.unravel_index(int(np.argmax(share)), share.shape)[1])
        most = float(np.abs(torque[:, m]).max())
        return (
            f"{t[-1]:.1f} s. Largest error: {said(robot, int(i), float(error[k, i]))} at {robot.joints[i].name}, "
            f"after {t[k]:.1f} s; the tool was up to {1000.0 * off:.1f} mm off. "
            f"Most load: {robot.joints[m].name}, "
            f"{forced(robot, m, most)} of {forced(robot, m, self.limits[m])}."
        )

    def save_csv(self, file: Path) -> None:
        """Write all samples: time, then commanded, measured and torque of each joint, in SI units."""
        names = [joint.name for joint in self.robot.joints]
        with file.open("w", newline="", encoding="utf-8") as stream:
            table = csv.writer(stream)
            table.writerow(
                ["time", *(f"{kind} {name}" for kind in ("commanded", "measured", "torque") for name in names)]
            )
            for t, *values in zip(*self.columns(), strict=True):
                table.writerow([f"{x:.6g}" for x in (t, *np.concatenate(values))])

    def save_svg(self, file: Path) -> None:
        """Write a plot: the error of each joint over time, and its torque as a share of the largest."""
        t, commanded, measured, torque = self.columns()
        turning = self.robot.revolute
        error = (commanded - measured) * np.where(turning, np.degrees(1.0), 1000.0)
        unit = "°" if turning.all() else "mm" if not turning.any() else "° or mm"
        parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {LEFT + WIDTH + 20} {2 * (HEIGHT + GAP) + 50}" '
            'font-family="sans-serif" font-size="13">',
            '<rect width="100%" height="100%" fill="white"/>',
            *_panel(t, error, f"commanded − measured ({unit})", GAP - 20, None),
            *_panel(t, 100.0 * torque / self.limits, "torque (% of the largest)", HEIGHT + 2 * GAP - 20, 100.0),
        ]
        for i, joint in enumerate(self.robot.joints):
            x, y = LEFT + 110 * i, 2 * (HEIGHT + GAP) + 30
            parts.append(f'<rect x="{x}" y="{y - 9}" width="14" height="4" fill="{COLOURS[i % len(COLOURS)]}"/>')
            parts.append(f'<text x="{x + 19}" y="{y}">{escape(joint.name[:14])}</text>')
        file.write_text("\n".join([*parts, "</svg>", ""]), encoding="utf-8")


def _panel(t: Array, values: Array, title: str, top: float, most: float | None) -> list[str]:
    """Lines of `values` ``(k, m)`` over time, in a frame with its largest and smallest value."""
    most = most or max(float(np.abs(values).max()) * 1.05, 0.1)
    step = max(1, len(t) // 1000)  # a picture shows no more points than that
    t, values = t[::step], np.clip(values[::step], -most, most)
    x = LEFT + WIDTH * t / max(float(t[-1]), 1e-9)
    y = top + 0.5 * HEIGHT * (1.0 - values / most)
    parts = [f'<text x="{LEFT}" y="{top - 8}">{title}</text>']
    for value in (most, 0.0, -most):
        at = top + 0.5 * HEIGHT * (1.0 - value / most)
        parts.append(f'<path d="M{LEFT},{at:.1f}h{WIDTH}" stroke="#ced4da" fill="none"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{at + 4:.1f}" text-anchor="end">{value:.3g}</text>')
    for i in range(values.shape[1]):
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y[:, i], strict=True))
        colour = COLOURS[i % len(COLOURS)]
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
    end = f'<text x="{LEFT + WIDTH}" y="{top + HEIGHT + 16}" text-anchor="end">{float(t[-1]):.1f} s</text>'
    return [*parts, end]


def saved(recording: Recording, files: Sequence[str | None]) -> list[str]:
    """Write a plot and a table, where their files are named; returns the names of those that were written."""
    written = []
    for file, save in zip(files, (recording.save_svg, recording.save_csv), strict=True):
        if file is not None:
            save(Path(file))
            written.append(file)
    return written
