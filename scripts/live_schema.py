"""Write docs/live-schema.json: the JSON Schema of what a program may send to a page."""

from __future__ import annotations

import json
from pathlib import Path

from app.api.live.messages import LiveMessage

FILE = Path(__file__).parents[1] / "docs/live-schema.json"


def schema() -> str:
    """The text of the file."""
    return json.dumps(LiveMessage.model_json_schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    FILE.write_text(schema(), encoding="utf-8")
