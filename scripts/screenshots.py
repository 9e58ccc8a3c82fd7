"""Screenshots of the dashboard for README.md and docs/, ``docs/images/*.webp``.

    kinboard serve --port 8765 &
    python scripts/screenshots.py http://127.0.0.1:8765/

Each picture is a link that restores a view, and the tab of the panel to open. Needs what the browser tests need:
playwright, Chromium (KINBOARD_TEST_CHROMIUM) and pillow.
"""

from __future__ import annotations

import base64
import io
import json
import os
import sys
from pathlib import Path
from typing import NamedTuple

from PIL import Image
from playwright.sync_api import Page, expect, sync_playwright

from app.viewer.own_arm import KEY, own_arm, pack
from app.viewer.tabs.robot.presets import PRESETS

FOLDER = Path(__file__).parents[1] / "docs" / "images"
SIZE = {"width": 1280, "height": 720}
WAIT = 60_000  # ms; software rendering is slow


class Shot(NamedTuple):
    """A picture: its name, the tab of the panel that is open, and the state of the page."""

    name: str
    tab: str
    state: dict[str, object]
    seconds: float = 4.0


PUMA = [0.35, 0.75, -2.9, 0.3, 0.7, 0.2]
CLOUD = {"drawn": True, "n": 200_000, "strategy": "uniform", "axis": "y", "at": 0.0}
UR5 = [3.1416, -1.9199, 1.7453, -1.3963, -1.5708, 0.0]
MOVES = [
    ["p", UR5],
    ["p", [3.9, -1.5, 1.7, -1.77, -1.5708, 0.0], "above the part"],
    ["l", [3.9, -1.4, 1.9, -2.07, -1.5708, 0.0], "on the part", 1.0, {"v": 0.2}],
    ["p", [2.6, -1.7, 1.6, -1.47, -1.5708, 0.0], "tray"],
]
PROGRAM = {"programs": {"ur5": MOVES}, "ghosts": True, "compare": "lin"}
SHOTS = (
    Shot("dashboard", "Move", {"robot": "puma560", "q": PUMA}),
    Shot("dh", "Learn", {"robot": "stanford", "lesson": "dh", "features": {"dh": {"at": 8.0}}}),
    Shot("equations", "Learn", {"robot": "pioneer5", "lesson": "equations"}),
    Shot("postures", "Learn", {"robot": "puma560", "q": PUMA, "lesson": "postures"}, 8.0),
    Shot("redundancy", "Learn", {"robot": "iiwa14", "lesson": "redundancy"}, 8.0),
    Shot("velocity", "Learn", {"robot": "ur5", "lesson": "velocity"}, 8.0),
    Shot("own-arm", "Robot", {"robot": KEY, "own": pack(own_arm(PRESETS["wrist-6r"], "wrist-6r"))}),
    Shot("program", "Program", {"robot": "ur5", "q": UR5, "features": {"program": PROGRAM}}, 8.0),
    Shot("workspace", "Workspace", {"robot": "irb120", "features": {"workspace": CLOUD}}, 25.0),
)


def take(page: Page, address: str, shot: Shot) -> Image.Image:
    """Open the view, wait until it stands still, and photograph it."""
    text = json.dumps({"v": 1, **shot.state}, separators=(",", ":")).encode()
    page.goto(f"{address}viewer/#s={base64.urlsafe_b64encode(text).decode().rstrip('=')}")
    expect(page.locator("[data-status]").first).to_be_visible()
    notice = page.locator("#webgl-software-rendering button")
    if notice.count():
        notice.click()
    page.get_by_role("tab", name=shot.tab).click(force=True)
    page.mouse.move(5, 5)
    page.wait_for_timeout(1000 * shot.seconds)
    return Image.open(io.BytesIO(page.screenshot(timeout=WAIT)))


def main(address: str) -> None:
    """Take all pictures of the service at `address`."""
    chromium = os.environ.get("KINBOARD_TEST_CHROMIUM", "/usr/bin/chromium")
    expect.set_options(timeout=WAIT)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for shot in SHOTS:
            page = browser.new_page(viewport=SIZE, color_scheme="light")  # a new visitor for each picture
            page.add_init_script('localStorage.setItem("kinboard-hints", "drag joint learn")')
            file = FOLDER / f"{shot.name}.webp"
            take(page, address, shot).convert("RGB").save(file, quality=86, method=6)
            page.close()
            print(f"{file.name}: {file.stat().st_size} bytes", flush=True)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1].rstrip("/") + "/")
