"""A browser tab with the dashboard, and the actions and readings of it that the tests need."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, ConsoleMessage, Locator, Page, ViewportSize, expect

import kin
from app.viewer.panel.joints import label
from app.viewer.scene import camera
from app.viewer.scene.arm.arm_scene import FOR_FINGERS, GIZMO
from app.viewer.scene.meshes import body
from app.viewer.session.state import decode

ARTIFACTS = Path(__file__).parents[1] / "artifacts"
PICTURES = "KINBOARD_TEST_PICTURES" in os.environ  # save pictures of the screens: a second or two each
WAIT = 45_000  # ms; software rendering on a busy machine is slow
# viser draws an idle page once a second, which takes a quarter of a processor here.
QUIET = """
{
  const { setInterval } = window;
  window.setInterval = (act, ms, ...rest) => setInterval(act, ms === 1000 ? 20000 : ms, ...rest);
}
"""
# Half of the work of a page is drawing the scene in software. Where a test looks at the picture, edges are not
# smoothed, there are ten frames a second, and after one that is drawn the next ones leave it as it is for a while.
# Pictures that are saved have all of it.
ROUGH = """
{
  const { getContext } = HTMLCanvasElement.prototype, gl = WebGL2RenderingContext.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    return getContext.call(this, kind, kind.startsWith("webgl") ? { ...options, antialias: false } : options);
  };
  let leftOut = false, drawn = -Infinity;
  for (const name of ["clear", "drawElements", "drawArrays", "drawElementsInstanced", "drawArraysInstanced"]) {
    const draw = gl[name];
    gl[name] = function (...what) { if (!leftOut) draw.apply(this, what); };
  }
  const { requestAnimationFrame } = window, acts = new Map();
  let last = -Infinity, ids = 0, asked = false;
  const frame = (time) => {
    last = time;
    asked = false;
    leftOut = time - drawn < 2000;
    if (!leftOut) drawn = time;
    const now = [...acts.keys()]; // what these request is for the next frame; they may cancel each other
    for (const id of now) {
      const act = acts.get(id);
      acts.delete(id);
      try { act?.(time); } catch (error) { reportError(error); }
    }
    leftOut = false;
  };
  window.requestAnimationFrame = (act) => {
    acts.set(++ids, act);
    if (!asked) setTimeout(() => requestAnimationFrame(frame), last + 90 - performance.now());
    asked = true;
    return ids;
  };
  window.cancelAnimationFrame = (id) => { acts.delete(id); };
}
"""
PLAIN = QUIET if PICTURES else QUIET + ROUGH
# For tests that would pass on a page without a picture: nothing is drawn.
BLIND = PLAIN if PICTURES else QUIET + (Path(__file__).parent / "no_drawing.js").read_text(encoding="utf-8")
# As after the first minute: the hints are closed, and so is the note that the browser draws slowly.
NO_HINTS = """
localStorage.setItem("kinboard-hints", "drag joint learn");
localStorage.setItem("kinboard-software", "closed");
"""

# Keeps the websockets of the page's own scripts: viser's is in a worker.
KEEP_SOCKETS = """
{
  const { WebSocket } = window;
  window.kbSockets = [];
  window.WebSocket = class extends WebSocket {
    constructor(...given) {
      super(...given);
      window.kbSockets.push(this);
    }
  };
}
"""

# What the console of a browser says beside errors of ours.
EXPECTED = (
    "THREE.Clock: This module has been deprecated",  # viser uses it
    "KHR_parallel_shader_compile extension not supported",  # by software rendering
    "GL Driver Message",  # of software rendering, where a picture is read
)

# For half a second and five looks: a page that is held up may be looked at twice before it acts on anything.
UNCHANGED = """() => {
  const texts = [...document.querySelectorAll("[data-status], td, input")].map((e) => e.value ?? e.textContent);
  const now = texts.join("\\n"), before = window.kbRest;
  if (before?.now !== now) window.kbRest = { now, since: performance.now(), looks: 0 };
  const rests = before?.now === now && ++before.looks >= 5 && performance.now() - before.since > 500;
  if (rests) delete window.kbRest;
  return rests;
}"""


class Tab:
    """One browser tab: actions on its controls, and readings of what it shows. Its scene is not drawn.

    Attributes:
        scripts: what runs in the page first.
    """

    scripts = BLIND + NO_HINTS

    def __init__(self, browser: Browser, address: str, width: int, height: int, touch: bool = False) -> None:
        self.touch = touch
        self._browser, self._address, self._size = browser, address, ViewportSize(width=width, height=height)
        self.page: Page
        self._open()

    @contextmanager
    def sized(self, width: int, height: int) -> Iterator[Tab]:
        """The tab with a window of this size, meanwhile."""
        self.page.set_viewport_size({"width": width, "height": height})
        yield self
        self.page.set_viewport_size(self._size)

    def _open(self) -> None:
        self.page = self._browser.new_page(viewport=self._size, has_touch=self.touch, is_mobile=self.touch)
        self.page.add_init_script(self.scripts)
        self.page.set_default_timeout(WAIT)
        expect.set_options(timeout=WAIT)
        self.errors: list[str] = []
        self.spoilt = False  # a test failed here, typed at random, or left what others do not expect
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", self.listen)
        self._arrive()
        expect(self.status).to_have_attribute("data-status", "hand")

    def listen(self, message: ConsoleMessage) -> None:
        """Keep what the page writes into the browser's console, but for what is expected there."""
        if message.type in ("error", "warning") and not any(each in message.text for each in EXPECTED):
            self.errors.append(f"{message.type} in the console: {message.text}")

    def _arrive(self) -> None:
        """Go to the viewer."""
        self.page.goto(self._address + "viewer/")

    def reopen(self) -> None:
        """Open a new page, with nothing in its storage."""
        self.page.close()
        self._open()

    def text(self) -> str:
        """The address and all texts and buttons of the page, as a screen reader has them."""
        return f"{self.page.url}\n{self.page.locator('body').aria_snapshot()}"

    def close(self) -> None:
        self.page.close()
        assert self.errors == [], self.errors

    @property
    def status(self) -> Locator:
        return self.page.locator("[data-status]")

    def row(self, label: str) -> Locator:
        """The row of the panel with this label."""
        return self.page.get_by_text(label, exact=True).locator("xpath=ancestor::div[.//input or .//button][1]")

    def number(self, label: str) -> float:
        return float(self.row(label).locator("input:visible").last.input_value().replace("−", "-"))

    def type_number(self, label: str, text: str) -> None:
        entry = self.row(label).locator("input:visible").last
        entry.focus()
        while entry.input_value() != text:  # a value that comes while all is selected takes the selection away
            entry.fill(text)
        entry.press("Enter")

    def open(self, title: str) -> None:
        """Open a tab of the panel. Tabs seldom move, so the click need not wait for two equal frames."""
        tab = self.page.get_by_role("tab", name=title)
        tab.click(force=True)
        try:
            expect(tab).to_have_attribute("aria-selected", "true", timeout=1500)
        except (
            AssertionError
        ):  # a folder was being closed: the panel got shorter, and the click has missed the tab
            tab.click()
            expect(tab).to_have_attribute("aria-selected", "true")

    def select(self, robot: kin.Robot) -> None:
        """Show this robot."""
        if self.row("Robot").locator("input:visible").first.input_value() != robot.name:
            self.choose("Robot", robot.name)
            expect(self.status.first).to_contain_text(robot.name)

    def choose_lesson(self, title: str) -> None:
        self.open("Learn")
        self.choose("Lesson", title)

    def explore(self, title: str) -> None:
        """Open a lesson with the arm on show, also if it asks about others."""
        shown = self.row("Robot").locator("input:visible").first
        robot = shown.input_value()
        self.choose_lesson(title)
        expect(self.page.locator(f'[data-guide=goal][data-lesson="{title}"]')).to_be_visible()
        if shown.input_value() != robot:
            self.choose("Robot", robot)
            expect(self.page.locator("[data-guide=elsewhere]")).to_be_visible()

    def show_answer(self, lesson: str, by_key: bool = False) -> None:
        """Once the lesson of this title is on show, have the answer to its step shown, if one is asked for.

        None is where an earlier test has had it shown: a page keeps how far one was in a lesson.
        """
        expect(self.page.locator(f'[data-guide=goal][data-lesson="{lesson}"]')).to_be_visible()
        steps = self.page.locator("[data-guide=steps]")
        expect(steps).to_be_visible()
        reveal = steps.locator(".kb-reveal").first
        if reveal.count():
            reveal.press("Enter") if by_key else reveal.click()
        expect(self.page.locator("[data-asked]")).to_have_count(0)

    def set_dark(self, dark: bool) -> None:
        """Switch to the dark or the light colour scheme."""
        self.open("View")
        scheme = "dark" if dark else "light"
        self.choose("Page colours", scheme.capitalize())
        expect(self.page.locator("html")).to_have_attribute("data-mantine-color-scheme", scheme)

    def choose(self, label: str, option: str) -> None:
        self.row(label).locator("input:visible").first.click()
        shown = self.page.locator("[data-combobox-option]")  # the tab Robot has options of another kind
        self.page.get_by_role("option", name=option, exact=True).and_(shown).click()

    def check(self, label: str) -> None:
        self.row(label).locator("input:visible").first.click()

    def tool(self) -> list[float]:
        """x, y, z of the tool in mm as the panel shows them."""
        cells = self.page.locator('table[aria-label="tool pose"] tr').first.locator("td span")
        return [float(text.replace("−", "-")) for text in cells.all_inner_texts()]

    def wait_for_tool(self, xyz: np.ndarray, within: float) -> None:
        end = time.monotonic() + WAIT / 1000
        while np.abs(np.array(self.tool()) - 1000 * xyz).max() > within:
            assert time.monotonic() < end, f"the tool is at {self.tool()}, expected {1000 * xyz}"
            self.page.wait_for_timeout(50)

    def wait_for_link(self, robot: kin.Robot, index: int, degrees: float) -> None:
        """Wait until the link has a joint at an angle: it is written a moment after the arm has come to rest."""
        end = time.monotonic() + WAIT / 1000
        while True:
            text = self.page.evaluate("new URLSearchParams(location.hash.slice(1)).get('s') ?? ''")
            q = decode(text, (robot,)).q
            if q is not None and abs(math.degrees(q[index]) - degrees) < 1e-4:
                return
            assert time.monotonic() < end, f"the link has {q}, expected {degrees}° of joint {index + 1}"
            self.page.wait_for_timeout(50)

    def rest(self) -> None:
        """Wait until the numbers of the panel no longer change, after an action with several answers."""
        self.page.wait_for_function(UNCHANGED, polling=100)

    def mark_is_under_thumb(self, label: str, degrees: float) -> None:
        """Assert that this value of ψ is where the strip of feasible values and the slider below both have it."""
        strip = self.page.locator("[data-redundancy=psi]:visible > div").first.bounding_box()
        thumb = self.row(label).get_by_role("slider").first.bounding_box()
        assert strip is not None
        assert thumb is not None
        middle = strip["x"] + strip["width"] * (degrees + 180) / 360
        assert abs(middle - (thumb["x"] + thumb["width"] / 2)) < 8

    def pixel(self, robot: kin.Robot, point: np.ndarray, room: Sequence[camera.Sphere] = ()) -> np.ndarray:
        """Page coordinates of a point of the scene, in the default view with room for these spheres."""
        area = self.page.locator("canvas").first.bounding_box()
        assert area is not None
        return pixel((area["x"], area["y"], area["width"], area["height"]), robot, point, room)

    def arrow(
        self,
        robot: kin.Robot,
        T: np.ndarray,
        axis: int,
        lengths: float = 1.0,
        room: Sequence[camera.Sphere] = (),
    ) -> tuple[np.ndarray, np.ndarray]:
        """Page coordinates of a point on an arrow of the gizmo at pose T, and of one farther by its length."""
        start, end = arrow(robot, T, axis, lengths, FOR_FINGERS if self.touch else 1.0)
        return self.pixel(robot, start, room), self.pixel(robot, end, room)

    def drag_arrow(
        self,
        robot: kin.Robot,
        T: np.ndarray,
        axis: int,
        lengths: float,
        steps: int = 6,
        room: Sequence[camera.Sphere] = (),
    ) -> None:
        """Drag an arrow of the gizmo at pose T along its own direction, by a multiple of its length."""
        at, to = self.arrow(robot, T, axis, lengths, room)
        self.page.mouse.move(*at.tolist())
        self.page.wait_for_timeout(300)  # the arrow lights up under the pointer
        self.page.mouse.down()
        for k in range(1, steps + 1):
            self.page.mouse.move(*(at + (to - at) * k / steps).tolist())
            self.page.wait_for_timeout(60)
        self.page.mouse.up()

    def show(self, robot: kin.Robot) -> None:
        """Show the robot in its home configuration, without a lesson."""
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
        """The scrolling part of the panel."""
        return self.page.locator(".mantine-ScrollArea-viewport:has([data-status])").first

    def hidden(self) -> int:
        """Height in pixels of the part of the panel outside of the window."""
        hidden: int = self._area().evaluate("area => area.scrollHeight - area.clientHeight")
        return hidden

    def top(self) -> None:
        """Scroll the panel to the top."""
        self._area().evaluate("area => area.scrollTo(0, 0)")

    def picture_of_the_rest(self, name: str) -> None:
        """A picture of the end of the panel, if the panel does not fit the window."""
        if PICTURES and self.hidden() > 2:
            area = self._area()
            area.evaluate("area => area.scrollTo(0, area.scrollHeight)")
            area.screenshot(path=ARTIFACTS / f"{name}.png", animations="disabled")

    def screenshot(self, name: str) -> None:
        """Move the mouse off the controls and, if `PICTURES`, save a picture of the page."""
        self.page.mouse.move(5, 5)
        if PICTURES:
            self.page.wait_for_timeout(400)
            save_picture(self.page, name)


