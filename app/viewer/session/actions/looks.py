"""The visitor's actions on the looks of the page and on the view of the scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import kin
from app.viewer.labels import size_labels, text_factor
from app.viewer.panel.gripper import share_of
from app.viewer.scene.camera import Sphere
from app.viewer.scene.viewpoints import SIDES
from app.viewer.session.parts import Page
from kin.transforms import Array


class LookControls:
    """Changes the looks of one page.

    Attributes:
        handlers: by the first part of an event's key; each takes the other parts, and the value.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        arm, looks = page.arm, page.looks
        self.handlers: dict[str, Callable[..., Any]] = {
            "copy-as": lambda name: page.panel.share.choose(name),
            "view": self._on_view,
            "body": looks.use_library,
            "system-dark": lambda dark: looks.use_colours(page.view.dark, bool(dark)),
            "camera": lambda _: page.camera.aim(arm.scene.body, self._frames(), glide=True),
            "fit-arm": self._fit,
            "look-from": self._look_from,
            "resized": self._on_resize,
            "looked": self._on_look,  # the viewpoint is read when the camera rests
            "frame": lambda name: page.use_frames(page.frames.choose(name)),
            "gripper": lambda value: arm.scene.open_gripper(share_of(value)),
            "text-size": lambda name: size_labels(page.client.scene, text_factor(name)),
        }

    def _fit(self, _: object) -> None:
        """Show the whole arm, and what there is of a program, obstacles and clouds."""
        found: list[Sphere] = []
        self._page.for_features(lambda feature: found.extend(feature.extents()))
        self._page.camera.look_at_arm(self._frames(), found)

    def _on_resize(self, _: object) -> None:
        self._page.camera.refit()
        self._on_look(None)

    def _on_look(self, _: object) -> None:
        self._page.arm.scene.size_gizmo(self._page.camera.small)
        self._page.place_scale()

    def _look_from(self, side: object, _: object = None) -> None:
        if side not in SIDES:
            raise kin.InputError("look-from", side, "one of " + ", ".join(SIDES))
        self._page.camera.look_from(side, self._frames())

    def _frames(self) -> Array:
        """Origins ``(n, 3)`` of the frames of the arm where it is heading."""
        frames: Array = kin.link_frames(self._page.now.robot, self._page.now.goal)[:, :3, 3]
        return frames

    def _on_view(self, place: str, path: str, serial: int, value: object) -> None:
        page = self._page
        before, chosen = page.view, page.forms.read(place, path, serial, value)
        if chosen.units != page.units:
            page.looks.use_units(chosen.units)
        if chosen.view != before:
            page.looks.use_view(chosen.view)
        if chosen.view.avoid != before.avoid:
            page.solve_again()
