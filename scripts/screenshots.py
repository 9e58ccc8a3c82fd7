"""Screenshots of the dashboard for README.md and docs/, ``docs/images/*.webp``.

    kinboard serve --port 8765 &
    python scripts/screenshots.py http://127.0.0.1:8765/ [NAME …]

Each picture is a link that restores a view, and the tab of the panel to open; *wall* is a class, which is opened
and ended, *so101* a simulated arm, which follows its page. Needs what the browser tests need: playwright, Chromium
(KINBOARD_TEST_CHROMIUM) and pillow.
"""

from __future__ import annotations

import base64
import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from PIL import Image
from playwright.sync_api import Browser, Page, expect, sync_playwright

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
ANSWERED = {"guide": {"revealed": ["1"]}}  # an open question withholds what these pictures show
SHOTS = (
    Shot("dashboard", "Move", {"robot": "puma560", "q": PUMA}),
    Shot("dh", "Learn", {"robot": "stanford", "lesson": "dh", "features": {"dh": {"at": 8.0}, **ANSWERED}}),
    Shot("equations", "Learn", {"robot": "pioneer5", "lesson": "equations", "features": ANSWERED}),
    Shot("postures", "Learn", {"robot": "puma560", "q": PUMA, "lesson": "postures", "features": ANSWERED}, 8.0),
    Shot("redundancy", "Learn", {"robot": "iiwa14", "lesson": "redundancy", "features": ANSWERED}, 8.0),
    Shot("velocity", "Learn", {"robot": "ur5", "lesson": "velocity", "features": ANSWERED}, 8.0),
    Shot("own-arm", "Robot", {"robot": KEY, "own": pack(own_arm(PRESETS["wrist-6r"], "wrist-6r"))}),
    Shot("program", "Program", {"robot": "ur5", "q": UR5, "features": {"program": PROGRAM}}, 8.0),
    Shot("workspace", "Workspace", {"robot": "irb120", "features": {"workspace": CLOUD}}, 25.0),
)


WALL, SO101 = "wall", "so101"
PROJECTOR = {"width": 1920, "height": 1080}
TASK = "which-joint-goes-down"
RIGHT, WRONG = 2, 0  # of its choices
# Alias, configuration, choices, and whether the hand is raised.
CLASS: tuple[tuple[str, list[float], tuple[int, ...], bool], ...] = (
    ("Ada", [0.35, 0.75, -2.9, 0.3, 0.7, 0.2], (RIGHT,), False),
    ("Emmy", [-0.6, 1.2, -2.6, 0.0, 0.9, 0.0], (), False),
    ("George", [1.2, 0.4, -2.2, 0.6, -0.5, 0.0], (WRONG,) * 3, False),
    ("Grace", [0.0, 1.57, -3.1, 0.0, 0.0, 0.0], (RIGHT,), False),
    ("Isaac", [-1.3, 0.9, -3.3, 1.0, 0.6, 0.0], (), True),
    ("Jacques", [2.2, 0.6, -2.4, 0.0, 1.1, 0.0], (WRONG,), False),
    ("Katherine", [0.9, 1.0, -2.0, 0.0, -0.8, 0.0], (RIGHT,), False),
    ("Sofia", [-2.4, 0.5, -2.8, 0.4, 0.8, 0.0], (), False),
)
# The students' pages are drawn seldom: nobody looks at them.
SELDOM = """{
  const { requestAnimationFrame } = window;
  window.requestAnimationFrame = (act) => setTimeout(() => requestAnimationFrame(act), 1500);
}"""


def link(address: str, state: dict[str, object]) -> str:
    """The link that restores this state."""
    text = json.dumps({"v": 1, **state}, separators=(",", ":")).encode()
    return f"{address}viewer/#s={base64.urlsafe_b64encode(text).decode().rstrip('=')}"


def arrive(page: Page) -> None:
    """Wait for the page, and close its note that the browser draws slowly."""
    expect(page.locator("[data-status]").first).to_be_visible()
    note = page.locator("[data-slow-close]")
    if note.is_visible():
        note.click()


def join(page: Page, address: str, code: str, alias: str, q: list[float]) -> None:
    """Join a room, with an arm at a configuration."""
    page.set_default_timeout(WAIT)
    page.add_init_script(SELDOM)
    page.goto(f"{address}room?code={code}")
    page.get_by_label("Alias").fill(alias)
    page.get_by_role("button", name="Join").click()
    page.wait_for_url("**/viewer/**")
    page.goto("about:blank")
    page.goto(link(address, {"robot": "puma560", "q": q}))
    expect(page.locator("[data-class-bar=free]")).to_be_attached(timeout=5 * WAIT)  # one of nine pages that start


