"""A browser tab without a browser: speaks viser's websocket protocol and stores what a page would show."""

from __future__ import annotations

import html
import json
import time
import weakref
from collections.abc import Callable, Hashable
from typing import Any

import msgspec
import numpy as np
import viser
import zstandard
from starlette.types import Message
from starlette.websockets import WebSocket
from websockets.sync.client import connect

from app.service.web.viewer_proxy import VisitorConnection
from app.viewer.panel.script import LABEL
from app.viewer.session.persistence import SAVE_AFTER
from app.viewer.session.state import KEY_LAST
from app.viewer.session.worker.worker import Worker
from kin.transforms import pose_from_position_wxyz, wxyz_from_rotation

ANSWER = 1.5  # s until a message is answered on a busy machine, by a service in another process
PATIENCE = 30.0  # s until something that must happen has happened, on a machine that does much else
WORK = 10.0  # s for which `settle` waits for a worker that has something to do

# Of services in this process: workers that something was posted to, those that act, and how many messages of each
# visitor have been handled, by the visitor's port.
_workers: weakref.WeakSet[Worker] = weakref.WeakSet()
_acting: weakref.WeakSet[Worker] = weakref.WeakSet()
_handled: dict[int, int] = {}
_post, _act, _connect = Worker.post, Worker._act_once, VisitorConnection.__init__


def _watched_post(self: Worker, key: Hashable, value: object = None) -> None:
    _workers.add(self)
    _post(self, key, value)


def _watched_act(self: Worker) -> float | None:
    _acting.add(self)
    try:
        return _act(self)
    finally:
        _acting.discard(self)


def _watched_connect(self: VisitorConnection, visitor: WebSocket) -> None:
    _connect(self, visitor)
    receive, received = visitor.receive, 0
    port = visitor.client.port if visitor.client else 0

    async def watched() -> Message:
        nonlocal received
        _handled[port] = received  # it asks for the next one
        event = await receive()
        received += event["type"] == "websocket.receive"
        return event

    visitor.receive = watched  # type: ignore[method-assign]
    hear = self.hear

    def watched_hear(take: Callable[[bytes], bool]) -> None:
        def counted(data: bytes) -> bool:
            nonlocal received
            taken = take(data)
            received += taken
            if taken:
                _handled[port] = received
            return taken

        hear(counted)

    self.hear = watched_hear  # type: ignore[method-assign]


Worker.post, Worker._act_once = _watched_post, _watched_act  # type: ignore[method-assign]
VisitorConnection.__init__ = _watched_connect  # type: ignore[method-assign]


def working() -> bool:
    """Whether a viewer in this process has something to do that was posted: a page is not at rest then."""
    return bool(list(_acting)) or any(not each.join(0.0) and each._inbox.waits for each in list(_workers))


