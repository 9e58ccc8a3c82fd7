"""The private names of viser that Kinboard uses, and what each is for.

Only :mod:`app.viewer.viser_patches`, :mod:`app.viewer.viser_outbox` and :mod:`app.viewer.viser_server` use them. A
version of viser that lacks one of `SERVER` cannot be driven: REST works all the same, and ``/readyz`` reports that
the viewer failed. Whatever else is missing costs an improvement, and viser's own behaviour takes its place.

``pyproject.toml`` allows a narrow range of versions because of `SERVER`, and because the page's scripts
(``static/viser_page.js``) know viser's page.
"""

from __future__ import annotations

from app.shared.private_names import PrivateUse

_SCENE, _GUI, _MESSAGES = "viser._scene_handles", "viser._gui_handles", "viser._messages"
_INFRA, _BUFFER = "viser.infra._infra", "viser.infra._async_message_buffer:AsyncMessageBuffer"
_HANDLE = "viser._assignable_props_api:AssignablePropsBase._impl"

SERVER = PrivateUse(
    "viser",
    "Its message server without a port, in the service's own event loop: nobody connects past the service.",
    "The viewer cannot be served; install viser==1.1.*.",
    (
        f"{_INFRA}:_message_producer(websocket, buffer, client_id, backlog_done_message)",
        f"{_INFRA}:_ClientHandleState(message_buffer, event_loop)",
        "viser.infra:WebsockClientConnection(client_id, client_state)",
        "viser.infra:WebsockServer._background_worker(self, ready_sem)",
        "viser.infra:WebsockServer._handle_incoming_message(self, client_id, message)",
        "viser.infra:WebsockServer.unregister_handler(self, message_cls, callback)",
        "viser.infra:WebsockServer._backlog_done_message",
        "viser.infra:WebsockServer._background_event_loop",
        "viser.infra:WebsockServer._client_connect_cb",
        "viser.infra:WebsockServer._client_disconnect_cb",
        "viser.infra:WebsockServer._client_state_from_id",
        "viser.infra:WebsockServer._incoming_handlers",
        "viser.infra:WebsockServer._message_class",
        "viser.infra:WebsockServer._server_thread",
        "viser.infra:WebsockClientConnection._state",
        f"{_MESSAGES}:Message.deserialize(message)",
        f"{_MESSAGES}:ShareUrlRequest",
        f"{_MESSAGES}:ShareUrlDisconnect",
        f"{_BUFFER}.set_done(self)",
        f"{_BUFFER}.generator_cursors",
        f"{_BUFFER}.done",
        "viser:ViserServer._websock_server",
    ),
)
OUTBOX = PrivateUse(
    "viser",
    "One frame and one wake-up of the event loop for all messages of a step.",
    "viser's own buffer sends the messages: drags take about twice as long, and a connection may be lost.",
    (
        f"{_BUFFER}.event_loop",
        f"{_BUFFER}.message_event",
        f"{_BUFFER}.flush_event",
        f"{_BUFFER}.message_from_id",
        f"{_BUFFER}.buffer_lock",
        f"{_BUFFER}.atomic_counter",
        f"{_BUFFER}.max_window_size",
        f"{_BUFFER}.window_duration_sec",
        f"{_BUFFER}.id_from_redundancy_key",
        f"{_BUFFER}.ids_from_entity_state_key",
        f"{_BUFFER}.push(self, message)",
        f"{_BUFFER}.pop_message_locked(self, message_id)",
        f"{_BUFFER}.atomic_start(self)",
        f"{_BUFFER}.atomic_end(self)",
        f"{_BUFFER}.flush(self)",
        f"{_INFRA}:_append_aligned_buffers",
        f"{_MESSAGES}:SetOrientationMessage(name, wxyz, owner)",
        f"{_MESSAGES}:SetPositionMessage(name, position, owner)",
        f"{_MESSAGES}:GuiUpdateMessage(uuid, updates)",
        f"{_MESSAGES}:GuiRemoveMessage(uuid)",
        f"{_MESSAGES}:SceneNodeUpdateMessage(name, updates, owner)",
        "viser:ClientHandle._websock_connection",
    ),
)
POSES = PrivateUse(
    "viser",
    "Poses exactly as computed, without viser's costly comparison with the last one, and texts of labels.",
    "viser's own setters pose nodes: steps below 1e-5 are not shown.",
    (
        _HANDLE,
        f"{_SCENE}:_SceneNodeHandleState.name",
        f"{_SCENE}:_SceneNodeHandleState.api",
        f"{_SCENE}:_SceneNodeHandleState.props",
        f"{_SCENE}:_SceneNodeHandleState.position",
        f"{_SCENE}:_SceneNodeHandleState.wxyz",
        f"{_SCENE}:_SceneNodeHandleState.removed",
        "viser:SceneApi._queue_scene_message(self, message)",
        f"{_MESSAGES}:SetPositionMessage(name, position, owner)",
        f"{_MESSAGES}:SetOrientationMessage(name, wxyz, owner)",
        f"{_MESSAGES}:SceneNodeUpdateMessage(name, updates, owner)",
    ),
)
VALUES = PrivateUse(
    "viser",
    "Values in the panel without a task of the event loop for each callback.",
    "viser's own setters show values, which takes longer.",
    (
        _HANDLE,
        f"{_GUI}:_GuiHandleState.uuid",
        f"{_GUI}:_GuiHandleState.gui_api",
        f"{_GUI}:_GuiHandleState.value",
        f"{_GUI}:_GuiHandleState.update_timestamp",
        f"{_GUI}:_GuiHandleState.removed",
        "viser:GuiApi._websock_interface",
        f"{_MESSAGES}:GuiUpdateMessage(uuid, updates)",
    ),
)
SENT_VALUES = PrivateUse(
    "viser",
    "The value as a browser sent it, although another one has been shown meanwhile.",
    "A value typed while the arm moves may be lost.",
    ("viser:GuiApi._handle_gui_updates(self, client_id, message)", f"{_MESSAGES}:GuiUpdateMessage(uuid, updates)"),
)
MARKS = PrivateUse(
    "viser",
    "Undo, typed values and lessons take effect after the sliders that were moved before, and before later ones.",
    "They take effect when they come: Undo may pass a slider.",
    (
        "viser:ClientHandle._websock_connection",
        f"{_MESSAGES}:LocalStorageGetItemResponseMessage(value, error, request_uuid)",
    ),
)
IDENTITY = PrivateUse(
    "viser",
    "The ids of controls, by which the page finds them, and whether a node has been removed.",
    "Sliders have no number fields beside them, and labels on show keep their size.",
    (_HANDLE, f"{_SCENE}:_SceneNodeHandleState.removed", f"{_GUI}:_GuiHandleState.uuid"),
)
FILTER = PrivateUse(
    "viser",
    "Hiding all nodes of a scene but some: for the wall of a classroom, and while a pose is shown alone.",
    "What should be hidden stays in view beside the wall of a classroom and poses shown alone.",
    (
        "viser:SceneApi._queue_scene_message(self, message)",
        "viser:SceneApi._handle_from_node_name",
        f"{_MESSAGES}:SetSceneNodeVisibilityMessage(name, visible, owner)",
    ),
)
GIZMOS = PrivateUse(
    "viser",
    "Motions of a gizmo are not repeated to other visitors, of which its scene has none.",
    "Each event of a drag is sent back, which takes longer.",
    (
        f"{_SCENE}:TransformControlsHandle._impl_aux",
        f"{_SCENE}:_TransformControlsState(last_updated, update_cb, sync_cb)",
    ),
)
TYPE_HINTS = PrivateUse(
    "viser",
    "The type hints of a class are evaluated once, not for each of its objects.",
    "Pages open a little later.",
    ("viser._assignable_props_api:get_type_hints",),
)

CALLBACK_ERRORS = PrivateUse(
    "viser",
    "Errors of callbacks in the log, where control characters are escaped.",
    "viser prints what callbacks raise, which may contain what a visitor has sent.",
    ("viser._threadpool_exceptions:traceback", "viser._threadpool_exceptions:print_awaited_callback_error(exc)"),
)

ALL = (
    *(SERVER, OUTBOX, POSES, VALUES, SENT_VALUES, MARKS),
    *(IDENTITY, FILTER, GIZMOS, TYPE_HINTS, CALLBACK_ERRORS),
)
