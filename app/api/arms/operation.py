"""One handler for two addresses: an arm of this service by its id, and an arm sent along.

``@operation(router, "fk", …)`` makes of a handler ``(request, robot, body)`` the routes
``POST /robots/{robot_id}/fk`` and ``POST /fk``; the body of the latter has a further field `robot`. A handler of a
GET takes `query` instead of `body`: its second route is a POST with these parameters as fields.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from copy import copy
from functools import partial
from typing import Annotated, Any, get_type_hints

from fastapi import APIRouter, Body, Query, Request
from pydantic import BeforeValidator, Field, Strict, create_model

from app.api import schemas
from app.api.arms.description import EXAMPLE, SENT, RobotDescription
from app.api.arms.frames import FramesBody
from app.api.schemas import POST_REFUSALS, RobotId, example, integral, robot_of
from app.api.work import Deadline, computed
from kin import Robot

Handler = Callable[..., Any]
_STRICT: dict[Any, Any] = {
    bool: Annotated[bool, Strict()],
    int: Annotated[int, Strict(), BeforeValidator(integral)],
}
_SENT_ALONG = "The arm is sent along as `robot`, with the fields of a robot file."


def operation(
    router: APIRouter,
    path: str,
    *,
    method: str = "POST",
    sent: str = "",
    name: str = "",
    examples: dict[str, Any] | None = None,
    **route: Any,
) -> Callable[[Handler], Handler]:
    """Decorator: adds both routes of a handler, a coroutine.

    Args:
        router: where they are added.
        path: below ``/robots/{robot_id}/``, and by default of the second route.
        method: of the first route.
        sent: another path of the second route.
        name: id of the first route in the OpenAPI document, by default the name of the handler; that of the second
            one ends with ``_sent``.
        examples: request bodies for the arm pioneer5; the first is one of the second route as well.
        route: further arguments of the routes; `responses` are those of the first one.
    """
    responses = route.pop("responses")

    def add(handler: Handler) -> Handler:
        hints = get_type_hints(handler, include_extras=True)
        part = "query" if "query" in hints else "body"
        model = hints.get(part)
        others = {key: hint for key, hint in hints.items() if key not in ("request", "robot", part, "return")}
        plain: dict[str, Any] = {"request": Request, "robot_id": RobotId, **others}
        if model is not None:
            plain[part] = Annotated[model, Query() if part == "query" else Body(openapi_examples=examples)]
        url = f"/robots/{{robot_id}}/{path}"
        short = name or handler.__name__
        router.add_api_route(
            url, _by_id(handler, plain), methods=[method], responses=responses, operation_id=short, **route
        )

        first = list((examples or {"one": example("An arm", {})}).items())[:1]
        given: Any = {key: example(each["summary"], {"robot": EXAMPLE, **each["value"]}) for key, each in first}
        body: Any = with_robot(model, "".join(map(str.title, handler.__name__.split("_"))))
        refusals = {status: text for status, text in {**POST_REFUSALS, **responses}.items() if status != 404}
        endpoint = _of_sent(
            handler,
            {"request": Request, **others, "body": Annotated[body, Body(openapi_examples=given)]},
            part if model else None,
            model,
        )
        more = {**route, "operation_id": f"{short}_sent", "summary": f"{route['summary']} (arm sent along)"}
        more["description"] = f"{inspect.getdoc(handler)}\n\n{_SENT_ALONG}"
        router.add_api_route(f"/{sent or path}", endpoint, methods=["POST"], responses=refusals, **more)
        return handler

    return add


def _by_id(handler: Handler, parameters: dict[str, Any]) -> Handler:
    """The endpoint of an arm of this service."""

    async def answer(**given: Any) -> Any:
        robot = robot_of(given["request"], given.pop("robot_id"))
        return await handler(**given, robot=_framed(robot, given.get("body")))

    return _endpoint(answer, handler, "", parameters)


def _of_sent(
    handler: Handler, parameters: dict[str, Any], part: str | None, model: type[schemas.Body] | None
) -> Handler:
    """The endpoint of an arm that is sent along; its table is read as an answer is computed."""

    async def answer(**given: Any) -> Any:
        sent, body = _parted(given.pop("body"), model)
        robot = _framed(await computed(given["request"], partial(_read, sent)), body)
        return await handler(**given, robot=robot, **({part: body} if part else {}))

    return _endpoint(answer, handler, "_sent", parameters)


def _parted(body: Any, model: type[schemas.Body] | None) -> tuple[RobotDescription, schemas.Body | None]:
    """The arm, and what else was sent, as the model without an arm: its class can be found by its name."""
    if model is None:
        return body.robot, None
    return body.robot, model.model_construct(**{name: getattr(body, name) for name in model.model_fields})


def _read(sent: RobotDescription, _: Deadline) -> Robot:
    return sent.robot()


def _framed(robot: Robot, body: object) -> Robot:
    return body.framed(robot) if isinstance(body, FramesBody) else robot


def _endpoint(call: Handler, handler: Handler, suffix: str, parameters: dict[str, Any]) -> Handler:
    """`call` with the name and documentation of the handler and these parameters, for FastAPI."""
    keyword, own = inspect.Parameter.KEYWORD_ONLY, inspect.signature(handler).parameters
    defaults = {name: own[name].default if name in own else inspect.Parameter.empty for name in parameters}
    signature = inspect.Signature(
        [inspect.Parameter(n, keyword, default=defaults[n], annotation=a) for n, a in parameters.items()],
        return_annotation=get_type_hints(handler).get("return", inspect.Signature.empty),
    )
    call.__name__, call.__doc__ = handler.__name__ + suffix, handler.__doc__
    call.__signature__ = signature  # type: ignore[attr-defined]
    return call


def with_robot(model: type[schemas.Body] | None, name: str = "") -> type[schemas.Body]:
    """The body with the field `robot`. What is text in a query may be numbers, booleans or lists in JSON.

    Args:
        model: the body, or the query; None: the arm is all there is.
        name: of the operation, if there is no model.
    """
    base = schemas.Body if model is None else model
    text = "An arm." if model is None else f"{inspect.getdoc(model)} And the arm itself."
    fields: dict[str, Any] = {"robot": (RobotDescription, SENT)}
    for key, field in base.model_fields.items():
        if field.annotation in _STRICT:
            fields[key] = (_STRICT[field.annotation], copy(field))
    for key, hint in base.in_json().items():
        field = base.model_fields[key]
        fields[key] = (hint, Field(field.default, description=field.description, examples=field.examples))
    return create_model(f"Sent{name if model is None else model.__name__}", __base__=base, __doc__=text, **fields)
