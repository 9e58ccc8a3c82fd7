"""The workspace over REST: clouds as files and as messages, sizes, reachability of targets, capability maps."""

from fastapi import APIRouter

from app.api.body import JsonRoute
from app.api.workspace import capability, download, reachable, socket, summary

router = APIRouter(route_class=JsonRoute)
for module in (download, socket, summary, reachable, capability):
    router.include_router(module.router)
