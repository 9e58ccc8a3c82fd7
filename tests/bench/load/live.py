"""Programs that move the arms of pages, one each: how long until the picture shows what they send."""

from __future__ import annotations

import asyncio
import json
import re
from typing import Any

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from load import table
from load.drag import measure
from load.service import serve
from load.visitor import Visitor, decoded

HZ = 30.0  # configurations that a program sends a second
_CODE = re.compile(r"data-live-code>([A-Z0-9-]+)<")


class Programmed(Visitor):
    """A tab whose arm a program moves, as far as the hand of a visitor would."""

    def __init__(self, token: str = "", source: str = "127.0.0.1") -> None:
        super().__init__(token, source)
        self._code = ""
        self._program: ClientConnection | None = None
        self._q: list[float] = []
        self._sending: set[asyncio.Task[None]] = set()

    async def connect(self, port: int, timeout: float = 60.0) -> None:
        """Connect the tab, and then its program by the code of the page."""
        await super().connect(port, timeout)
        await self.offers("Connect a program")
        self.set("Connect a program", True)
        async with asyncio.timeout(timeout):
            while not self._code:
                await asyncio.sleep(0.02)
        address = f"ws://127.0.0.1:{port}/api/v1/live/{self._code}?name=load"
        headers = {"Authorization": f"Bearer {self._token}"} if self._token else {}
        self._program = await connect(
            address, proxy=None, compression=None, additional_headers=headers, local_addr=(self._source, 0)
        )
        joints = json.loads(await self._program.recv())["robot"]["joints"]
        self._q = [0.5 * (joint["lower"] + joint["upper"]) for joint in joints]
        await self._program.send(json.dumps({"q": self._q}))
        await asyncio.sleep(0.3)

    async def flood(self, seconds: float, text: str) -> int:
        """Send the same message over and over, as fast as it is taken; answers are not read. Returns the bytes."""
        assert self._program is not None
        sent = 0
        try:
            async with asyncio.timeout(seconds):
                while True:
                    await self._program.send(text)
                    sent += len(text)
        except (TimeoutError, ConnectionClosed):
            pass
        return sent

    def grab(self) -> None:
        """Take the arm as it is."""
        if self._home is None:
            self._home = [float(x) for x in self._poses[self._joint]["wxyz"]]

    def release(self) -> None:
        """Nothing is held."""

    def close(self) -> None:
        """End the program, if it is connected, then the tab."""
        if self._program is not None:
            self._program.transport.abort()
        super().close()

    def _turn_to(self, angle: float) -> None:
        assert self._program is not None
        q = [self._q[0] + angle, *self._q[1:]]
        task = asyncio.ensure_future(self._program.send(json.dumps({"q": q})))
        self._sending.add(task)
        task.add_done_callback(self._sending.discard)

    def _heard(self, data: bytes) -> None:
        super()._heard(data)
        if not self._code and (found := _CODE.search(json.dumps(decoded(data), default=str))) is not None:
            self._code = found[1]


def run(quick: bool, counts: list[int] | None = None) -> dict[str, Any]:
    """The tables on stdout, and what is in them."""
    counts = counts or ([1, 10] if quick else [1, 10, 30, 100])
    seconds = 3.0 if quick else 15.0
    found: dict[str, Any] = {"seconds": seconds, "hz": HZ}
    for name, kind in (("drag", Visitor), ("program", Programmed)):
        found[name] = []
        for count in counts:
            with serve() as service:
                asyncio.run(measure(service, 1, 1.0, HZ, kind))
                found[name].append(asyncio.run(measure(service, count, seconds, HZ, kind)))
        print(table(f"{name}: {HZ:g} a second each for {seconds:g} s", found[name]))
    return found
