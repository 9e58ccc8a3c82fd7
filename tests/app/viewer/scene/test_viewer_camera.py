"""The visitor's camera: aimed, orbited, stored when it stops, restored on the same screen and on another."""

from __future__ import annotations

import json
import math
import time
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.shared.store import Store
from app.viewer.scene import camera, viewpoints
from app.viewer.scene.arm.arm_scene import FOR_FINGERS, GIZMO
from app.viewer.scene.meshes import body
from app.viewer.session.state import PageState, decode, encode

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, UR5 = STORE.get("pioneer5"), STORE.get("ur5")
DESKTOP, PHONE = 1280 / 720, 390 / 844
ASIDE = np.array([[2.5, -1.5, 1.0], [0.1, 0.0, 0.4], [0.0, 0.0, 1.0]])


def memory(state: PageState | str) -> str:
    return json.dumps({"address": "", "state": state if isinstance(state, str) else encode(state)})


def shown(tab: FakeBrowser) -> np.ndarray:
    """The viewpoint the page was sent to."""
    return np.array([tab.camera[name] for name in ("position", "look_at", "up_direction")], float)


def default(robot: object, aspect: float) -> np.ndarray:
    return np.stack([*camera.view(body(robot), aspect), camera.UP])


def orbit(tab: FakeBrowser, viewpoint: np.ndarray, **size: int) -> None:
    position, look_at, up = viewpoint.tolist()
    tab.look(position=position, look_at=look_at, up_direction=up, **size)


def rest(tab: FakeBrowser, count: int = 1) -> PageState:
    """The stored state of the page after its `count`-th update."""
    tab.wait(lambda: len(tab.kept) >= count)
    tab.settle(quiet=0.8)
    assert len(tab.kept) == count
    return decode(tab.kept[-1], STORE.robots)


@pytest.mark.parametrize("aspect", [0.3, PHONE, 0.99, 1.0, 1.6])
def test_the_view_of_a_narrow_picture_is_undone_in_a_wide_one(aspect: float) -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        viewpoint = np.stack([rng.normal(size=3) * 3, rng.normal(size=3), camera.UP])
        there = camera.narrowed(viewpoint, aspect)
        assert np.abs(camera.widened(there, aspect) - viewpoint).max() < 1e-12
        ways = [v[0] - v[1] for v in (there, viewpoint)]
        assert np.allclose(np.cross(*ways), 0.0, atol=1e-9), "the direction stays"
        assert np.array_equal(there[1:], viewpoint[1:])
        if aspect >= 1.0:
            assert np.allclose(there, viewpoint)


def test_a_narrow_picture_shows_what_a_wide_one_shows() -> None:
    wide = default(PIONEER, DESKTOP)
    there = camera.narrowed(wide, PHONE)
    assert np.abs(there - default(PIONEER, PHONE)).max() < 1e-12
    radius = body(PIONEER).radius
    forward = (there[1] - there[0]) / np.linalg.norm(there[1] - there[0])
    right = np.cross(forward, camera.UP) / np.linalg.norm(np.cross(forward, camera.UP))
    above = np.cross(right, forward)
    for point in (wide[1] + sign * radius * side for sign in (-1, 1) for side in (right, above)):
        x, y, depth = np.array([right, above, forward]) @ (point - there[0])
        assert abs(x) / depth < math.tan(camera.FOV / 2) * PHONE, "beside the picture"
        assert abs(y) / depth < math.tan(camera.FOV / 2), "above or below the picture"
    straight_down = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 0.0], camera.UP])
    assert np.isfinite(camera.narrowed(straight_down, PHONE)).all()


