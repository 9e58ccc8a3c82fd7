"""The page in Firefox and in WebKit: the same short tour in each, and what a page says that cannot start."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import web_driver
from page import ARTIFACTS, NO_HINTS, PICTURES, UNCHANGED, arrow, pixel
from web_driver import ENTER, RIGHT, RemotePage

import kin
from app.viewer.session.state import decode

pytestmark = pytest.mark.browser

PIONEER = kin.get_robot("pioneer5")
NAMES = [f"{i + 1} {joint.name}" for i, joint in enumerate(PIONEER.joints)]


class Visit:
    """The viewer in another browser: its controls by their labels, and what it shows."""

    def __init__(self, page: RemotePage, browser: str) -> None:
        self.page, self.browser = page, browser

    def start(self, address: str) -> None:
        """Open the viewer without its hints."""
        self.page.open(address + "viewer/")
        self.page.run(NO_HINTS + "location.reload()")
        self.wait_for_arm()

    def wait_for_arm(self) -> None:
        covered = "document.documentElement.dataset.kbCover"
        self.page.wait(f"document.querySelector('[data-status]') && !{covered} && viserPage.scene()")
        self.page.run("window.kbErrors = []; addEventListener('error', (event) => kbErrors.push(event.message));")

    def row(self, label: str) -> str:
        """The line of a control."""
        labels = "[...document.querySelectorAll('label')].filter((e) => e.checkVisibility())"
        return f"{labels}.find((e) => e.textContent === {label!r})?.closest('.mantine-Flex-root')"

    def field(self, label: str) -> str:
        inputs = f"[...({self.row(label)})?.querySelectorAll('input') ?? []]"
        return f"{inputs}.filter((e) => e.checkVisibility()).at(-1)"

    def button(self, text: str) -> str:
        return (
            f"[...document.querySelectorAll('button')].find((e) => e.textContent.endsWith({text!r})"
            " && e.checkVisibility())"
        )

    def open(self, title: str) -> None:
        self.page.click(f"viserPage.tab({title!r})")
        self.page.wait(f"viserPage.openTitles().includes({title!r})")

    def choose(self, label: str, option: str) -> None:
        self.page.click(self.field(label))
        self.page.click(
            "[...document.querySelectorAll('[data-combobox-option]')]"
            f".find((e) => e.textContent === {option!r} && e.checkVisibility())"
        )

    def q(self) -> np.ndarray:
        """The joint values in the fields, in radians."""
        texts = [self.page.wait(f"({self.field(name)})?.value") for name in NAMES]
        return np.radians([float(text.replace("−", "-")) for text in texts])

    def tool(self) -> np.ndarray:
        """The tool point of the read-out, in metres."""
        cells = "document.querySelectorAll('table[aria-label=\"tool pose\"] tr:first-child td span')"
        texts = self.page.run(f"return [...{cells}].map((e) => e.textContent)")
        return np.array([float(text.replace("−", "-")) for text in texts]) / 1000.0

    def wait_for_tool(self, xyz: np.ndarray, within: float = 6e-5) -> None:
        cells = "[...document.querySelectorAll('table[aria-label=\"tool pose\"] tr:first-child td span')]"
        self.page.wait(
            f"((xyz) => {cells}.every((e, k) => Math.abs(Number(e.textContent.replace('−', '-')) - xyz[k])"
            f" <= {1000 * within}))(arguments[0])",
            [1000 * float(x) for x in xyz],
        )

    def wait_for_link(self) -> None:
        """Wait until the link has the configuration on show: it is written after the arm has come to rest."""
        end = time.monotonic() + web_driver.WAIT
        while True:
            text = self.page.run("return new URLSearchParams(location.hash.slice(1)).get('s') ?? ''")
            q = decode(text, (PIONEER,)).q
            if q is not None and np.abs(kin.fk(PIONEER, q)[:3, 3] - self.tool()).max() < 6e-5:
                return
            assert time.monotonic() < end, f"the link has {q}, the tool is at {self.tool()}"
            time.sleep(0.1)

    def rest(self) -> None:
        """Wait until the numbers of the panel no longer change."""
        self.page.wait(f"({UNCHANGED})()")

    def picture(self, name: str) -> None:
        if PICTURES:
            ARTIFACTS.mkdir(exist_ok=True)
            (ARTIFACTS / f"{self.browser}-{name}.png").write_bytes(self.page.screenshot())


@pytest.fixture(params=["firefox", "webkit"])
def visit(request: pytest.FixtureRequest, address: str, tmp_path: Path) -> Iterator[Visit]:
    with web_driver.started(request.param, tmp_path) as page:
        page.resize(1280, 720)
        visit = Visit(page, request.param)
        visit.start(address)
        yield visit
        assert page.run("return kbErrors") == []


def home_with(i: int, degrees: float) -> np.ndarray:
    q = PIONEER.q_home.copy()
    q[i] = math.radians(degrees)
    return q


def test_the_page_starts_and_moves_the_arm(visit: Visit) -> None:
    """WebKit has the locale C, which it takes for a language."""
    visit.wait_for_tool(kin.fk(PIONEER, PIONEER.q_home)[:3, 3])
    visit.picture("start")
    visit.page.fill(visit.field(NAMES[0]), "12.5")
    visit.wait_for_tool(kin.fk(PIONEER, home_with(0, 12.5))[:3, 3])


@pytest.mark.slow  # WebKit draws in software, half a minute of a processor for the whole tour
def test_a_tour(visit: Visit) -> None:
    page = visit.page
    use_the_controls(visit)
    drag_the_gizmo(visit)
    type_a_target(visit)
    take_a_step_of_a_lesson(visit)
    play_a_program(visit)
    reload_keeps(visit)
    page.resize(390, 844)
    look_at_a_phone(visit)


def use_the_controls(visit: Visit) -> None:
    """A slider by key and by mouse, and its number field."""
    page = visit.page
    thumb = f"({visit.row(NAMES[0])})?.querySelector('[role=slider]')"
    page.run(f"({thumb}).focus()")
    page.press(RIGHT)
    visit.wait_for_tool(kin.fk(PIONEER, home_with(0, 91.0))[:3, 3])
    x, y = page.middle(thumb)
    page.drag([x, y], [x + 10, y], [x + 25, y])
    page.wait(f"({visit.field(NAMES[0])}).value > 100")
    page.fill(visit.field(NAMES[0]), "12.5")
    visit.wait_for_tool(kin.fk(PIONEER, home_with(0, 12.5))[:3, 3])
    page.click(visit.button("Home"))
    visit.wait_for_tool(kin.fk(PIONEER, PIONEER.q_home)[:3, 3])


def drag_the_gizmo(visit: Visit) -> None:
    page = visit.page
    home = kin.fk(PIONEER, PIONEER.q_home)
    area = page.run("const r = viserPage.scene().getBoundingClientRect(); return [r.x, r.y, r.width, r.height]")
    ways = [[pixel(area, PIONEER, point) for point in arrow(PIONEER, home, k, -0.4)] for k in range(3)]
    axis = int(np.argmax([np.linalg.norm(end - start) for start, end in ways]))  # seen best from the side
    start, end = ways[axis]
    page.drag(*[(start + (end - start) * k / 6).tolist() for k in range(7)])
    page.wait("['compromise', 'reached'].includes(document.querySelector('[data-status]').dataset.status)")
    page.wait(f"({visit.button('Undo')}).getAttribute('aria-disabled') !== 'true'")
    visit.rest()
    moved = visit.tool() - home[:3, 3]
    assert moved @ home[:3, axis] < -2e-3, moved
    visit.wait_for_tool(kin.fk(PIONEER, visit.q())[:3, 3], within=6e-4)
    visit.picture("dragged")


def type_a_target(visit: Visit) -> None:
    page = visit.page
    page.click(visit.button("Type a target"))
    page.wait("document.activeElement?.matches('[data-typed] textarea')")
    page.press("100 120 -150", ENTER)
    visit.wait_for_tool(np.array([0.1, 0.12, -0.15]))
    assert np.abs(kin.fk(PIONEER, visit.q())[:3, 3] - [0.1, 0.12, -0.15]).max() < 6e-4


def take_a_step_of_a_lesson(visit: Visit) -> None:
    page = visit.page
    visit.open("Learn")
    visit.choose("Lesson", "DH table step by step")
    page.wait("document.querySelector('[data-guide=goal]')")
    page.click("document.querySelector('[data-step=\"1\"] [data-guide-do=reveal]')")
    page.wait("document.querySelector('[data-guide=shown]')?.textContent")
    page.click("document.querySelector('[data-step=\"1\"] .kb-guide-turn button:last-child')")
    page.wait("document.querySelector('[data-step=\"2\"]')")
    visit.picture("lesson")
    visit.choose("Lesson", "None")


def play_a_program(visit: Visit) -> None:
    page = visit.page
    visit.open("Move")
    page.click(visit.button("Home"))
    visit.wait_for_tool(kin.fk(PIONEER, PIONEER.q_home)[:3, 3])
    for i, angle in enumerate((60.0, 120.0)):
        visit.open("Move")
        page.fill(visit.field(NAMES[0]), str(angle))
        q = visit.q()
        assert math.degrees(q[0]) == pytest.approx(angle)
        visit.wait_for_tool(kin.fk(PIONEER, q)[:3, 3], within=6e-4)
        visit.open("Program")
        page.click("document.querySelector('[data-program-do=record]')")
        page.wait(f"document.querySelectorAll('[data-program-item]').length === {i + 1}")
    clock = "document.querySelector('[data-program=clock]')"
    page.wait(f"Number({clock}?.dataset.duration) > 0")
    page.click("document.querySelector('[data-program-do=play]')")
    page.wait(f"{clock}.dataset.playing === '0' && {clock}.dataset.time === {clock}.dataset.duration")
    visit.picture("program")


def reload_keeps(visit: Visit) -> None:
    """A reload keeps the program and the arm."""
    page = visit.page
    page.click("document.querySelector('[data-program-item] [data-program-do=choose]')")
    page.click("document.querySelector('[data-program-do=go]')")
    before = kin.fk(PIONEER, home_with(0, 60.0))[:3, 3]
    visit.wait_for_tool(before)
    visit.wait_for_link()
    page.reload()
    visit.wait_for_arm()
    page.wait("document.querySelectorAll('[data-program-item]').length === 2")
    visit.wait_for_tool(before)


def look_at_a_phone(visit: Visit) -> None:
    page = visit.page
    page.wait("document.documentElement.hasAttribute('data-kb-narrow')")
    visit.open("Move")
    page.click(visit.button("Home"))
    visit.wait_for_tool(kin.fk(PIONEER, PIONEER.q_home)[:3, 3])
    wide = "document.documentElement.scrollWidth - innerWidth"
    assert page.run(f"return {wide}") <= 0
    visit.rest()
    scene, sheet = (
        page.run(f"const r = ({of}).getBoundingClientRect(); return [r.top, r.bottom, r.height]")
        for of in ("viserPage.scene()", "document.querySelector('[data-kb-panel]')")
    )
    assert scene[2] > 100
    assert sheet[2] > 100
    visit.picture("phone")


def test_a_browser_without_webgl_gets_a_sentence(address: str, tmp_path: Path) -> None:
    with web_driver.started("firefox", tmp_path, {"webgl.disabled": True}) as page:
        page.open(address + "viewer/")
        said = page.wait("document.getElementById('kb-failed')?.textContent")
        assert "WebGL 2 is switched off or missing here" in said
        assert page.run("return document.documentElement.hasAttribute('data-kb-cover')")
