"""Faster and safer versions of some of viser's operations, and what viser would have to offer in their place.

:mod:`app.viewer.viser_names` lists the private names of viser that these use. Where one is missing, each function
does the same in viser's own way, as far as there is one. Tests compare them with viser's own.

Poses (`assign`): viser's own setters ignore poses within 1e-5 of the last one, so an arm would end near its
solution and not on it. That comparison (`np.allclose`) takes most of their time, and a moving arm sets one pose
per joint and frame: with thirty visitors it was a fifth of all processor time. *viser: an exact comparison.*

Texts (`show_text`): viser's setter of a property evaluates its type hint, 40 µs with each event of a drag.
*viser: hints that are evaluated once.*

Values (`show_value`, `sent_value`): viser's setter of an input element's value starts a task of the event loop
for each callback, for each slider that follows the arm. When a visitor sets a value, viser's callbacks read it
from the element, where another thread may have shown a newer one meanwhile, as a moving arm does: what was typed
was lost. *viser: a setter that calls nobody, and the sent value in the event.*

Marks (`hear_marks`): a page says which changes of controls come before its own message. *viser: messages of a
page's own script, in order.*

Parts of a scene (`SceneFilter`): viser can hide one node or all of them. A filter hides all but some, including
nodes that are added later, and knows which to show again. *viser: a node above those of a client.*

Gizmos (`keep_private`), ids of controls (`uuid_of`): *viser: no copies to other visitors where there are none;
public ids.*

Pages (`cache_type_hints`): viser evaluates the type hints of a class for each of its objects, a quarter of the
cost of a page. *viser: once for each class.*

Log (`log_what_viser_prints`): viser prints what a callback raises, and warns of messages with all that is in
them. *viser: the module logging.*
"""

from __future__ import annotations

import contextvars
import functools
import logging
import sys
import time
import typing
import warnings
from collections.abc import Callable, Coroutine, Sequence
from types import SimpleNamespace, TracebackType
from typing import Any

import numpy as np
import viser
from viser import _messages as messages

from app.viewer import viser_names
from kin.transforms import Array

log = logging.getLogger(__name__)


def assign(
    node: viser.SceneNodeHandle,
    position: Array | Sequence[float] | None = None,
    wxyz: Array | Sequence[float] | None = None,
    again: bool = False,
) -> None:
    """Set a node's position ``(3,)`` and quaternion ``(4,)`` in its parent's frame.

    Unchanged values are sent only `again` if that is asked for.

    Raises:
        RuntimeError: the node has been removed.
    """
    if not viser_names.IMPROVEMENTS.is_there:
        if position is not None:
            node.position = np.asarray(position)
        if wxyz is not None:
            node.wxyz = np.asarray(wxyz)
        return
    state = node._impl
    if state.removed:
        raise RuntimeError(f"{state.name} was removed and cannot be posed")
    if position is not None and ((place := _floats(position)) != state.position.tolist() or again):
        state.position[:] = place
        x, y, z = place
        state.api._queue_scene_message(messages.SetPositionMessage(state.name, (x, y, z)))
    if wxyz is not None and ((turn := _floats(wxyz)) != state.wxyz.tolist() or again):
        state.wxyz[:] = turn
        w, x, y, z = turn
        state.api._queue_scene_message(messages.SetOrientationMessage(state.name, (w, x, y, z)))


def show_value(handle: Any, value: object, again: bool = False) -> None:
    """Show another value in an input element; an unchanged value is sent only `again` if that is asked for.

    viser's own setter also calls the element's callbacks, each as a task of the event loop, which it wakes for it.

    Raises:
        RuntimeError: the element has been removed.
    """
    if not viser_names.IMPROVEMENTS.is_there:
        handle.value = value
        return
    state = handle._impl
    if state.removed:
        raise RuntimeError(f"a {type(handle).__name__} was removed and cannot be set")
    value = type(state.value)(value)
    if again or value != state.value:
        state.gui_api._websock_interface.queue_message(messages.GuiUpdateMessage(state.uuid, {"value": value}))
        state.value = value
        state.update_timestamp = time.time()


MARK = "kinboard-mark"  # in the place of a question's id
_DIGITS = 16  # of a mark, at most
_HEARD = contextvars.ContextVar[Any]("heard", default=None)  # the message of a browser that is handled


def note_heard(message: object) -> None:
    """Have callbacks know the message for which they are called."""
    _HEARD.set(message)


def sent_value(event: Any) -> Any:
    """The value that a browser has sent, in a callback of an input element; of the type of its values."""
    shown, message = event.target.value, _HEARD.get()
    if not isinstance(message, messages.GuiUpdateMessage) or "value" not in message.updates:
        return shown
    value = message.updates["value"]
    if isinstance(shown, tuple):
        return tuple(map(type(shown[0]), value)) if shown else tuple(value)
    return type(shown)(value)


