"""How a page looks: its units, its colours, what the scene shows of the arm, and the view of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import kin
from app.viewer.labels import size_labels, text_factor
from app.viewer.panel.gripper import share_of
from app.viewer.panel.status import Notice
from app.viewer.panel.theme import configure_theme
from app.viewer.scene.camera import Sphere
from app.viewer.scene.viewpoints import SIDES
from app.viewer.session.choices import ViewState
from app.viewer.session.parts import Page
from kin.units import Units


class Looks:
    """Changes the looks of one page. Not thread-safe: the visitor's worker calls it.

    Attributes:
        handlers: by the first part of an event's key; each takes the other parts, and the value.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        self.handlers: dict[str, Callable[..., Any]] = {
            "copy-as": lambda name: page.panel.share.choose(name),
            "view": self._on_view,
            "body": self.use_library,
            "system-dark": lambda dark: self.use_colours(page.view.dark, bool(dark)),
            "camera": lambda _: page.camera.aim(page.arm.scene.body, page.arm.now.goal_points, True),
            "fit-arm": self._fit,
            "look-from": self._look_from,
            "resized": self._on_resize,
            "looked": self._on_look,  # the viewpoint is read when the camera rests
            "frame": lambda name: page.display.use_frames(page.display.frames.choose(name)),
            "gripper": lambda value: page.arm.scene.open_gripper(share_of(value)),
            "text-size": lambda name: size_labels(page.client.scene, text_factor(name)),
        }

    def use_units(self, units: Units) -> None:
        """Show all numbers in these units."""
        page = self._page
        page.display.units = units
        page.forms.show()
        page.status.use(units)
        page.joints.renew()
        page.posture.show()
        page.arm.scene.floor.use_units(units)
        page.numbers.use_pose()
        page.for_features(lambda feature: feature.on_style())

    def use_colours(self, dark: bool | None, system_dark: bool) -> None:
        """Make the page dark or light; None: as the visitor's system is."""
        page = self._page
        display, before = page.display, page.display.dark
        page.view, page.system_dark = replace(page.view, dark=dark), system_dark
        display.dark = page.view.is_dark(system_dark)
        if display.dark != before:
            configure_theme(page.client.gui, display.dark)
            page.for_features(lambda feature: feature.on_style())
            self.apply()

    def use_view(self, view: ViewState) -> None:
        """Show the page and the scene as `view` says."""
        page = self._page
        before, page.view = page.view, replace(view, dark=page.view.dark)
        if view.base_axes != before.base_axes:
            page.arm.use_base_axes(view.base_axes)
        if view.dark != before.dark:
            self.use_colours(view.dark, page.system_dark)
        if view.detailed != page.bodies.detailed:
            page.bodies.detailed, page.bodies.last_refusal = view.detailed, ""
            self.redraw_body()
        if view.language != before.language:
            page.activity.language = view.language
            page.lessons.show_language()
            page.for_features(lambda feature: feature.on_style())
        if view.rotations != before.rotations:
            page.panel.readout.use_rotations(view.rotations)
            page.numbers.use_pose()
        page.forms.show()
        self.apply()

    def redraw_body(self) -> None:
        """Draw the body of the arm on show anew."""
        page = self._page
        page.arm.scene.use_drawing(page.bodies.of(page.arm.robot, page.robots.own))
        self.apply()

    def use_library(self, why: str) -> None:
        """A detailed body was read, or could not be, for this reason: then our own drawing stays."""
        page = self._page
        if not why:
            self.redraw_body()
        elif page.bodies.detailed and why != page.bodies.last_refusal:
            page.bodies.last_refusal = why
            detail = f"{why} The simple drawing stays."
            page.status.show(Notice("error", f"The real shape of {page.arm.robot.name} cannot be shown", detail))

    def apply(self) -> None:
        """Show the scene as the page's view says."""
        page, scene, display = self._page, self._page.arm.scene, self._page.display
        page.arm.avoid_collisions(page.view.avoid)
        scene.show_as(page.view.look)
        page.panel.gripper.offer(scene.opened)
        scene.show_frames(page.view.frames)
        scene.show_labels(page.view.labels)
        scene.show_axes(page.view.axes)
        scene.floor.use_dark(display.dark)
        scene.floor.use_units(display.units)

    # What the visitor does

    def _fit(self, _: object) -> None:
        """Show the whole arm, and what there is of a program, obstacles and clouds."""
        found: list[Sphere] = []
        self._page.for_features(lambda feature: found.extend(feature.extents()))
        self._page.camera.look_at_arm(self._page.arm.now.goal_points, found)

    def _on_resize(self, _: object) -> None:
        self._page.camera.refit()
        self._on_look(None)

    def _on_look(self, _: object) -> None:
        self._page.arm.scene.size_gizmo(self._page.camera.small)
        self._page.picture.place_scale()

    def _look_from(self, side: object, _: object = None) -> None:
        if side not in SIDES:
            raise kin.InputError("look-from", side, "one of " + ", ".join(SIDES))
        self._page.camera.look_from(side, self._page.arm.now.goal_points)

    def _on_view(self, place: str, path: str, serial: int, value: object) -> None:
        page = self._page
        before, chosen = page.view, page.forms.read(place, path, serial, value)
        if chosen.units != page.display.units:
            self.use_units(chosen.units)
        if chosen.view != before:
            self.use_view(chosen.view)
        if chosen.view.avoid != before.avoid:
            page.arm.solve_again(page.status.shows_result)
