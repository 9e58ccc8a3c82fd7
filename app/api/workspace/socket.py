"""A cloud of tool points over a websocket: float32 rows as binary messages, progress as text messages.

For an arm of the service the query of the URL describes the cloud. An arm that is sent along is in the first
message, with the parameters of the query as further fields.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections.abc import Awaitable, Callable
from typing import Any

from fastapi import WebSocket
from starlette.concurrency import run_in_threadpool
from starlette.websockets import WebSocketDisconnect

from app.api.arms.operation import with_robot
from app.api.body import parsed, versioned
from app.api.problems import ProblemError, invalid, unknown_robot
from app.api.websockets import DONE, FAILED, LATER, POLICY, UNSUPPORTED, accept, close
from app.api.workspace.query import CloudQuery, read_cloud_query, validated
from app.api.workspace.streaming import ThreadedGenerator
from app.exports.formats import slices, table_of
from app.shared.clients import client_of
from app.shared.clouds import Cloud
from app.shared.metrics import STREAMED
from app.shared.problems import FieldError, Problem
from app.shared.slots import Slot
from kin import Robot, UnknownRobotError
from kin.parsing import Limits, TextError, read_json

logger = logging.getLogger("kinboard.workspace")
router = versioned("workspace")

PATIENCE = 10.0  # seconds for the first message of a client that sends its arm along
PROGRESS_EVERY = 0.1  # seconds between two progress messages

_LIMITS = Limits(1000, 10, 4)  # of a message after the first one

SentCloud = with_robot(CloudQuery)

# Close code and reason; None if the visitor has left.
_Ending = tuple[int, str] | None


@router.websocket("/robots/{robot_id}/workspace/stream")
async def stream(visitor: WebSocket, robot_id: str) -> None:
    """The cloud of an arm of the service, from the handshake to its end, a cancellation or a disconnect."""

    async def described() -> tuple[CloudQuery, Robot]:
        return read_cloud_query(visitor.query_params), visitor.app.state.store.get(robot_id)

    await _serve(visitor, described)


@router.websocket("/workspace/stream")
async def stream_of_sent(visitor: WebSocket) -> None:
    """The cloud of the arm in the first message, from the handshake to its end."""

    async def described() -> tuple[CloudQuery, Robot]:
        text = await _first_message(visitor)
        state = visitor.app.state
        with state.streams.slot(client_of(visitor.scope)):  # so that few arms are read at a time
            return await run_in_threadpool(_read, text)

    await _serve(visitor, described)


async def _first_message(visitor: WebSocket) -> str:
    """The text that describes the cloud; raises `ProblemError` if it does not come, or is none."""
    expected = "`robot` and the parameters of the cloud, as a JSON object in a text message"
    try:
        async with asyncio.timeout(PATIENCE):
            event = await visitor.receive()
    except TimeoutError:
        detail = f"No message arrived within {PATIENCE:g} s; the first one describes the arm."
        raise ProblemError(408, "request-timeout", detail, f"Send {expected}.") from None
    if event["type"] == "websocket.disconnect":
        raise WebSocketDisconnect
    if not isinstance(text := event.get("text"), str):
        raise invalid(FieldError(field="body", value="a binary message", expected=expected))
    return text


def _read(text: str) -> tuple[CloudQuery, Robot]:
    """The cloud and the arm of a first message; raises `ProblemError`."""
    body: Any = validated(SentCloud, parsed(text.encode()), "body")
    return body, body.robot.robot()


async def _serve(visitor: WebSocket, described: Callable[[], Awaitable[tuple[CloudQuery, Robot]]]) -> None:
    """One client's cloud; errors are sent as problems."""
    state = visitor.app.state
    if not await accept(visitor, logger):
        return
    ending: _Ending = None
    try:
        query, robot = await described()
        cloud = query.cloud(robot, state.settings)
        with state.streams.slot(client_of(visitor.scope)) as slot:
            ending = await _carry(visitor, slot, cloud, query.q)
    except WebSocketDisconnect:  # before the first message
        return
    except UnknownRobotError as error:
        ending = await _refuse(visitor, unknown_robot(error).problem)
    except ProblemError as error:
        ending = await _refuse(visitor, error.problem)
    except Exception:
        logger.exception("a workspace stream failed")
        ending = FAILED, "Internal error."
    if ending is not None:
        await close(visitor, *ending)


async def _carry(visitor: WebSocket, slot: Slot, cloud: Cloud, with_q: bool) -> _Ending:
    """Send the cloud until it is complete or the client cancels."""
    tasks = asyncio.create_task(_send(visitor, slot, cloud, with_q)), asyncio.create_task(_listen(visitor))
    try:
        ended, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    return ended.pop().result()


async def _send(visitor: WebSocket, slot: Slot, cloud: Cloud, with_q: bool) -> _Ending:
    table = table_of(cloud, with_q)
    chunks = ThreadedGenerator(slices(visitor.app.state.clouds, cloud, with_q))
    begun = reported = time.perf_counter()
    send_bytes = slot.lent(visitor.send_bytes)
    try:
        await _send_text(visitor, type="start", total=table.n, columns=table.columns)
        while (chunk := await run_in_threadpool(chunks.take)) is not None:
            rows = table.single(chunk).tobytes()
            await send_bytes(rows)
            STREAMED.labels("workspace").inc(len(rows))
            now = time.perf_counter()
            if chunk.done == chunk.total or now - reported >= PROGRESS_EVERY:
                reported = now
                rate = chunk.done / max(now - begun, 1e-9)
                await _send_text(
                    visitor, type="progress", done=chunk.done, total=chunk.total, points_per_second=round(rate)
                )
    except WebSocketDisconnect:
        return None
    finally:
        await run_in_threadpool(chunks.close)  # waits for the current slice
    return DONE, "done"


async def _listen(visitor: WebSocket) -> _Ending:
    """Any message of the client ends the stream."""
    event = await visitor.receive()
    if event["type"] == "websocket.disconnect":
        return None
    try:
        message = read_json(event.get("text") or "", _LIMITS)
    except TextError:
        message = None
    if message == {"cancel": True}:
        return DONE, "cancelled"
    return UNSUPPORTED, 'The only valid message is {"cancel": true}.'


async def _refuse(visitor: WebSocket, problem: Problem) -> _Ending:
    """Send the problem document; how to close with its detail."""
    with contextlib.suppress(WebSocketDisconnect):
        await _send_text(visitor, type="problem", problem=problem.model_dump())
    return LATER if problem.status == 503 else POLICY, problem.detail


async def _send_text(visitor: WebSocket, **message: Any) -> None:
    await visitor.send_text(json.dumps(message, ensure_ascii=False))
