"""Arguments of ``kinboard mcp``."""

from __future__ import annotations

import argparse
from typing import Any

from app.cli.arguments.shared import Parents

HERE = "http://localhost:8000"


def add_mcp(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard mcp``."""
    about = "offer the tools to an agent over standard input and output (Model Context Protocol)"
    parser: argparse.ArgumentParser = commands.add_parser("mcp", parents=[parents.robots], help=about)
    parser.add_argument(
        "--url", default=HERE, help=f"the service whose pages the agent may drive (default {HERE})"
    )
    return parser
