"""A browser tab without a browser: speaks viser's websocket protocol and stores what a page would show."""

from __future__ import annotations

import contextlib
import json
import time
import weakref
from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

import msgspec
import numpy as np
import viser
import zstandard
from starlette.types import Message
from starlette.websockets import WebSocket
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from app.service.web.viewer_proxy import (
    CHANNEL_NAME,
    CHANNEL_PROTOCOL,
    FILE,
    ChannelConnection,
    VisitorConnection,
)
from app.viewer.session.persistence import SAVE_AFTER
from app.viewer.session.state import KEY_LAST
from app.viewer.session.worker.worker import Worker
from app.viewer.viser_patches import MARK
from kin.transforms import pose_from_position_wxyz, wxyz_from_rotation

ANSWER = 1.5  # s until a message is answered on a busy machine, by a service in another process
PATIENCE = 30.0  # s until something that must happen has happened, on a machine that does much else
LOOK = 0.005  # s between two looks at the channel
SAME_STEP, LATE = 0.02, 0.2  # s between the two connections of one step; in all, while an arm moves
WORK = 10.0  # s for which `settle` waits for a worker that has something to do
QUIET = 0.3  # s without a message: the page rests, as far as somebody outside of the service can tell
WINDOW = 0.03  # s; viser holds messages back for a sixtieth of a second

# Of services in this process: workers that something was posted to, those that act, and how many messages of each
# visitor have been handled, by the visitor's port.
_workers: weakref.WeakSet[Worker] = weakref.WeakSet()
_acting: weakref.WeakSet[Worker] = weakref.WeakSet()
_handled: dict[int, int] = {}
_post, _act, _connect = Worker.post, Worker._act_once, VisitorConnection.__init__
_connect_channel = ChannelConnection.__init__
_submit = ThreadPoolExecutor.submit
_pending: set[Future[Any]] = set()  # what threads of this process compute meanwhile


def _watched_post(self: Worker, key: Hashable, value: object = None) -> None:
    _workers.add(self)
    _post(self, key, value)


def _watched_act(self: Worker) -> float | None:
    _acting.add(self)
    try:
        return _act(self)
    finally:
        _acting.discard(self)


def _watched_submit(self: ThreadPoolExecutor, *given: Any, **named: Any) -> Future[Any]:
    future = _submit(self, *given, **named)
    _pending.add(future)
    future.add_done_callback(_pending.discard)
    return future


def _watched_channel(self: ChannelConnection, visitor: WebSocket) -> None:
    _connect_channel(self, visitor)
    _count_messages(visitor)


def _count_messages(visitor: WebSocket) -> None:
    """Note how many messages of a connection have been handled."""
    receive, received = visitor.receive, 0
    port = visitor.client.port if visitor.client else 0

    async def watched() -> Message:
        nonlocal received
        _handled[port] = received  # it asks for the next one
        event = await receive()
        if event["type"] == "websocket.receive":
            received += 1
        return event

    visitor.receive = watched  # type: ignore[method-assign]


def _watched_connect(self: VisitorConnection, visitor: WebSocket) -> None:
    _connect(self, visitor)
    _count_messages(visitor)


Worker.post, Worker._act_once = _watched_post, _watched_act  # type: ignore[method-assign]
VisitorConnection.__init__ = _watched_connect  # type: ignore[method-assign]
ChannelConnection.__init__ = _watched_channel  # type: ignore[method-assign]
ThreadPoolExecutor.submit = _watched_submit  # type: ignore[assignment, method-assign]


def working() -> bool:
    """Whether a viewer in this process has something to do that was posted: a page is not at rest then."""
    return bool(list(_acting)) or any(not each.join(0.0) and each._inbox.waits for each in list(_workers))


