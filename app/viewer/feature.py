"""Features: parts of the page with their own controls and drawings, such as the workspace tab and each lesson.

A feature sees its visitor's session only through :class:`Stage`, whose members are the parts of the page: the arm
(``stage.arm``), the robots (``stage.robots``), units and colours (``stage.display``), the status line
(``stage.status``) and so on. What a part offers stands in its class. Controls post their events; the methods of a
feature are called by the visitor's worker, one at a time, inside ``client.atomic()``. So a feature needs no locks,
and what it sends appears together with the arm's new pose.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence, Set
from types import MappingProxyType
from typing import ClassVar, Protocol

import viser

from app.live import Listener
from app.shared.security import Rights
from app.viewer.activity.activity import Activity
from app.viewer.meshes.bodies import Bodies
from app.viewer.meshes.reader import ClientMeshes
from app.viewer.own_arm import clean
from app.viewer.page.controller import ArmController
from app.viewer.page.display import Display
from app.viewer.page.joints import Joints
from app.viewer.page.links import Links
from app.viewer.page.picture import Picture
from app.viewer.page.robots import Robots
from app.viewer.page.services import Services
from app.viewer.panel.fence import Fence
from app.viewer.panel.part import Shows
from app.viewer.panel.status import Notice, StatusLine
from app.viewer.scene.camera import Sphere, VisitorCamera
from kin import IKResult, InputError
from kin.collision import Contact

SAVED = "Your browser has put it where it puts downloads."


class Stage(Protocol):
    """The parts of a visitor's page that its features use.

    A protocol, because the session's page builds the features and so knows their classes.

    Attributes:
        client: the visitor's browser tab: its ``gui``, ``scene`` and ``camera``.
        arm: the arm on show: ``arm.now`` is what it is at one moment; the methods move it and change its request.
        robots: the robot on show, and the visitor's own arm.
        display: units, colours, workpieces.
        status: the status line.
        camera: from where the scene is looked at, unless the visitor chooses.
        picture: what of the scene is in the picture, and its legend.
        joints: the joint sliders.
        services: what all pages share: robots, clouds, maps, summaries, the pace of frames.
        rights: what the visitor may cause.
        links: the address of the service, links to the page.
        activity: what is open, and what is withheld.
        meshes, bodies: reads meshes; which body each arm has.
        door: the line to a program, if there is one.
        fence: shows which values of controls have crossed on the way.
    """

    client: viser.ClientHandle
    arm: ArmController
    robots: Robots
    display: Display
    status: StatusLine
    camera: VisitorCamera
    picture: Picture
    joints: Joints
    services: Services
    rights: Rights
    links: Links
    activity: Activity
    meshes: ClientMeshes
    bodies: Bodies
    door: Listener
    fence: Fence

    @property
    def channel(self) -> Shows:
        """Shows values to the page's own scripts, by their keys."""

    def post(self, key: Hashable, value: object = None) -> None:
        """Queue an event for the worker; thread-safe. A newer value replaces a queued one of the same key."""

    def open_choice(self, title: str) -> None:
        """Open another choice of the tab *Learn*, in the same step for undo."""


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

    def on_arm_changed(self, changed: Set[str]) -> None:
        """``stage.arm.now`` is another one, in what is named (`Arm.changes`): once, at the end of a step."""

    def on_result(self, result: IKResult) -> None:
        """Inverse kinematics was solved for a target."""

    def on_request(self) -> None:
        """The task, the requested branch, or the locked joints changed."""

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
    stage.status.show(Notice("hand", f"{name} is saved", words))


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
