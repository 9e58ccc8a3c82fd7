"""`documented`: REST takes the descriptions of an answer's fields from the strings under them."""

from __future__ import annotations

import ast
import inspect
import sys
from functools import cache
from itertools import pairwise
from typing import Any, TypeVar

T = TypeVar("T")


def documented(cls: type[T]) -> type[T]:
    """Decorator: REST takes the descriptions of the fields from the strings under them.

    The attribute is set by name, so that the command line need not import pydantic. Pydantic's own
    `use_attribute_docstrings` would read the source at each start of the service, which takes 0.25 s.
    """
    setattr(cls, "__pydantic_config__", {"json_schema_extra": _describe})  # noqa: B010
    return cls


def _describe(schema: dict[str, Any], cls: type) -> None:
    """Puts the strings under the fields of `cls` into its JSON schema."""
    for name, text in _field_texts(cls.__module__)[cls.__name__].items():
        schema["properties"][name]["description"] = text


@cache
def _field_texts(module: str) -> dict[str, dict[str, str]]:
    """For each class of a module, its fields and the string under each."""
    classes = [
        node for node in ast.parse(inspect.getsource(sys.modules[module])).body if isinstance(node, ast.ClassDef)
    ]
    return {
        node.name: {
            field.target.id: inspect.cleandoc(text.value.value)
            for field, text in pairwise(node.body)
            if isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(text, ast.Expr)
            and isinstance(text.value, ast.Constant)
            and isinstance(text.value.value, str)
        }
        for node in classes
    }
