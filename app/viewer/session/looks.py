"""How a page looks: its units, its colours, and what the scene shows of the arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import viser

from app.viewer.feature import Feature
from app.viewer.meshes.bodies import Bodies
from app.viewer.own_arm import OwnArm
from app.viewer.panel.layout import Panel
from app.viewer.panel.status import Notice, StatusLine
from app.viewer.panel.theme import configure_theme
from app.viewer.session.choices import ViewState
from app.viewer.session.controller import ArmController
from app.viewer.session.forms import Forms
from app.viewer.session.numbers import Numbers
from app.viewer.session.posture import PosturePanel
from kin.units import Units


class LooksPage(Protocol):
    """What looks may use of a page, and change of it."""

    client: viser.ClientHandle
    arm: ArmController
    bodies: Bodies
    own: OwnArm | None
    panel: Panel
    forms: Forms
    posture: PosturePanel
    status: StatusLine
    numbers: Numbers
    units: Units
    view: ViewState
    system_dark: bool

    @property
    def dark(self) -> bool:
        """Whether the page is dark."""

    def renew_sliders(self) -> None:
        """Make the sliders of the joints anew."""

    def for_features(self, action: Callable[[Feature], None]) -> None:
        """Call every feature."""


class Looks:
    """Changes the looks of one page. Not thread-safe: the visitor's worker calls it."""

    def __init__(self, page: LooksPage) -> None:
        self._page = page

    def use_units(self, units: Units) -> None:
        """Show all numbers in these units."""
        page = self._page
        page.units = units
        page.forms.show()
        page.status.use(units)
        page.renew_sliders()
        page.posture.show()
        page.arm.scene.floor.use_units(units)
        page.numbers.use_pose()
        page.for_features(lambda feature: feature.on_style())

    def use_colours(self, dark: bool | None, system_dark: bool) -> None:
        """Make the page dark or light; None: as the visitor's system is."""
        page = self._page
        before = page.dark
        page.view, page.system_dark = replace(page.view, dark=dark), system_dark
        if page.dark != before:
            configure_theme(page.client.gui, page.dark)
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
        if view.rotations != before.rotations:
            page.panel.readout.use_rotations(view.rotations)
            page.numbers.use_pose()
        page.forms.show()
        self.apply()

    def redraw_body(self) -> None:
        """Draw the body of the arm on show anew."""
        page = self._page
        page.arm.scene.use_drawing(page.bodies.of(page.arm.robot, page.own))
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
        page, scene = self._page, self._page.arm.scene
        page.arm.avoid_collisions(page.view.avoid)
        scene.show_as(page.view.look)
        page.panel.gripper.offer(scene.opened)
        scene.show_frames(page.view.frames)
        scene.show_labels(page.view.labels)
        scene.show_axes(page.view.axes)
        scene.floor.use_dark(page.dark)
        scene.floor.use_units(page.units)
