"""A page and its program: the websocket under ``/api/v1/live``, what may be sent, what the page answers."""