class FakeBrowser:
    """One visitor of a local port or of any URL, which may need more `options` to connect.

    `read` reads messages; everything shown is in `gui`, `values`, `poses` and `visible`. `memory` is the content
    of the page's storage, `kept` what the service has stored there, and `left_off` what it has stored for the next
    page of the browser. `said` has the last messages of the page's own script. `camera` is where the service has
    moved it; unlike a real page, this one reports it only with `look`.
    """

    def __init__(
        self,
        where: int | str,
        width: int = 1280,
        height: int = 720,
        path: str = "/viewer",
        memory: str | None = None,
        **options: Any,
    ) -> None:
        self.memory = memory
        self.said: list[list[Any]] = []
        self.kept: list[str] = []
        self.left_off: list[str] = []
        self._socket = connect(
            where if isinstance(where, str) else f"ws://127.0.0.1:{where}{path}",
            subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
            max_size=None,
            max_queue=None,  # or its end would wait ten seconds for messages that nobody has read
            compression=None,
            **options,
        )
        self._port: int = self._socket.local_address[1]
        self.gui: dict[str, dict[str, Any]] = {}
        self.values: dict[str, Any] = {}
        self.poses: dict[str, dict[str, tuple[float, ...]]] = {}
        self.visible: dict[str, bool] = {}
        self.nodes: dict[str, dict[str, Any]] = {}
        self.log: list[dict[str, Any]] = []
        self._sent = 0  # messages
        self._owed = False  # whether one was sent that may still be answered
        self.answers = True  # whether the page reports its storage, as a page in the foreground does
        self.camera: dict[str, Any] = {"position": (3, 3, 3), "look_at": (0, 0, 0), "up_direction": (0, 0, 1)}
        self._size = {"image_width": width, "image_height": height}
        self.look()

    def __enter__(self) -> FakeBrowser:
        self.wait(lambda: any(m["type"] == "TransformControlsMessage" for m in self.nodes.values()))
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def close(self) -> None:
        self._socket.close()

    def send(self, type_: str, **fields: Any) -> None:
        self.send_raw(msgspec.msgpack.encode({"type": type_, **fields}))

    def send_raw(self, data: bytes | str) -> None:
        self._socket.send(data)
        self._sent += 1
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
        """Pose of the gripper, composed from every node above it."""
        name = next(n for n in self.nodes if n.endswith("/gripper") and not n.startswith(self.gizmo))
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
        """Send a message as the page's own script does; returns its number."""
        number = self.said[-1][0] + 1 if self.said else 1
        self.said = [*self.said[-19:], [number, name, argument]]
        self.set(LABEL, json.dumps(self.said))
        return int(number)

    @property
    def script(self) -> dict[str, Any]:
        """What the page's own script knows: next steps of the history, the last reply."""
        shown = next(
            m["props"]["content"] for m in self.gui.values() if "data-answers" in m["props"].get("content", "")
        )
        answers: dict[str, Any] = json.loads(html.unescape(shown.split('data-answers="', 1)[1].split('"', 1)[0]))
        return answers

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
        """Read messages until a condition holds; fails after `timeout` seconds."""
        end = time.monotonic() + timeout
        while not until():
            left = end - time.monotonic()
            assert left > 0, f"not seen within {timeout} s; page shows: {self.html[:600]}"
            self.read(left)

    def settle(self, quiet: float = 0.3, timeout: float = PATIENCE) -> None:
        """Read messages until the service has handled all that was sent, and then none comes for `quiet` s."""
        now = time.monotonic()
        end, late, answered = now + timeout, now + WORK, now + (ANSWER if self._owed else 0.0)
        self._owed = False
        while True:
            now = time.monotonic()
            if now > answered and self._port in _handled:
                self._sent = _handled[self._port]  # some messages are not passed on
            if self._port in _handled:
                rests = now > late or (_handled[self._port] >= self._sent and not working())
            else:
                rests = now > answered
            if self.read(quiet if rests else 0.02):
                answered = answered if self._port in _handled else 0.0
            elif rests:
                return
            assert time.monotonic() < end, f"the page did not come to rest within {timeout} s"

    def stored(self) -> str:
        """The state that the service has stored in the page, a moment after the last change."""
        self.wait(lambda: bool(self.kept))
        self.settle(quiet=SAVE_AFTER + 0.3)
        return self.kept[-1]

    def read(self, timeout: float) -> bool:
        """Read one frame of messages; returns whether one came in time."""
        try:
            data = self._socket.recv(timeout=timeout)
        except TimeoutError:
            return False
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
        return True

    def _apply(self, m: dict[str, Any]) -> None:
        self.log.append(m)
        match m["type"]:
            case "LocalStorageGetItemRequestMessage":
                if self.answers:
                    uuid = m["request_uuid"]
                    self.send(
                        "LocalStorageGetItemResponseMessage", request_uuid=uuid, value=self.memory, error=None
                    )
            case "LocalStorageSetItemMessage":
                (self.left_off if m["key"].endswith(KEY_LAST) else self.kept).append(m["value"])
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
            case "SceneNodeUpdateMessage":
                if m["name"] in self.nodes:
                    self.nodes[m["name"]]["props"].update(m["updates"])
            case "GuiUpdateMessage":
                if m["uuid"] in self.gui:
                    for key, value in m["updates"].items():
                        if key == "value":
                            self.values[m["uuid"]] = value
                        else:
                            self.gui[m["uuid"]]["props"][key] = value
            case "GuiRemoveMessage":
                self.gui.pop(m["uuid"], None)
            case kind if kind.startswith("Gui") and "props" in m and "uuid" in m:
                self.gui[m["uuid"]] = m
                self.values[m["uuid"]] = m.get("value")
            case _ if "props" in m and "name" in m:
                self.nodes[m["name"]] = m


def _arrays(data: bytes, start: int, lengths: list[int]) -> list[memoryview]:
    """The raw arrays behind the packed messages, each at a multiple of eight bytes."""
    found = []
    for length in lengths:
        start = (start + 7) // 8 * 8
        found.append(memoryview(data)[start : start + length])
        start += length
    return found