def show_text(label: viser.LabelHandle, text: str) -> None:
    """Show another text in a label; an unchanged one is not sent.

    Raises:
        RuntimeError: the label has been removed.
    """
    if not viser_names.IMPROVEMENTS.is_there:
        label.text = text
        return
    state = label._impl
    if state.removed:
        raise RuntimeError(f"{state.name} was removed and cannot be written")
    props: Any = state.props
    if text != props.text:
        props.text = text
        state.api._queue_scene_message(messages.SceneNodeUpdateMessage(state.name, {"text": text}))


def hear_marks(client: viser.ClientHandle, act: Callable[[int], Coroutine[Any, Any, None]]) -> None:
    """Call `act` in the event loop with the numbers that a page puts between the changes of viser's controls.

    Later messages of viser's connection are heard when it has returned.

    A mark is an answer to nobody's question about the browser's storage, which viser ignores.
    """
    if not viser_names.IMPROVEMENTS.is_there:
        return

    async def hear(_: int, message: messages.LocalStorageGetItemResponseMessage) -> None:
        text = message.value or ""
        if message.request_uuid == MARK and len(text) <= _DIGITS and text.isascii() and text.isdecimal():
            await act(int(text))

    client._websock_connection.register_handler(messages.LocalStorageGetItemResponseMessage, hear)


class SceneFilter:
    """Hides all nodes of a visitor's scene but some, and lights without a place, until `open`.

    What the nodes say of themselves (`visible`) goes on as if they were seen: what is added, shown or hidden
    meanwhile is as its owner left it when the filter ends.

    Args:
        kept: what the names of those begin with that stay, such as ``"/wall-"``.
    """

    def __init__(self, scene: viser.SceneApi, kept: str) -> None:
        self._scene = typing.cast(Any, scene)
        self._kept = kept
        self._open = not viser_names.IMPROVEMENTS.is_there
        if self._open:
            return
        self._send = self._scene._queue_scene_message
        for node in self._hidden():
            self._send(messages.SetSceneNodeVisibilityMessage(node.name, False))
        self._queues = self._scene._queue_scene_message = self._queue  # the same object, to be recognised

    def open(self) -> None:
        """Show again what is visible, as far as no other filter hides it."""
        if self._open:
            return
        self._open = True
        if self._scene._queue_scene_message is self._queues:
            self._scene._queue_scene_message = self._send
        for node in self._hidden():
            self._scene._queue_scene_message(messages.SetSceneNodeVisibilityMessage(node.name, node.visible))

    def _hides(self, name: str) -> bool:
        """Whether this names a top-level node that must not be seen."""
        node = self._scene._handle_from_node_name.get(name)
        return name.count("/") == 1 and not name.startswith(self._kept) and not isinstance(node, _LIGHTS)

    def _hidden(self) -> list[viser.SceneNodeHandle]:
        nodes = list(self._scene._handle_from_node_name.values())
        return [node for node in nodes if self._hides(node.name)]

    def _queue(self, message: Any) -> None:
        is_visibility = isinstance(message, messages.SetSceneNodeVisibilityMessage)
        if is_visibility and not self._open and self._hides(message.name):
            message = messages.SetSceneNodeVisibilityMessage(message.name, False)
        self._send(message)


_LIGHTS = viser.AmbientLightHandle, viser.DirectionalLightHandle, viser.HemisphereLightHandle


def uuid_of(handle: Any) -> str:
    """The id of a control: of its message, and of its element in the page; empty where that is not known."""
    return str(handle._impl.uuid) if viser_names.IMPROVEMENTS.is_there else ""


def keep_private(gizmo: viser.TransformControlsHandle) -> None:
    """Stop viser from copying a gizmo's motion to other visitors: a visitor's own scene has no others.

    The copies would also take the place of poses that wait for the visitor.
    """
    if viser_names.IMPROVEMENTS.is_there:
        gizmo._impl_aux.sync_cb = None


def _floats(values: Array | Sequence[float]) -> list[float]:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


def log_what_viser_prints() -> None:
    """Make viser log its warnings, and what callbacks raise: messages of visitors may be in both.

    Python's own `warnings` would keep the text of each for ever. While another thread is in a block of
    `warnings.catch_warnings`, it would give them to that thread, and with two such threads to nobody from then on.
    """

    def warn(message: object, category: type[Warning] = UserWarning, stacklevel: int = 1, **_: Any) -> None:
        log.warning("%s: %s", category.__name__, message, stacklevel=stacklevel + 1)

    def log_error(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        log.error("a callback of the viewer failed", exc_info=(kind, error, trace))

    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] == "viser" and vars(module).get("warnings") is warnings:
            vars(module)["warnings"] = SimpleNamespace(warn=warn)
    if viser_names.IMPROVEMENTS.is_there:
        from viser import _threadpool_exceptions as printing

        vars(printing).update(print=lambda *_, **__: None, traceback=SimpleNamespace(print_exception=log_error))


def cache_type_hints() -> None:
    """Make viser evaluate the type hints of each class once."""
    if viser_names.IMPROVEMENTS.is_there:
        from viser import _assignable_props_api as props

        props.get_type_hints = functools.cache(typing.get_type_hints)  # type: ignore[attr-defined, assignment]
