"""The REST door: ``build_router()`` holds the routes of /api/v1, `install_problem_handlers` the one error shape.

Routes find what they share in ``app.state``: robots in ``store``, ``settings``, ``clouds``, the ``gate`` that
counts the clouds and maps under way, capability ``maps``, in ``sizes`` those computed, and in ``work`` the
places to compute in.
"""

from fastapi import APIRouter

from app.api import equations, fk, ik, jacobian, path, robots, workspace
from app.api.body import JsonRoute
from app.api.document import complete_document
from app.api.problems import install_problem_handlers
from app.api.work import Work
from app.api.workspace.flow import Gate
from app.api.workspace.summary import memory

__all__ = ["Gate", "Work", "build_router", "complete_document", "install_problem_handlers", "memory"]


def build_router() -> APIRouter:
    """Every route of the first version of the interface, under /api/v1."""
    router = APIRouter(prefix="/api/v1", route_class=JsonRoute)
    for module in (robots, fk, ik, path, jacobian, equations, workspace):
        router.include_router(module.router)
    return router
