"""The REST door: ``build_router()`` holds the routes of /api/v1, `install_problem_handlers` the one error shape.

Routes find the robots and the settings in ``app.state.store`` and ``app.state.settings``.
"""

from fastapi import APIRouter

from app.api import fk, ik, jacobian, path, robots
from app.api.body import JsonRoute
from app.api.problems import install_problem_handlers

__all__ = ["build_router", "install_problem_handlers"]


def build_router() -> APIRouter:
    """Every route of the first version of the interface, under /api/v1."""
    router = APIRouter(prefix="/api/v1", route_class=JsonRoute)
    for module in (robots, fk, ik, path, jacobian):
        router.include_router(module.router)
    return router
