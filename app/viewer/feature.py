"""Features: parts of the page with their own controls and drawings, such as the workspace tab and each lesson.

A feature sees its visitor's session only through :class:`Stage`: the robot, where the arm is and where it is
heading, the visitor's scene and panel, and the actions that features may request. Controls post their events; the
methods of a feature are called by the visitor's worker, one at a time, inside ``client.atomic()``. So a feature
needs no locks, and what it sends appears together with the arm's new pose.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import ClassVar, Protocol

import viser

from app.exports.snippets import Service
from app.live import Listener
from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.viewer.activity.activity import Activity
from app.viewer.arm import Arm
from app.viewer.frames import Frames
from app.viewer.meshes.bodies import Bodies
from app.viewer.meshes.reader import ClientMeshes
from app.viewer.own_arm import OwnArm, clean
from app.viewer.panel.fence import Fence
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import Sphere
from kin import IKResult, InputError, Obstacle, Robot
from kin.collision import Contact
from kin.ik import Task
from kin.transforms import Array
from kin.units import Units

SAVED = "Your browser has put it where it puts downloads."


class Stage(Protocol):
    """The part of a visitor's session that features may use."""

    store: Store
    clouds: Clouds
    maps: Maps
    summaries: Summaries
    meshes: ClientMeshes
    bodies: Bodies
    frames: Frames  # the workpieces, and the frame in which poses are shown
    activity: Activity  # what is open, and what is withheld
    door: Listener  # the line to a program, if there is one
    fence: Fence  # shows which values have crossed on the way
    may_save: bool  # whether the visitor may save in a folder of the service

    @property
    def client(self) -> viser.ClientHandle:
        """The visitor's browser tab: its ``gui``, ``scene`` and ``camera``."""

    @property
    def now(self) -> Arm:
        """The arm as it is now: robot, configuration, target, and how targets are solved."""

    @property
    def own(self) -> OwnArm | None:
        """The visitor's own arm, whether or not it is on show."""

    @property
    def units(self) -> Units:
        """The units in which angles and lengths are shown."""

    @property
    def dark(self) -> bool:
        """Whether the page is dark."""

    @property
    def frame(self) -> float:
        """Seconds between two frames of a moving arm, which depend on how many visitors' arms move."""

    @property
    def reading(self) -> float:
        """Seconds between two updates of the numbers that follow a moving arm, which depend on it too."""

    @property
    def service(self) -> Service:
        """Where this page has come from, for code that asks the service."""

    @property
    def link(self) -> str:
        """A link to this page as it is."""

    def link_to(self, features: dict[str, dict[str, object]], lesson: str) -> str:
        """A link to a page with nothing but these states of features, at this lesson."""

    def post(self, key: Hashable, value: object = None) -> None:
        """Queue an event for the worker; thread-safe. A newer value replaces a queued one of the same key."""

    def play(self, on: bool) -> None:
        """Count the arm among those that move, while a feature moves it frame by frame with `move_to`."""

    def move_to(self, q: Array, notice: Notice | None = None, at_once: bool = False) -> None:
        """Move the arm to a configuration ``(n,)``; the target follows the tool, the status shows `notice`.

        The motion is eased unless `at_once`: between two configurations, easing takes the tool off its target.
        """

    def show_own(self, own: OwnArm) -> None:
        """Show an arm of the visitor's own, at its home configuration."""

    def edit_arm(self, own: OwnArm) -> None:
        """Show a changed version of the arm on show as the visitor's own.

        Viewpoint, task and a target that is not reached stay; configuration and locks do if it has as many joints
        of the same kinds.
        """

    def discard_own(self) -> OwnArm | None:
        """Delete the visitor's own arm, and show the robot it was made from; returns the arm."""

    def redraw_body(self) -> None:
        """Draw the body of the arm on show anew: there may be another one by now."""

    def use_frames(self, frames: Frames) -> None:
        """Take these frames."""

    def use_obstacles(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take these obstacles."""

    def solve_again(self) -> None:
        """The visitor changed what the arm avoids: it makes way, and an answer that is on show is renewed."""

    def change_robot(self, robot: Robot) -> None:
        """Show a robot of the service, at its home configuration."""

    def set_target(self, T_base_tool: Array) -> None:
        """Make this pose ``(4, 4)`` the target, as if the gizmo had been dragged there."""

    def set_task(self, task: Task) -> None:
        """Change how much of the target pose the arm must match."""

    def unlock(self, joint: int | None = None) -> None:
        """Unlock one joint; None: all joints."""

    def allow_any_branch(self) -> None:
        """Drop the request for a particular branch."""

    def notify(self, notice: Notice) -> None:
        """Show a notice in the status line."""

    def see_through(self, on: bool, gizmo: bool = False) -> None:
        """Make way for drawings inside the arm: translucent links, and no gizmo unless it is kept.

        Another robot undoes it.
        """

    def show_legend(self, html: str) -> None:
        """Say what is drawn in the scene, on whatever tab; "" removes the legend."""

    def show_driven(self, name: str) -> None:
        """Put a frame around the whole page: a program drives something of this name with it; "" removes it."""

    def show_alone(self, names: str, notice: Notice) -> None:
        """Hide everything in the scene but nodes whose names begin with `names`, and show this in the status line.

        What is hidden stays as it is, and goes on; so does the status.
        """

    def show_all(self) -> None:
        """Show again what `show_alone` has hidden."""

    def open_choice(self, title: str) -> None:
        """Open another choice of the tab *Learn*, in the same step for undo."""

    def show_joints(self, folder: viser.GuiFolderHandle | None) -> None:
        """Show the joint sliders in this folder as well; None: in the tab Move only."""

    def fit_view(self, spheres: Sequence[Sphere], points: Array | None = None) -> None:
        """Make the default view show these spheres and points ``(n, 3)`` as well as the arm.

        A view chosen by the visitor stays.
        """

    def keep_in_view(self, target: Array | None = None, points: Array | None = None) -> None:
        """Glide to where the picture contains the arm at its goal, and these, if it does not.

        Args:
            target: a point ``(3,)`` above which a number is written.
            points: what is drawn besides ``(n, 3)``.
        """

    def toward_camera(self) -> Array:
        """A vector ``(3,)`` in the world frame, from the point the visitor looks at to the camera."""


class Feature:
    """One feature of one visitor. Override what is needed; build controls in ``__init__``.

    Controls go into the container that is open when the feature is constructed.

    Attributes:
        key: short name, used in events and in the shared URL.
        title: name shown to the visitor.
        about: one-sentence description, for the list of lessons.
        messages: the events that the page's own script may send, by the first part of their key.
        files: those of these events that bring a file, and its most bytes (`app.viewer.session.channel.files`).
        acts: whether they change what the visitor sees of the arm and the lessons, which a class that is led or
            frozen does not leave to its students.
        shared: whether the pages that a class follows show its state, as they do that of the open lesson.
        due: the worker sleeps at most this many seconds and then calls `tick`; it also does so after every other
            event. None: no ticks.
    """

    key: ClassVar[str]
    title: ClassVar[str]
    about: ClassVar[str] = ""
    messages: ClassVar[frozenset[str]] = frozenset()
    files: ClassVar[Mapping[str, int]] = MappingProxyType({})
    acts: ClassVar[bool] = True
    shared: ClassVar[bool] = False

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.due: float | None = None

    def post(self, key: Hashable, value: object = None) -> None:
        """Queue an event for this feature's `handle`; thread-safe. Pass it to controls (`panel.listen`)."""
        self.stage.post(("feature", self.key, key), value)

    def handle(self, key: Hashable, value: object) -> None:
        """Process a queued event; raises `kin.InputError` for a value that none of our controls sends."""
        raise KeyError(key)

    def step_name(self, key: Hashable) -> str:
        """What undo calls a change that an event of the feature made."""
        return self.title

    def on_robot(self) -> None:
        """Another robot was selected. Not called for the robot that is there when the feature is constructed."""

    def on_pose(self, T_base_tool: Array) -> None:
        """The scene shows the arm at another ``stage.now.q``, with the tool at this pose ``(4, 4)``."""

    def on_result(self, result: IKResult) -> None:
        """Inverse kinematics was solved for a target."""

    def on_request(self) -> None:
        """The task, the requested branch, or the locked joints changed."""

    def on_obstacles(self) -> None:
        """There are other obstacles, or the arm avoids them from now on, or no longer."""

    def on_contacts(self, contacts: Sequence[Contact]) -> None:
        """What the arm touches has changed; the deepest contact first."""

    def on_style(self) -> None:
        """The units or the colours of the page changed."""

    def on_activity(self) -> None:
        """Something else is open or withheld, or an answer was judged: see `Stage.activity`."""

    @property
    def failure(self) -> str:
        """What has failed and stands, as words after "Ready, but"; "" if nothing has."""
        return ""

    @property
    def offer(self) -> str:
        """What can be done about where the arm is, as HTML for the status card; "" if there is nothing."""
        return ""

    @property
    def labels(self) -> Mapping[str, str]:
        """Words in place of the labels and hints of its declared controls."""
        return {}

    def commands(self) -> Iterable[tuple[str, tuple[str | int, ...], object]]:
        """What the command palette offers of it: words, and key and value of the message of the button."""
        return ()

    def extents(self) -> Sequence[Sphere]:
        """Spheres around what it shows in the scene. *Fit* includes them in the picture with the arm."""
        return ()

    def tick(self, now: float) -> None:
        """Continue long work, for at most ten milliseconds: frames wait. `now` is `time.perf_counter`'s."""

    def state(self) -> dict[str, object]:
        """The visitor's settings as JSON; a shared URL restores them."""
        return {}

    def restore(self, state: dict[str, object]) -> None:
        """Apply settings that `state` returned; missing or invalid ones are ignored."""

    def on_leave(self) -> None:
        """The visitor has disconnected: release what is shared with others. The page no longer exists."""

    def remove(self) -> None:
        """Remove everything from scene and panel."""


def save_file(stage: Stage, name: str, data: bytes | str, words: str = SAVED) -> None:
    """Have the browser of a page save a file, and say so."""
    stage.client.send_file_download(name, data.encode() if isinstance(data, str) else data, save_immediately=True)
    stage.notify(Notice("hand", f"{name} is saved", words))


def sent_text(value: object, most: int) -> tuple[str, str]:
    """Name and text of a file that the page sends, of at most so many bytes; raises `kin.InputError`."""
    match value:
        case [str(name), str(text)] if len(text.encode(errors="replace")) <= most:
            return clean(name, 60), text
        case [str(name), _]:
            raise InputError("file", clean(name, 60), f"a file of at most {most // 1000} kB")
    raise InputError("upload", value, "the name and the text of a file")


def message_of(features: Iterable[Feature], message: object) -> tuple[str, Hashable, object]:
    """Feature, key and value of an event that the page's own script sends to a feature.

    Raises:
        InputError: none of these features takes such a message.
    """
    match message:
        case [str(name), [str(kind), *rest], value] if all(type(part) in (int, str) for part in rest):
            if any(feature.key == name and kind in feature.messages for feature in features):
                return name, (kind, *rest), value
    raise InputError("feature", message, "the name of a feature on show, a key it takes, and a value")
