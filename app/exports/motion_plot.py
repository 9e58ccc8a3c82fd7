"""A motion as a picture: joint values and speeds over time, with the limits of speed as shares."""

from __future__ import annotations

import numpy as np

from app.exports.svg import Axes, AxisStyle, Plot, Series, joint_colour, text_of, tick_labels
from kin.motion import Motion
from kin.transforms import Array

WIDTH, HEIGHT = 900.0, 636.0
LEFT, RIGHT, TOP, GAP = 84.0, 40.0, 84.0, 70.0
SAMPLES = 1200
LONGEST = 115  # characters of the reason
INK, QUIET = "#20252a", "#c3c8cc"
STYLE = AxisStyle(f'stroke="{QUIET}" stroke-width=".6"', "", "", length=3.0, grid=True)


def motion_plot(motion: Motion) -> str:
    """The picture as SVG text; of a motion that was refused, its reason."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" width="{WIDTH:g}" '
        f'height="{HEIGHT:g}" font-family="system-ui, sans-serif" font-size="12" fill="{INK}">'
        f'<rect width="{WIDTH:g}" height="{HEIGHT:g}" fill="#fff"/>'
    )
    title = text_of(motion.program.name or motion.robot.name)
    parts = [f'<text x="{LEFT:g}" y="30" font-size="17" font-weight="600">{title}</text>']
    parts.append(f'<text x="{LEFT:g}" y="50">{text_of(_cut(motion.reason))}</text>')
    if motion.planned and motion.duration > 0.0:
        times = np.linspace(0.0, motion.duration, SAMPLES)
        q, qd = motion.derivatives(times)[:2]
        height = (HEIGHT - TOP - GAP - 72.0) / 2.0
        turning = motion.robot.revolute
        values = np.where(turning, np.degrees(q), 1000.0 * q)
        named = "°" if turning.all() else "mm" if not turning.any() else "° or mm"
        parts.append(_panel(motion, times, values, TOP, height, f"joint values ({named})"))
        share = 100.0 * qd / motion.limits.velocity
        parts.append(
            _panel(motion, times, share, TOP + height + GAP, height, "speeds (% of the limit)", (-100.0, 100.0))
        )
        parts.append(_legend(motion))
    return head + "".join(parts) + "</svg>\n"


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST else text[: LONGEST - 1] + "…"


def _panel(
    motion: Motion,
    times: Array,
    values: Array,
    top: float,
    height: float,
    title: str,
    band: tuple[float, float] | None = None,
) -> str:
    """One line per joint over time, the ends of segments, and a band of what is allowed."""
    low, high = (float(values.min()), float(values.max())) if band is None else (1.1 * band[0], 1.1 * band[1])
    room = max(0.05 * (high - low), 1e-3) if band is None else 0.0
    plot = Plot(LEFT, top, WIDTH - LEFT - RIGHT, height, (0.0, motion.duration), (low - room, high + room))
    parts = [] if band is None else [plot.box(plot.x, band, 'fill="#eef4f8"')]
    parts.append(Axes(plot, x=(), style=STYLE).svg())
    for value, text in tick_labels(*plot.x, 1.0):
        x = float(plot.at((value, low))[0])
        parts.append(f'<text x="{x:.1f}" y="{plot.bottom + 16:.1f}" text-anchor="middle">{text}</text>')
    dashes = f'stroke="{QUIET}" stroke-dasharray="4 3"'
    ends = [np.array([[each.end, plot.y[0]], [each.end, plot.y[1]]]) for each in motion.segments]
    parts.extend(f'<path d="{plot.path(end)}" {dashes}/>' for end in ends)
    for joint in range(motion.robot.n):
        look = f'fill="none" stroke="{joint_colour(joint)}" stroke-width="1.8"'
        parts.append(Series(plot, np.column_stack([times, values[:, joint]]), look).svg())
    parts.append(f'<text x="{LEFT:g}" y="{top - 8:g}" font-weight="600">{title}</text>')
    parts.append(f'<text x="{plot.right:g}" y="{plot.bottom + 32:g}" text-anchor="end">time (s)</text>')
    return "".join(parts)


def _legend(motion: Motion) -> str:
    parts = []
    step = (WIDTH - LEFT - RIGHT) / max(motion.robot.n, 6)
    for i, joint in enumerate(motion.robot.joints):
        x = LEFT + i * step
        parts.append(f'<path d="M{x:.1f} {HEIGHT - 18:g}h18" stroke="{joint_colour(i)}" stroke-width="3"/>')
        plain = joint.name.lower() in (f"joint {i + 1}", str(i + 1))
        name = joint.name if plain else f"{i + 1} {joint.name}"
        parts.append(f'<text x="{x + 23:.1f}" y="{HEIGHT - 14:g}">{text_of(name[:16])}</text>')
    return "".join(parts)
