"""The visitor's camera: a default view that fits the arm and the window, until the visitor moves the camera.

A link made on one screen is opened on another. In a picture that is wider than high, a viewpoint shows the same
whatever the size. In a narrow picture the width is the limit: a viewpoint chosen there is saved as the one that
shows the same in a wide picture. When the picture changes its shape (a phone is turned, its sheet opened), the
camera moves so that the picture still shows the same.
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
from app.viewer.scene.viewpoints import (
    DIRECTIONS,
    FOV,
    GLIDE,
    UP,
    Side,
    between,
    contains,
    distance_to_see,
    places,
)
from kin.transforms import Array

DIRECTION = np.array([0.80, 0.92, 0.46])  # of the default view, from the arm to the camera
LOOK_EVERY = 0.25  # seconds; a moving camera reports thirty times a second
PATIENCE = 10.0  # seconds for a page to reach the viewpoint it was sent to; a lesson may move it meanwhile
FARTHEST = 1e6  # metres; viser's own limit of zooming out is 1e4
SAME = 1e-3  # tolerance, relative to the distance to the look-at point
_MARGIN = 1.06  # of the sphere around the arm
_AROUND = 0.12  # room around each frame of the arm, in radii of the sphere around the arm
_ARROWS = 0.28  # room around the tool in the default view, in these radii: the gizmo's arrows and some space
_NEAREST, _REMOTEST = 0.4, 14.0  # limits of zooming in and out, in these radii
_FARTHEST_ASIDE = 3.0  # limit of panning, in these radii
_LOWEST = 0.03  # least height of the camera above the floor, in these radii: from below, the floor hides the arm
_SMALL_PICTURE = 420  # pixels
_ABOVE = 0.3  # room above a target for the number that is written there, in these radii
_OUTLOOK = 5.0  # in these radii: a target farther away is not shown
_SMALLEST = 0.01  # metres; viser's own limit of zooming in
_INSIDE = 0.88  # share of the picture, in both directions, that contains the extra points: they have labels
_RESIZED = 0.01  # relative change of the picture's narrow side that moves the camera
Sphere = tuple[Array, float]  # centre ``(3,)`` and radius, m


def round_points(points: NDArray[np.floating]) -> Sphere:
    """A sphere around points ``(n, 3)``, n > 0, about the centre of their bounding box."""
    center = (points.min(axis=0) + points.max(axis=0)).astype(float) / 2.0
    return center, float(np.linalg.norm(points - center, axis=1).max())


def round_both(one: Sphere, other: Sphere) -> Sphere:
    """The smallest sphere around two spheres."""
    out = other[0] - one[0]
    apart = float(np.linalg.norm(out))
    if apart + other[1] <= one[1]:
        return one
    if apart + one[1] <= other[1]:
        return other
    radius = (apart + one[1] + other[1]) / 2.0
    return one[0] + out / apart * (radius - one[1]), radius


def view(body: Body, aspect: float, room: Sequence[Sphere] = ()) -> tuple[Array, Array]:
    """Camera position and look-at point ``(3,)`` that show the whole arm in a picture of this aspect ratio.

    `room`: spheres that must be visible as well.
    """
    viewpoint = _framed(_together(body, room), DIRECTION, aspect)
    return viewpoint[0], viewpoint[1]


def narrowed(viewpoint: Array, aspect: float) -> Array:
    """The viewpoint for a picture of this aspect ratio. It shows what `viewpoint` ``(3, 3)`` shows in a wide one.

    Rows of a viewpoint: camera position, look-at point, and up direction.
    """
    return _at_distance(viewpoint, _farther(aspect))


def widened(viewpoint: Array, aspect: float) -> Array:
    """The inverse of `narrowed`."""
    return _at_distance(viewpoint, 1.0 / _farther(aspect))


class VisitorCamera:
    """The camera of one visitor.

    Posts ``"looked"`` a few times a second while the visitor moves it, and ``"resized"`` when the picture has
    another shape.

    Attributes:
        chosen: the viewpoint ``(3, 3)`` the visitor has chosen, as in a wide picture; None: the default view.
    """

    def __init__(self, client: viser.ClientHandle, post: Post) -> None:
        self._camera = client.camera
        self._post = post
        self._posted_at = 0.0
        self._reported = self._here()
        # The viewpoint the page was sent to, when, and whether it has arrived. Until then it reports the previous
        # viewpoint, which nobody has chosen.
        self._aimed, self._aimed_at, self._arrived = np.zeros((3, 3)), 0.0, False
        self._framed = self._aspect  # the aspect ratio of the picture for which the camera was placed
        self.chosen: Array | None = None
        self._body: Body | None = None
        self._room: tuple[Sphere, ...] = ()
        self._extra = np.zeros((0, 3))  # points that the default view shows besides `_room`
        self._points = np.zeros((0, 3))
        self._glide: tuple[Array, float] | None = None  # start of the way to `_aimed`, and when it began
        # The viewpoint that `keep` has left, and `chosen` there; None: it has not, or the visitor has moved since.
        self._left: tuple[Array, Array | None] | None = None
        self._target: Array | None = None  # the last one that `keep` was asked to show
        self._camera.on_update(self._on_update)

    def aim(self, body: Body, points: Array | None = None, glide: bool = False) -> None:
        """Move to the default view, at once or in a glide; for another arm, what `fit` added is dropped.

        The view also contains the origins of the arm's frames `points` ``(n, 3)``, by default the last ones given,
        and the arrows at the last of them, the tool.
        """
        if body is not self._body:
            self._body, self._room = body, ()
            self._points = self._extra = np.zeros((0, 3))
        if points is not None:
            self._points = points
        self._camera.fov = FOV
        self._camera.near, self._camera.far = body.radius / 50, body.radius * 200
        self.chosen = self._left = None
        self._framed = self._aspect
        viewpoint = np.stack([*view(body, self._framed, self._room), UP])
        arrows = _ARROWS * body.radius
        tool = self._points[-1:]
        if not self._shows(viewpoint, self._points) or not contains(viewpoint, self._framed, tool, arrows):
            room = [*self._room, self._arm(self._points), (tool[0], arrows)]
            viewpoint = np.stack([*view(body, self._framed, room), UP])
        if len(self._extra):
            least = distance_to_see(viewpoint, self._framed, self._extra, _INSIDE)
            viewpoint = _at_distance(viewpoint, max(1.0, least / _distance(viewpoint)))
        self._go(viewpoint, glide)
        self._camera.min_orbit_distance = _SMALLEST  # never above the upper limit
        self._camera.max_orbit_distance = max(_REMOTEST * body.radius, 1.5 * _distance(viewpoint))
        self._camera.min_orbit_distance = _NEAREST * body.radius

    def keep(self, points: Array, target: Array | None = None, also: Array | None = None) -> None:
        """If the picture does not contain these origins of the arm's frames ``(n, 3)``, glide until it does.

        It then also contains a target ``(3,)`` and the points `also` ``(k, 3)``; of one that is very far, the
        beginning of the line to it. The camera glides back when the picture of before contains everything again.
        """
        self._points, self._target = points, target
        self.look()
        here = self._viewpoint
        if self._body is None:
            return
        more = [] if also is None else [self._this_side(point) for point in also]
        if target is not None:
            seen = self._this_side(target)
            more += [seen, seen + _ABOVE * self._body.radius * UP]
        points = np.vstack([points, *more])
        if self._left is not None and self._shows(self._left[0], points):
            self._return(*self._left)
            return
        if self._shows(here, points):
            return
        left = self._left or ((here, self.chosen) if more else None)
        sphere = round_both(_together(self._body, self._room), self._arm(points))
        viewpoint = _framed(sphere, here[0] - here[1], self._aspect, here[2])
        if self.chosen is None:
            self._go(viewpoint, glide=True)
        else:
            self._choose(widened(viewpoint, self._aspect))
        self._left = left

    def _this_side(self, point: Array) -> Array:
        """The point ``(3,)``, or where the line from the arm to it leaves what is shown at most."""
        assert self._body is not None
        out = point - self._body.center
        far = float(np.linalg.norm(out)) / (_OUTLOOK * self._body.radius)
        return np.asarray(self._body.center + out / max(far, 1.0))

    def _return(self, viewpoint: Array, chosen: Array | None) -> None:
        """Glide back to a viewpoint that `keep` has left."""
        self._left = None
        self.chosen = chosen
        self._go(viewpoint, glide=True)

    def look_at_arm(self, points: Array, room: Sequence[Sphere] = ()) -> None:
        """Glide to a view that the arm and these spheres fill, in the present direction; not to those far away."""
        self.look()
        here = self._viewpoint
        self._points = points
        sphere, middle, most = self._arm(points), np.zeros(3), 0.0
        if self._body is not None:
            middle, most = self._body.center, _OUTLOOK * self._body.radius
        for other in room:
            if float(np.linalg.norm(other[0] - middle)) + other[1] <= most:
                sphere = round_both(sphere, other)
        self._choose(_framed(sphere, here[0] - here[1], 1.0, here[2]))

    def look_from(self, side: Side, points: Array) -> None:
        """Glide to a standard view of the arm."""
        if self._body is None:
            return
        self._points = points
        sphere = round_both((self._body.center, self._body.radius), self._arm(points))
        self._choose(_framed(sphere, np.array(DIRECTIONS[side]), 1.0))

    @property
    def gliding(self) -> bool:
        """Whether the camera is on its way to another viewpoint; `tick` moves it."""
        return self._glide is not None

    def tick(self, now: float) -> None:
        """Continue a glide. `now` is `time.perf_counter`'s."""
        if self._glide is None:
            return
        start, begun = self._glide
        share = min((now - begun) / GLIDE, 1.0)
        if share >= 1.0:
            self._glide = None
        self._send(self._aimed if share >= 1.0 else between(start, self._aimed, share))

    def places(self, points: Array) -> Array:
        """Where points ``(n, 3)`` will be in the picture, and how long a metre there; see `viewpoints.places`."""
        return places(self._viewpoint, self._aspect, points)

    @property
    def toward(self) -> Array:
        """From the look-at point of the picture to the camera ``(3,)``."""
        out: Array = self._viewpoint[0] - self._viewpoint[1]
        return out

    def fit(self, spheres: Sequence[Sphere], points: Array | None = None) -> None:
        """Make the default view show these spheres and points ``(n, 3)`` as well; a `chosen` view stays."""
        before = len(self._room) + len(self._extra)
        self._room, self._extra = tuple(spheres), np.zeros((0, 3)) if points is None else points
        self.look()
        if self._body is not None and self.chosen is None and before + len(self._room) + len(self._extra):
            self.aim(self._body)

    def restore(self, viewpoint: Array) -> None:
        """Move to a viewpoint that was `chosen` in this or another window."""
        self._choose(viewpoint, glide=False)

    def refit(self) -> None:
        """Show in a picture of another shape what the last one showed."""
        if self._body is None or not self._reshaped:
            return
        self.look()
        if self.chosen is not None:
            self.restore(self.chosen)
            return
        target = None if self._left is None else self._target  # still in the picture
        self.aim(self._body)
        if target is not None:
            self.keep(self._points, target)

    def look(self) -> None:
        """Update `chosen`."""
        here = self._reported
        if self._settled and here is not None and not _same(here, self._aimed):
            self._aimed, self._arrived, self._left = here, True, None
            self.chosen = widened(here, self._framed)

    def lead_back(self) -> None:
        """Glide back to the arm and above the floor, if the visitor has gone far aside or below."""
        if self._body is None or not self._settled or self._glide is not None:
            return
        position, look_at, up = self._viewpoint
        radius, aside = self._body.radius, look_at - self._body.center
        near = aside * min(1.0, _FARTHEST_ASIDE * radius / max(float(np.linalg.norm(aside)), 1e-9))
        center, out = self._body.center + near, position - look_at
        lowest = self._body.mount.floor + _LOWEST * radius - center[2]
        height = max(out[2], min(lowest, float(np.linalg.norm(out))))
        # The page reports rounded numbers: at a limit, they may lie a little beyond it.
        too_low = height - out[2] > SAME * radius
        if not too_low and float(np.linalg.norm(near - aside)) <= SAME * radius:
            return
        if too_low:
            level = math.hypot(out[0], out[1])
            across = math.sqrt(max(float(out @ out) - height**2, 0.0))
            out = np.array([*(out[:2] * (across / level) if level > 1e-9 else (across, 0.0)), height])
        self._choose(widened(np.stack([center + out, center, up]), self._framed))

    @property
    def _aspect(self) -> float:
        width, height = self._camera.image_width, self._camera.image_height
        return width / height if width > 0 and height > 0 else 1.6

    @property
    def small(self) -> bool:
        """Whether the picture is as small as on a phone."""
        return 0 < min(self._camera.image_width, self._camera.image_height) < _SMALL_PICTURE

    @property
    def _reshaped(self) -> bool:
        return abs(_farther(self._aspect) / _farther(self._framed) - 1.0) > _RESIZED

    @property
    def _settled(self) -> bool:
        return self._arrived or time.perf_counter() - self._aimed_at > PATIENCE

    @property
    def _viewpoint(self) -> Array:
        """The viewpoint of the picture, or the one it is on its way to."""
        return self._reported if self._reported is not None and self._settled else self._aimed

    def _shows(self, viewpoint: Array, points: Array) -> bool:
        margin = 0.0 if self._body is None else _AROUND * self._body.radius
        return len(points) == 0 or contains(viewpoint, self._aspect, points, margin)

    def _arm(self, points: Array) -> Sphere:
        """A sphere around the arm whose frames have these origins."""
        if self._body is None:
            return round_points(points)
        center, radius = round_points(np.vstack([points, self._body.mount.foot]))
        return center, radius + _AROUND * self._body.radius

    def _choose(self, viewpoint: Array, glide: bool = True) -> None:
        """Move to a viewpoint that the visitor has chosen, as in a wide picture."""
        self.chosen, self._framed, self._left = viewpoint, self._aspect, None
        self._go(narrowed(viewpoint, self._framed), glide)

    def _go(self, viewpoint: Array, glide: bool = False) -> None:
        start, now = self._viewpoint, time.perf_counter()
        # The page reports only changes. What it reported before it arrives elsewhere is older than the way there.
        here = self._reported is not None and _same(self._reported, viewpoint)
        elsewhere = here and not self._settled and not _same(self._aimed, viewpoint)
        self._aimed, self._aimed_at = viewpoint, now
        self._arrived = here and not elsewhere
        self._glide = (start, now) if glide and not self._arrived else None
        if self._glide is None:
            self._send(viewpoint, elsewhere)

    def _send(self, viewpoint: Array, anew: bool = False) -> None:
        position, look_at, up = viewpoint
        self._camera.up_direction = up
        if anew:  # viser sends nothing that equals the last report
            self._camera.position = position + up
        self._camera.position = position
        self._camera.look_at = look_at

    def _here(self) -> Array | None:
        """The viewpoint that the page reported last; None if it is invalid."""
        camera = self._camera
        try:
            here = np.array([camera.position, camera.look_at, camera.up_direction], float)
        except ValueError:  # a row of another length
            return None
        return here if here.shape == (3, 3) and (np.abs(here) < FARTHEST).all() else None

    async def _on_update(self, _: viser.CameraHandle) -> None:
        self._reported = here = self._here()
        if not self._arrived and here is not None:
            self._arrived = _same(here, self._aimed)
        if self._reshaped:
            self._post("resized", None)
        now = time.perf_counter()
        if now - self._posted_at >= LOOK_EVERY:
            self._posted_at = now
            self._post("looked", None)


