"""Write docs/live-schema.json: the JSON Schema of what a program may send to a page.

What REST takes too, such as a robot, is described once, by the service's OpenAPI document, and named here.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from app.api.live import messages
from app.api.live.messages import LiveMessage

FILE = Path(__file__).parents[1] / "docs/live-schema.json"


def schema() -> str:
    """The text of the file."""
    found = LiveMessage.model_json_schema()
    own = {
        name
        for name in found["$defs"]
        if getattr(getattr(messages, name, None), "__module__", "") == messages.__name__
    }
    found["$defs"] = {name: found["$defs"][name] for name in sorted(own)}
    text = json.dumps(found, indent=1, ensure_ascii=False)

    def elsewhere(ref: re.Match[str]) -> str:
        return ref[0] if ref[1] in own else f'"/openapi.json#/components/schemas/{ref[1]}"'

    return re.sub(r'"#/\$defs/(\w+)"', elsewhere, text) + "\n"


if __name__ == "__main__":
    FILE.write_text(schema(), encoding="utf-8")
