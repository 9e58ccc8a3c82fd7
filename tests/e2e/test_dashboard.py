"""The dashboard in a real headless Chromium, through the public port of the real service."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, Page, expect, sync_playwright

import kin
from app.viewer import camera
from app.viewer.meshes import body

pytestmark = pytest.mark.browser

CHROMIUM = Path(os.environ.get("KINBOARD_TEST_CHROMIUM", "/usr/bin/chromium"))
ARTIFACTS = Path(__file__).parents[1] / "artifacts"
ROOT = Path(__file__).parents[2]
PIONEER = kin.get_robot("pioneer5")
SRS = kin.get_robot("redundant7-craig")
WAIT = 20_000  # ms; software rendering on a busy machine is slow


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The service as a user starts it, on a free port."""
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "app.cli", "serve", "--port", "0"]
    with subprocess.Popen(
        command, cwd=ROOT, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            assert "http://" in line, f"the service did not start: {line}{process.stdout.read()}"
            url = "http://" + line.split("http://")[1].split()[0]
            wait_until_ready(url)
            yield url
        finally:
            process.terminate()
            process.wait(20)


def wait_until_ready(url: str, seconds: float = 180.0) -> None:
    end = time.monotonic() + seconds
    reason = ""
    while time.monotonic() < end:
        try:
            with urllib.request.urlopen(url + "readyz", timeout=5):
                return
        except OSError as error:  # 503 until everything is warm
            reason = str(error)
        time.sleep(0.2)
    pytest.fail(f"not ready after {seconds} s: {reason}")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if not CHROMIUM.exists():
        pytest.fail(
            f"no Chromium at {CHROMIUM}: install it (apt-get install chromium) or set KINBOARD_TEST_CHROMIUM"
        )
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture(scope="module")
def desktop(browser: Browser, address: str) -> Iterator[Tab]:
    """One tab for all tests: software rendering compiles its shaders for seconds whenever a page opens."""
    opened = Tab(browser, address, 1280, 720)
    yield opened
    opened.close()


@pytest.fixture
def tab(desktop: Tab) -> Tab:
    """The tab with the Pioneer arm at home."""
    desktop.show(PIONEER)
    return desktop


class Tab:
    """One visitor's page, with the hands and eyes the tests need."""

    def __init__(self, browser: Browser, address: str, width: int, height: int) -> None:
        self.page: Page = browser.new_page(viewport={"width": width, "height": height})
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

    def pixel(self, robot: kin.Robot, point: np.ndarray) -> np.ndarray:
        """Where a point of the scene is on the page, in the default view."""
        area = self.page.locator("canvas").first.bounding_box()
        assert area is not None
        position, look_at = camera.view(body(robot), area["width"] / area["height"])
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
        """The robot at home."""
        self.page.get_by_role("tab", name="Move").click()
        if self.row("Robot").locator("input:visible").first.input_value() != robot.name:
            self.choose("Robot", robot.name)
            free = 1 if robot.n > 5 else 0  # the arm angle, or θ1
            expect(self.page.get_by_role("slider")).to_have_count(robot.n + free)
        self.page.get_by_role("button", name="Home").click()
        self.wait_for_tool(kin.fk(robot, robot.q_home)[:3, 3], within=0.06)
        self.page.wait_for_timeout(500)

    def screenshot(self, name: str) -> None:
        ARTIFACTS.mkdir(exist_ok=True)
        self.page.mouse.move(5, 5)
        self.page.wait_for_timeout(700)
        self.page.screenshot(path=ARTIFACTS / f"{name}.png")


def home_with(robot: kin.Robot, index: int, degrees: float) -> np.ndarray:
    q = robot.q_home.copy()
    q[index] = math.radians(degrees)
    return q


def test_sliders_by_keyboard_mouse_and_number(tab: Tab) -> None:
    tab.type_number("1 rotating base", "37.25")
    tab.wait_for_tool(kin.fk(PIONEER, home_with(PIONEER, 0, 37.25))[:3, 3], within=0.06)
    assert tab.number("1 rotating base") == 37.25
    expect(tab.status).to_contain_text("Moved by joints")

    thumb = tab.row("1 rotating base").get_by_role("slider").first
    thumb.focus()
    for _ in range(5):
        tab.page.keyboard.press("ArrowRight")
    expect(tab.row("1 rotating base").locator("input:visible").last).to_have_value("37.3")
    tab.wait_for_tool(kin.fk(PIONEER, home_with(PIONEER, 0, 37.3))[:3, 3], within=0.06)

    handle = thumb.bounding_box()
    assert handle is not None
    x, y = handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x + 50, y, steps=10)
    tab.page.mouse.up()
    tab.page.wait_for_timeout(500)
    degrees = tab.number("1 rotating base")
    assert degrees > 60
    tab.wait_for_tool(kin.fk(PIONEER, home_with(PIONEER, 0, degrees))[:3, 3], within=0.06)


