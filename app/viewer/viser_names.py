"""The private names of viser that Kinboard uses.

Only :mod:`app.viewer.viser_patches`, :mod:`app.viewer.viser_outbox` and :mod:`app.viewer.viser_server` use them,
and say what for. A version of viser that lacks one of `SERVER` cannot be driven: REST works all the same, and
``/readyz`` reports that the viewer failed. Where one of `IMPROVEMENTS` is missing, viser's own ways take the
place of all of them.

``pyproject.toml`` allows a narrow range of versions because of `SERVER`, and because the page's scripts
(``static/viser_page.js``) know viser's page.
"""

from __future__ import annotations

from app.shared.private_names import PrivateUse

_SCENE, _GUI, _MESSAGES = "viser._scene_handles", "viser._gui_handles", "viser._messages"
_INFRA, _BUFFER = "viser.infra._infra", "viser.infra._async_message_buffer:AsyncMessageBuffer"

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
        f"{_MESSAGES}:GuiUpdateMessage(uuid, updates)",
        f"{_MESSAGES}:Message.deserialize(message)",
        f"{_MESSAGES}:ShareUrlRequest",
        f"{_MESSAGES}:ShareUrlDisconnect",
        f"{_BUFFER}.set_done(self)",
        f"{_BUFFER}.generator_cursors",
        f"{_BUFFER}.done",
        "viser:ViserServer._websock_server",
    ),
)
IMPROVEMENTS = PrivateUse(
    "viser",
    "One frame for each step, exact poses, values and marks in their order, parts of a scene that can be hidden.",
    "Drags take about twice as long, Undo may pass a slider, sliders have no number fields, and what should be "
    "hidden beside the wall of a classroom is seen.",
    (
        # The outbox
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
        f"{_MESSAGES}:GuiRemoveMessage(uuid)",
        f"{_MESSAGES}:SceneNodeUpdateMessage(name, updates, owner)",
        "viser:ClientHandle._websock_connection",
        # Poses and values
        "viser._assignable_props_api:AssignablePropsBase._impl",
        f"{_SCENE}:_SceneNodeHandleState.name",
        f"{_SCENE}:_SceneNodeHandleState.api",
        f"{_SCENE}:_SceneNodeHandleState.position",
        f"{_SCENE}:_SceneNodeHandleState.wxyz",
        f"{_SCENE}:_SceneNodeHandleState.removed",
        f"{_GUI}:_GuiHandleState.uuid",
        f"{_GUI}:_GuiHandleState.gui_api",
        f"{_GUI}:_GuiHandleState.value",
        f"{_GUI}:_GuiHandleState.update_timestamp",
        f"{_GUI}:_GuiHandleState.removed",
        "viser:GuiApi._websock_interface",
        "viser:SceneApi._queue_scene_message(self, message)",
        f"{_MESSAGES}:SetPositionMessage(name, position, owner)",
        f"{_MESSAGES}:SetOrientationMessage(name, wxyz, owner)",
        # Marks
        f"{_MESSAGES}:LocalStorageGetItemResponseMessage(value, error, request_uuid)",
        # Filters of scenes, and gizmos
        "viser:SceneApi._handle_from_node_name",
        f"{_MESSAGES}:SetSceneNodeVisibilityMessage(name, visible, owner)",
        f"{_SCENE}:TransformControlsHandle._impl_aux",
        f"{_SCENE}:_TransformControlsState(last_updated, update_cb, sync_cb)",
        # Type hints, and what viser prints
        "viser._assignable_props_api:get_type_hints",
        "viser._threadpool_exceptions:traceback",
        "viser._threadpool_exceptions:print_awaited_callback_error(exc)",
    ),
)

ALL = SERVER, IMPROVEMENTS
