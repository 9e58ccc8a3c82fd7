"""A page without a browser, a worker or a session: a feature and what viser's handles say it shows.

`BarePage` is the stage of one feature. `panel` and `scene` describe what is on show in a form that does not depend
on how it was made: names, ids and hidden nodes of the scene do not count.
"""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import viser

import kin
from app.shared.store import Store
from app.viewer.arm import Arm
from app.viewer.feature import Feature
from app.viewer.panel.fence import Fence
from kin.transforms import Array, pose_from_position_wxyz
from kin.units import DEFAULT_UNITS

STORE = Store()
EYE = np.array([1.7, 1.1, 0.9])


def nodes_of(scene: Any) -> dict[str, Any]:
    """The nodes that a scene of viser has, by name."""
    nodes: dict[str, Any] = scene._handle_from_node_name
    return nodes


def state_of(handle: Any) -> Any:
    """What viser keeps of a control or node: its properties, value, uuid, and whether it was removed."""
    return handle._impl


def controls_of(gui: Any) -> list[tuple[str, Any]]:
    """The controls that have a label, each with it, the oldest first."""
    handles = list(gui._gui_input_handle_from_uuid.values())
    return [(state_of(h).props.label, h) for h in handles if hasattr(state_of(h).props, "label")]


class _Part:
    """A part of a bare page. What it offers is kept by the page itself, where `names` says under which name."""

    def __init__(self, page: Any, names: Mapping[str, str] | None = None, **parts: Any) -> None:
        self._page, self._names = page, names or {}
        vars(self).update(parts)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._page, self._names.get(name, name))


class BarePage:
    """The stage of one feature; the arm moves where it is sent, at once.

    Attributes:
        sent: the kinds of the messages to the browser.
        notices, legend, driven, poses: what the feature has said, and where it has sent the arm.
    """

    def __init__(self, server: viser.ViserServer, robot: kin.Robot) -> None:
        storage = SimpleNamespace(get_item=lambda *_, **__: None)
        self.client = SimpleNamespace(
            gui=server.gui, scene=server.scene, camera=_camera(), client_id=0, local_storage=storage
        )
        self._answered = threading.Event()
        self.fence = Fence(cast(Any, self.client), self._answered.set)
        self.store, self.units, self.dark = STORE, DEFAULT_UNITS, False
        self.frame, self.reading = 1 / 30, 0.05
        self.eye = np.ones(3)  # from the camera's look-at point
        self.own: Any = None
        self.opening: float | None = None  # of the gripper
        self.legend, self.driven, self.translucent = "", "", False
        self.notices: list[Any] = []
        self.views: list[tuple[Any, ...]] = []
        self.kept: list[Array] = []  # points that the picture was to contain
        self.events: list[tuple[Hashable, object]] = []
        self.feature: Feature | None = None
        self.targets: list[Array] = []
        self.activity = SimpleNamespace(
            changed=lambda: None, lesson=None, withheld=frozenset(), text=lambda lesson: None
        )
        self._make_parts()
        self.use(robot)

    def _make_parts(self) -> None:
        self.arm = _Part(self, scene=_Part(self))
        self.robots = _Part(self, {"show": "change_robot", "edit": "edit_arm"})
        self.status = _Part(self, {"show": "notify"})
        self.camera = _Part(self, {"fit": "fit_view", "toward": "eye"})
        self.channel = SimpleNamespace(show=lambda key, value: setattr(self, key, value))
        self.joints = _Part(self, {"show_in": "show_joints"})
        self.rights = _Part(self, {"save": "may_save"})
        self.links = _Part(self, {"page": "link", "to": "link_to"})
        self.services = _Part(self, pace=_Part(self, {"interval": "frame"}))
        self.display = self.picture = _Part(self)

    def use(self, robot: kin.Robot, q: Array | None = None, **more: Any) -> None:
        """Show a robot at a configuration, and what else `Arm` has."""
        q = robot.q_home if q is None else q
        self.now = Arm(robot, q, q, **more)

    def post(self, key: Hashable, value: object = None) -> None:
        self.events.append((key, value))

    def answer(self) -> None:
        """The browser says what it has heard, as long as there is something to be said."""
        while True:
            self.fence.ask()
            if self.fence.last == self.fence.asked:
                return
            assert self._answered.wait(10.0)
            self._answered.clear()
            self.fence.passed()

    def move_to(self, q: Array, notice: Any = None, at_once: bool = False) -> None:
        self.now = Arm(self.now.robot, np.array(q), np.array(q), task=self.now.task)
        if notice is not None:
            self.notices.append(notice)
        if self.feature is not None:
            self.feature.on_arm_changed(self.now.changes(None))

    def set_target(self, T: Array) -> None:
        self.targets.append(T)

    def notify(self, notice: Any) -> None:
        self.notices.append(notice)

    def show_legend(self, html: str) -> None:
        self.legend = html

    def show_alone(self, names: str, notice: Any) -> None:
        self.alone = names

    def show_all(self) -> None:
        self.alone = ""

    def see_through(self, on: bool, gizmo: bool = False) -> None:
        self.translucent = on

    def fit_view(self, spheres: Any, points: Array | None = None) -> None:
        self.views.append((spheres, points))

    def keep_in_view(self, target: Array | None = None, points: Array | None = None) -> None:
        self.kept.append(np.zeros((0, 3)) if points is None else points)

    # What happens

    def open(self, feature: type[Feature]) -> Any:
        """Build a feature."""
        self.feature = feature(self)  # type: ignore[arg-type]
        self.rest()
        return self.feature

    def rest(self, most: float = 60.0) -> None:
        """Handle what was posted, and tick until the feature sleeps."""
        assert self.feature is not None
        end = time.monotonic() + most
        while self.events or self.feature.due is not None:
            while self.events:
                key, value = self.events.pop(0)
                assert isinstance(key, tuple)
                assert key[:2] == ("feature", self.feature.key)
                self.feature.handle(key[2], value)
            if self.feature.due is not None:
                time.sleep(min(self.feature.due, 0.3))
                self.feature.tick(time.perf_counter())
            assert time.monotonic() < end, "the feature does not come to rest"

    def messages_each(self, lesson: Any, robot: kin.Robot, count: int = 10) -> float:
        """Messages for one new configuration of a lesson, on average; a frame alone takes none."""
        self.watch()
        for share in np.linspace(0.0, 1.0, count + 1)[1:]:
            self.use(robot, robot.q_home + share * np.array([0.3, -0.2, 0.25, 0.1, 0.2, 0.3, 0.1])[: robot.n])
            before = len(self.sent)
            lesson.on_arm_changed(self.now.changes(None))
            assert len(self.sent) == before, "a frame alone takes none"
            self.rest()
        return len(self.sent) / count

    def pose(self, q: Array, **more: Any) -> None:
        """Move the arm."""
        assert self.feature is not None
        self.use(self.now.robot, q, **more)
        self.feature.on_arm_changed(self.now.changes(None))
        self.rest()

    def restore(self, state: dict[str, object]) -> None:
        """Restore a state as a link does."""
        assert self.feature is not None
        self.feature.restore(state)
        self.rest()

    def style(self, units: Any) -> None:
        """Change the units."""
        assert self.feature is not None
        self.units = units
        self.feature.on_style()
        self.rest()

    def change(self, robot: kin.Robot) -> None:
        """Select another robot."""
        assert self.feature is not None
        self.use(robot)
        self.translucent = False
        self.feature.on_robot()
        self.rest()

    def set(self, label: str, value: object) -> None:
        """Set a control as a visitor does; what it posts waits for `rest`."""
        handle = self.control(label)
        state_of(handle).value = value
        target = SimpleNamespace(value=value)
        for call in state_of(handle).update_cb:
            asyncio.run(call(SimpleNamespace(client=self.client, target=target)))

    def press(self, label: str, option: str | None = None) -> None:
        """Press a button as a visitor does, or one of a group."""
        self.set(label, True if option is None else option)

    def watch(self) -> None:
        """Note the kinds of messages in `sent` from now on."""
        self.sent: list[str] = []
        interface = self.client.gui._websock_interface
        queue = type(interface).queue_message

        def noted(message: Any) -> None:
            self.sent.append(type(message).__name__)
            queue(interface, message)

        interface.queue_message = noted

    # What is shown

    def control(self, label: str) -> Any:
        """The handle of the control with this label."""
        (found,) = [handle for name, handle in controls_of(self.client.gui) if name == label]
        return found

    def panel(self) -> list[Any]:
        """The controls that are seen, in their order, with all their properties; containers without a name do not
        count."""
        gui = self.client.gui
        return list(_inside(gui, gui._container_handle_from_uuid["root"]))

    def scene(self) -> list[tuple[str, list[float], dict[str, Any]]]:
        """What is drawn: kind, pose in the scene ``(12,)``, and properties of each visible node."""
        nodes = nodes_of(self.client.scene)
        found = []
        for name, node in nodes.items():
            if (T := _pose(nodes, name)) is None:
                continue
            props = {key: _plain(value) for key, value in vars(state_of(node).props).items()}
            kind = type(node).__name__
            if kind == "FrameHandle" and not props["show_axes"]:
                continue
            if kind == "LineSegmentsHandle" and not len(props["points"]):
                continue
            found.append((kind, T[:3].ravel().tolist(), props))
        return found


