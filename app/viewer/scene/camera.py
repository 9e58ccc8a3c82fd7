"""Where a visitor looks from: a default view that fits the arm and the window, until the visitor moves the camera.

A link made on one screen is opened on another. Beside a docked panel a viewpoint is what it is, whatever the size.
On a phone the width is what limits, and the panel is a sheet that covers the lower part: what is chosen there is
told as the viewpoint that shows the same beside a docked panel.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np
import viser
from numpy.typing import NDArray

from app.viewer.panel import Post
from app.viewer.scene.meshes import Body
from kin.transforms import Array

FOV = math.radians(38)
DIRECTION = np.array([0.80, 0.92, 0.46])
UP = np.array([0.0, 0.0, 1.0])
NARROW = 700  # pixels
LOOK_EVERY = 0.25  # seconds: a moving camera is told of thirty times a second
PATIENCE = 10.0  # seconds for a page to draw where it was sent; a lesson may have sent it elsewhere meanwhile
FARTHEST = 1e6  # metres; viser's own limit of zooming out is 1e4
SAME = 1e-3  # of the distance to what is looked at
_MARGIN = 1.06  # of the sphere around the arm
_SEEN = 0.4  # of the window's height, above a sheet
Sphere = tuple[Array, float]  # centre ``(3,)`` and radius, m


def round_points(points: NDArray[np.floating]) -> Sphere:
    """A sphere that holds points ``(n, 3)``, n > 0: round the middle of their box."""
    center = (points.min(axis=0) + points.max(axis=0)).astype(float) / 2.0
    return center, float(np.linalg.norm(points - center, axis=1).max())


def round_both(one: Sphere, other: Sphere) -> Sphere:
    """The smallest sphere that holds two."""
    out = other[0] - one[0]
    apart = float(np.linalg.norm(out))
    if apart + other[1] <= one[1]:
        return one
    if apart + one[1] <= other[1]:
        return other
    radius = (apart + one[1] + other[1]) / 2.0
    return one[0] + out / apart * (radius - one[1]), radius


def view(body: Body, aspect: float, sheet: bool = False, room: Sequence[Sphere] = ()) -> tuple[Array, Array]:
    """Camera position and look-at point ``(3,)`` that show the whole of the arm in a window of this aspect.

    In a portrait window the width is what limits. On a phone the panel is a `sheet` that covers the lower part:
    there the arm goes above it. `room`: what else is to be seen.
    """
    center, radius = body.center, body.radius
    for sphere in room:
        center, radius = round_both((center, radius), sphere)
    margin, lift = _framed(aspect, sheet)
    # The way up is seen aslant.
    upright = math.hypot(*DIRECTION[:2]) / float(np.linalg.norm(DIRECTION))
    center = center - UP * lift * radius / upright
    distance = margin * radius / math.sin(_half_angle(aspect))
    return center + DIRECTION / np.linalg.norm(DIRECTION) * distance, center


def on_sheet(viewpoint: Array, aspect: float) -> Array:
    """What shows above a phone's sheet what a viewpoint ``(3, 3)`` shows beside a docked panel.

    Rows of a viewpoint: the camera's position, the point it looks at, and the direction that is up.
    """
    farther, drop = _sheet(aspect)
    return _moved(viewpoint, farther, -drop)


def off_sheet(viewpoint: Array, aspect: float) -> Array:
    """The inverse of `on_sheet`."""
    farther, drop = _sheet(aspect)
    return _moved(viewpoint, 1.0 / farther, drop / farther)


class VisitorCamera:
    """The camera of one visitor. Posts ``"looked"`` a few times a second while the visitor moves it.

    Attributes:
        sheet: whether the panel is a phone's sheet. Asked once: a docked panel makes the picture narrower.
        chosen: the viewpoint ``(3, 3)`` the visitor has chosen, as beside a docked panel; None: the default view.
    """

    def __init__(self, client: viser.ClientHandle, post: Post) -> None:
        self._camera = client.camera
        self._post = post
        self._posted_at = 0.0
        self._told = self._here()
        # Where the page was sent to, since when, and whether it has been there. Until then it tells of the view
        # before, which nobody has chosen.
        self._aimed, self._aimed_at, self._arrived = np.zeros((3, 3)), 0.0, False
        self.sheet = self._camera.image_width < NARROW
        self.chosen: Array | None = None
        self._body: Body | None = None
        self._room: tuple[Sphere, ...] = ()
        self._camera.on_update(self._on_update)

    def aim(self, body: Body) -> None:
        """Move to the default view; that of another arm has room for nothing else."""
        if body is not self._body:
            self._body, self._room = body, ()
        self._camera.fov = FOV
        self._camera.near, self._camera.far = body.radius / 50, body.radius * 200
        self.chosen = None
        self._go(np.stack([*view(body, self._aspect, self.sheet, self._room), UP]))

    def make_room(self, room: Sequence[Sphere]) -> None:
        """Have the default view show these spheres too, from now on; a view that is `chosen` stays as it is."""
        before, self._room = self._room, tuple(room)
        self.look()
        if self._body is not None and self.chosen is None and (before or room):
            self.aim(self._body)

    def restore(self, viewpoint: Array) -> None:
        """Move to a viewpoint that was `chosen` in this window or in another."""
        self.chosen = viewpoint
        self._go(on_sheet(viewpoint, self._aspect) if self.sheet else viewpoint)

    def look(self) -> None:
        """Bring `chosen` up to date."""
        here = self._told
        settled = self._arrived or time.perf_counter() - self._aimed_at > PATIENCE
        if settled and here is not None and not _same(here, self._aimed):
            self._aimed, self._arrived = here, True
            self.chosen = off_sheet(here, self._aspect) if self.sheet else here

    @property
    def _aspect(self) -> float:
        width, height = self._camera.image_width, self._camera.image_height
        return width / height if width > 0 and height > 0 else 1.6

    def _go(self, viewpoint: Array) -> None:
        self._aimed, self._aimed_at = viewpoint, time.perf_counter()
        self._arrived = self._told is not None and _same(self._told, viewpoint)  # then it has no reason to tell
        position, look_at, up = viewpoint
        self._camera.up_direction = up
        self._camera.position = position
        self._camera.look_at = look_at

    def _here(self) -> Array | None:
        """The viewpoint that the page told last; None for nonsense."""
        camera = self._camera
        try:
            here = np.array([camera.position, camera.look_at, camera.up_direction], float)
        except ValueError:  # a row of another length
            return None
        return here if here.shape == (3, 3) and (np.abs(here) < FARTHEST).all() else None

    async def _on_update(self, _: viser.CameraHandle) -> None:
        self._told = here = self._here()
        if not self._arrived and here is not None:
            self._arrived = _same(here, self._aimed)
        now = time.perf_counter()
        if now - self._posted_at >= LOOK_EVERY:
            self._posted_at = now
            self._post("looked", None)


def _half_angle(aspect: float) -> float:
    return math.atan(math.tan(FOV / 2) * min(aspect, 1.0))


def _framed(aspect: float, sheet: bool) -> tuple[float, float]:
    """What the sphere around the arm needs, in its radii: half the picture's narrow side, and how far to go up."""
    if not sheet or aspect >= 1.0:
        return _MARGIN, 0.0
    margin = max(_MARGIN, aspect * _MARGIN / _SEEN)
    return margin, (1.0 - _SEEN) * margin / aspect


def _sheet(aspect: float) -> tuple[float, float]:
    """How many times farther a camera is on a phone, and how much lower it looks, in distances of the other."""
    if aspect >= 1.0:
        return 1.0, 0.0
    margin, lift = _framed(aspect, True)
    farther = margin / _MARGIN * math.sin(FOV / 2) / math.sin(_half_angle(aspect))
    return farther, lift / _MARGIN * math.sin(FOV / 2)


def _moved(viewpoint: Array, farther: float, lift: float) -> Array:
    """Look in the same direction from so many times as far, the picture `lift` distances higher."""
    position, look_at, up = viewpoint
    back = position - look_at
    upright = up * (back @ back) - back * (up @ back)
    size = float(np.linalg.norm(upright))
    if size > 0.0:
        look_at = look_at + upright / size * lift * float(np.linalg.norm(back))
    return np.stack([look_at + back * farther, look_at, up])


def _same(a: Array, b: Array) -> bool:
    distance = float(np.linalg.norm(b[0] - b[1]))
    return bool(np.abs(a[:2] - b[:2]).max() < SAME * distance and np.abs(a[2] - b[2]).max() < SAME)
