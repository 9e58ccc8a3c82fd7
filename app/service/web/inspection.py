"""Inspection of the messages that visitors send to viser.

viser trusts its clients: it starts a task per message, lets one set any attribute of a control, takes uploads into
memory and opens a tunnel to the public internet when asked to. All visitors share its event loop. So the bridge
passes on only what our page has a reason to send, in sizes it has a reason to have, as fast as a hand can move.
"""

from __future__ import annotations

from typing import Any

import msgspec

from app.shared.security import CAMERA, CONTROL, MEMORY, Rights

# A message of the page is some hundred bytes long; a name typed into a field, or a stored state, may be longer.
MAX_MESSAGE = 64 * 1024
MAX_DEPTH = 6
# Messages a second, and at once: a control sends at most 20 times a second, the camera with every frame.
RATE, BURST = 240.0, 480.0

ALLOWED = frozenset(
    {
        CAMERA,
        CONTROL,
        "GuiButtonHoldMessage",
        "GuiFormSubmitMessage",
        "GuiFormDirtyMessage",
        "CommandTriggerMessage",
        "ScenePointerMessage",
        "SceneNodeClickMessage",
        "SceneNodeDragMessage",
        "TransformControlsUpdateMessage",
        "TransformControlsDragStartMessage",
        "TransformControlsDragEndMessage",
        MEMORY,
        "FileTransferPartAck",
    }
)

_decoder = msgspec.msgpack.Decoder(dict[str, Any])


class MalformedMessageError(ValueError):
    """Not a message of viser's protocol."""


class MessageLimit:
    """Rate limit of one visitor's messages: `rate` a second, `burst` at once."""

    def __init__(self, rate: float, burst: float) -> None:
        self._rate = rate
        self._burst = burst
        self._left = burst
        self._since: float | None = None

    def spend(self, now: float, cost: float = 1.0) -> float:
        """Count a message, or a frame that costs more; returns the seconds to wait before the next."""
        since = now if self._since is None else self._since
        self._left = min(self._burst, self._left + self._rate * (now - since)) - cost
        self._since = now
        return max(0.0, -self._left / self._rate)


def admitted(message: bytes, rights: Rights) -> bool:
    """Whether a message is passed on to viser; others are dropped.

    Args:
        rights: of the visitor.

    Raises:
        MalformedMessageError: it cannot be read; the connection is not worth keeping.
    """
    if len(message) > MAX_MESSAGE:
        raise MalformedMessageError(f"larger than {MAX_MESSAGE} bytes")
    try:
        fields = _decoder.decode(message)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
        raise MalformedMessageError("not a message of the viewer") from error
    kind = fields.get("type")
    if kind == CONTROL:
        # viser sets the attribute named in the message, whatever it is.
        updates = fields.get("updates")
        if not isinstance(updates, dict) or set(updates) - {"value"}:
            return False
    if not all(_shallow(value, MAX_DEPTH) for value in fields.values()):
        raise MalformedMessageError("nested too deeply")
    return isinstance(kind, str) and kind in ALLOWED and rights.allow_message(kind)


def _shallow(value: object, depth: int) -> bool:
    if isinstance(value, dict):
        return depth > 0 and all(_shallow(item, depth - 1) for item in value.values())
    if isinstance(value, list | tuple):
        return depth > 0 and all(_shallow(item, depth - 1) for item in value)
    return True