@pytest.mark.full
def test_a_picture_of_another_shape_shows_the_same(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.look()
        tab.look(image_width=390, image_height=360)
        tab.settle()
        assert np.allclose(shown(tab), default(PIONEER, DESKTOP)), "still wider than high"
        tab.look(image_width=390, image_height=780)
        tab.settle()
        assert np.allclose(shown(tab), default(PIONEER, 0.5)), "a sheet was closed"
        tab.look(image_width=390, image_height=780)
        orbit(tab, camera.narrowed(ASIDE, 0.5), image_width=390, image_height=780)
        tab.settle()
        orbit(tab, camera.narrowed(ASIDE, 0.5), image_width=800, image_height=390)
        tab.settle()
        assert np.abs(shown(tab) - ASIDE).max() < 1e-9, "a phone was turned"
        assert np.abs(rest(tab).camera - ASIDE).max() < 1e-3


@pytest.mark.full
def test_a_picture_that_is_narrow_for_a_moment_leaves_the_view(port: int) -> None:
    """A window made as narrow as a phone squeezes the picture beside the panel before the panel moves below it."""
    narrow = default(PIONEER, 64 / 350)
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.look()
        tab.look(image_width=64, image_height=350)
        tab.wait(lambda: np.allclose(shown(tab), narrow))
        # The page has not moved yet when it reports that the panel has.
        orbit(tab, default(PIONEER, DESKTOP), image_width=500, image_height=350)
        tab.wait(lambda: np.allclose(shown(tab), default(PIONEER, DESKTOP)))
        orbit(tab, narrow, image_width=500, image_height=350)
        orbit(tab, default(PIONEER, DESKTOP), image_width=500, image_height=350)
        tab.settle()
        tab.look(image_width=1280, image_height=720)
        tab.settle()
        assert np.allclose(shown(tab), default(PIONEER, DESKTOP))
        assert tab.kept == [], "nobody has chosen a view"


@pytest.mark.full
def test_where_the_camera_stops_is_stored_and_restored(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        assert np.allclose(shown(tab), default(PIONEER, DESKTOP))
        tab.look()
        tab.settle(quiet=0.8)
        assert tab.kept == [], "the view it was sent to is nobody's choice"
        sent = len(tab.log)
        for k in range(30):
            orbit(tab, np.array([ASIDE[0] * (1.0 + 0.02 * k), ASIDE[1], ASIDE[2]]))
            time.sleep(0.03)
        orbit(tab, ASIDE)
        tab.settle(quiet=0.8)
        assert np.abs(decode(tab.kept[-1], STORE.robots).camera - ASIDE).max() < 1e-9
        seen = {m["type"] for m in tab.log[sent:]}
        of_bar = {"SceneNodeUpdateMessage", "SetPositionMessage"}
        assert seen == {"GuiUpdateMessage", *of_bar}
        (bar,) = (name for name in tab.nodes if name.endswith("-scale/length"))
        assert {m["name"] for m in tab.log[sent:] if m["type"] == "SetPositionMessage"} == {bar}
        changed = [(m["name"], m["updates"]) for m in tab.log[sent:] if m["type"] == "SceneNodeUpdateMessage"]
        assert changed == [(bar, {"anchor": "bottom-left"})], (
            "the bar's left end, beside which it is, is on the right"
        )
        text = tab.kept[-1]
    with FakeBrowser(port, memory=memory(text)) as tab:
        tab.settle()
        assert np.abs(shown(tab) - ASIDE).max() < 1e-9
        tab.look()
        tab.set("1 rotating base", 20.0)
        assert np.abs(rest(tab).camera - ASIDE).max() < 1e-9
        tab.set("Camera", "Reset view")
        assert rest(tab, 2).camera is None
        assert np.allclose(shown(tab), default(PIONEER, DESKTOP))
        tab.look()
        orbit(tab, ASIDE)
        assert rest(tab, 3).camera is not None
        tab.choose(UR5.name)
        assert rest(tab, 4).camera is None
        assert np.allclose(shown(tab), default(UR5, DESKTOP))


def test_a_roll_of_the_camera_is_stored_and_reset(port: int) -> None:
    rolled = np.array([*ASIDE[:2], [0.0, 0.6, 0.8]])
    with FakeBrowser(port, memory=memory(PageState("pioneer5", PIONEER.q_home, camera=rolled))) as tab:
        tab.settle()
        assert np.abs(shown(tab) - rolled).max() < 1e-9
        tab.set("Camera", "Reset view")
        tab.settle()
        assert np.allclose(shown(tab), default(PIONEER, DESKTOP))


@pytest.mark.full
def test_a_view_before_the_camera_was_aimed_is_not_stored(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.look(position=(3, 3, 3), look_at=(0, 0, 0))  # a page that has not applied its camera yet
        tab.set("1 rotating base", 20.0)
        assert rest(tab).camera is None
        tab.look()
        orbit(tab, ASIDE)
        assert rest(tab, 2).camera is not None


@pytest.mark.full
def test_a_page_that_is_already_at_its_view_is_trusted_at_once(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.look()
        tab.set("Camera", "Reset view")
        tab.settle()
        orbit(tab, ASIDE)
        assert rest(tab).camera is not None


@pytest.mark.full
def test_a_page_that_never_confirms_its_view_is_trusted_after_a_while(port: int, monkeypatch) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        orbit(tab, ASIDE)
        tab.settle(quiet=0.8)
        assert tab.kept == []
        monkeypatch.setattr(camera, "PATIENCE", 0.0)
        orbit(tab, ASIDE)
        assert rest(tab).camera is not None


@pytest.mark.full
@pytest.mark.filterwarnings("ignore:.*does not match annotation")
@pytest.mark.parametrize(
    "nonsense",
    [
        *({"position": (math.nan, 0, 1)}, {"look_at": (0, 0, math.inf)}, {"position": (1e300, 0, 0)}),
        *({"up_direction": (0, 0)}, {"position": ()}),
    ],
)
def test_an_invalid_camera_is_ignored(port: int, nonsense: dict[str, object]) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.look()
        tab.look(**nonsense)
        tab.set("1 rotating base", 20.0)
        state = rest(tab)
        assert state.camera is None
        assert state.q[0] == pytest.approx(math.radians(20.0))
        assert "Something went wrong" not in tab.html


@pytest.mark.full
def test_a_link_from_a_desktop_shows_the_arm_on_a_phone_and_comes_back(port: int) -> None:
    link = memory(PageState("pioneer5", PIONEER.q_home, camera=ASIDE))
    with FakeBrowser(port, 390, 844, memory=link) as tab:
        tab.settle()
        assert np.abs(shown(tab) - camera.narrowed(ASIDE, PHONE)).max() < 1e-9
        tab.look()
        tab.set("1 rotating base", 20.0)
        assert np.abs(rest(tab).camera - ASIDE).max() < 1e-9, "not touched on the phone"
        nearer = shown(tab)
        nearer[0] += 0.2 * (nearer[1] - nearer[0])
        orbit(tab, nearer)
        again = rest(tab, 2)
        assert np.abs(camera.narrowed(again.camera, PHONE) - nearer).max() < 1e-3
        text = tab.kept[-1]
    with FakeBrowser(port, 390, 844, memory=memory(text)) as tab:
        tab.settle()
        assert np.abs(shown(tab) - nearer).max() < 1e-3


def test_an_address_without_a_camera_has_the_default_view(port: int) -> None:
    with FakeBrowser(port, 390, 844, memory=memory(PageState("ur5", UR5.q_home))) as tab:
        tab.settle()
        assert np.allclose(shown(tab), default(UR5, PHONE))


@pytest.mark.full
@pytest.mark.parametrize("far", [0.5, 0.8])
def test_a_link_to_a_target_out_of_reach_shows_arm_and_target_on_a_phone(port: int, far: float) -> None:
    T = kin.fk(PIONEER, PIONEER.q_home)
    T[:3, 3] = far, -far, 0.2
    needed = np.vstack([frames(PIONEER, PIONEER.q_home), T[:3, 3]])
    assert not viewpoints.contains(default(PIONEER, PHONE), PHONE, needed, 0.0)
    with FakeBrowser(port, 390, 844, memory=memory(PageState("pioneer5", PIONEER.q_home, target=T))) as tab:
        tab.wait(lambda: viewpoints.contains(shown(tab), PHONE, needed, 0.0))
        tab.settle()
        upright = shown(tab)
        tab.look()
        tab.look(image_width=844, image_height=390)
        tab.settle()
        assert viewpoints.contains(shown(tab), 844 / 390, needed, 0.0), "the phone was turned"
        assert np.linalg.norm(shown(tab)[0] - shown(tab)[1]) < np.linalg.norm(upright[0] - upright[1])


def a_camera() -> tuple[SimpleNamespace, camera.VisitorCamera]:
    """The camera of a visitor, and what the browser's is in viser."""
    lens = SimpleNamespace(
        image_width=956,
        image_height=720,
        position=np.ones(3),
        look_at=np.zeros(3),
        up_direction=camera.UP,
        on_update=lambda act: act,
    )
    return lens, camera.VisitorCamera(SimpleNamespace(camera=lens), lambda key, value: None)  # type: ignore[arg-type]


def test_the_camera_makes_room_for_drawings_but_keeps_a_chosen_view() -> None:
    lens, of_visitor = a_camera()
    arm = body(PIONEER)
    of_visitor.aim(arm)
    near = lens.position
    points = np.random.default_rng(1).normal(size=(500, 3))
    room = [camera.round_points(points)]
    assert np.linalg.norm(points - room[0][0], axis=1).max() <= room[0][1]

    def distance() -> float:
        return float(np.linalg.norm(lens.position - lens.look_at) / np.linalg.norm(near - arm.center))

    of_visitor.fit(room)
    assert distance() > 1.5
    of_visitor.fit([])
    assert np.array_equal(lens.position, near), "and comes near again"
    of_visitor.fit([], points)
    there = np.stack([lens.position, lens.look_at, lens.up_direction])
    assert viewpoints.contains(there, 956 / 720, points, 0.0)
    of_visitor.fit([])
    assert np.array_equal(lens.position, near)
    of_visitor.restore(ASIDE)
    of_visitor.fit(room)
    assert np.array_equal(lens.position, ASIDE[0]), "it is the visitor's now"
    of_visitor.aim(arm)
    assert distance() > 1.5, "until asked to"
    of_visitor.aim(body(UR5))
    of_visitor.aim(arm)
    assert np.array_equal(lens.position, near), "another arm, another cloud"


@pytest.mark.parametrize("target", [(0.1, 0.2, 0.0), (1.0, 0.0, 0.0), (0.0, -1.5, 0.4), (400.0, 0.0, 0.0)])
def test_a_typed_target_and_the_arm_are_both_in_the_picture(target: tuple[float, float, float]) -> None:
    lens, of_visitor = a_camera()
    arm = body(PIONEER)
    origins = frames(PIONEER, PIONEER.q_home)
    of_visitor.aim(arm, origins)
    before = lens.position
    of_visitor.keep(origins, np.array(target))
    of_visitor.tick(math.inf)
    there = np.stack([lens.position, lens.look_at, lens.up_direction])
    far = np.linalg.norm(np.array(target)) > 100.0
    assert np.array_equal(lens.position, before) == (np.linalg.norm(target) < 0.3), "it moves only if it must"
    assert viewpoints.contains(there, 956 / 720, origins, 0.0)
    assert viewpoints.contains(there, 956 / 720, np.array([target]), 0.0) != far
    if far:
        assert np.linalg.norm(lens.position - arm.center) < 20.0 * arm.radius, "the arm is not lost from sight"


@pytest.mark.parametrize("chosen", [False, True])
def test_the_camera_comes_back_when_the_target_is_near_again(chosen: bool) -> None:
    lens, of_visitor = a_camera()
    origins = frames(PIONEER, PIONEER.q_home)
    of_visitor.aim(body(PIONEER), origins)
    if chosen:
        near = body(PIONEER)
        of_visitor.restore(np.stack([near.center + 3.0 * near.radius, near.center, camera.UP]))
    view = of_visitor.chosen

    def there() -> np.ndarray:
        of_visitor.tick(math.inf)
        return np.stack([lens.position, lens.look_at, lens.up_direction])

    before = there()
    for far in (1.0, 3.0, 2.0):
        of_visitor.keep(origins, np.array([far, 0.0, 0.0]))
        assert not np.allclose(there(), before)
    of_visitor.keep(origins, body(PIONEER).center)
    assert np.allclose(there(), before)
    assert of_visitor.chosen is view
    of_visitor.keep(origins, np.array([3.0, 0.0, 0.0]))
    of_visitor.look_from("Front", origins)
    front = there()
    of_visitor.keep(origins)
    assert np.allclose(there(), front), "the visitor has looked from elsewhere since"


def test_the_camera_shows_what_is_drawn_beside_the_arm_and_its_target() -> None:
    lens, of_visitor = a_camera()
    origins = frames(PIONEER, PIONEER.q_home)
    of_visitor.aim(body(PIONEER), origins)
    before = lens.position
    drawn = np.array([[0.0, 0.0, 1.5], [0.0, 0.9, 0.0]])
    target = np.array([[-1.2, 0.0, 0.0]])
    of_visitor.keep(origins, target[0], drawn)
    of_visitor.tick(math.inf)
    there = np.stack([lens.position, lens.look_at, lens.up_direction])
    assert viewpoints.contains(there, 956 / 720, np.vstack([origins, target, drawn]), 0.0)
    of_visitor.keep(origins, None, np.zeros((0, 3)))
    of_visitor.tick(math.inf)
    assert np.allclose(lens.position, before), "nothing is drawn any more"


def test_the_default_view_shows_the_arrows_at_the_tool() -> None:
    lens, of_visitor = a_camera()
    rng = np.random.default_rng(5)
    for robot in (PIONEER, UR5):
        arm = body(robot)
        for _ in range(40):
            origins = frames(robot, rng.uniform(robot.lower, robot.upper))
            of_visitor.aim(arm, origins)
            there = np.stack([lens.position, lens.look_at, lens.up_direction])
            assert viewpoints.contains(there, 956 / 720, origins[-1:], GIZMO * arm.radius)


def test_a_sphere_round_two() -> None:
    small, large = (np.array([1.0, 0.0, 0.0]), 0.5), (np.array([0.0, 0.0, 0.0]), 2.0)
    assert camera.round_both(small, large) is large
    assert camera.round_both(large, small) is large
    center, radius = camera.round_both(small, (np.array([-2.0, 0.0, 0.0]), 1.0))
    assert radius == pytest.approx(2.25)
    assert center == pytest.approx([-0.75, 0.0, 0.0])


def frames(robot: kin.Robot, q: np.ndarray) -> np.ndarray:
    return kin.link_frames(robot, q)[:, :3, 3]


@pytest.mark.full
def test_random_never_takes_the_arm_out_of_the_picture(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose("UR5")
        tab.look()
        moved = 0
        for _ in range(20):
            before = shown(tab)
            tab.set("Go to", "Random")
            tab.settle(quiet=0.6)
            q = np.radians([tab.value(label) for label in tab.sliders_in("Joints")])
            assert viewpoints.contains(shown(tab), DESKTOP, frames(UR5, q), 0.0)
            if not np.array_equal(shown(tab), before):
                moved += 1
                assert not viewpoints.contains(before, DESKTOP, frames(UR5, q), 0.3 * body(UR5).radius)
            tab.look()
            if moved == 2:
                break
        assert moved > 0, "twenty random postures, and the default view contained them all"
        tab.set("Go to", "Home")
        tab.settle(quiet=0.6)
        assert decode(tab.kept[-1], STORE.robots).camera is None, "the visitor has not chosen a view"
        near = shown(tab).copy()
        near[0] = near[1] + 0.25 * (near[0] - near[1])
        orbit(tab, near)
        tab.settle(quiet=0.8)
        tab.set("Go to", "Random")
        tab.settle(quiet=0.8)
        tab.look()  # as a page reports where its camera is

        def stored() -> bool:
            chosen = decode(tab.kept[-1], STORE.robots).camera
            return chosen is not None and np.allclose(chosen, shown(tab), atol=1e-3)

        tab.wait(stored, timeout=20.0)  # the state is stored once the camera rests
        out = [v[0] - v[1] for v in (near, shown(tab))]
        assert np.allclose(np.cross(*out), 0.0, atol=1e-2), "the direction stays"


@pytest.mark.full
def test_standard_views_and_fit_arm(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.look()
        for side, (x, y, z) in viewpoints.DIRECTIONS.items():
            tab.set("View from", side)
            tab.settle(quiet=0.6)
            position, look_at, up = shown(tab)
            out = position - look_at
            assert np.allclose(out / np.linalg.norm(out), np.array([x, y, z]) / math.hypot(x, y, z), atol=1e-6)
            assert np.array_equal(up, camera.UP)
            assert viewpoints.contains(shown(tab), DESKTOP, frames(PIONEER, PIONEER.q_home), 0.0)
            tab.look()
        tab.say("look-from", "Front")  # the toolbar in the scene
        tab.settle(quiet=0.6)
        tab.look()
        tab.say("look-from", "__class__")
        tab.wait(lambda: "Front, Side, Top, Corner" in tab.html)
        out = shown(tab)[0] - shown(tab)[1]
        assert np.allclose(out / np.linalg.norm(out), [1.0, 0.0, 0.0], atol=1e-6)
        tab.say("fit-arm")
        tab.settle(quiet=0.6)
        fitted = shown(tab)
        assert viewpoints.contains(fitted, DESKTOP, frames(PIONEER, PIONEER.q_home), 0.0)
        assert np.allclose(np.cross(fitted[0] - fitted[1], out), 0.0, atol=1e-6), "the direction stays"
        assert np.allclose(decode(tab.kept[-1], STORE.robots).camera, fitted, atol=1e-3)
        tab.set("Camera", "Reset view")
        tab.wait(lambda: np.allclose(shown(tab), default(PIONEER, DESKTOP)))


@pytest.mark.full
def test_fit_shows_arm_program_and_obstacles_but_nothing_far_away(port: int) -> None:
    ball = kin.Obstacle("sphere", (0.0, 1.2, 0.2), radius=0.2, name="ball")
    lost = kin.Obstacle("sphere", (0.0, 0.0, 500.0), radius=0.2, name="lost")
    turned = PIONEER.q_home.copy()
    turned[0] -= 1.5
    rows = [["p", PIONEER.q_home.tolist()], ["p", turned.tolist()]]
    features = {"program": {"programs": {PIONEER.id: rows}}}
    state = PageState(PIONEER.id, obstacles=(ball, lost), features=features)
    with FakeBrowser(port, memory=memory(state)) as tab:
        tab.wait(lambda: any("/program-" in name for name in tab.nodes))
        tab.look()
        tab.say("fit-arm")
        tab.settle(quiet=0.6)
        there = shown(tab)
        q = np.linspace(PIONEER.q_home, turned, 20)
        assert viewpoints.contains(there, DESKTOP, kin.fk(PIONEER, q)[:, :3, 3], 0.0)
        assert viewpoints.contains(there, DESKTOP, np.array([ball.xyz]), ball.radius)
        assert np.linalg.norm(there[0] - there[1]) < 20.0 * body(PIONEER).radius
        tab.look()
        closer = np.linalg.norm(there[0] - there[1])
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.look()
        tab.say("fit-arm")
        tab.settle(quiet=0.6)
        assert np.linalg.norm(shown(tab)[0] - shown(tab)[1]) < closer


@pytest.mark.full
def test_fit_shows_the_workspace_cloud(port: int) -> None:
    cloud = {"drawn": True, "n": 20_000, "strategy": "uniform", "axis": "y", "at": 0.0}
    state = PageState(PIONEER.id, camera=ASIDE, features={"workspace": cloud})
    points = kin.fk(PIONEER, PIONEER.random_q(np.random.default_rng(4), 500))[:, :3, 3]
    near = ASIDE[1] + 0.4 * (ASIDE - ASIDE[1])
    near[2] = ASIDE[2]
    with FakeBrowser(port, memory=memory(state)) as tab:
        tab.wait(lambda: any("/workspace-" in name for name in tab.nodes))
        tab.settle(quiet=0.6)
        orbit(tab, near)
        assert not viewpoints.contains(near, DESKTOP, points, 0.0), "seen from here, parts are outside"
        tab.say("fit-arm")
        tab.settle(quiet=0.6)
        assert viewpoints.contains(shown(tab), DESKTOP, points, 0.0)


@pytest.mark.full
def test_the_camera_returns_from_below_the_floor_and_from_far_aside(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.look()
        made = body(PIONEER)
        for position, look_at in (
            (np.add(made.center, [1.0, 0.5, -2.0]), made.center),
            (np.add(made.center, [60.0, 1.0, 1.0]), np.add(made.center, [60.0, 0.0, 0.0])),
            (np.add(made.center, [0.0, 0.0, -1.0]), made.center),
        ):
            orbit(tab, np.array([position, look_at, camera.UP]))
            tab.wait(
                lambda look_at=look_at: (
                    not np.allclose(shown(tab)[1], look_at) or shown(tab)[0][2] > made.mount.floor
                )
            )
            tab.settle(quiet=0.8)
            there = shown(tab)
            assert there[0][2] > made.mount.floor
            assert np.linalg.norm(there[1] - made.center) < 3.01 * made.radius
            assert np.linalg.norm(there[0] - there[1]) == pytest.approx(
                np.linalg.norm(position - look_at), rel=1e-6
            )
            tab.look()


def test_the_gizmo_is_larger_in_the_picture_of_a_phone(port: int) -> None:
    def size(tab: FakeBrowser) -> float:
        controls = {n: m for n, m in tab.nodes.items() if m["type"] == "TransformControlsMessage"}
        (gizmo,) = (m["props"]["scale"] for n, m in controls.items() if "/ring-" not in n)
        return float(gizmo)

    with FakeBrowser(port) as tab:
        tab.settle()
        tab.look()
        usual = size(tab)
        for image, factor in (((390, 350), FOR_FINGERS), ((1280, 720), 1.0), ((496, 338), FOR_FINGERS)):
            for _ in range(50):  # of many reports, some are dropped
                tab.look(image_width=image[0], image_height=image[1])
                tab.settle()
                if size(tab) == pytest.approx(factor * usual):
                    break
            assert size(tab) == pytest.approx(factor * usual)


@pytest.mark.full
def test_a_glide_has_steps_and_zooming_has_limits(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        limits = {m["type"]: m for m in tab.log if "OrbitDistance" in m["type"]}
        radius = body(PIONEER).radius
        nearest = limits["SetCameraMinOrbitDistanceMessage"]["min_orbit_distance"]
        farthest = limits["SetCameraMaxOrbitDistanceMessage"]["max_orbit_distance"]
        distance = np.linalg.norm(shown(tab)[0] - shown(tab)[1])
        assert radius * 0.2 < nearest < distance / 2
        assert 2 * distance < farthest < 30 * radius
        tab.look()
        start, sent = shown(tab)[0], len(tab.log)
        tab.set("View from", "Top")
        tab.settle(quiet=0.6)
        way = [np.array(m["position"]) for m in tab.log[sent:] if m["type"] == "SetCameraPositionMessage"]
        assert len(way) > 3, "it glides"
        # All steps lead towards the goal.
        left = [np.linalg.norm(p - way[-1]) for p in [start, *way]]
        assert all(a >= b - 1e-6 for a, b in pairwise(left))


def test_the_default_view_contains_the_restored_arm(port: int) -> None:
    rng = np.random.default_rng(3)
    usual = default(UR5, DESKTOP)
    q = next(q for q in UR5.random_q(rng, 500) if not viewpoints.contains(usual, DESKTOP, frames(UR5, q), 0.05))
    with FakeBrowser(port, memory=memory(PageState(robot="ur5", q=q))) as tab:
        tab.settle()
        assert viewpoints.contains(shown(tab), DESKTOP, frames(UR5, q), 0.05)
