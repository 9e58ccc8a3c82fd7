"""The REST interface: ``api_routes()`` under /api/v1, and `install_problem_handlers` for error responses.

Routes share objects in ``app.state``: ``settings``, the robots in ``store``, the caches ``clouds``, ``maps`` and
``summaries``, the limit of concurrent ``streams``, the slots for computations in ``compute``, and the memory of
request bodies in ``uploads``, the ``classroom``, and the ``lines`` of pages with the ``tries`` of their codes.
"""

from starlette.routing import BaseRoute

from app.api import equations, fk, ik, jacobian, motion, path, postures, singularity, way
from app.api.arms import calibrate, compare, files, motors, picture, robots
from app.api.body import UploadMemory
from app.api.classroom import results
from app.api.document import complete_document
from app.api.live import socket as live
from app.api.problems import install_problem_handlers
from app.api.work import ComputeSlots
from app.api.workspace import capability, download, reachable, socket, summary
from app.api.workspace.streaming import StreamLimit

__all__ = [
    "ComputeSlots",
    "StreamLimit",
    "UploadMemory",
    "api_routes",
    "complete_document",
    "install_problem_handlers",
]

# Routes are tried one after another: those that are asked most come first.
_MODULES = (
    fk,
    ik,
    robots,
    files,
    compare,
    motors,
    calibrate,
    picture,
    path,
    motion,
    way,
    jacobian,
    postures,
    singularity,
    equations,
    download,
    socket,
    summary,
    reachable,
    capability,
    results,
    live,
)


def api_routes() -> list[BaseRoute]:
    """Every route of the first version of the interface, under /api/v1."""
    return [route for module in _MODULES for route in module.router.routes]
