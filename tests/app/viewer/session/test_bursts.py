"""Whatever a visitor does in whatever order, and however late it is heard: at rest, the page shows what is.

Bursts of acts at random are sent without a look at what comes back, as from a busy page or over a slow line. Then
all that the page shows of the arm must be the arm's: bodies, gizmo, read-out, sliders, locks and the link.
"""

from __future__ import annotations

import html
import itertools
import math
import random
import re
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.panel.joints import label, lock_buttons
from app.viewer.server import ViewerServer
from app.viewer.session import persistence
from app.viewer.session.page import VisitorPage
from app.viewer.session.state import decode

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER = STORE.get("pioneer5")
ROBOTS = (PIONEER, STORE.get("scara"), STORE.get("puma560"))
ELBOW = label(PIONEER, 1)
SERIAL = itertools.count(1)


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[ViewerServer, int]]:
    monkeypatch.setattr(persistence, "SAVE_AFTER", 0.1)
    viewer = ViewerServer(STORE, Settings(), Clouds())
    with serve_viewer(viewer) as port:
        yield viewer, port


def point(robot: kin.Robot, chance: random.Random) -> np.ndarray:
    return kin.fk(robot, robot.random_q(np.random.default_rng(chance.randrange(1000))))


def slider(tab: FakeBrowser, page: VisitorPage, chance: random.Random) -> None:
    for _ in range(chance.randint(1, 3)):
        name = chance.choice(tab.sliders_in("Joints"))
        bounds = tab.gui[tab.element(name)]["props"]
        tab.set(name, round(chance.uniform(bounds["min"], bounds["max"]), 1))


def drag(tab: FakeBrowser, page: VisitorPage, chance: random.Random) -> None:
    tab.grab()
    for _ in range(chance.randint(1, 3)):
        tab.drag(point(page.arm.robot, chance))
    tab.release()


def typed(tab: FakeBrowser, page: VisitorPage, chance: random.Random) -> None:
    x, y, z = (1000 * point(page.arm.robot, chance)[:3, 3]).tolist()
    tab.say("target", ["position", f"{x:.1f} {y:.1f} {z:.1f}"])


def program(tab: FakeBrowser, page: VisitorPage, chance: random.Random) -> None:
    for name in chance.choice((["record"], ["record", "play"], ["play", "stop"], ["stop"])):
        tab.say("feature", ["program", [name, next(SERIAL)], None])


ACTS = {
    "slider": slider,
    "drag": drag,
    "typed": typed,
    "program": program,
    "home": lambda tab, *_: tab.set("Go to", "Home"),
    "random": lambda tab, *_: tab.set("Go to", "Random"),
    "lock": lambda tab, _, chance: tab.set(
        "Locked", chance.choice(tab.gui[tab.element("Locked")]["props"]["options"])
    ),
    "undo": lambda tab, *_: tab.say("undo"),
    "redo": lambda tab, *_: tab.say("redo"),
    "lesson": lambda tab, _, chance: tab.set("Lesson", chance.choice(("None", "Screws"))),
    "step": lambda tab, _, chance: tab.say("feature", ["guide", ["go", next(SERIAL)], chance.randint(0, 3)]),
    "robot": lambda tab, _, chance: tab.set("Robot", chance.choice(ROBOTS).name),
}
OFTEN = ("slider", "home", "undo", "drag", "slider", "home")


def rest(tab: FakeBrowser, page: VisitorPage) -> None:
    """Wait until nothing moves or plays; what follows once the visitor rests may still come."""
    tab.settle(quiet=0.05)
    while page.arm.moving or page.arm.playing or page.numbers.waiting is not None:
        tab.read(0.05)
    tab.settle(quiet=0.05)


def shows_what_is(tab: FakeBrowser, page: VisitorPage, after: str) -> None:
    rest(tab, page)
    end = time.monotonic() + 10.0
    while differences(tab, page) and time.monotonic() < end:
        tab.read(0.05)
    assert differences(tab, page) == [], after


def differences(tab: FakeBrowser, page: VisitorPage) -> list[str]:
    """What the page shows and is not so."""
    arm, robot = page.arm, page.arm.robot
    T = kin.fk(robot, arm.q)
    cells = re.search(r'aria-label="tool pose">.*?<tr.*?</tr>', tab.html, re.DOTALL)
    assert cells is not None
    numbers = re.findall(r'class="kb-number"[^>]*>([^<]*)<', cells[0])
    tool = [float(html.unescape(text).replace("−", "-")) for text in numbers]
    units = [1.0 if joint.kind == "revolute" else 0.001 for joint in robot.joints]
    shown = [tab.value(label(robot, i)) for i in range(robot.n)]
    angles = [math.radians(v) if unit == 1.0 else unit * v for v, unit in zip(shown, units, strict=True)]
    link = decode(tab.kept[-1], STORE.robots).q if tab.kept else arm.q
    aim = T if arm.target is None else arm.target
    checks = {
        "goal": np.allclose(arm.q, arm.goal),
        "robot": tab.value("Robot") == robot.name,
        "bodies": np.allclose(tab.tool_pose(), T, atol=1e-6),
        "gizmo": np.allclose(tab.gizmo_pose(), aim, atol=1e-6),
        "read-out": np.allclose(tool, 1000 * T[:3, 3], atol=0.06),
        "sliders": np.allclose(angles, arm.goal, atol=2e-4),
        "locks": tuple(tab.gui[tab.element("Locked")]["props"]["options"]) == lock_buttons(arm.locks),
        "link": link is not None and link.shape == arm.q.shape and np.allclose(link, arm.q, atol=1e-6),
    }
    return [name for name, holds in checks.items() if not holds]


