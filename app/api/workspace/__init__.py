"""The workspace over REST: clouds as files and as websocket messages, its sizes, and whether targets are in it."""

from fastapi import APIRouter

from app.api.body import JsonRoute
from app.api.workspace import download, reachable, socket, summary

router = APIRouter(route_class=JsonRoute)
for module in (download, socket, summary, reachable):
    router.include_router(module.router)
