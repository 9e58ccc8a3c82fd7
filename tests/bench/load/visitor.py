"""A visitor of the viewer without a browser: builds no page, remembers what has to be answered or measured."""

from __future__ import annotations

import asyncio
import json
import math
import re
import time
from collections import deque
from typing import Any

import msgspec
import numpy as np
import viser
import zstandard

from load.raw import Socket

SUBPROTOCOL = f"viser-v{viser.__version__}"
_CHANNEL = re.compile(r'data-channel="([\w-]+)"')
_BASE_JOINT = re.compile(r"/arm-\d+/\d+")
_unpack = zstandard.ZstdDecompressor().decompress
_decode = msgspec.msgpack.Decoder().decode
_encode = msgspec.msgpack.Encoder().encode
SWING = 0.5  # radians to either side
STEP = 0.02  # radians from one event to the next: 0.4 rad/s
_TURN = round(SWING / STEP)  # steps from the middle to a turning point
_CLOSE = 1e-4  # steps


class Visitor:
    """One tab.

    A drag turns the gizmo about the line of joint 1 to and fro. Event k is k steps along this way, so the angle of
    joint 1 tells how far along the picture is, as it never goes back: one beyond event k − 1 can only have been
    drawn for event k or a later one. Pictures of the easing towards an earlier target do not count, and a picture
    need not have shown the turning point: a page that follows another shows the newest state, not every one.
    """

    def __init__(self, token: str = "", source: str = "127.0.0.1", cookie: str = "") -> None:
        self._token, self._cookie = token, cookie
        self._source = source
        self._socket: Socket
        self._channel: Socket | None = None
        self._opening: set[asyncio.Task[None]] = set()
        self.began = time.perf_counter()
        self.complete = self.last = math.nan  # when the gizmo was there, and the last message
        self.gizmo: dict[str, Any] = {}
        self.elements: dict[str, str] = {}  # uuid by label
        self.points = 0
        self.bytes = 0
        self.pictures = 0
        self.latencies: list[float] = []
        self.times: deque[float] = deque(maxlen=5000)  # when the pictures came
        self._poses: dict[str, dict[str, Any]] = {}
        self._joint = ""
        self._home: Any = None
        self._there = asyncio.Event()
        self._sent = 0  # events since the first grab
        self._along = 0.0  # how far the picture is, in steps
        self._waiting: deque[tuple[int, float]] = deque()  # number and time of events not answered

    async def connect(self, port: int, timeout: float = 60.0) -> None:
        """Connect and wait until the arm is there. Who gives up hangs up, and leaves no page to the next round."""
        self.began = time.perf_counter()
        self._port = port
        async with asyncio.timeout(timeout):
            self._socket = await Socket.open(
                port, "/viewer", SUBPROTOCOL, self._heard, self._token, self._source, self._cookie
            )
            try:
                self.send(
                    "ViewerCameraMessage",
                    wxyz=(1, 0, 0, 0),
                    position=(3, 3, 3),
                    fov=1.3,
                    near=0.01,
                    far=1000,
                    image_height=720,
                    image_width=1280,
                    look_at=(0, 0, 0),
                    up_direction=(0, 0, 1),
                )
                await self._there.wait()
            except BaseException:
                self.close()
                raise

    async def quiet(self, seconds: float = 0.3, timeout: float = 60.0) -> None:
        """Wait until nothing has come for a while."""
        end = time.perf_counter() + timeout
        while (left := self.last + seconds - time.perf_counter()) > 0.0 and time.perf_counter() < end:
            await asyncio.sleep(left)

    async def offers(self, label: str, timeout: float = 60.0) -> None:
        """Wait until there is a control with this label: the tabs come after the arm."""
        async with asyncio.timeout(timeout):
            while label not in self.elements:
                await asyncio.sleep(0.02)

    def stop_reading(self) -> None:
        """Read nothing more of what the service sends."""
        self._socket.stop_reading()

    def close(self) -> None:
        """Close the tab."""
        self._socket.close()
        if self._channel is not None:
            self._channel.close()

    def send(self, kind: str, **fields: Any) -> None:
        """A message of viser's protocol."""
        self._socket.send(_encode({"type": kind, **fields}))

    def set(self, label: str, value: object) -> None:
        """Change the control with this label, or click a button of the group of that name."""
        self.send("GuiUpdateMessage", uuid=self.elements[label], updates={"value": value})

    # Drags

    def grab(self) -> None:
        """Take the gizmo, which stands where the page has put it, or where it was released."""
        if self._home is None:
            pose = self._poses[self.gizmo["name"]]
            self._position = [float(x) for x in pose["position"]]
            self._wxyz = [float(x) for x in pose["wxyz"]]
            self._home = [float(x) for x in self._poses[self._joint]["wxyz"]]
        self.send("TransformControlsDragStartMessage", name=self.gizmo["name"], owner=self.gizmo["owner"])

    def drag(self) -> bool:
        """One event farther; False at a turning point, where the hand rests until all is answered."""
        if self._waiting and self._sent % (2 * _TURN) == _TURN:
            return False
        self._sent += 1
        self._waiting.append((self._sent, time.perf_counter()))
        self._turn_to(STEP * _swung(self._sent))
        return True

    def _turn_to(self, angle: float) -> None:
        """Ask for another angle of the base joint."""
        half = 0.5 * angle
        c, s = math.cos(2 * half), math.sin(2 * half)
        x, y, z = self._position
        turn = (math.cos(half), 0.0, 0.0, math.sin(half))
        self.send(
            "TransformControlsUpdateMessage",
            name=self.gizmo["name"],
            owner=self.gizmo["owner"],
            position=(c * x - s * y, s * x + c * y, z),
            wxyz=_product(turn, self._wxyz),
        )

    def watch(self, leader: Visitor) -> None:
        """Expect a picture for the event that another visitor has just sent, whose arm this page shows."""
        if self._home is None:
            self._home = leader._home
        self._sent = leader._sent
        self._waiting.append(leader._waiting[-1])

    def release(self) -> None:
        """Let the gizmo go."""
        self.send("TransformControlsDragEndMessage", name=self.gizmo["name"], owner=self.gizmo["owner"])

    @property
    def lost(self) -> bool:
        """Whether the service has ended the connection."""
        return self._socket.closed.done()

    @property
    def unanswered(self) -> int:
        """Events that no picture has answered yet."""
        return len(self._waiting)

    def _shown(self, wxyz: list[float], now: float) -> None:
        """The base joint has been posed."""
        self.pictures += 1
        self.times.append(now)
        if not self._waiting:
            return
        w, _, _, z = _product((self._home[0], *(-x for x in self._home[1:])), wxyz)
        angle = math.remainder(2.0 * math.atan2(z, w), 2.0 * math.pi) / STEP
        along = _next(self._along, angle)
        if along > self._sent + _CLOSE:  # not on the way: rounding, or the arm has yet to come to the first event
            return
        self._along = along
        while self._waiting and self._waiting[0][0] - 1 < along - _CLOSE:
            self.latencies.append(now - self._waiting.popleft()[1])

    # Messages

    def _heard(self, data: bytes) -> None:
        now = self.last = time.perf_counter()
        self.bytes += len(data)
        said = decoded(data)
        for message in said["messages"]:
            kind = message["type"]
            if kind == "SetOrientationMessage":
                name = message["name"]
                self._pose(name)["wxyz"] = message["wxyz"]
                if name == self._joint:
                    self._shown(message["wxyz"], now)
            elif kind == "SetPositionMessage":
                self._pose(message["name"])["position"] = message["position"]
            elif kind == "PointCloudMessage":
                points = message["props"]["points"]
                width = 3 * np.dtype(points["dtype"]).itemsize
                self.points += said["binaryBufferLengths"][points["__binary_index"]] // width
            elif kind == "GuiHtmlMessage" and (found := _CHANNEL.search(message["props"]["content"])):
                self._opening.add(asyncio.get_running_loop().create_task(self._open_channel(found[1])))
            elif kind == "LocalStorageGetItemRequestMessage":
                self.send(
                    "LocalStorageGetItemResponseMessage",
                    request_uuid=message["request_uuid"],
                    value=None,
                    error=None,
                )
            elif kind == "TransformControlsMessage":
                self.gizmo = self.gizmo or message
                self.complete = now
                self._there.set()
            elif kind == "FrameMessage" and _BASE_JOINT.fullmatch(message["name"]):
                self._joint = message["name"]
            elif "uuid" in message and "props" in message:
                self.elements[message["props"].get("label", "")] = message["uuid"]

    async def _open_channel(self, name: str) -> None:
        """Open the page's channel, which remembers nothing."""
        channel = await Socket.open(
            self._port,
            "/viewer/channel",
            f"kinboard-1, {name}",
            self._give_sign,
            self._token,
            self._source,
            self._cookie,
        )
        self._channel, self._said = channel, 0
        self.say("hello", None)

    def _give_sign(self, _: bytes) -> None:
        """Answer a text of the channel, as the service expects every two seconds."""
        if self._channel is not None:
            self._channel.send_text('["heard", 0]')

    def say(self, name: str, argument: object) -> None:
        """Send a message of the page's scripts."""
        assert self._channel is not None
        self._said += 1
        self._channel.send_text(json.dumps([self._said, name, argument]))

    def _pose(self, name: str) -> dict[str, Any]:
        return self._poses.setdefault(name, {"position": (0.0, 0.0, 0.0), "wxyz": (1.0, 0.0, 0.0, 0.0)})


def decoded(data: bytes) -> Any:
    """A frame of the page: its messages."""
    size, packed = int.from_bytes(data[:8], "little"), int.from_bytes(data[8:16], "little")
    return _decode(_unpack(data[16 : 16 + packed], max_output_size=size))


def _swung(along: float) -> float:
    """How many steps to the side the hand is after so many along its way: up, down past the middle, up again."""
    return _TURN - abs((along + _TURN) % (4 * _TURN) - 2 * _TURN)


def _next(along: float, angle: float) -> float:
    """The first place on the way, not before `along`, where the hand is so many steps to the side."""
    if abs(_swung(along) - angle) < _CLOSE:
        return along
    up = along + (angle - along) % (4 * _TURN)
    down = along + (2 * _TURN - angle - along) % (4 * _TURN)
    return min(up, down)


def _product(a: Any, b: Any) -> tuple[float, float, float, float]:
    """Of two quaternions."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )
