"""Request bodies: checked type, bounded size, and a JSON parser without recursion in Python.

FastAPI reads a body of any size and parses it with `json.loads`, whose depth is limited only by the interpreter's
stack. `JsonRoute` replaces those two steps. NaN and Infinity are accepted here: the schema then rejects them with
the name of their field.

Parsing, validating and forgetting a body are single steps of compiled code, during which no other thread of the
process runs Python. Their time grows with the number of values rather than of bytes, so values are counted as they
arrive, and a body with too many is refused before it is parsed.
"""

from __future__ import annotations

from codecs import BOM_UTF8
from collections import Counter
from collections.abc import Callable, Coroutine
from email.message import Message
from functools import partial
from inspect import iscoroutinefunction, signature
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from pydantic_core import from_json

from app.api.problems import ProblemError
from app.api.work import busy, compute_slots
from app.shared.clients import client_of, share_of
from app.shared.problems import show

LARGE = 16 * 1024  # bytes of a body that takes the event loop longer than a drag
# One of these stands before each value but the first, and one after each name. Those in texts count too.
MARKS = (b",", b":", b"[", b"{")
MOST_VALUES = 200_000  # parsed in 10 to 20 ms
PER_ITEM = 20  # so many if they are more, for each of KINBOARD_MAX_BATCH


class UploadMemory:
    """The bodies that one process holds. Used by the event loop only, so it needs no lock.

    Args:
        most: bytes of all bodies.
        share: of one client.
    """

    def __init__(self, most: int, share: float) -> None:
        self._most = most
        self._most_of_one = share_of(most, share)
        self._clients: Counter[str] = Counter()
        self.held = 0

    def body(self, client: str) -> Body:
        """The memory of one body, for as long as the context that it is lasts."""
        return Body(self, client)

    def take(self, body: Body, size: int) -> None:
        """Count further bytes of a body; raises 503 if there is no room for them. A body alone always has room."""
        mine = self._clients[body.client] - body.size
        full = self.held > body.size and self.held + size > self._most
        if full or (mine and mine + body.size + size > self._most_of_one):
            detail = "The bodies of other requests take all the memory for them."
            raise busy(detail, "KINBOARD_UPLOAD_MEMORY", {"Connection": "close"})
        self.held += size
        self._clients[body.client] += size

    def give_back(self, body: Body) -> None:
        """Count a body no longer."""
        self.held -= body.size
        self._clients[body.client] -= body.size
        if not self._clients[body.client]:
            del self._clients[body.client]


class Body:
    """The bytes of one body so far."""

    def __init__(self, memory: UploadMemory, client: str) -> None:
        self._memory = memory
        self.client = client
        self.size = 0

    def __enter__(self) -> Body:
        return self

    def __exit__(self, *_: object) -> None:
        self._memory.give_back(self)

    def grow(self, size: int) -> None:
        """Count further bytes; raises 503 if there is no room for them."""
        self._memory.take(self, size)
        self.size += size


class JsonRequest(Request):
    """A request whose body is JSON of at most ``settings.max_body`` bytes, counted in `memory`."""

    def __init__(self, request: Request, memory: Body) -> None:
        super().__init__(request.scope, request.receive)
        self._memory = memory

    async def body(self) -> bytes:
        """The body; raises 413 as soon as size (announced or received) or values exceed a limit; or 503."""
        if not hasattr(self, "_body"):
            settings = self.app.state.settings
            limit, most = settings.max_body, max(MOST_VALUES, PER_ITEM * settings.max_batch)
            announced = self.headers.get("content-length", "")
            if announced.isdecimal() and int(announced[:20]) > limit:
                raise _too_large(limit)
            chunks: list[bytes] = []
            size = values = 0
            async for chunk in self.stream():
                size += len(chunk)
                if size > limit:
                    raise _too_large(limit)
                values += sum(map(chunk.count, MARKS))
                if values > most:
                    raise _too_many(most)
                self._memory.grow(len(chunk))
                chunks.append(chunk)
            self._body = b"".join(chunks)
        return self._body

    async def json(self) -> Any:
        """The parsed body; raises 400 naming the position of the syntax error."""
        if not hasattr(self, "_json"):
            self._json = parsed(await self.body())
        return self._json

    async def validate(self, read: Callable[..., tuple[Any, list[Any]]]) -> Any:
        """The validated body. A large one is validated in a thread, in turn: others are served meanwhile.

        FastAPI passes on the validated body as it is. Raises 400 or the errors of the schema.
        """
        body = await self.body()

        def validated() -> Any:
            value, errors = read(parsed(body))
            if errors:
                raise RequestValidationError(errors)
            return value

        large = len(body) >= LARGE
        self._json = await compute_slots(self).read(self, validated) if large else validated()
        return self._json

    async def require_json(self) -> None:
        """Raises 415 if the Content-Type of the body is not JSON."""
        if not await self.body():
            return
        given = self.headers.get("content-type", "")
        if given == "application/json":  # the common case
            return
        message = Message()
        message["content-type"] = given or "none/none"
        subtype = message.get_content_subtype()
        if message.get_content_maintype() != "application" or (
            subtype != "json" and not subtype.endswith("+json")
        ):
            detail = f"The body's Content-Type is {show(given) if given else 'missing'}."
            hint = "Send the header Content-Type: application/json (curl: -H 'Content-Type: application/json')."
            raise ProblemError(415, "unsupported-media-type", detail, hint)