@contextmanager
def bare_page(robot: kin.Robot) -> Iterator[BarePage]:
    """A page for a robot, with a server of its own."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        yield BarePage(server, robot)
    finally:
        server.stop()


def _camera() -> SimpleNamespace:
    return SimpleNamespace(position=EYE, look_at=np.zeros(3), image_width=1280, image_height=720)


def _inside(gui: Any, container: Any) -> Iterator[Any]:
    children = sorted(container._children.values(), key=lambda child: state_of(child).props.order)
    for child in children:
        props = {k: _plain(v) for k, v in vars(state_of(child).props).items()}
        if not props.get("visible", True):
            continue
        for name in ("order", "visible", "_markdown"):
            props.pop(name, None)
        kind = type(child).__name__
        if kind == "GuiFolderHandle":
            inner = list(_inside(gui, child))
            if props["label"] is None:
                yield from inner
            else:
                yield {"kind": kind, **props, "inside": inner}
        elif kind != "GuiHtmlHandle" or props["content"]:
            value = getattr(state_of(child), "value", None)
            yield {"kind": kind, "value": _plain(value) if kind != "GuiButtonGroupHandle" else None, **props}


def _pose(nodes: dict[str, Any], name: str) -> Array | None:
    """The pose in the scene ``(4, 4)``; None: it is hidden."""
    T = np.eye(4)
    parts = name.strip("/").split("/")
    for k in range(len(parts)):
        above = nodes.get("/" + "/".join(parts[: k + 1]))
        if above is None:
            continue
        if not state_of(above).visible:
            return None
        T = T @ pose_from_position_wxyz(state_of(above).position, state_of(above).wxyz)
    return T


def _plain(value: Any) -> Any:
    """A property as JSON has it."""
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if value is None or isinstance(value, str | int | float):
        return value
    return vars(value) if hasattr(value, "__dict__") else str(value)