def test_dragging_the_gizmo_moves_the_arm_and_out_of_reach_is_said(tab: Tab) -> None:
    tab.show(SRS)
    home = kin.fk(SRS, SRS.q_home)
    tab.drag_arrow(SRS, home, axis=2, lengths=-0.6)
    expect(tab.status).to_have_attribute("data-status", "reached")
    expect(tab.status).to_contain_text("Reached")
    moved = np.array(tab.tool()) / 1000 - home[:3, 3]
    assert moved @ home[:3, 2] < -0.03, "the tool went backwards along its own axis"
    assert np.linalg.norm(moved - home[:3, 2] * (moved @ home[:3, 2])) < 1e-3, "and nowhere else"
    q = np.radians([tab.number(f"Joint {i + 1}") for i in range(SRS.n)])
    assert np.abs(kin.fk(SRS, q)[:3, 3] * 1000 - tab.tool()).max() < 0.5, "the sliders show the solution"
    tab.screenshot("drag-reached")

    reached = home.copy()
    reached[:3, 3] += moved
    tab.drag_arrow(SRS, reached, axis=2, lengths=4.2)
    expect(tab.status).to_have_attribute("data-status", "unreachable")
    expect(tab.status).to_contain_text("Out of reach by")
    expect(tab.status).to_contain_text("mm")
    tab.screenshot("drag-out-of-reach")

    tab.page.get_by_role("button", name="Home").click()
    tab.wait_for_tool(home[:3, 3], within=0.06)


def test_branches_and_the_arm_angle_move_the_arm_and_not_the_tool(tab: Tab) -> None:
    tab.show(SRS)
    home = kin.fk(SRS, SRS.q_home)[:3, 3]
    name = next(n for n in kin.branch_names(SRS) if "back" in n and "elbow up" in n and "no-flip" in n)
    tab.choose("Branch", "back · up · no-flip")
    expect(tab.status).to_contain_text("Reached")
    expect(tab.page.locator("[data-branch]")).to_have_text(f"now: {name}")
    tab.wait_for_tool(home, within=0.06)
    tab.type_number("Arm angle ψ", "60")
    tab.page.wait_for_timeout(900)
    tab.wait_for_tool(home, within=0.06)
    q = np.radians([tab.number(f"Joint {i + 1}") for i in range(SRS.n)])
    assert kin.branch_of(SRS, q) == name
    assert np.abs(kin.fk(SRS, q)[:3, 3] - home).max() < 5e-4
    assert abs(q[0]) > 0.2, "the elbow swung out"
    expect(tab.page.locator("[data-free=psi]")).to_contain_text("feasible: −111.7 … 111.7°")
    strip = tab.page.locator("[data-free=psi] > div").first.bounding_box()
    track = tab.row("Arm angle ψ").get_by_role("slider").first.bounding_box()
    assert strip is not None
    assert track is not None
    middle = strip["x"] + strip["width"] * (60 + 180) / 360
    assert abs(middle - (track["x"] + track["width"] / 2)) < 8, "the strip's mark is under the slider's thumb"
    tab.screenshot("posture-light")
    tab.type_number("Arm angle ψ", "150")
    expect(tab.status).to_have_attribute("data-status", "limits")
    expect(tab.status).to_contain_text("joint")
    tab.screenshot("posture-at-the-limit")


def test_five_joints_name_the_roll_error(tab: Tab) -> None:
    home = kin.fk(PIONEER, PIONEER.q_home)
    axes = [tab.pixel(PIONEER, home[:3, 3] + 0.05 * home[:3, k]) for k in range(3)]
    origin = tab.pixel(PIONEER, home[:3, 3])
    axis = int(np.argmax([np.linalg.norm(a - origin) for a in axes]))
    tab.drag_arrow(PIONEER, home, axis, lengths=-0.25)
    expect(tab.status).to_have_attribute("data-status", "compromise")
    expect(tab.status).to_contain_text("error")
    assert np.linalg.norm(np.array(tab.tool()) / 1000 - home[:3, 3]) > 0.002
    tab.screenshot("roll-error")


def test_looks(tab: Tab) -> None:
    """Frames, labels and dark colours can be switched; one picture of each robot, light and dark."""
    tab.screenshot("pioneer5-light")
    for robot in kin.builtin_robots().values():
        if robot.id != "pioneer5":
            tab.choose("Robot", robot.name)
            expect(tab.status).to_contain_text(robot.name)
            tab.screenshot(f"{robot.id}-light")
    tab.page.get_by_role("tab", name="View").click()
    tab.check("Link frames")
    tab.screenshot("frames-light")
    tab.check("Dark page")
    expect(tab.page.locator("html")).to_have_attribute("data-mantine-color-scheme", "dark")
    tab.screenshot("frames-dark")
    tab.page.get_by_role("tab", name="Move").click()
    tab.page.get_by_role("button", name="Random").click()
    expect(tab.status).to_contain_text("Moved by joints")
    tab.screenshot("random-dark")
    tab.page.get_by_role("tab", name="View").click()
    tab.check("Dark page")
    tab.check("Link frames")


def test_nothing_in_the_panel_overlaps(tab: Tab) -> None:
    """At 1280×720 every line of the panel is inside the window and below the one before it."""
    lines = [tab.status, *(tab.row(label) for label in ("Robot", *slider_labels(), *AFTER_JOINTS))]
    boxes = [line.first.bounding_box() for line in lines]
    bottom = 0.0
    for box in boxes:
        assert box is not None
        assert box["y"] >= bottom - 1.0
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 1280
        bottom = box["y"] + box["height"]
    assert bottom <= 720


AFTER_JOINTS = ("Go to", "Match", "Target", "Branch")


def slider_labels() -> list[str]:
    return [f"{k + 1} {joint.name}" for k, joint in enumerate(PIONEER.joints)]


def test_phone(browser: Browser, address: str) -> None:
    phone = Tab(browser, address, 390, 844)
    phone.type_number("1 rotating base", "60")
    phone.wait_for_tool(kin.fk(PIONEER, home_with(PIONEER, 0, 60))[:3, 3], within=0.06)
    phone.screenshot("phone")
    phone.close()
