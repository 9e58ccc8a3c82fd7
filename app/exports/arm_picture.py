"""A picture of an arm as PNG: its capsules, in one posture or in those of a motion.

The bodies are those that collisions are computed with, so the picture shows what the answers are about, and no
more. They are seen from infinitely far away and painted from the back to the front. Of a motion, postures before
the last are pale and behind it, and a line shows the path of the tool point.
"""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from PIL import Image, ImageColor, ImageDraw, ImageFont

import kin
from app.exports.svg import joint_colour, png
from kin import Robot
from kin.collision import capsules
from kin.transforms import Array
from kin.units import general

Side = Literal["corner", "front", "side", "top"]
Colour = tuple[int, int, int]

# From the arm to the eye. The arm faces x.
EYES: Final[dict[Side, tuple[float, float, float]]] = {
    "corner": (1.0, -1.0, 0.7),
    "front": (1.0, 0.0, 0.0),
    "side": (0.0, -1.0, 0.0),
    "top": (0.0, -0.002, 1.0),
}
POSTURES: Final = 6  # of a motion that are drawn; the path is that of all
FINER: Final = 3  # painted so many times larger: smooth edges
MARGIN: Final = 0.06  # of the picture's side
WHITE, INK, BASE, PATH = (255, 255, 255), (24, 33, 43), (150, 155, 160), (200, 30, 30)
AXES: Final = {"x": (200, 30, 30), "y": (30, 125, 79), "z": (31, 95, 139)}


def arm_picture(robot: Robot, q: Array, side: Side = "corner", size: int = 480) -> bytes:
    """The picture, a square.

    Args:
        q: the configurations ``(k, n)`` of a motion, or a single one ``(1, n)``.
        side: from which the arm is seen.
        size: of the side in pixels.
    """
    toward = np.array(EYES[side]) / np.linalg.norm(EYES[side])
    right = np.cross((0.0, 0.0, 1.0), toward)
    right /= np.linalg.norm(right)
    eye = np.stack([right, np.cross(toward, right), toward])
    shown = q[np.unique(np.linspace(0, len(q) - 1, POSTURES).round().astype(int))]
    bodies = capsules(robot)
    radii = np.array([body.radius for body in bodies])
    ends, tips = _ends(robot, shown) @ eye.T, kin.fk(robot, q)[:, :3, 3] @ eye.T
    origin = robot.T_world_base[:3, 3] @ eye.T
    corners = [ends[..., :2] + sign * radii[:, None, None] for sign in (-1.0, 1.0)]
    seen = np.concatenate([*(each.reshape(-1, 2) for each in corners), tips[:, :2], origin[None, :2]])
    low, high = seen.min(axis=0), seen.max(axis=0)
    pixels = FINER * size
    scale = (1.0 - 2.0 * MARGIN) * pixels / max(float((high - low).max()), 1e-6)
    middle = 0.5 * (low + high)

    def place(points: Array) -> Array:
        return (points[..., :2] - middle) * scale * (1.0, -1.0) + 0.5 * pixels  # type: ignore[no-any-return]

    image = Image.new("RGB", (pixels, pixels), WHITE)
    draw = ImageDraw.Draw(image)
    last, depths = len(shown) - 1, ends[..., 2].mean(axis=2)
    for i, j in sorted(np.ndindex(depths.shape), key=lambda place: (place[0] == last, depths[place])):
        colour = ImageColor.getrgb(joint_colour(bodies[j].link - 1)) if bodies[j].link else BASE
        _capsule(
            draw,
            place(ends[i, j]),
            float(radii[j]) * scale,
            _mixed(colour[:3], WHITE, 0.0 if i == last else 0.7),
        )
    if len(q) > 1:
        draw.line([tuple(point) for point in place(tips).tolist()], PATH, 2 * FINER, "curve")
    _axes(draw, place(origin), eye, 0.09 * pixels)
    _bar(draw, scale, pixels)
    return png(np.asarray(image.resize((size, size), Image.Resampling.LANCZOS)))


def _ends(robot: Robot, q: Array) -> Array:
    """Both ends of each capsule in the world frame ``(k, m, 2, 3)``."""
    bodies = capsules(robot)
    base = np.broadcast_to(robot.T_world_base, (len(q), 1, 4, 4))
    frames = np.concatenate([base, kin.link_frames(robot, q)], axis=1)[:, [body.row + 1 for body in bodies]]
    axes = np.array([(body.start, body.end) for body in bodies]).reshape(-1, 2, 3)  # a wrist alone has no bodies
    found: Array = np.einsum("kmij,mej->kmei", frames[..., :3, :3], axes) + frames[:, :, None, :3, 3]
    return found


def _mixed(colour: Colour, other: Colour, share: float) -> Colour:
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(colour, other, strict=True))
    return red, green, blue


def _capsule(draw: ImageDraw.ImageDraw, ends: Array, radius: float, colour: Colour) -> None:
    """A capsule with a dark edge, and lighter where light from above left falls on it."""
    light = np.array([-0.25, -0.25]) * radius
    for r, shift, shade in (
        (radius + FINER, 0.0, _mixed(colour, INK, 0.55)),
        (radius, 0.0, colour),
        (0.5 * radius, 1.0, _mixed(colour, WHITE, 0.25)),
    ):
        (x0, y0), (x1, y1) = (ends + shift * light).tolist()
        draw.line((x0, y0, x1, y1), shade, max(1, round(2.0 * r)))
        for x, y in ((x0, y0), (x1, y1)):
            draw.ellipse((x - r, y - r, x + r, y + r), shade)


def _axes(draw: ImageDraw.ImageDraw, origin: Array, eye: Array, length: float) -> None:
    """The axes of the world frame at the arm's base."""
    font = ImageFont.load_default(12 * FINER)
    for k, (name, colour) in enumerate(AXES.items()):
        tip = origin + length * eye[:2, k] * (1.0, -1.0)
        draw.line((*origin.tolist(), *tip.tolist()), colour, FINER)
        if np.linalg.norm(eye[:2, k]) > 0.2:  # else it points to the eye
            draw.text(tuple((origin + 1.15 * (tip - origin)).tolist()), name, colour, font, "mm")


def _bar(draw: ImageDraw.ImageDraw, scale: float, pixels: int) -> None:
    """How long some round length is."""
    rough = 0.2 * pixels / scale
    power = 10.0 ** np.floor(np.log10(rough))
    length = next(power * step for step in (5.0, 2.0, 1.0) if power * step <= rough)
    x, y = 0.03 * pixels, 0.97 * pixels
    draw.line((x, y, x + length * scale, y), INK, FINER)
    text = f"{general(1000.0 * float(length), 3)} mm"
    draw.text((x, y - 2 * FINER), text, INK, ImageFont.load_default(12 * FINER), "ls")