def _acts_soon() -> bool:
    """Whether a viewer in this process, at rest now, acts by itself within `QUIET`, or may hear of a result."""
    soon = time.monotonic() + QUIET
    dues = [each._turn.due for each in list(_workers) if not each.join(0.0)]
    return bool(_pending) or any(due is not None and due < soon for due in dues)


# Messages with a mark in viser's connection, as static/channel.js has them.
_SCRIPT = (Path(__file__).parents[2] / "static" / "channel.js").read_text(encoding="utf-8")
IN_ORDER = frozenset(json.loads(_SCRIPT.split("IN_ORDER = new Set(", 1)[1].split(")", 1)[0]))
# s in which a text is answered, also where it only shows something
ANSWER_WITHIN = int(_SCRIPT.split("ANSWER_WITHIN = ", 1)[1].split(";", 1)[0]) / 1000.0


class Wire:
    """A websocket; `delay` is how long (s) a message is on its way, in either direction."""

    def __init__(self, url: str, protocols: list[str], options: Any, delay: float = 0.0) -> None:
        self._socket = connect(
            url,
            subprotocols=protocols,  # type: ignore[arg-type]
            max_size=None,
            max_queue=None,  # or its end would wait ten seconds for messages that nobody has read
            compression=None,
            **options,
        )
        self.port = 0
        with contextlib.suppress(OSError):  # the service has ended it already
            self.port = self._socket.local_address[1]
        self.sent = 0  # messages
        self.ended = False
        self._pinged = 0.0  # when
        self._delay = delay
        self._leaving: deque[tuple[float, bytes | str]] = deque()  # and when they arrive
        self._coming: deque[tuple[float, bytes | str]] = deque()

    def receive(self, timeout: float) -> bytes | str | None:
        """The next message; None: there is none within this time. Raises `ConnectionClosed`."""
        if not self._delay:
            return self._receive(timeout)
        end = time.monotonic() + timeout
        while True:
            while self._leaving and self._leaving[0][0] <= time.monotonic():
                self._socket.send(self._leaving.popleft()[1])
            while (data := self._receive(0.0)) is not None:
                self._coming.append((time.monotonic() + self._delay, data))
            if self._coming and self._coming[0][0] <= time.monotonic():
                return self._coming.popleft()[1]
            if time.monotonic() >= end:
                return None
            time.sleep(0.002)

    def _receive(self, timeout: float) -> bytes | str | None:
        try:
            return self._socket.recv(timeout=timeout)
        except TimeoutError:
            return None
        except ConnectionClosed:
            self.ended = True
            raise

    def send(self, data: bytes | str) -> None:
        if self._delay:
            self._leaving.append((time.monotonic() + self._delay, data))
        else:
            self._socket.send(data)
        self.sent += 1

    def ping(self) -> None:
        """Wait until what the service has sent so far has arrived; the service takes thirty in a second."""
        time.sleep(max(0.0, self._pinged + 0.04 - time.monotonic()))
        self._pinged = time.monotonic()
        with contextlib.suppress(ConnectionClosed):
            self._socket.ping().wait(1.0)

    def close(self) -> None:
        self._socket.close()

    @property
    def is_handled(self) -> bool:
        """Whether a service in this process has handled all that was sent; of another process: True."""
        return self.ended or (_handled.get(self.port, self.sent) >= self.sent and not self._coming)

    def wait_until_handled(self) -> None:
        """For a moment: what comes over the other connection must not pass what was sent over this one."""
        end = time.monotonic() + WORK
        while not (self._delay or self.is_handled) and time.monotonic() < end:
            time.sleep(0.0005)