def _together(body: Body, room: Sequence[Sphere]) -> Sphere:
    """A sphere around the arm at home and these spheres."""
    sphere: Sphere = (body.center, body.radius)
    for other in room:
        sphere = round_both(sphere, other)
    return sphere


def _framed(sphere: Sphere, out: Array, aspect: float, up: Array = UP) -> Array:
    """The viewpoint in the direction `out` of a sphere that it fills the picture with."""
    center, radius = sphere
    distance = _MARGIN * radius / math.sin(_half_angle(aspect))
    return np.stack([center + out / float(np.linalg.norm(out)) * distance, center, up])


def _distance(viewpoint: Array) -> float:
    return float(np.linalg.norm(viewpoint[0] - viewpoint[1]))


def _half_angle(aspect: float) -> float:
    return math.atan(math.tan(FOV / 2) * min(aspect, 1.0))


def _farther(aspect: float) -> float:
    """How many times farther than in a wide picture the camera is."""
    return math.sin(FOV / 2) / math.sin(_half_angle(aspect))


def _at_distance(viewpoint: Array, factor: float) -> Array:
    """Multiply the camera's distance to the look-at point by `factor`."""
    position, look_at, up = viewpoint
    return np.stack([look_at + (position - look_at) * factor, look_at, up])


def _same(a: Array, b: Array) -> bool:
    distance = float(np.linalg.norm(b[0] - b[1]))
    return bool(np.abs(a[:2] - b[:2]).max() < SAME * distance and np.abs(a[2] - b[2]).max() < SAME)
