"""The REST door: ``build_router()`` holds the routes of /api/v1, `install_problem_handlers` the one error shape.

Routes find what they share in ``app.state``: robots in ``store``, ``settings``, ``clouds``, the ``gate`` that
counts the clouds being sent, and in ``sizes`` those that were computed.
"""

from fastapi import APIRouter

from app.api import equations, fk, ik, jacobian, path, robots, workspace
from app.api.body import JsonRoute
from app.api.problems import install_problem_handlers
from app.api.workspace.flow import Gate
from app.api.workspace.summary import memory

__all__ = ["Gate", "build_router", "install_problem_handlers", "memory"]


def build_router() -> APIRouter:
    """Every route of the first version of the interface, under /api/v1."""
    router = APIRouter(prefix="/api/v1", route_class=JsonRoute)
    for module in (robots, fk, ik, path, jacobian, equations, workspace):
        router.include_router(module.router)
    return router
