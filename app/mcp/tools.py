"""The tools: operations of REST by their names, with the schemas of its document."""

from __future__ import annotations

import json
from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any
from urllib.parse import quote

from app.api.problems import invalid
from app.shared.problems import FieldError, show

Schema = dict[str, Any]


@dataclass(frozen=True)
class Row:
    """An operation as a tool.

    Attributes:
        operation: its id in the OpenAPI document.
        defaults: what an agent gets unless it asks for something else: the answers should be short.
    """

    operation: str
    defaults: Mapping[str, Any] = field(default_factory=dict)


TOOLS = {
    "list_robots": Row("list_robots", {"brief": True}),
    "describe_robot": Row("describe_robot"),
    "fk": Row("fk"),
    "ik": Row("ik"),
    "plan": Row("plan_motion", {"samples": False}),
    "compare": Row("compare_robots"),
    "examine_urdf": Row("examine"),
    "import_urdf": Row("import_robot"),
    "workspace": Row("summary"),
    "touch_postures": Row("touch_postures"),
    "calibrate": Row("calibrate"),
    "code": Row("export_robot", {"format": "c"}),
    "picture": Row("picture"),
}
EXAMPLE = "pioneer5"  # the arm of the examples of REST

_FILE = {"type": "object", "description": "An arm as the fields of a robot file, see kinboard://docs/robot-files."}
WORDS = frozenset({"title", "description", "example", "examples", "discriminator"})
_EITHER = {
    "description": "The id of an arm of this service, or the fields of a robot file as an object "
    "(kinboard://docs/robot-files).",
    "anyOf": [{"type": "string"}, {"type": "object"}],
}


@dataclass(frozen=True)
class Tool:
    """An operation of REST, for agents.

    Attributes:
        title, description: as in the document.
        method, path: of the operation on an arm of the service.
        sent: path of that on an arm that is sent along; empty: there is none.
        query: arguments that stand in the address.
        defaults: see `Row`.
        takes: JSON schema of the arguments.
        answers: that of the answer; None: it is no JSON.
    """

    title: str
    description: str
    method: str
    path: str
    sent: str
    query: frozenset[str]
    defaults: Mapping[str, Any]
    takes: Schema
    answers: Schema | None

    def request(self, arguments: Mapping[str, Any]) -> tuple[str, str, dict[str, str], dict[str, Any] | None]:
        """Method, path, query and body of the request; raises `ProblemError` for an arm that is none.

        What stands in the address and is null is as if it were not given: there is no null in an address.
        """
        values = {name: value for name, value in arguments.items() if value is not None or name not in self.query}
        given = {**self.defaults, **values}
        path = self.path
        if "{robot_id}" in path:
            robot = given.pop("robot", None)
            if self.sent and isinstance(robot, dict):
                query = {
                    name: _text(given.pop(name)) for name in self.query & given.keys() if self.method == "POST"
                }
                return "POST", self.sent, query, {"robot": robot, **given}
            if not isinstance(robot, str) or not robot:
                expected = "the id of an arm" + ", or the fields of a robot file" * bool(self.sent)
                raise invalid(FieldError(field="robot", value=show(robot), expected=expected))
            path = path.replace("{robot_id}", quote(robot, safe=""))
        if self.method == "GET":
            return "GET", path, {name: _text(value) for name, value in given.items()}, None
        query = {name: _text(given.pop(name)) for name in self.query & given.keys()}
        return self.method, path, query, given


def _text(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def tools_of(document: Schema) -> dict[str, Tool]:
    """The tools by their names, from the OpenAPI document."""
    operations = {
        operation["operationId"]: (path, method.upper(), operation)
        for path, item in document["paths"].items()
        for method, operation in item.items()
    }
    return {name: _tool(row, operations, document["components"]["schemas"]) for name, row in TOOLS.items()}


def _tool(row: Row, operations: Mapping[str, tuple[str, str, Schema]], schemas: Mapping[str, Schema]) -> Tool:
    path, method, operation = operations[row.operation]
    sent = operations.get(f"{row.operation}_sent", ("",))[0]
    parameters = [each for each in operation.get("parameters", ()) if each["in"] == "query"]
    properties = {
        each["name"]: {"description": each.get("description", ""), **each["schema"]} for each in parameters
    }
    required = [each["name"] for each in parameters if each.get("required")]
    examples: list[Schema] = []
    if (body := operation.get("requestBody")) is not None:
        media = body["content"]["application/json"]
        model = schemas[media["schema"]["$ref"].rpartition("/")[2]]
        properties, required = {**properties, **model["properties"]}, [*required, *model.get("required", ())]
        examples = [each["value"] for each in media.get("examples", {}).values()][:1]
    if "{robot_id}" in path:
        properties = {
            "robot": _EITHER if sent else {"type": "string", "description": "The id of an arm."},
            **properties,
        }
        required, examples = ["robot", *required], [{"robot": EXAMPLE, **each} for each in examples]
    for name, value in row.defaults.items():
        properties[name] = {**properties[name], "default": value}
    takes: Schema = {
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }
    answer = operation["responses"]["200"]["content"].get("application/json")
    return Tool(
        title=operation["summary"],
        description=operation["description"],
        method=method,
        path=path,
        sent=sent,
        query=frozenset(each["name"] for each in parameters),
        defaults=row.defaults,
        takes=closed(takes | ({"examples": examples} if examples else {}), schemas),
        answers=None if answer is None else {"type": "object", **closed(answer["schema"], schemas, WORDS)},
    )


def closed(
    schema: Schema,
    schemas: Mapping[str, Schema],
    without: Container[str] = ("title", "discriminator"),
    elsewhere: Mapping[str, Schema] = MappingProxyType({}),
) -> Schema:
    """The schema with all that it refers to. An agent reads every letter, so it is no longer than it must be.

    Args:
        without: keywords that are left out.
        elsewhere: what stands for parts that are described elsewhere; an arm that is sent along is one of them.
    """
    known = {"RobotDescription": _FILE, **elsewhere}
    found: dict[str, Any] = {}

    def part(node: Any) -> Any:
        if isinstance(node, list):
            return [part(each) for each in node]
        if not isinstance(node, dict):
            return node
        if "$ref" in node:
            name = node["$ref"].rpartition("/")[2]
            if name not in found:
                found[name] = None  # it may refer to itself
                found[name] = known[name] if name in known else part(schemas[name])
            return {"$ref": f"#/$defs/{name}"} | (
                {"description": node["description"]} if "description" in node else {}
            )
        made = {key: part(value) for key, value in node.items() if key not in without and key != "properties"}
        if "properties" in node:
            made["properties"] = {name: part(each) for name, each in node["properties"].items()}
        return made

    whole: Schema = part(schema)
    return {**whole, "$defs": found} if found else whole
