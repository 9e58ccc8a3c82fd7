"""``kinboard serve``: settings from flags and the environment, then the service."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import os
import sys
from argparse import Namespace
from collections.abc import Callable, Mapping
from typing import Any

from pydantic import ValidationError

from app.cli.startup import no_collections
from app.shared.settings import OBSOLETE, Settings
from app.shared.threads import end_process

FLAGS = ("host", "port", "root_path", "robots", "read_only")  # they override the environment

SECRET = ("token", "database_url")  # logs keep what is printed


def run(arguments: Namespace) -> int:
    """Serve until Ctrl-C; 2 for an invalid setting."""
    for name in sorted(OBSOLETE.keys() & os.environ.keys()):
        print(f"kinboard: {name} does nothing any more: {OBSOLETE[name]}.", file=sys.stderr)
    for option in ("workers", "pin"):
        if getattr(arguments, option):
            why = OBSOLETE[f"KINBOARD_{option.upper()}"]
            print(f"kinboard: --{option} does nothing any more: {why}.", file=sys.stderr)
    settings = read_settings({name: value for name in FLAGS if (value := getattr(arguments, name)) is not None})
    if settings is None:
        return 2
    run_service = import_service()
    try:
        return run_service(settings, open_browser=arguments.open)
    finally:
        gc.unfreeze()


def run_mcp(arguments: Namespace) -> int:
    """Serve an agent over standard input and output until it leaves; 2: an invalid setting, or no extra."""
    settings = read_settings({} if arguments.robots is None else {"robots": arguments.robots})
    if settings is None:
        return 2
    try:
        from app.mcp.server import serve_stdio
    except ModuleNotFoundError:  # what kernels raise is none
        print("kinboard: this needs an extra: pip install 'kinboard[mcp]'", file=sys.stderr)
        return 2
    with no_collections():
        from app.service.main import create_app
    token = None if settings.token is None else settings.token.get_secret_value()
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(serve_stdio(create_app(settings.on_this_machine()), arguments.url, token))
    return end_process(0)  # threads may still compute


def read_settings(given: Mapping[str, Any]) -> Settings | None:
    """The settings of the environment and these values of flags; None: some are invalid, which is printed."""
    try:
        return Settings(**given)
    except ValidationError as error:
        for item in error.errors():
            name = str(item["loc"][0]) if item["loc"] else "settings"
            variable = f"KINBOARD_{name.upper()}"
            where = f"--{name.replace('_', '-')} or {variable}" if name in FLAGS else variable
            got = "a value that is not shown" if name in SECRET else repr(item["input"])
            print(f"kinboard: {where}: got {got}: {item['msg']}", file=sys.stderr)
        return None


def import_service() -> Callable[..., int]:
    """What runs the service (:func:`app.service.main.run`); later collections skip what it has imported."""
    with no_collections():
        from app.service.main import run

        gc.freeze()
    return run
