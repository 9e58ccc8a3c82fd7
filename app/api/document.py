"""Additions to FastAPI's OpenAPI document: media types, examples of answers and access control."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from fastapi import FastAPI

from app.shared.problems import MEDIA_TYPE
from app.shared.settings import Settings

_PROBLEM = {"$ref": "#/components/schemas/Problem"}
# Which of these are answered depends on the settings of a service. A client is made for all services.
_OF_ACCESS: dict[str, Any] = {
    status: {"description": text, "content": {MEDIA_TYPE: {"schema": _PROBLEM}}}
    for status, text in {
        "401": "The token is missing or wrong, where the service asks for one.",
        "403": "The service is read-only, or this is not allowed.",
        "429": "Too many requests; the header Retry-After says when to try again.",
    }.items()
}

# Answers to the first example of each operation, or to a short request; `tests/app/api/test_api_openapi.py` asks
# for them again, and writes them with --snapshot-update.
ANSWERS = Path(__file__).parent / "answers.json"

# Parts of the schema of an arm that is sent along, and their names: generated clients have a class for each.
_PARTS = {"rows": ("RowDescription", "A DH row."), "capsules": ("CapsuleDescription", "A body of a link.")}


def complete_document(app: FastAPI, settings: Settings) -> None:
    """Add to ``/openapi.json`` of `app`: media types of problems, examples of answers, access control, parts."""
    plain = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is not None:
            return app.openapi_schema
        document = plain()
        for path, operation in _operations(document):
            _name_media_type(operation)
            if path.startswith("/api/"):
                operation["responses"].update(_OF_ACCESS)
                _give_example(operation)
        _name_parts(document["components"]["schemas"])
        document["components"]["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer"}}
        asked = settings.token is not None and not settings.read_only
        document["security"] = [{"token": []}] if asked else [{"token": []}, {}]
        return document

    app.openapi = openapi  # type: ignore[method-assign]  # FastAPI's own way to adjust the document


def _operations(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for path, item in document["paths"].items():
        for operation in item.values():
            yield path, operation


@cache
def _answers() -> dict[str, Any]:
    """Answers by the name of their operation."""
    found: dict[str, Any] = json.loads(ANSWERS.read_text(encoding="utf-8"))
    return found


def _give_example(operation: dict[str, Any]) -> None:
    """Give an operation an example of its answer; that on an arm sent along has the same one."""
    name = operation["operationId"].removesuffix("_sent")
    if name in _answers():
        operation["responses"]["200"]["content"]["application/json"]["example"] = _answers()[name]


def _name_media_type(operation: dict[str, Any]) -> None:
    """FastAPI lists every response model as application/json; problem documents get their own media type."""
    for response in operation["responses"].values():
        content = response.get("content", {})
        if content.get("application/json", {}).get("schema") == _PROBLEM:
            content[MEDIA_TYPE] = content.pop("application/json")


def _name_parts(schemas: dict[str, Any]) -> None:
    """Give `_PARTS` names.

    The field `d` of a row comes last, after those that may be absent and so as if it might be absent too:
    openapi-python-client has a variable `d`, and reads the fields that are required first.
    """
    properties = schemas["RobotDescription"]["properties"]
    for key, (name, text) in _PARTS.items():
        schemas[name] = {"description": text, **properties[key]["items"]}
        properties[key] = properties[key] | {"items": {"$ref": f"#/components/schemas/{name}"}}
    for name in ("RowDescription", "RowAnswer"):
        row = dict(schemas[name]["properties"])
        row["d"] = row.pop("d")
        required = [field for field in schemas[name].get("required", ()) if field != "d"]
        schemas[name] = schemas[name] | {"properties": row} | ({"required": required} if required else {})
