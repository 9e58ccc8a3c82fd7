"""What all websockets of the API have in common: who may open one, and how one is closed."""

from __future__ import annotations

import contextlib
import logging

from fastapi import WebSocket
from starlette.websockets import WebSocketDisconnect, WebSocketState

from app.shared.security import origin_allowed

# Close codes of RFC 6455.
DONE, POLICY, UNSUPPORTED, FAILED, LATER = 1000, 1008, 1003, 1011, 1013
_LONGEST = 123  # bytes of a close reason


async def accept(visitor: WebSocket, logger: logging.Logger) -> bool:
    """Accept a websocket, unless it is from a page of another origin; whether it is open.

    Browsers give a page no reason for a rejected handshake, so problems are sent as messages.
    """
    if not origin_allowed(visitor.headers, visitor.app.state.settings.allowed_origins):
        logger.warning("rejected a websocket from a page of %.200r", visitor.headers.get("origin"))
        await visitor.close()  # before the handshake: a 403
        return False
    await visitor.accept()
    return True


async def close(visitor: WebSocket, code: int, reason: str) -> None:
    """Close a websocket unless the visitor has left; the reason is cut to what a close frame holds."""
    if visitor.client_state is WebSocketState.CONNECTED:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):  # left in this very moment
            await visitor.close(code, reason.encode()[:_LONGEST].decode(errors="ignore"))
