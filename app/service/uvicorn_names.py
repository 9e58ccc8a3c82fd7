"""The undocumented names of uvicorn that Kinboard uses, and what each is for.

Only :mod:`app.service.http_protocol` and :mod:`app.service.websocket_protocol` use them; they are imported where
all are there. Otherwise uvicorn's own protocols serve, without the bounds that ours put on clients.
"""

from __future__ import annotations

from app.shared.private_names import PrivateUse

_HTTP = "uvicorn.protocols.http.httptools_impl"
_PROTOCOL, _CYCLE = f"{_HTTP}:HttpToolsProtocol", f"{_HTTP}:RequestResponseCycle"
_SOCKET = "uvicorn.protocols.websockets.websockets_sansio_impl:WebSocketsSansIOProtocol"

HTTP = PrivateUse(
    "uvicorn",
    "Bounds on heads, pipelines and waiting clients; refusals as problem documents.",
    "uvicorn's own HTTP serves, without bounds on slow clients: put a proxy in front.",
    (
        f"{_PROTOCOL}.connection_made(self, transport)",
        f"{_PROTOCOL}.connection_lost(self, exc)",
        f"{_PROTOCOL}.data_received(self, data)",
        f"{_PROTOCOL}.resume_writing(self)",
        f"{_PROTOCOL}.on_message_begin(self)",
        f"{_PROTOCOL}.on_header(self, name, value)",
        f"{_PROTOCOL}.on_headers_complete(self)",
        f"{_PROTOCOL}.on_body(self, body)",
        f"{_PROTOCOL}.on_message_complete(self)",
        f"{_PROTOCOL}.on_response_complete(self)",
        f"{_PROTOCOL}.handle_websocket_upgrade(self)",
        f"{_PROTOCOL}._start_asgi_task(self, cycle, app)",
        f"{_PROTOCOL}._should_upgrade(self)",
        f"{_PROTOCOL}._unset_keepalive_if_required(self)",
        f"{_PROTOCOL}.cycle",
        f"{_PROTOCOL}.flow",
        f"{_PROTOCOL}.headers",
        f"{_PROTOCOL}.loop",
        f"{_PROTOCOL}.parser",
        f"{_PROTOCOL}.pipeline",
        f"{_PROTOCOL}.server_state",
        f"{_PROTOCOL}.transport",
        f"{_CYCLE}.chunked_encoding",
        f"{_CYCLE}.disconnected",
        f"{_CYCLE}.expected_content_length",
        f"{_CYCLE}.keep_alive",
        f"{_CYCLE}.message_event",
        f"{_CYCLE}.response_complete",
        f"{_CYCLE}.response_started",
        f"{_CYCLE}.scope",
        f"{_CYCLE}.transport",
        f"{_HTTP}:STATUS_LINE",
        "uvicorn.protocols.http.flow_control:FlowControl(transport)",
        "uvicorn.protocols.http.flow_control:FlowControl.pause_reading(self)",
        "uvicorn.protocols.http.flow_control:FlowControl.resume_reading(self)",
        "uvicorn.protocols.http.flow_control:FlowControl.read_paused",
    ),
)
WEBSOCKET = PrivateUse(
    "uvicorn",
    "A budget for frames and for waiting, quick pings in rooms, and messages sent and heard without a task.",
    "uvicorn's own websockets serve, without bounds on the frames of a client.",
    (
        f"{_SOCKET}.connection_made(self, transport)",
        f"{_SOCKET}.connection_lost(self, exc)",
        f"{_SOCKET}.data_received(self, data)",
        f"{_SOCKET}.resume_writing(self)",
        f"{_SOCKET}.receive(self)",
        f"{_SOCKET}.send(self, message)",
        f"{_SOCKET}.handle_connect(self, event)",
        f"{_SOCKET}.handle_text(self, event)",
        f"{_SOCKET}.handle_bytes(self, event)",
        f"{_SOCKET}.handle_cont(self, event)",
        f"{_SOCKET}.handle_ping(self)",
        f"{_SOCKET}.handle_pong(self, event)",
        f"{_SOCKET}.handle_parser_exception(self)",
        f"{_SOCKET}.send_receive_event_to_app(self)",
        f"{_SOCKET}.send_keepalive_ping(self)",
        f"{_SOCKET}.keepalive_timeout(self)",
        f"{_SOCKET}.client",
        f"{_SOCKET}.close_sent",
        f"{_SOCKET}.conn",
        f"{_SOCKET}.curr_msg_data_type",
        f"{_SOCKET}.default_headers",
        f"{_SOCKET}.disconnected",
        f"{_SOCKET}.frames",
        f"{_SOCKET}.handshake_complete",
        f"{_SOCKET}.handshake_initiated",
        f"{_SOCKET}.last_ping_rtt",
        f"{_SOCKET}.loop",
        f"{_SOCKET}.ping_interval",
        f"{_SOCKET}.pong_timer",
        f"{_SOCKET}.queue",
        f"{_SOCKET}.read_paused",
        f"{_SOCKET}.transport",
        f"{_SOCKET}.writable",
        "uvicorn.protocols.utils:ClientDisconnected",
        "websockets.protocol:Protocol.max_message_size",
    ),
)

ALL = (HTTP, WEBSOCKET)