class FakeBrowser:
    """One visitor of a local port or of any URL, which may need more `options` to connect.

    `read` reads messages; everything shown is in `gui`, `values`, `poses` and `visible`, and `shown` by the
    channel, which it opens when it can. `memory` is the content of the page's storage, which it sends first,
    `kept` what the service has stored there, and `left_off` what it has stored for the next page of the browser.
    `camera` is where the service has moved it; unlike a real
    page, this one reports it only with `look`. `delays` are those of its two wires: viser's, and of the channel.
    """

    def __init__(
        self,
        where: int | str,
        width: int = 1280,
        height: int = 720,
        path: str = "/viewer",
        memory: str | None = None,
        delays: tuple[float, float] = (0.0, 0.0),
        **options: Any,
    ) -> None:
        self.memory = memory
        self.kept: list[str] = []
        self.kept_as: list[str] = []  # the names of the notices
        self.left_off: list[str] = []
        self._url = where if isinstance(where, str) else f"ws://127.0.0.1:{where}{path}"
        self._options = options
        self._delays = delays
        self.viser = Wire(self._url, [f"viser-v{viser.__version__}"], options, delays[0])
        self.channel: Wire | None = None
        self.name = ""  # of the channel
        self._number = self._noted = 0  # of the last message and the last notice
        self._answered_at = 0.0  # when a text of the channel was answered
        self.shown: dict[str, Any] = {}  # by the channel
        self.replied: list[Any] = [0, "", []]
        self._parts: dict[str, str] = {}  # uuids by the keys of what comes by the channel
        self.gui: dict[str, dict[str, Any]] = {}
        self.values: dict[str, Any] = {}
        self.poses: dict[str, dict[str, tuple[float, ...]]] = {}
        self.visible: dict[str, bool] = {}
        self.nodes: dict[str, dict[str, Any]] = {}
        self.log: list[dict[str, Any]] = []
        self._owed = False  # whether one was sent that may still be answered
        self.answers = True  # whether the page answers by itself, as a page in the foreground does
        self.camera: dict[str, Any] = {"position": (3, 3, 3), "look_at": (0, 0, 0), "up_direction": (0, 0, 1)}
        self._size = {"image_width": width, "image_height": height}
        self.look()

    def __enter__(self) -> FakeBrowser:
        self.wait(lambda: any(m["type"] == "TransformControlsMessage" for m in self.nodes.values()))
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self.viser.close()
        if self.channel is not None:
            self.channel.close()

    def send(self, type_: str, **fields: Any) -> None:
        self.send_raw(msgspec.msgpack.encode({"type": type_, **fields}))

    def send_raw(self, data: bytes | str) -> None:
        if self.channel is not None:
            self.channel.wait_until_handled()
        self.viser.send(data)
        self._owed = True

    # What is shown

    def element(self, label: str) -> str:
        """The uuid of the input element with this label."""
        found = [u for u, m in self.gui.items() if m["props"].get("label") == label]
        assert len(found) == 1, (label, [m["props"].get("label") for m in self.gui.values()])
        return found[0]

    def value(self, label: str) -> Any:
        return self.values[self.element(label)]

    @property
    def html(self) -> str:
        return " ".join(m["props"].get("content", "") for m in self.gui.values())

    @property
    def sliders(self) -> list[str]:
        return [m["props"]["label"] for m in self.gui.values() if m["type"] == "GuiSliderMessage"]

    def sliders_in(self, folder: str) -> list[str]:
        """The labels of the sliders in the folder with this label."""
        (box,) = [
            u for u, m in self.gui.items() if m["type"] == "GuiFolderMessage" and m["props"]["label"] == folder
        ]
        sliders = (m for m in self.gui.values() if m["type"] == "GuiSliderMessage")
        return [m["props"]["label"] for m in sliders if m["container_uuid"] == box]

    @property
    def gizmo(self) -> str:
        return next(n for n, m in self.nodes.items() if m["type"] == "TransformControlsMessage")

    def gizmo_pose(self) -> np.ndarray:
        return self.local(self.gizmo)

    def tool_pose(self) -> np.ndarray:
        """Pose of the gripper, composed from every node above it; NaN while another arm is on its way."""
        name = next((n for n in self.nodes if n.endswith("/gripper") and not n.startswith(self.gizmo)), None)
        if name is None:
            return np.full((4, 4), np.nan)
        T = np.eye(4)
        parts = name.strip("/").split("/")
        for k in range(len(parts)):
            T = T @ self.local("/" + "/".join(parts[: k + 1]))
        return T

    def local(self, name: str) -> np.ndarray:
        pose = self.poses.get(name, {})
        return pose_from_position_wxyz(pose.get("position", (0, 0, 0)), pose.get("wxyz", (1, 0, 0, 0)))

    # Actions of the visitor

    def set(self, label: str, value: Any) -> None:
        uuid = self.element(label)
        self.values[uuid] = value
        self.send("GuiUpdateMessage", uuid=uuid, updates={"value": value})

    def say(self, name: str, argument: Any = None) -> int:
        """Send a message as the page's own scripts do; returns its number."""
        self.wait(lambda: self.channel is not None)
        assert self.channel is not None
        self._number += 1
        if name in IN_ORDER:
            self.channel.send(json.dumps([self._number, name, argument, True]))
            self.answer_storage(MARK, str(self._number))
        else:
            self.viser.wait_until_handled()
            self.channel.send(json.dumps([self._number, name, argument]))
        self._owed = True
        return self._number

    @property
    def commands(self) -> dict[str, str]:
        """The ids of the palette's commands by their labels."""
        found: dict[str, str] = {}
        for m in self.log:
            if m["type"] == "RegisterCommandMessage":
                found[m["uuid"]] = m["props"]["label"]
            elif m["type"] == "RemoveCommandMessage":
                del found[m["uuid"]]
        return {label: uuid for uuid, label in found.items()}

    def trigger(self, label: str) -> None:
        """Choose a command of the palette."""
        self.send("CommandTriggerMessage", uuid=self.commands[label])

    def answer_storage(self, uuid: str, value: str | None = None) -> None:
        """Answer a question about the browser's storage."""
        self.send("LocalStorageGetItemResponseMessage", request_uuid=uuid, value=value, error=None)

    def begin_file(self, feature: str, name: str, size: int, key: str = "upload") -> HTTPConnection:
        """The request that sends a file, up to its head."""
        self.wait(lambda: self.channel is not None)
        self.viser.wait_until_handled()
        place = urlsplit(self._url)
        assert place.hostname is not None
        request = HTTPConnection(place.hostname, place.port, timeout=PATIENCE)
        request.putrequest("POST", f"{place.path.rstrip('/')}/upload")
        about = {CHANNEL_NAME: self.name, FILE: quote(json.dumps([feature, key, name])), "Content-Length": size}
        for field, value in (about | self._options.get("additional_headers", {})).items():
            request.putheader(field, str(value))
        request.endheaders()
        return request

    def open_file(self, feature: str, name: str, content: bytes | str, key: str = "upload") -> int:
        """Send a file as static/upload.js does; returns the status of the answer when the page has taken it."""
        data = content.encode() if isinstance(content, str) else content
        request = self.begin_file(feature, name, len(data), key)
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # it may be refused before all has come
            request.send(data)
        answer = request.getresponse()
        answer.read()
        request.close()
        self._catch_up()
        if self.channel is not None:
            for _ in range(2):  # the event loop brings what the worker has shown in the round after that
                self.channel.ping()
        while self._read_channel():
            pass
        return answer.status

    @property
    def script(self) -> dict[str, Any]:
        """What the page's own scripts know: next steps of the history, what it started with, the last reply."""
        (undo, redo), (start, tab) = self.shown.get("history", ["", ""]), self.shown.get("start", ["", ""])
        return {"undo": undo, "redo": redo, "start": start, "tab": tab, "reply": self.replied}

    def open_channel(self) -> None:
        """Open the channel of the present session, or open it anew."""
        before, protocols = self.channel, [CHANNEL_PROTOCOL, self.name]
        self.channel = Wire(f"{self._url.rstrip('/')}/channel", protocols, self._options, self._delays[1])
        if before is not None:
            before.close()
            before.ended = True

    def _note_channel(self, content: str) -> None:
        name = content.split('data-channel="', 1)[1].split('"', 1)[0]
        if name != self.name:
            self.name = name
            self._number, self._noted, self.replied = 0, 0, [0, "", []]
            self.shown = {}
            self.open_channel()
            if self.answers:
                self.say("hello", _value(self.memory))

    def _read_channel(self) -> bool:
        """Take what has come by the channel; returns whether it was more than a beat, such as its end."""
        wire = self.channel
        try:
            text = None if wire is None else wire.receive(0.0)
        except ConnectionClosed:
            self.channel = None
            return True
        if wire is None or text is None:
            return False
        heard = json.loads(text)
        self.shown |= heard.get("set", {})
        parts = [key for key, html in heard.get("set", {}).items() if key.startswith("part-") and html is not None]
        if parts or "notices" in heard:
            self._catch_up("notices" in heard)
        for key in parts:
            self._show_part(key)
        for number, name, value in heard.get("notices", []):
            if number > self._noted:
                self._noted = number
                self._take(name, value)
        now = time.monotonic()
        if "notices" in heard or "set" not in heard or now - self._answered_at > ANSWER_WITHIN:
            self._answered_at = now
            with contextlib.suppress(ConnectionClosed):  # the service has ended it since
                wire.send(json.dumps(["heard", self._noted]))
        return "set" in heard or "notices" in heard

    def _show_part(self, key: str) -> None:
        """Show the HTML of a part that has come by the channel."""
        if key in self._parts:
            updates = {"content": self.shown[key]}
            self._apply({"type": "GuiUpdateMessage", "uuid": self._parts[key], "updates": updates})

    def _catch_up(self, all_sent: bool = True) -> None:
        """Show what belongs to the step that a notice comes from, as a person sees both at once.

        Without `all_sent` only what has come: the service takes few pings a second.
        """
        if self.viser.port in _handled:
            end = time.monotonic() + ANSWER
            while working() and time.monotonic() < end:
                time.sleep(0.0005)
        if all_sent:
            self.viser.ping()
        while not self.viser.ended and (data := self.viser.receive(0.0)) is not None:
            self._apply_frame(data)

    def _take(self, name: str, value: Any) -> None:
        if name == "reply":
            self.replied = value
        elif name == KEY_LAST:
            self.left_off.append(value)
        else:
            self.kept.append(value)
            self.kept_as.append(name)

    def updates_without_component(self) -> list[dict[str, Any]]:
        """Updates of the panel that came before their component, or after its removal."""
        there: set[str] = set()
        found = []
        for message in self.log:
            kind, uuid = message["type"], message.get("uuid")
            if kind == "GuiUpdateMessage" and uuid not in there:
                found.append(message)
            elif kind == "GuiRemoveMessage":
                there.discard(str(uuid))
            elif kind.startswith("Gui") and uuid and "props" in message:
                there.add(uuid)
        return found

    def choose(self, robot: str) -> None:
        """Choose another robot by its name, and wait until it is shown."""
        if self.value("Robot") == robot:
            return
        before = self.gizmo
        self.set("Robot", robot)
        self.wait(lambda: before not in self.nodes)
        self.settle()

    def open_lesson(self, title: str) -> None:
        """Choose a lesson, and have the answer to its first question shown, which withholds facts until then."""
        self.set("Lesson", title)
        self.wait(lambda: 'data-step="1"' in self.html)
        self.reveal("1")

    def reveal(self, question: str) -> None:
        """Have the answer to a question of the lesson shown."""
        self.say("feature", ["guide", ["reveal", question, len(self.log)], None])
        self.wait(
            lambda: f'data-question="{question}" data-closed="1"' in self.html and "data-asked" not in self.html
        )

    def grab(self) -> None:
        self.send("TransformControlsDragStartMessage", name=self.gizmo, owner=self.nodes[self.gizmo]["owner"])

    def drag(self, T: np.ndarray | None = None, position: Any = None, wxyz: Any = None) -> None:
        if T is not None:
            position, wxyz = T[:3, 3].tolist(), wxyz_from_rotation(T[:3, :3]).tolist()
        self.poses[self.gizmo] = {"position": position, "wxyz": wxyz}
        self.send(
            "TransformControlsUpdateMessage",
            name=self.gizmo,
            position=position,
            wxyz=wxyz,
            owner=self.nodes[self.gizmo]["owner"],
        )

    def release(self) -> None:
        self.send("TransformControlsDragEndMessage", name=self.gizmo, owner=self.nodes[self.gizmo]["owner"])

    def look(self, **camera: Any) -> None:
        """Report the camera: where the service has moved it, except for the arguments given."""
        place = {
            "wxyz": (1, 0, 0, 0),
            "fov": 1.3,
            "near": 0.01,
            "far": 1000,
            **self._size,
            **self.camera,
            **camera,
        }
        self.send("ViewerCameraMessage", **place)

    def click(self, name: str) -> None:
        """Click a node of the scene."""
        self.send(
            "SceneNodeClickMessage",
            name=name,
            instance_index=0,
            ray_origin=(0, 0, 0),
            ray_direction=(0, 0, 1),
            screen_pos=(0.5, 0.5),
            modifier=None,
            owner=self.nodes[name]["owner"],
        )

    # Time

    def wait(self, until: Callable[[], bool], timeout: float = PATIENCE) -> None:
        """Read messages until a condition holds; fails after `timeout` seconds.

        What the same step has sent by the other connection is read as well.
        """
        end = time.monotonic() + timeout
        while not until():
            left = end - time.monotonic()
            assert left > 0, f"not seen within {timeout} s; page shows: {self.html[:600]}"
            self.read(left)
        end = time.monotonic() + LATE
        while time.monotonic() < end and self.read(SAME_STEP):
            pass

    def settle(self, quiet: float | None = None, timeout: float = PATIENCE) -> None:
        """Read messages until the service has handled all that was sent and none is to come.

        A service in this process is known to rest when all it has sent has arrived; of another one, or with
        `quiet`, that is assumed after so many seconds without a message.
        """
        now = time.monotonic()
        end, late, answered = now + timeout, now + WORK, now + (ANSWER if self._owed else 0.0)
        self._owed = False
        while True:
            now = time.monotonic()
            wires = [self.viser, *([] if self.channel is None else [self.channel])]
            if now > answered:
                for wire in wires:
                    wire.sent = _handled.get(wire.port, wire.sent)  # some messages are not passed on
            here = self.viser.port in _handled
            if here:
                rests = now > late or (all(wire.is_handled for wire in wires) and not working())
            else:
                rests = now > answered
            known = here and quiet is None and not (any(self._delays) or _acts_soon())
            if self.read((WINDOW if known else quiet or QUIET) if rests else 0.02):
                answered = answered if here else 0.0
            elif rests and not (known and self._hears_more(wires)):
                return
            assert time.monotonic() < end, f"the page did not come to rest within {timeout} s"

    def _hears_more(self, wires: list[Wire]) -> bool:
        """Whether something was on its way, or begins: what the service has sent comes before its answers."""
        for wire in wires:
            wire.ping()
        return self.read(0.0) or working()

    def stored(self) -> str:
        """The state that the service has stored in the page, a moment after the last change."""
        self.wait(lambda: bool(self.kept))
        self.settle(quiet=SAVE_AFTER + 0.3)
        return self.kept[-1]

    def read(self, timeout: float) -> bool:
        """Read what comes next by either connection; returns whether something came in time."""
        end = time.monotonic() + timeout
        while True:
            if self._read_channel():
                return True
            left = max(0.0, end - time.monotonic())
            data = self.viser.receive(left if self.channel is None else min(left, LOOK))
            if data is not None and self._apply_frame(data):
                return True
            if left == 0.0:
                return False

    def _apply_frame(self, data: bytes | str) -> bool:
        """Show a frame of viser's messages; returns whether it had more than a question."""
        assert isinstance(data, bytes)
        size, packed = (int.from_bytes(data[i : i + 8], "little") for i in (0, 8))
        inner = zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed], max_output_size=size)
        decoded = msgspec.msgpack.decode(inner)
        arrays = _arrays(data, 16 + packed, decoded["binaryBufferLengths"])
        for message in decoded["messages"]:
            for values in (message.get("props"), message.get("updates")):
                for key, value in (values or {}).items():
                    if isinstance(value, dict) and "__binary_index" in value:
                        values[key] = np.frombuffer(arrays[value["__binary_index"]], value["dtype"])
            self._apply(message)
        return any(message["type"] != "LocalStorageGetItemRequestMessage" for message in decoded["messages"])

    def _apply(self, m: dict[str, Any]) -> None:
        self.log.append(m)
        match m["type"]:
            case "LocalStorageGetItemRequestMessage":
                if self.answers:
                    self.answer_storage(m["request_uuid"])
            case "SetCameraPositionMessage":
                self.camera["position"] = m["position"]
            case "SetCameraLookAtMessage":
                self.camera["look_at"] = m["look_at"]
            case "SetCameraUpDirectionMessage":
                self.camera["up_direction"] = m["position"]
            case "SetPositionMessage":
                self.poses.setdefault(m["name"], {})["position"] = m["position"]
            case "SetOrientationMessage":
                self.poses.setdefault(m["name"], {})["wxyz"] = m["wxyz"]
            case "SetSceneNodeVisibilityMessage":
                self.visible[m["name"]] = m["visible"]
            case "SceneNodeUpdateMessage":
                if m["name"] in self.nodes:
                    self.nodes[m["name"]]["props"].update(m["updates"])
            case "RemoveSceneNodeMessage":
                # As in the real page, the poses of removed nodes remain.
                self.nodes = {
                    n: v for n, v in self.nodes.items() if n != m["name"] and not n.startswith(m["name"] + "/")
                }
            case "GuiUpdateMessage":
                if m["uuid"] in self.gui:
                    for key, value in m["updates"].items():
                        if key == "value":
                            self.values[m["uuid"]] = value
                        else:
                            self.gui[m["uuid"]]["props"][key] = value
            case "GuiRemoveMessage":
                self.gui.pop(m["uuid"], None)
                # What the channel says of it later is for nothing, as in static/parts.js.
                self._parts = {key: uuid for key, uuid in self._parts.items() if uuid != m["uuid"]}
            case kind if kind.startswith("Gui") and "props" in m and "uuid" in m:
                self.gui[m["uuid"]] = m
                content = m["props"].get("content", "")
                if "data-channel=" in content:
                    self._note_channel(content)
                if content.startswith('<div data-part="'):
                    self._parts[key := content.split('"')[1]] = m["uuid"]
                    m["props"]["content"] = content.partition(">")[2].removesuffix("</div>")
                    if self.shown.get(key) is not None:
                        self._show_part(key)
                self.values[m["uuid"]] = m.get("value")
            case _ if "props" in m and "name" in m:
                self.nodes[m["name"]] = m


def _value(text: str | None) -> Any:
    """The value of a text of JSON; of another text, the text."""
    try:
        return json.loads(text or "null")
    except ValueError:
        return text


def _arrays(data: bytes, start: int, lengths: list[int]) -> list[memoryview]:
    """The raw arrays behind the packed messages, each at a multiple of eight bytes."""
    found = []
    for length in lengths:
        start = (start + 7) // 8 * 8
        found.append(memoryview(data)[start : start + length])
        start += length
    return found