class DrawnTab(Tab):
    """A tab whose scene is drawn, for tests that look at it."""

    scripts = PLAIN + NO_HINTS


def pixel(
    area: Sequence[float], robot: kin.Robot, point: np.ndarray, room: Sequence[camera.Sphere] = ()
) -> np.ndarray:
    """Page coordinates of a point of the scene in an area (x, y, width, height), in the default view."""
    left, top, width, height = area
    position, look_at = camera.view(body(robot), width / height, room=room)
    forward = (look_at - position) / np.linalg.norm(look_at - position)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    seen = np.array([right, np.cross(right, forward), forward]) @ (point - position)
    half = math.tan(camera.FOV / 2) * seen[2] * 2
    return np.array([left + width / 2 + seen[0] / half * height, top + height / 2 - seen[1] / half * height])


def arrow(
    robot: kin.Robot, T: np.ndarray, axis: int, lengths: float, factor: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """A point on an arrow of the gizmo at pose T, and one farther by so many of its lengths, in the scene."""
    along = GIZMO * factor * body(robot).radius * T[:3, axis]
    return T[:3, 3] + 0.8 * along, T[:3, 3] + (0.8 + lengths) * along


def save_picture(page: Page, name: str, full_page: bool = False) -> None:
    """Save a picture of a page in tests/artifacts, if `PICTURES`."""
    if PICTURES:
        ARTIFACTS.mkdir(exist_ok=True)
        page.screenshot(path=ARTIFACTS / f"{name}.png", full_page=full_page)
