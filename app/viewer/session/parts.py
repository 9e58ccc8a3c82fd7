"""What the parts of a session may use of their page."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Protocol

from app.viewer.feature import Feature, Stage
from app.viewer.own_arm import OwnArm
from app.viewer.panel.joints import JointSliders
from app.viewer.panel.layout import Panel
from app.viewer.panel.status import StatusLine
from app.viewer.scene.camera import VisitorCamera
from app.viewer.session.channel.channel import Channel
from app.viewer.session.choices import ViewState
from app.viewer.session.controller import ArmController
from app.viewer.session.forms import Forms
from app.viewer.session.lessons import LessonChoice
from app.viewer.session.numbers import Numbers
from app.viewer.session.posture import PosturePanel
from app.viewer.session.state import PageState
from kin import Robot
from kin.transforms import Array
from kin.units import Units


class Page(Stage, Protocol):
    """A visitor's page. The class itself knows all its parts, so they know it by this description."""

    own: OwnArm | None
    arm: ArmController
    units: Units
    camera: VisitorCamera
    view: ViewState
    system_dark: bool
    channel: Channel
    panel: Panel
    forms: Forms
    sliders: JointSliders
    posture: PosturePanel
    status: StatusLine
    lessons: LessonChoice
    numbers: Numbers

    @property
    def features(self) -> list[Feature]:
        """The tabs, and the open lesson with its steps."""

    def for_features(self, action: Callable[[Feature], None]) -> None:
        """Call every feature; an error of one does not stop the others."""

    def put_back(self) -> None:
        """Show in all controls of the arm what is true."""

    def refuse(self, key: Hashable, why: str) -> None:
        """Say why an event is not handled."""

    def snapshot(self) -> PageState:
        """The present state."""

    def settle_status(self) -> None:
        """End the news in the status: show what is true now."""

    def change_robot(self, robot: Robot, q: Array | None = None, glide: bool = False) -> None:
        """Replace the robot, at its home configuration or at `q` ``(n,)``, in a fitting view."""

    def set_locks(self, locks: Sequence[bool]) -> None:
        """Lock exactly these joints ``(n,)``."""

    def change_lock(self, joint: int | None, lock: bool) -> None:
        """Lock or unlock one joint, or all of them, at the value it is heading for."""

    def set_branch(self, branch: str) -> None:
        """Request a branch from the next target on."""

    def renew_sliders(self) -> None:
        """Make the sliders of the joints anew."""

    def place_scale(self) -> None:
        """Write the length of the floor's scale bar where it covers nothing, as camera and tool are now."""
