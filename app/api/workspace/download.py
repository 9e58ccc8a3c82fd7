"""A cloud of tool points as a file, computed while it is sent."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import Request, Response
from pydantic import Field

from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.schemas import OneOf, refusals, settings_of
from app.api.workspace.query import CloudQuery
from app.api.workspace.streaming import ComputedResponse
from app.exports.formats import FORMATS, encode, table_of
from kin import Robot

router = versioned("workspace")

_BINARY: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
_CONTENT: dict[str, Any] = {
    each.media_type: {"schema": {"type": "string"}} if each.name in ("csv", "ndjson") else _BINARY
    for each in FORMATS.values()
}
_HEADERS: dict[str, Any] = {
    "x-cloud-count": {"description": "Number of points.", "schema": {"type": "integer"}},
    "x-cloud-columns": {"description": "Names of the columns, separated by commas.", "schema": {"type": "string"}},
}


class DownloadQuery(CloudQuery):
    """Parameters of a cloud, and its format."""

    format: Annotated[str, OneOf(FORMATS)] = Field(
        "ndjson", description="; ".join(f"{each.name}: {each.meaning}" for each in FORMATS.values()) + "."
    )


@operation(
    router,
    "workspace",
    method="GET",
    summary="Point cloud of the workspace",
    response_class=Response,
    responses={
        200: {"description": "The cloud, point by point.", "content": _CONTENT, "headers": _HEADERS},
        **refusals(404, 422, 500, 503),
    },
)
async def workspace(request: Request, robot: Robot, query: DownloadQuery) -> Response:
    """A cloud of tool points in the world frame, in metres, computed while it is sent.

    Equal requests get equal bytes, and a larger cloud begins with the points of a smaller one. Columns are x, y,
    z, then the requested measures, then with `q` the joint values q1, q2, …. A `bin` file begins with
    `KINCLOUD`, version (uint16), number of columns (uint16), offset of the first row (uint32), number of points
    (uint64), all little-endian, then the names of the columns, separated by commas and padded with spaces.
    """
    cloud = query.cloud(robot, settings_of(request))
    kind, table = FORMATS[query.format], table_of(cloud, query.q)
    headers = {
        "content-disposition": f'attachment; filename="{robot.id}-{query.strategy}-{query.n}.{kind.name}"',
        "x-cloud-count": str(table.n),
        "x-cloud-columns": ",".join(table.columns),
    }
    if kind.size is not None:
        headers["content-length"] = str(kind.size(table))
    state = request.app.state
    pieces = encode(query.format, state.clouds, cloud, query.q)
    return ComputedResponse(pieces, "workspace", kind.media_type, headers, state.streams)
