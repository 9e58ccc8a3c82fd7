"""The layout of the panel."""

from __future__ import annotations

from collections.abc import Sequence

import viser

from app.viewer.own_arm import OwnArm
from app.viewer.panel import Post
from app.viewer.panel.gripper import GripperSlider
from app.viewer.panel.jog import JogPad
from app.viewer.panel.joints import go_to_buttons
from app.viewer.panel.part import add_html
from app.viewer.panel.readout import PoseReadout
from app.viewer.panel.robots import RobotMenu
from app.viewer.panel.share import SharePanel
from app.viewer.panel.status import LOOKING, READY, Notice, StatusLine
from app.viewer.views.templates import render
from kin import Robot, fk
from kin.units import Units

PANEL_WIDTH = 344  # pixels; visitors change it at the panel's edge
SMALL_WIDTH = 280  # of a small one
MOVE, LEARN, VIEW = "Move", "Learn", "View"  # titles of tabs


class Panel:
    """One visitor's panel. Posts what its parts post.

    Args:
        own: the visitor's own arm.
        tabs: titles of the features' tabs.
        acts: whether the visitor may act.

    Attributes:
        jog: buttons that move the arm in steps.
        joints, posture: folders that are filled for each robot.
        gripper: its slider, below those of the joints.
        obstacles: the folder of the obstacles. Like that of `jog` it is closed at first, so that the rest fits a
        small window.
        view, target, avoid: where the choices for the whole page are: in the tab *View*, between the joints and
            the posture, and at the top of the obstacles.
        learn: the tab for lessons.
        tabs: the features' tabs.
        legend: what a lesson draws in the scene; below the tabs, so that it stays when another tab is opened.
        hints: where the hints of the first minute are shown in the scene.
        sheet: the page to print of a worksheet, hidden.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        robots: Sequence[Robot],
        own: OwnArm | None,
        robot: Robot,
        units: Units,
        welcome: Notice,
        tabs: Sequence[str],
        post: Post,
        acts: bool,
    ) -> None:
        self.status = StatusLine(gui, welcome, READY if acts else LOOKING)
        add_html(gui, render("panel/head"))
        self.robots = RobotMenu(gui, robots, own, robot, post)
        self.readout = PoseReadout(gui, fk(robot, robot.q_home), units, acts)
        group = gui.add_tab_group()
        with group.add_tab(MOVE):
            self.joints = gui.add_folder("Joints")
            self.gripper = GripperSlider(gui, self.joints, post)
            go_to_buttons(gui, post)
            self.target = gui.add_folder(None)
            self.posture = gui.add_folder("Posture and redundancy")
            self.jog = JogPad(gui, robot)
            self.obstacles = gui.add_folder("Obstacles", expand_by_default=False)
        self.legend = add_html(gui)
        self.hints = add_html(gui)
        self.sheet = add_html(gui)
        self.learn = group.add_tab(LEARN)
        self.tabs = [group.add_tab(title) for title in tabs]
        for title, tab in zip(tabs, self.tabs, strict=True):
            if title == "Robot":
                with tab:
                    self.robots.add_field(gui, post)
        with group.add_tab(VIEW):
            self.view = gui.add_folder(None)
            with gui.add_folder("Share"):
                self.share = SharePanel(gui, post)
        with self.obstacles:
            self.avoid = gui.add_folder(None)

    def fit(self, panel: viser.MainPanelHandle, embedded: str) -> None:
        """Set the width; within another page, keep the tool's pose and the joints only (``static/layout.css``)."""
        small = embedded == "panel"
        panel.set_width(SMALL_WIDTH if small else PANEL_WIDTH)
        if small:
            self.robots.hide()
            for folder in (self.target, self.jog.folder, self.posture, self.obstacles):
                folder.visible = False
