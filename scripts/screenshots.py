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
from playwright.sync_api import Browser, Page, expect, sync_playwright

from app.viewer.own_arm import KEY, own_arm, pack
from app.viewer.tabs.robot.presets import PRESETS

FOLDER = Path(__file__).parents[1] / "docs" / "images"
SIZE = {"width": 1280, "height": 720}
SMALL = {"width": 800, "height": 480}  # of pages that are not photographed
WAIT = 60_000  # ms; software rendering is slow
NO_HINTS = 'localStorage.setItem("kinboard-hints", "drag joint learn")'


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

STUDENTS = {
    "Ada": ("puma560", PUMA),
    "Ben": ("ur5", UR5),
    "Chiara": ("scara", [0.5, 0.9, 0.1, 0.0]),
    "Dmitri": ("iiwa14", [0.4, 0.6, 0.2, -1.3, 0.1, 0.9, 0.0]),
    "Emre": ("pioneer5", [1.2, 0.7, 1.2, 0.5, 0.5]),
    "Fumiko": ("irb120", [0.3, 0.4, 0.2, 0.1, 0.6, 0.0]),
}


def take(page: Page, address: str, shot: Shot) -> Image.Image:
    """Open the view, wait until it stands still, and photograph it."""
    page.goto(f"{address}viewer/{arm(**shot.state)}")
    expect(page.locator("[data-status]").first).to_be_visible()
    notice = page.locator("#webgl-software-rendering button")
    if notice.count():
        notice.click()
    page.get_by_role("tab", name=shot.tab).click(force=True)
    page.mouse.move(5, 5)
    page.wait_for_timeout(1000 * shot.seconds)
    return Image.open(io.BytesIO(page.screenshot(timeout=WAIT)))


def arm(**state: object) -> str:
    """The part of a link that restores this state."""
    text = json.dumps({"v": 1, **state}, separators=(",", ":")).encode()
    return f"#s={base64.urlsafe_b64encode(text).decode().rstrip('=')}"


def enter(browser: Browser, address: str, door: str, form: dict[str, str], link: str = "") -> Page:
    """The page of a member of a room who has come in by a form."""
    page = browser.new_page(viewport=SIZE if door == "room" else SMALL, color_scheme="light")
    page.add_init_script(NO_HINTS)
    assert page.request.post(address + door, form=form).ok
    page.goto(f"{address}viewer/{link}")
    expect(page.locator("[data-class-bar]")).to_be_visible()
    return page


def take_class(browser: Browser, address: str) -> Image.Image:
    """The wall of a class: students with an arm each, of whom one raises a hand."""
    teacher = enter(browser, address, "room", {"title": "Kinematics 1", "hours": "2"})
    code = teacher.locator("[data-class-code]").inner_text()
    students = [
        enter(browser, address, "room/join", {"code": code, "alias": alias}, arm(robot=robot, q=q))
        for alias, (robot, q) in STUDENTS.items()
    ]
    students[1].locator("[data-class-bar] [data-guide-do=hand]").click()
    teacher.locator("#webgl-software-rendering button").click()
    expect(teacher.locator("[data-guide-do=pick]")).to_have_count(len(students))
    expect(teacher.locator(".kb-class-hands")).to_be_visible()
    teacher.locator("[data-guide-do=wall]").first.click()
    teacher.wait_for_timeout(8000)
    teacher.mouse.move(5, 5)
    picture = Image.open(io.BytesIO(teacher.screenshot(timeout=WAIT)))
    for page in (teacher, *students):
        page.context.close()
    return picture


def save(picture: Image.Image, name: str) -> None:
    """Save a picture in `FOLDER`."""
    file = FOLDER / f"{name}.webp"
    picture.convert("RGB").save(file, quality=86, method=6)
    print(f"{file.name}: {file.stat().st_size} bytes", flush=True)


def main(address: str) -> None:
    """Take all pictures of the service at `address`."""
    chromium = os.environ.get("KINBOARD_TEST_CHROMIUM", "/usr/bin/chromium")
    expect.set_options(timeout=WAIT)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for shot in SHOTS:
            page = browser.new_page(viewport=SIZE, color_scheme="light")  # a new visitor for each picture
            page.add_init_script(NO_HINTS)
            save(take(page, address, shot), shot.name)
            page.close()
        save(take_class(browser, address), "class")
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1].rstrip("/") + "/")
