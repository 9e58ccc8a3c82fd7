"""The undocumented names of uvicorn that Kinboard uses, and what they are for.

Only :mod:`app.service.http_protocol` and :mod:`app.service.websocket_protocol` use them; they are imported where
all are there. Otherwise uvicorn's own protocols serve, without the bounds that ours put on clients.
"""

from __future__ import annotations

from app.shared.private_names import PrivateUse

_HTTP = "uvicorn.protocols.http.httptools_impl"
_PROTOCOL, _CYCLE = f"{_HTTP}:HttpToolsProtocol", f"{_HTTP}:RequestResponseCycle"
_FLOW = "uvicorn.protocols.http.flow_control:FlowControl"
_SOCKET = "uvicorn.protocols.websockets.websockets_sansio_impl:WebSocketsSansIOProtocol"

PROTOCOLS = PrivateUse(
    "uvicorn",
    "Bounds on heads, pipelines, frames and waiting clients; refusals as problem documents.",
    "uvicorn's own HTTP and websockets serve, without bounds on slow clients: put a proxy in front.",
    (
        f"{_PROTOCOL}.connection_made(self, transport)",
        f"{_PROTOCOL}.connection_lost(self, exc)",
        f"{_PROTOCOL}.data_received(self, data)",
        f"{_PROTOCOL}.on_message_begin(self)",
        f"{_PROTOCOL}.on_header(self, name, value)",
        f"{_PROTOCOL}.on_headers_complete(self)",
        f"{_PROTOCOL}.on_body(self, body)",
        f"{_PROTOCOL}.on_message_complete(self)",
        f"{_PROTOCOL}.handle_websocket_upgrade(self)",
        f"{_PROTOCOL}._should_upgrade(self)",
        f"{_PROTOCOL}._unset_keepalive_if_required(self)",
        f"{_PROTOCOL}.client",
        f"{_PROTOCOL}.cycle",
        f"{_PROTOCOL}.flow",
        f"{_PROTOCOL}.headers",
        f"{_PROTOCOL}.loop",
        f"{_PROTOCOL}.parser",
        f"{_PROTOCOL}.pipeline",
        f"{_PROTOCOL}.server_state",
        f"{_PROTOCOL}.transport",
        f"{_CYCLE}.keep_alive",
        f"{_CYCLE}.response_complete",
        f"{_CYCLE}.response_started",
        f"{_HTTP}:STATUS_LINE",
        f"{_FLOW}.pause_reading(self)",
        f"{_FLOW}.read_paused",
        f"{_SOCKET}.data_received(self, data)",
        f"{_SOCKET}.receive(self)",
        f"{_SOCKET}.handle_connect(self, event)",
        f"{_SOCKET}.handle_cont(self, event)",
        f"{_SOCKET}.handle_ping(self)",
        f"{_SOCKET}.handle_pong(self, event)",
        f"{_SOCKET}.handle_parser_exception(self)",
        f"{_SOCKET}.send_receive_event_to_app(self)",
        f"{_SOCKET}.close_sent",
        f"{_SOCKET}.conn",
        f"{_SOCKET}.curr_msg_data_type",
        f"{_SOCKET}.default_headers",
        f"{_SOCKET}.frames",
        f"{_SOCKET}.handshake_complete",
        f"{_SOCKET}.handshake_initiated",
        f"{_SOCKET}.last_ping_rtt",
        f"{_SOCKET}.loop",
        f"{_SOCKET}.ping_interval",
        f"{_SOCKET}.queue",
        f"{_SOCKET}.read_paused",
        f"{_SOCKET}.transport",
        "websockets.protocol:Protocol.max_message_size",
    ),
)
