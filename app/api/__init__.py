"""The REST door: ``api_routes()`` are those of /api/v1, `install_problem_handlers` the one error shape.

Routes find what they share in ``app.state``: robots in ``store``, ``settings``, ``clouds``, the ``gate`` that
counts the clouds and maps under way, capability ``maps``, ``summaries`` (sizes and sections), and in ``work`` the
places to compute in.
"""

from starlette.routing import BaseRoute

from app.api import equations, fk, ik, jacobian, path, robots
from app.api.document import complete_document
from app.api.problems import install_problem_handlers
from app.api.work import Work
from app.api.workspace import capability, download, reachable, socket, summary
from app.api.workspace.flow import Gate

__all__ = ["Gate", "Work", "api_routes", "complete_document", "install_problem_handlers"]

_MODULES = (robots, fk, ik, path, jacobian, equations, download, socket, summary, reachable, capability)


def api_routes() -> list[BaseRoute]:
    """Every route of the first version of the interface, under /api/v1."""
    return [route for module in _MODULES for route in module.router.routes]
