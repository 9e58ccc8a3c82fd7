"""Write down what programs of others rely on: the names of `kin`, the REST interface, the command line.

``python scripts/surface.py`` prints it as JSON. Each release keeps its own in ``tests/data/releases``, and
``tests/test_releases.py`` holds every later version to them.

A parameter is written as in a signature: ``*`` before those that go by keyword only, ``=`` behind one that may be
left out. A field of a request is ``target.position``, one of each item of a list ``solutions[].q``; a ``!`` behind
it says that it must be sent.
"""

from __future__ import annotations

import argparse
import inspect
import json
import sys
from collections.abc import Iterator, Mapping
from typing import Any, get_args, get_type_hints

import kin
from app.cli.parser import subcommands
from app.service.main import create_app
from app.shared.settings import Settings

Json = dict[str, Any]


def surface() -> Json:
    """The whole surface of this version."""
    return {"version": kin.__version__, "python": python(), "rest": rest(), "cli": command_line()}


def python() -> Json:
    """The public names of `kin`: parameters of functions, members of classes."""
    return {name: described(value) for name, value in public().items()}


def public() -> dict[str, Any]:
    """What `kin` and its public packages offer, by names such as ``fk`` and ``motion.Ptp``; each thing once."""
    top = {name: getattr(kin, name) for name in kin.__all__ if name != "__version__"}
    packages = {name: value for name, value in top.items() if inspect.ismodule(value)}
    found = {name: value for name, value in top.items() if name not in packages}
    for package, module in packages.items():
        within = {name: getattr(module, name) for name in module.__all__ if name not in found}
        found |= {f"{package}.{name}": value for name, value in within.items()}
    return found


def described(value: object) -> Json:
    if inspect.isclass(value):
        fields = {name for each in value.__mro__ for name in vars(each).get("__annotations__", {})}
        return {"members": sorted(name for name in fields | set(dir(value)) if not name.startswith("_"))}
    return {"call": _parameters(value)} if inspect.isfunction(inspect.unwrap(value)) else {}


def _parameters(function: Any) -> list[str]:
    words: list[str] = []
    for each in inspect.signature(function).parameters.values():
        if each.kind in (each.KEYWORD_ONLY, each.VAR_KEYWORD) and "*" not in words:
            words.append("*")
        if each.kind is each.VAR_KEYWORD:
            (listed,) = get_args(get_type_hints(function)[each.name])
            words += sorted(f"{name}=" for name in listed.__optional_keys__)
        else:
            words.append(each.name if each.default is each.empty else f"{each.name}=")
    return words


def rest() -> Json:
    """The routes under ``/api``: what they take and what they answer."""
    document = create_app(Settings()).openapi()
    return {
        f"{method.upper()} {path}": _route(document, route)
        for path, methods in document["paths"].items()
        for method, route in methods.items()
    }


def _route(document: Json, route: Json) -> Json:
    taken = [f"{each['name']}{'!' if each.get('required') else ''}" for each in route.get("parameters", ())]
    body = route.get("requestBody", {})
    answers = {code: answer for code, answer in route["responses"].items() if code.startswith("2")}
    return {
        "parameters": sorted(taken),
        "request": sorted(set(_of_content(document, body))),
        "answers": {code: sorted(_of_content(document, answer)) for code, answer in answers.items()},
    }


def _of_content(document: Json, message: Json) -> set[str]:
    fields: set[str] = set()
    for kind, content in message.get("content", {}).items():
        fields |= {kind} | set(_fields(document, content.get("schema", {}), ""))
    return fields


def _fields(document: Json, schema: Json, path: str, within: tuple[str, ...] = ()) -> Iterator[str]:
    """The paths of all fields of a schema; what contains itself is followed once."""
    if name := schema.get("$ref"):
        if name not in within:
            yield from _fields(
                document, document["components"]["schemas"][name.split("/")[-1]], path, (*within, name)
            )
        return
    for variants in (schema.get(word, ()) for word in ("anyOf", "oneOf", "allOf")):
        for variant in variants:
            yield from _fields(document, variant, path, within)
    if isinstance(schema.get("items"), Mapping):
        yield from _fields(document, schema["items"], f"{path}[]", within)
    for name, inner in schema.get("properties", {}).items():
        place = f"{path}.{name}" if path else name
        yield f"{place}!" if name in schema.get("required", ()) else place
        yield from _fields(document, inner, place, within)


def command_line() -> Json:
    """The commands, with the names of their arguments and options."""
    return {name or "kinboard": _words(parser) for name, parser in subcommands().items()}


def _words(parser: argparse.ArgumentParser) -> list[str]:
    arguments = (action for action in parser._actions if not isinstance(action, argparse._SubParsersAction))
    return sorted({word for action in arguments for word in action.option_strings or [action.dest]})


if __name__ == "__main__":
    json.dump(surface(), sys.stdout, indent=1, ensure_ascii=False)
    print()
