"""uvicorn's configuration, and the guard of its connections."""

from __future__ import annotations

import uvicorn

from app.service.guard import Guard


class GuardedConfig(uvicorn.Config):
    """uvicorn's configuration, and the guard of its connections."""

    guard: Guard