def take_wall(browser: Browser, address: str) -> Image.Image:
    """Open a room with a class that works on a task, and photograph the wall."""
    teacher = browser.new_page(viewport=PROJECTOR, color_scheme="light")
    teacher.set_default_timeout(WAIT)
    teacher.goto(f"{address}room")
    teacher.get_by_label("Title").fill("Robotics 2")
    teacher.get_by_role("button", name="Open a room").click()
    code = teacher.locator(".code").inner_text()
    teacher.get_by_role("link", name="Start teaching").click()
    arrive(teacher)
    teacher.get_by_role("tab", name="Class").click(force=True)
    students = [browser.new_page(viewport={"width": 480, "height": 400}) for _ in CLASS]
    for student, (alias, q, _, _) in zip(students, CLASS, strict=True):
        join(student, address, code, alias, q)
    teacher.locator("[data-guide=class-task] select").select_option(TASK)
    teacher.locator("[data-guide=class-task] [data-guide-do=fields]").click()
    for student, (_, _, choices, hand) in zip(students, CLASS, strict=True):
        for tries, choice in enumerate(choices, 1):
            student.locator("[data-exercises=question] [data-guide-do=answer]").nth(choice).dispatch_event("click")
            said = "solved" if choice == RIGHT else f"{tries} tr"
            expect(student.locator("[data-class-bar] .kb-class-words")).to_contain_text(said)
        if hand:
            student.locator("[data-class-bar] [data-guide-do=hand]").dispatch_event("click")
    teacher.locator("[data-class-code]").scroll_into_view_if_needed()
    teacher.locator("[data-guide-do=wall]:visible").first.click()
    teacher.mouse.move(5, 5)
    teacher.wait_for_timeout(8000)
    image = Image.open(io.BytesIO(teacher.screenshot(timeout=WAIT)))
    end = teacher.locator("[data-guide=class-end] button")
    end.click()
    teacher.wait_for_timeout(1500)  # a double click is no second press
    end.click()
    for page in [page for context in browser.contexts for page in context.pages]:
        page.close()
    return image


def take_so101(browser: Browser, address: str) -> Image.Image:
    """Enable a simulated arm in its page, and photograph it on its way."""
    page = browser.new_page(viewport=SIZE, color_scheme="light")
    page.set_default_timeout(WAIT)
    page.add_init_script('localStorage.setItem("kinboard-hints", "drag joint learn")')
    page.goto(link(address, {"robot": "so101"}))
    arrive(page)
    page.get_by_role("tab", name="Program").click(force=True)
    page.get_by_role("button", name="Connect a program").click()
    code = page.locator("[data-live-code]").inner_text()
    words = ["so101", "--port", "sim", "--speed", "8", "--code", code, "--address", address]
    with subprocess.Popen([sys.executable, "-m", "app.cli", *words], cwd=FOLDER.parents[1]) as arm:
        page.get_by_role("tab", name="Move").click(force=True)
        page.locator("[data-confirm]").first.click()
        page.locator("#kb-confirm [data-guide-do]").click()
        expect(page.locator("[data-announced=enabled]").first).to_be_visible()
        field = page.locator(".kb-field input").first
        field.fill("40")
        field.press("Enter")
        page.mouse.move(5, 5)
        page.wait_for_timeout(2000)
        image = Image.open(io.BytesIO(page.screenshot(timeout=WAIT)))
        arm.terminate()
    page.close()
    return image


def take(page: Page, address: str, shot: Shot) -> Image.Image:
    """Open the view, wait until it stands still, and photograph it."""
    page.goto(link(address, shot.state))
    arrive(page)
    page.get_by_role("tab", name=shot.tab).click(force=True)
    page.mouse.move(5, 5)
    page.wait_for_timeout(1000 * shot.seconds)
    return Image.open(io.BytesIO(page.screenshot(timeout=WAIT)))


def main(address: str, names: list[str]) -> None:
    """Take these pictures of the service at `address`; none named: all."""
    chromium = os.environ.get("KINBOARD_TEST_CHROMIUM", "/usr/bin/chromium")
    expect.set_options(timeout=WAIT)

    def save(image: Image.Image, name: str) -> None:
        file = FOLDER / f"{name}.webp"
        image.convert("RGB").save(file, quality=86, method=6)
        print(f"{file.name}: {file.stat().st_size} bytes", flush=True)

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for shot in (shot for shot in SHOTS if not names or shot.name in names):
            page = browser.new_page(viewport=SIZE, color_scheme="light")  # a new visitor for each picture
            page.add_init_script('localStorage.setItem("kinboard-hints", "drag joint learn")')
            save(take(page, address, shot), shot.name)
            page.close()
        if not names or WALL in names:
            save(take_wall(browser, address), WALL)
        if not names or SO101 in names:
            save(take_so101(browser, address), SO101)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1].rstrip("/") + "/", sys.argv[2:])
