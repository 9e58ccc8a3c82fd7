"""Pictures of the built-in arms: ``python scripts/pictures.py``, or with the ids of some of them.

Those for the landing page are ``static/robots/*.webp``, smaller ones for the docs ``docs/images/arms/*.webp``.

Each arm is drawn by the viewer itself, at home, on nothing: the background is transparent, so one picture serves
light and dark pages. Needs what the browser tests need: playwright, Chromium (KINBOARD_TEST_CHROMIUM) and pillow.
"""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path

import numpy as np
import viser
from PIL import Image, ImageOps
from playwright.sync_api import sync_playwright

from app.viewer.scene.arm.arm_scene import ArmScene
from app.viewer.scene.camera import view
from app.viewer.scene.lights import light_scene
from app.viewer.scene.viewpoints import FOV
from kin import Robot, builtin_robots, get_robot

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "static" / "robots"
SMALL_FOLDER = ROOT / "docs" / "images" / "arms"
SIZE = (320, 240)
SMALL = (160, 120)
FINER = 3  # drawn so many times larger: smooth edges
MARGIN = 10


def draw(client: viser.ClientHandle, robot: Robot) -> Image.Image:
    """The arm, cut out and centred."""
    arm = ArmScene(client.scene, robot, root=f"/{robot.id}")
    arm.gizmo.visible = False
    arm.floor.show(False)
    arm.show_labels(False)
    arm.show_axes(True)
    arm.show_base_axes(False)
    width, height = (FINER * side for side in SIZE)
    position, look_at = view(arm.body, width / height)
    toward = look_at - position
    z = toward / np.linalg.norm(toward)
    x = np.cross(z, (0.0, 0.0, 1.0))
    x /= np.linalg.norm(x)
    rotation = viser.transforms.SO3.from_matrix(np.column_stack([x, np.cross(z, x), z]))
    client.flush()
    pixels = client.get_render(
        height, width, wxyz=rotation.wxyz, position=position, fov=FOV, transport_format="png", timeout=60
    )
    arm.remove()
    picture = Image.fromarray(pixels)
    picture = picture.crop(picture.getbbox())
    room = (SIZE[0] - 2 * MARGIN, SIZE[1] - 2 * MARGIN)
    picture = ImageOps.contain(picture, room, Image.Resampling.LANCZOS)
    canvas = Image.new("RGBA", SIZE)
    canvas.paste(picture, ((SIZE[0] - picture.width) // 2, (SIZE[1] - picture.height) // 2))
    return canvas


def main() -> None:
    """Draw all arms, or those that are named."""
    robots = [get_robot(name) for name in sys.argv[1:]] or list(builtin_robots().values())
    for folder in (FOLDER, SMALL_FOLDER):
        folder.mkdir(exist_ok=True)
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    light_scene(server.scene)
    done = threading.Event()

    @server.on_client_connect
    def _(client: viser.ClientHandle) -> None:
        for robot in robots:
            file = FOLDER / f"{robot.id}.webp"
            picture = draw(client, robot)
            picture.save(file, quality=82, method=6)
            small = picture.resize(SMALL, Image.Resampling.LANCZOS)
            small.save(SMALL_FOLDER / file.name, quality=75, method=6)
            print(f"{file.name}: {file.stat().st_size} bytes", flush=True)
        done.set()

    chromium = os.environ.get("KINBOARD_TEST_CHROMIUM", "/usr/bin/chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": FINER * SIZE[0], "height": FINER * SIZE[1]})
        page.goto(f"http://127.0.0.1:{server.get_port()}/")
        while not done.is_set():
            page.wait_for_timeout(200)
        browser.close()
    server.stop()


if __name__ == "__main__":
    main()
