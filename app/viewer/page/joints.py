"""The joint sliders of a page."""

from __future__ import annotations

import viser

from app.viewer.page.controller import ArmController
from app.viewer.page.display import Display
from app.viewer.panel import Post
from app.viewer.panel.fence import Fence
from app.viewer.panel.joints import JointSliders


class Joints:
    """The sliders of the arm on show: in the tab *Move*, and for a while in a folder of a feature as well.

    Args:
        folder: that of the tab *Move*.

    Attributes:
        sliders: the present ones; none until `renew` is called.
    """

    sliders: JointSliders

    def __init__(
        self,
        gui: viser.GuiApi,
        folder: viser.GuiFolderHandle,
        arm: ArmController,
        display: Display,
        post: Post,
        fence: Fence,
    ) -> None:
        self._gui, self._post, self._fence = gui, post, fence
        self._arm, self._display = arm, display
        self._folder = folder
        self._more: viser.GuiFolderHandle | None = None

    def show_in(self, folder: viser.GuiFolderHandle | None) -> None:
        """Show the sliders in this folder as well; None: in the tab *Move* only."""
        self._more = folder
        self.renew()

    def renew(self) -> None:
        """Make the sliders anew: there is another robot, or other units."""
        before = getattr(self, "sliders", None)
        if before is not None:
            before.remove()
        folders = [self._folder] if self._more is None else [self._folder, self._more]
        arm, units = self._arm, self._display.units
        self.sliders = JointSliders(
            self._gui, folders, arm.robot, arm.goal, arm.locks, units, self._post, self._fence, before
        )