class JsonRoute(APIRoute):
    """A route that reads its body as `JsonRequest` does.

    FastAPI collects the arguments of an endpoint anew for each request, which takes as long as a closed form of an
    arm. Where there is nothing to collect but the parts of the path and the body, the endpoint is called at once.
    """

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """FastAPI's handler, with a `JsonRequest`."""
        handle = super().get_route_handler()
        field = self.body_field
        if field is None:
            return handle
        asked_for = self._name_of_request()
        read = partial(field.validate, loc=("body",))

        async def handle_json(request: Request) -> Response:
            with request.app.state.uploads.body(client_of(request.scope)) as memory:
                request = JsonRequest(request, memory)
                await request.require_json()
                if not await request.body():
                    return await handle(request)  # which says that the body is missing
                body = await request.validate(read)
                if asked_for is None or request.scope["query_string"]:
                    return await handle(request)
                given = {asked_for: request, **request.path_params, field.name: body}
                answer: Response = await self.endpoint(**given)
                return answer

        return handle_json

    def _name_of_request(self) -> str | None:
        """The parameter of the endpoint for the request, if the others are parts of the path, the body and options
        of the query, and it is a coroutine that answers with a `Response`; else None."""
        found, parts = self.dependant, self.dependant.path_params
        other = found.dependencies or found.header_params or found.cookie_params
        plain = all(part.field_info.annotation is str for part in parts)
        required = any(parameter.field_info.is_required() for parameter in found.query_params)
        answers = signature(self.endpoint, eval_str=True).return_annotation is Response
        fits = answers and plain and iscoroutinefunction(self.endpoint) and not other and not required
        return found.request_param_name if fits else None


def versioned(tag: str) -> APIRouter:
    """A router for operations under /api/v1 with one tag of the documentation.

    The application adds their routes one by one: nested routers are searched several times per request.
    """
    return APIRouter(
        prefix="/api/v1",
        tags=[tag],
        route_class=JsonRoute,
        generate_unique_id_function=lambda route: route.name,  # generated clients name their functions by it
    )


def parsed(body: bytes) -> Any:
    """The value of a JSON text; raises 400 naming the position of a syntax error. A byte order mark is skipped."""
    try:
        return from_json(body.removeprefix(BOM_UTF8))
    except ValueError as error:
        hint = "Check quotes, commas and brackets there; JSON keys need double quotes."
        raise ProblemError(400, "malformed-json", f"The body is not valid JSON: {error}.", hint) from None


def _too_large(limit: int) -> ProblemError:
    return _refused(f"The request body is larger than {limit} bytes.", "KINBOARD_MAX_BODY")


def _too_many(limit: int) -> ProblemError:
    marks = " ".join(mark.decode() for mark in MARKS)
    return _refused(f"The request body holds more than {limit} values, counted by {marks}", "KINBOARD_MAX_BATCH")


def _refused(detail: str, setting: str) -> ProblemError:
    hint = f"Split it into several requests, or ask the operator to raise {setting}."
    # Closing the connection stops the rest from being read.
    return ProblemError(413, "body-too-large", detail, hint, headers={"Connection": "close"})
