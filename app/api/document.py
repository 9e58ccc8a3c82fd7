"""Additions to FastAPI's OpenAPI document: media types, ids of the robots, and access control."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fastapi import FastAPI

from app.api.problems import MEDIA_TYPE
from app.shared.settings import Settings
from app.shared.store import Store

_PROBLEM = {"$ref": "#/components/schemas/Problem"}


def complete_document(app: FastAPI, store: Store, settings: Settings) -> None:
    """Add to ``/openapi.json`` of `app` what depends on this service."""
    plain = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is not None:
            return app.openapi_schema
        document = plain()
        ids = [robot.id for robot in store.robots]
        for path, operation in _operations(document):
            _name_media_type(operation)
            for parameter in operation.get("parameters", []):
                if parameter["name"] == "robot_id":
                    parameter["schema"]["enum"] = ids
            if path.startswith("/api/"):
                operation["responses"].update(_of_access(settings))
        if settings.token is not None:
            document["components"]["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer"}}
            document["security"] = [{"token": []}, {}] if settings.read_only else [{"token": []}]
        return document

    app.openapi = openapi  # type: ignore[method-assign]  # FastAPI's own way to adjust the document


def _operations(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for path, item in document["paths"].items():
        for operation in item.values():
            yield path, operation


def _name_media_type(operation: dict[str, Any]) -> None:
    """FastAPI lists every response model as application/json; problem documents get their own media type."""
    for response in operation["responses"].values():
        content = response.get("content", {})
        if content.get("application/json", {}).get("schema") == _PROBLEM:
            content[MEDIA_TYPE] = content.pop("application/json")


def _of_access(settings: Settings) -> dict[str, Any]:
    """The error responses that depend on the settings."""
    reasons = {}
    if settings.token is not None:
        reasons["401"] = "The token is missing or wrong."
    if settings.read_only:
        reasons["403"] = "The service is read-only."
    if settings.token is not None or settings.rate_limit:
        reasons["429"] = "Too many requests; the header Retry-After says when to try again."
    return {
        status: {"description": text, "content": {MEDIA_TYPE: {"schema": _PROBLEM}}}
        for status, text in reasons.items()
    }
