"""The server of the protocol: which tools and resources there are, and what a call of one returns.

An answer of REST has its status and cause as codes, the numbers, and a sentence; so has that of a tool, as JSON.
What is refused is an error of the tool with the problem document, and its sentences as text: what is wrong, what
would be valid, what to do. Transports are chosen by who runs the server.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from fastapi import FastAPI
from mcp.server import Server, ServerRequestContext
from mcp.server.stdio import stdio_server
from mcp.shared.exceptions import MCPError
from mcp.types import (
    INVALID_PARAMS,
    CallToolRequestParams,
    CallToolResult,
    ImageContent,
    ListResourcesResult,
    ListResourceTemplatesResult,
    ListToolsResult,
    PaginatedRequestParams,
    ReadResourceRequestParams,
    ReadResourceResult,
    Resource,
    ResourceTemplate,
    TextContent,
    TextResourceContents,
    ToolAnnotations,
)
from mcp.types import Tool as ToolDescription
from pydantic_core import from_json, to_json
from starlette.concurrency import run_in_threadpool
from starlette.types import ASGIApp

from app.api.problems import ProblemError
from app.mcp import page
from app.mcp.inside import Reply, ask
from app.mcp.page import Pages
from app.mcp.tools import Tool, tools_of
from app.shared.problems import Problem, problem, show
from app.shared.settings import docs_folder
from kin import __version__

Context = ServerRequestContext[Any, Any]

MOST = 256 * 1024  # bytes of an answer; an agent reads every one of them
DRIVE, NOBODY = "drive_page", "An agent"
JSON, MARKDOWN = "application/json", "text/markdown"
ARMS, DOCS = "kinboard://arms", "kinboard://docs/"
INSTRUCTIONS = (
    "Kinematics of robot arms. {} Begin with list_robots. Every answer says in `status`, `cause` or `refusal` "
    "what is missing; the resource kinboard://docs/agents shows how the tools are used together."
)


class _Handlers:
    """What the server does.

    Args:
        app: the service, whose OpenAPI document the tools are made of.
        service: answers their requests: the routes of `app` for a request that its middleware has admitted, else
            the whole of it.
        pages: those that agents drive.
    """

    def __init__(self, app: FastAPI, service: ASGIApp, pages: Pages) -> None:
        self._app, self._service, self._pages = app, service, pages

    @cached_property
    def tools(self) -> dict[str, Tool]:
        """By their names."""
        return tools_of(self._app.openapi())

    @cached_property
    def listed(self) -> ListToolsResult:
        """As they are listed. Made by a thread: the document takes half a second."""
        hints = ToolAnnotations(read_only_hint=True, open_world_hint=False)
        drive = ToolDescription(
            name=DRIVE, title="Drive a page", description=page.DESCRIPTION, input_schema=page.takes()
        )
        found = [
            ToolDescription(
                name=name,
                title=tool.title,
                description=tool.description,
                input_schema=tool.takes,
                output_schema=tool.answers,
                annotations=hints,
            )
            for name, tool in self.tools.items()
        ]
        return ListToolsResult(tools=[*found, drive])

    async def list_tools(self, context: Context, _: PaginatedRequestParams | None) -> ListToolsResult:
        """All tools."""
        return await run_in_threadpool(lambda: self.listed)

    async def call_tool(self, context: Context, params: CallToolRequestParams) -> CallToolResult:
        """The answer of a tool, or why there is none."""
        if params.name == DRIVE:
            return await self._drive(context, params.arguments or {})
        await self.list_tools(context, None)
        tool = self.tools.get(params.name)
        if tool is None:
            raise MCPError(
                INVALID_PARAMS, f"There is no tool {show(params.name)}. Tools: {', '.join(self.tools)}."
            )
        try:
            method, path, query, body = tool.request(params.arguments or {})
        except ProblemError as error:
            return refused(error.problem)
        return result(await ask(self._service, context.request, method, path, query, body))

    async def _drive(self, context: Context, arguments: Mapping[str, Any]) -> CallToolResult:
        """What the page shows then."""
        client = context.session.client_params
        name = NOBODY if client is None else client.client_info.title or client.client_info.name
        try:
            shown = await self._pages.drive(context.request, name, arguments)
        except ProblemError as error:
            return refused(error.problem)
        return CallToolResult(content=[TextContent(text=to_json(shown).decode())], structured_content=shown)

    async def list_resources(self, context: Context, _: PaginatedRequestParams | None) -> ListResourcesResult:
        """The list of arms, and the pages of the documentation."""
        arms = Resource(uri=ARMS, name="arms", title="The arms of this service, in short", mime_type=JSON)
        pages = [
            Resource(uri=f"{DOCS}{page.stem}", name=page.stem, title=_heading(page), mime_type=MARKDOWN)
            for page in _pages()
        ]
        return ListResourcesResult(resources=[arms, *pages])

    async def list_templates(
        self, context: Context, _: PaginatedRequestParams | None
    ) -> ListResourceTemplatesResult:
        """One arm by its id."""
        arm = ResourceTemplate(uri_template=f"{ARMS}/{{id}}", name="arm", title="An arm", mime_type=JSON)
        return ListResourceTemplatesResult(resource_templates=[arm])

    async def read_resource(self, context: Context, params: ReadResourceRequestParams) -> ReadResourceResult:
        """The text of a resource; an error for one that there is not."""
        uri = params.uri
        arm = uri[len(ARMS) + 1 :] if uri.startswith(f"{ARMS}/") else ""
        page = next((page for page in _pages() if uri == f"{DOCS}{page.stem}"), None)
        if page is not None:
            text, kind = page.read_text(encoding="utf-8"), MARKDOWN
        elif uri == ARMS or arm:
            name, given = ("describe_robot", {"robot": arm}) if arm else ("list_robots", {})
            await self.list_tools(context, None)  # made by a thread
            reply = await ask(self._service, context.request, *self.tools[name].request(given))
            if reply.status != 200:
                raise MCPError(INVALID_PARAMS, from_json(reply.content)["detail"])
            text, kind = reply.content.decode(), JSON
        else:
            raise MCPError(INVALID_PARAMS, f"There is no resource {show(uri)}. resources/list names them.")
        return ReadResourceResult(contents=[TextResourceContents(uri=uri, mime_type=kind, text=text)])


def _pages() -> list[Path]:
    return sorted(docs_folder().glob("*.md"))


def _heading(page: Path) -> str:
    with page.open(encoding="utf-8") as file:
        return next((line[2:].strip() for line in file if line.startswith("# ")), page.stem)


def refused(document: Problem) -> CallToolResult:
    """The problem as an error of the tool."""
    text = f"{document.detail} {document.hint}"
    return CallToolResult(
        content=[TextContent(text=text)], structured_content=document.model_dump(), is_error=True
    )


def result(reply: Reply) -> CallToolResult:
    """An answer of REST as that of a tool."""
    if reply.status != 200:
        return refused(Problem(**from_json(reply.content)))
    if reply.kind.startswith("image/"):
        data = b64encode(reply.content).decode()
        return CallToolResult(content=[ImageContent(data=data, mime_type=reply.kind)])
    if len(reply.content) > MOST:
        detail = f"The answer has {len(reply.content)} bytes, more than an agent is sent ({MOST})."
        return refused(problem(413, "answer-too-large", detail, "Ask for fewer items at a time, or ask REST."))
    text = reply.content.decode()
    found = from_json(reply.content) if reply.kind == JSON else None
    return CallToolResult(content=[TextContent(text=text)], structured_content=found)


def agent_server(app: FastAPI, service: ASGIApp, pages: Pages) -> Server[Any]:
    """The server of a service; see `_Handlers`."""
    handlers = _Handlers(app, service, pages)
    return Server(
        "kinboard",
        version=__version__,
        title="Kinboard",
        instructions=INSTRUCTIONS.format(app.description),
        get_tool_input_schema=lambda _: None,  # no argument comes as a header; else each call lists all tools
        on_list_tools=handlers.list_tools,
        on_call_tool=handlers.call_tool,
        on_list_resources=handlers.list_resources,
        on_list_resource_templates=handlers.list_templates,
        on_read_resource=handlers.read_resource,
    )


async def serve_stdio(app: FastAPI, url: str, token: str | None) -> None:
    """Serve an agent that has started this process, over standard input and output, until it closes its end.

    Args:
        url, token: the service whose pages it may drive.
    """
    server = agent_server(app, app, pages := Pages(page.at(url, token)))
    async with stdio_server() as (read, write):
        await server.run(read, write, server.create_initialization_options())
    pages.close()