def follow(server: tuple[ViewerServer, int], seed: int, bursts: int, delay: float = 0.0) -> None:
    viewer, port = server
    chance = random.Random(seed)
    with FakeBrowser(port, delays=(delay, delay)) as tab:
        tab.settle()
        (page,) = viewer.pages.values()
        for k in range(bursts):
            names = chance.sample(list(ACTS), 2) + chance.choices(OFTEN, k=chance.randint(2, 5))
            chance.shuffle(names)
            for name in names:
                ACTS[name](tab, page, chance)
                while chance.random() < 0.3:
                    tab.read(0.01)
            shows_what_is(tab, page, f"seed {seed}, burst {k}: {', '.join(names)}")


@pytest.mark.full
def test_after_bursts_of_acts_the_page_shows_what_is(server: tuple[ViewerServer, int]) -> None:
    follow(server, 4, 3)


@pytest.mark.full
def test_so_it_does_over_a_slow_line(server: tuple[ViewerServer, int]) -> None:
    follow(server, 5, 3, 0.3)


@pytest.mark.slow
def test_so_it_does_over_a_line_of_three_seconds(server: tuple[ViewerServer, int]) -> None:
    follow(server, 6, 4, 3.0)


@pytest.mark.parametrize(
    "delays", [(0.0, 0.0), (0.1, 0.0), (0.0, 0.1)], ids=["at once", "viser late", "channel late"]
)
def test_undo_passes_no_slider_and_none_passes_it(
    server: tuple[ViewerServer, int], delays: tuple[float, float]
) -> None:
    viewer, port = server
    with FakeBrowser(port, delays=delays) as tab:
        tab.settle()
        (page,) = viewer.pages.values()
        base = label(PIONEER, 0)
        tab.set(base, 20.0)
        tab.say("released")
        tab.set(base, 40.0)
        tab.say("undo")
        tab.set(base, 60.0)
        tab.settle()
        for degrees in (60.0, 20.0, math.degrees(PIONEER.q_home[0])):
            assert math.degrees(page.arm.goal[0]) == pytest.approx(degrees, abs=1e-3)
            shows_what_is(tab, page, f"{degrees}")
            tab.say("undo")
            tab.settle()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_so_it_does_after_many(server: tuple[ViewerServer, int], seed: int) -> None:
    follow(server, seed, 40)


def unheard(page: VisitorPage, joint: float) -> None:
    """Wait until the arm has joint 2 at an angle (degrees) and has said so, which this page has not read yet."""
    while (
        page.arm.moving or page.numbers.waiting is not None or not math.isclose(page.arm.q[1], math.radians(joint))
    ):
        time.sleep(0.002)


def slider_after_home(tab: FakeBrowser, page: VisitorPage) -> None:
    tab.set(ELBOW, 75.0)
    rest(tab, page)
    tab.set("Go to", "Home")
    unheard(page, math.degrees(PIONEER.q_home[1]))
    tab.set(ELBOW, 50.0)


def target_after_a_slider(tab: FakeBrowser, page: VisitorPage) -> None:
    tab.set(ELBOW, 75.0)
    unheard(page, 75.0)
    tab.grab()
    tab.drag(position=(5.0, 0.0, 0.0), wxyz=(1.0, 0.0, 0.0, 0.0))
    tab.release()


@pytest.mark.full
@pytest.mark.parametrize(("acts", "joint"), [(slider_after_home, 50), (target_after_a_slider, None)])
def test_what_crosses_an_earlier_answer_on_the_way_is_shown(
    server: tuple[ViewerServer, int], acts: Callable[[FakeBrowser, VisitorPage], None], joint: float | None
) -> None:
    viewer, port = server
    with FakeBrowser(port) as tab:
        tab.settle()
        (page,) = viewer.pages.values()
        acts(tab, page)
        shows_what_is(tab, page, "")
        if joint is None:
            assert page.arm.open_target is not None
        else:
            assert page.arm.q[1] == pytest.approx(math.radians(joint))


@pytest.mark.full
def test_an_arm_angle_moved_right_after_home_is_shown(server: tuple[ViewerServer, int]) -> None:
    viewer, port = server
    arm, psi = STORE.get("iiwa14"), "Arm angle ψ"
    with FakeBrowser(port) as tab:
        tab.settle()
        (page,) = viewer.pages.values()
        for name, value in (("Robot", arm.name), ("Go to", "Random"), (psi, 40.0)):
            tab.set(name, value)
            rest(tab, page)
        tab.set("Go to", "Home")
        unheard(page, math.degrees(arm.q_home[1]))
        tab.set(psi, 20.0)
        tab.wait(lambda: page.arm.moving or not np.allclose(page.arm.goal, arm.q_home))
        shows_what_is(tab, page, "")
        tab.wait(lambda: tab.value(psi) == 20.0)
        (free,) = kin.solve_ik(
            arm, kin.fk(arm, page.arm.q), q_seed=page.arm.q, branch="seed", max_solutions=1
        ).redundancy
        assert math.degrees(free.value) == pytest.approx(20.0, abs=0.01)
