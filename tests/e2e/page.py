"""One visitor's page in a browser, with the hands and eyes the tests need."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, Locator, Page, expect

import kin
from app.viewer.panel.joints import label
from app.viewer.scene import camera
from app.viewer.scene.meshes import body

ARTIFACTS = Path(__file__).parents[1] / "artifacts"
WAIT = 45_000  # ms; software rendering on a busy machine is slow
# A third of the work of software rendering is smoothing edges, and half of the rest goes with a coarser picture.
PLAIN = """
const { getContext } = HTMLCanvasElement.prototype;
HTMLCanvasElement.prototype.getContext = function (kind, options) {
  return getContext.call(this, kind, kind.startsWith("webgl") ? { ...options, antialias: false } : options);
};
Object.defineProperty(window, "devicePixelRatio", { get: () => 0.5 });
"""


class Tab:
    """One visitor's page, with the hands and eyes the tests need."""

    def __init__(self, browser: Browser, address: str, width: int, height: int) -> None:
        self.page: Page = browser.new_page(viewport={"width": width, "height": height})
        self.page.add_init_script(PLAIN)
        self.page.set_default_timeout(WAIT)
        expect.set_options(timeout=WAIT)
        self.errors: list[str] = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.goto(address + "viewer/")
        expect(self.status).to_have_attribute("data-status", "hand")
        self.page.locator("#webgl-software-rendering button").click()

    def close(self) -> None:
        self.page.close()
        assert self.errors == []

    @property
    def status(self) -> Locator:
        return self.page.locator("[data-status]")

    def row(self, label: str) -> Locator:
        """The line of the panel with this label."""
        return self.page.get_by_text(label, exact=True).locator("xpath=ancestor::div[.//input or .//button][1]")

    def number(self, label: str) -> float:
        return float(self.row(label).locator("input:visible").last.input_value())

    def type_number(self, label: str, text: str) -> None:
        entry = self.row(label).locator("input:visible").last
        entry.fill(text)
        entry.press("Enter")

    def open(self, title: str) -> None:
        """A tab of the panel. They stand still: no need to wait for two frames of the picture to see that."""
        self.page.get_by_role("tab", name=title).click(force=True)

    def take(self, robot: kin.Robot) -> None:
        """Have this robot on show."""
        if self.row("Robot").locator("input:visible").first.input_value() != robot.name:
            self.choose("Robot", robot.name)
            expect(self.status.first).to_contain_text(robot.name)

    def choose_lesson(self, title: str) -> None:
        self.open("Learn")
        self.choose("Lesson", title)

    def dark(self, wanted: bool) -> None:
        """A dark page, or a light one."""
        self.open("View")
        scheme = "dark" if wanted else "light"
        if self.page.locator("html").get_attribute("data-mantine-color-scheme") != scheme:
            self.check("Dark page")
        expect(self.page.locator("html")).to_have_attribute("data-mantine-color-scheme", scheme)

    def choose(self, label: str, option: str) -> None:
        self.row(label).locator("input:visible").first.click()
        self.page.get_by_role("option", name=option, exact=True).click()

    def check(self, label: str) -> None:
        self.row(label).locator("input:visible").first.click()

    def tool(self) -> list[float]:
        """x, y, z in mm as the panel shows them."""
        cells = self.page.locator('table[aria-label="tool pose"] tr').first.locator("td span")
        return [float(text.replace("−", "-")) for text in cells.all_inner_texts()]

    def wait_for_tool(self, xyz: np.ndarray, within: float) -> None:
        end = time.monotonic() + WAIT / 1000
        while np.abs(np.array(self.tool()) - 1000 * xyz).max() > within:
            assert time.monotonic() < end, f"the tool is at {self.tool()}, expected {1000 * xyz}"
            self.page.wait_for_timeout(50)

    def pixel(self, robot: kin.Robot, point: np.ndarray, room: Sequence[camera.Sphere] = ()) -> np.ndarray:
        """Where a point of the scene is on the page, in the default view with room for these spheres."""
        area = self.page.locator("canvas").first.bounding_box()
        assert area is not None
        position, look_at = camera.view(body(robot), area["width"] / area["height"], room=room)
        forward = (look_at - position) / np.linalg.norm(look_at - position)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        seen = np.array([right, np.cross(right, forward), forward]) @ (point - position)
        half = math.tan(camera.FOV / 2) * seen[2] * 2
        return np.array(
            [
                area["x"] + area["width"] / 2 + seen[0] / half * area["height"],
                area["y"] + area["height"] / 2 - seen[1] / half * area["height"],
            ]
        )

    def drag_arrow(self, robot: kin.Robot, T: np.ndarray, axis: int, lengths: float, steps: int = 6) -> None:
        """Drag an arrow of the gizmo at pose T along its own direction, by a multiple of its length."""
        arrow = 0.26 * body(robot).radius * T[:3, axis]
        at = self.pixel(robot, T[:3, 3] + 0.8 * arrow)
        to = self.pixel(robot, T[:3, 3] + (0.8 + lengths) * arrow)
        self.page.mouse.move(*at.tolist())
        self.page.wait_for_timeout(300)  # the arrow lights up under the pointer
        self.page.mouse.down()
        for k in range(1, steps + 1):
            self.page.mouse.move(*(at + (to - at) * k / steps).tolist())
            self.page.wait_for_timeout(60)
        self.page.mouse.up()

    def show(self, robot: kin.Robot) -> None:
        """The robot at home, without a lesson."""
        self.open("Learn")
        if self.row("Lesson").locator("input:visible").first.input_value() != "None":
            self.choose("Lesson", "None")
        self.open("Move")
        if self.row("Robot").locator("input:visible").first.input_value() != robot.name:
            self.choose("Robot", robot.name)
            expect(self.page.get_by_text(label(robot, robot.n - 1), exact=True)).to_be_visible()
        self.page.get_by_role("button", name="Home").click()
        self.wait_for_tool(kin.fk(robot, robot.q_home)[:3, 3], within=0.06)
        self.page.wait_for_timeout(300)

    def _area(self) -> Locator:
        """What of the panel scrolls."""
        return self.page.locator(".mantine-ScrollArea-viewport:has([data-status])").first

    def hidden(self) -> int:
        """Pixels of the panel that have to be scrolled to."""
        hidden: int = self._area().evaluate("area => area.scrollHeight - area.clientHeight")
        return hidden

    def top(self) -> None:
        """Scroll the panel to its beginning."""
        self._area().evaluate("area => area.scrollTo(0, 0)")

    def picture_of_the_rest(self, name: str) -> None:
        """A picture of the panel's end, if it does not fit the window."""
        area = self._area()
        if self.hidden() > 2:
            area.evaluate("area => area.scrollTo(0, area.scrollHeight)")
            area.screenshot(path=ARTIFACTS / f"{name}.png", animations="disabled")

    def screenshot(self, name: str) -> None:
        ARTIFACTS.mkdir(exist_ok=True)
        self.page.mouse.move(5, 5)
        self.page.wait_for_timeout(400)
        self.page.screenshot(path=ARTIFACTS / f"{name}.png")
