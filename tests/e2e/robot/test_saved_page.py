"""A saved page, opened from a disk as a person does: in Chromium, Firefox and WebKit."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import web_driver
from page import ARTIFACTS, PICTURES
from playwright.sync_api import Browser, Page, expect

import kin
from app.viewer.takehome import SavedArm, web_page
from app.viewer.takehome.page import arm_data
from kin.motion import JointTarget, Program, Ptp
from kin.units import typeset

pytestmark = pytest.mark.browser

UR5 = kin.get_robot("ur5")
Q = np.array([0.3, -1.2, 1.4, -1.0, -1.5, 0.2])
WORST = """([arm, packed, expected]) => {
  const numbers = (text) => new Float64Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const [q, T, n] = [numbers(packed), numbers(expected), arm.joints.length];
  let worst = 0;
  for (let k = 0; k < T.length / 16; k++) {
    const found = kinboardArm.fk(q.subarray(k * n, (k + 1) * n), arm);
    found.forEach((value, i) => { worst = Math.max(worst, Math.abs(value - T[16 * k + i])); });
  }
  return worst;
}"""
MIDDLE = """() => {
  const { target, camera } = kinboardArm.scene;
  const box = document.querySelector("#scene canvas").getBoundingClientRect();
  const { x, y } = target.position.clone().project(camera);
  return [box.x + (x + 1) / 2 * box.width, box.y + (1 - y) / 2 * box.height];
}"""  # of the target on screen
DESCRIBED = (
    "UR5. Tool at x −490.6, y −272.1, z 282.5 mm. base 17.2°, shoulder −68.8°, elbow 80.2°, wrist 1 −57.3°, "
    "wrist 2 −85.9°, wrist 3 11.5°."
)


def packed(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f8").tobytes()).decode()


def question(robot: kin.Robot, count: int) -> list[object]:
    """What `WORST` compares: the arm as a page has it, configurations, and their poses."""
    q = robot.random_q(np.random.default_rng(11), count)
    return [arm_data(robot), packed(q), packed(kin.fk(robot, q))]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with a target and a program."""
    motion = kin.plan_motion(UR5, Program(segments=(Ptp(JointTarget(tuple((Q + 0.5).tolist()))),)), Q)
    path = tmp_path_factory.mktemp("saved") / "ur5.html"
    path.write_text(web_page(SavedArm(UR5, Q, target=kin.fk(UR5, Q), motion=motion)), encoding="utf-8")
    return path


@pytest.fixture
def saved(browser: Browser, file: Path) -> Iterator[Page]:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: said.append(request.url))
    page.goto(file.as_uri())
    expect(page.locator("#pose dd").last).not_to_be_empty()  # its meshes are unpacked
    yield page
    page.close()
    # Chromium without a graphics card says that it draws in software.
    expected = (file.as_uri(), "data:", "blob:", "[.WebGL-")
    assert [text for text in said if not text.startswith(expected)] == [], "no warning, and nothing loaded"


def shown(page: Page) -> list[float]:
    """The numbers of the pose on screen: millimetres and degrees."""
    texts = page.locator("#pose dd").all_inner_texts()
    return [float(text.replace("−", "-").removesuffix(" mm").removesuffix("°")) for text in texts]


@pytest.mark.parametrize("count", [500, pytest.param(10_000, marks=pytest.mark.slow)])
def test_forward_kinematics_are_those_of_kin(saved: Page, count: int) -> None:
    for robot in kin.builtin_robots().values():
        assert saved.evaluate(WORST, question(robot, count)) < 1e-12, robot.id


def test_a_slider_and_a_typed_value_move_the_arm(saved: Page) -> None:
    expect(saved.locator("#pose dd").last).not_to_be_empty()
    field = saved.get_by_label("elbow, exact value")
    field.fill("-30,5°")
    field.press("Enter")
    q = Q.copy()
    q[2] = np.radians(-30.5)
    T = kin.fk(UR5, q)
    seen = kin.pose_from_xyz_rpy(np.array(shown(saved)[:3]) / 1000.0, np.radians(shown(saved)[3:]))
    assert np.abs(seen - T).max() < 2e-3, "as rounded on screen: tenths of millimetres and degrees"
    slider = saved.get_by_label("base", exact=True)
    slider.focus()
    slider.press("Home")
    assert saved.evaluate("kinboardArm.q()")[0] == UR5.lower[0]
    for key, degrees in (("ArrowRight", 1.0), ("PageUp", 11.0), ("Shift+ArrowDown", 10.9), ("ArrowLeft", 9.9)):
        slider.press(key)
        assert np.isclose(saved.evaluate("kinboardArm.q()")[0], UR5.lower[0] + np.radians(degrees), atol=1e-12)
    field.fill("9000")
    field.press("Enter")
    expect(field).to_have_attribute("aria-invalid", "true")
    expect(saved.get_by_role("alert").filter(has_text="A number from −360.0° to 360.0°.")).to_be_visible()
    field.press("Escape")
    expect(field).to_have_value("−30.5")
    saved.get_by_label("Angles").select_option("radians")
    expect(field).to_have_value("−0.532")


@pytest.mark.full
def test_the_postures_are_stepped_through_and_the_program_plays(saved: Page) -> None:
    T, seen = kin.fk(UR5, Q), []
    expect(saved.locator("#postures button")).to_have_count(8)
    for button in saved.locator("#postures button").all():
        button.click()
        expect(button).to_have_attribute("aria-pressed", "true")
        seen.append(saved.evaluate("kinboardArm.q()"))
        assert np.allclose(kin.fk(UR5, seen[-1]), T, atol=1e-9)
    assert len({tuple(np.round(q, 6)) for q in seen}) == 8
    saved.get_by_role("button", name="Play").click()
    end = saved.locator("#program output").inner_text().partition(" of ")[2].removesuffix(" s")
    expect(saved.locator("#program output")).to_have_text(f"{end} of {end} s")
    expect(saved.get_by_role("button", name="Play")).to_be_visible()
    assert np.allclose(saved.evaluate("kinboardArm.q()"), Q + 0.5)
    saved.get_by_label("Time of the program").press("Home")
    assert np.allclose(saved.evaluate("kinboardArm.q()"), Q)


def settled(page: Page) -> dict:
    """The answer on show, once the page has solved."""
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return page.evaluate("({ ...kinboardArm.found(), T: kinboardArm.target(), q: kinboardArm.q() })")


def test_a_target_is_typed_and_dragged_and_the_page_solves(saved: Page) -> None:
    expect(saved.locator("#status")).to_have_text("Reached: 8 configurations for this pose.")
    field = saved.get_by_label("target x")
    field.fill("-0.45 m")
    field.press("Enter")
    found = settled(saved)
    T = kin.fk(UR5, Q)
    T[0, 3] = -0.45
    assert np.allclose(np.reshape(found["T"], (4, 4)), T, atol=1e-12)
    expected = kin.solve_ik(UR5, T, q_seed=Q)
    names = [each.branch.replace(" · ", ", ") for each in expected.solutions]
    assert [row["branch"] for row in found["rows"]] == names
    assert np.allclose(found["q"], expected.solutions[0].q, atol=1e-9)
    field.focus()
    field.press("ArrowUp")
    assert settled(saved)["T"][3] == pytest.approx(-0.449)
    place = saved.evaluate(MIDDLE)
    saved.mouse.move(*place)
    saved.mouse.down()
    saved.mouse.move(place[0] + 30, place[1] - 40, steps=4)
    saved.mouse.up()
    found = settled(saved)
    dragged = np.reshape(found["T"], (4, 4))
    assert np.linalg.norm(dragged[:3, 3] - T[:3, 3]) > 0.02
    assert np.allclose(dragged[:3, :3], T[:3, :3], atol=1e-9), "arrows move, they do not turn"
    assert np.allclose(kin.fk(UR5, found["q"]), dragged, atol=1e-9)
    field.fill("3 m")
    field.press("Enter")
    expect(saved.locator("#status")).to_contain_text("Out of reach by ")
    far = np.reshape(settled(saved)["T"], (4, 4))
    expected = kin.solve_ik(UR5, far, q_seed=found["q"])
    said = expected.explain()._replace(note="").text  # the page names no singularity
    expect(saved.locator("#status")).to_have_text(typeset(said))
    closest = expected.closest
    assert closest is not None
    assert np.allclose(kin.fk(UR5, settled(saved)["q"]), kin.fk(UR5, closest.q), atol=1e-5)
    assert saved.locator("#postures button").count() == 0
    saved.get_by_role("button", name="As saved").click()
    expect(saved.locator("#postures button")).to_have_count(8)


@pytest.mark.full
def test_a_saved_target_with_obstacles_keeps_its_answer(browser: Browser, tmp_path: Path) -> None:
    iiwa, ball = kin.get_robot("iiwa14"), kin.Obstacle("sphere", [0.0, 0.0, 3.0], radius=0.1)
    q = iiwa.clip(iiwa.q_home + 0.4)
    path = kin.save_page(iiwa, tmp_path / "iiwa.html", q, target=kin.fk(iiwa, q), obstacles=[ball])
    page = browser.new_page()
    page.goto(path.as_uri())
    bar, postures = page.locator("#free .quiet"), page.locator("#postures button")
    expect(bar).to_contain_text("feasible: ")
    count = postures.count()
    assert count > 0
    assert page.evaluate("kinboardArm.found()") is None
    page.get_by_role("button", name="Home").click()
    page.get_by_role("button", name="As saved").click()
    settled(page)
    assert page.evaluate("kinboardArm.found()") is None
    assert np.allclose(page.evaluate("kinboardArm.q()"), q)
    expect(postures).to_have_count(count)
    page.get_by_label("Angles").select_option("radians")
    expect(bar).not_to_contain_text("°")
    page.get_by_label("arm angle ψ", exact=True).press("ArrowRight")
    assert page.evaluate("kinboardArm.found()") is not None, "another value is solved for here"
    page.close()


def test_the_arm_is_drawn_and_can_be_turned_with_the_keyboard(saved: Page) -> None:
    canvas = saved.locator("#scene canvas")
    expect(canvas).to_have_attribute("aria-label", DESCRIBED)

    def picture() -> bytes:
        saved.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        return canvas.screenshot()

    canvas.focus()
    before = picture()
    canvas.press("ArrowLeft")
    assert picture() != before
    canvas.press("f")
    assert picture() == before
    saved.get_by_role("button", name="Frames").click()
    expect(saved.get_by_role("button", name="Frames")).to_have_attribute("aria-pressed", "true")
    canvas.focus()
    assert picture() != before
    if PICTURES:
        ARTIFACTS.mkdir(exist_ok=True)
        saved.screenshot(path=ARTIFACTS / "saved-page.png")


@pytest.mark.full
@pytest.mark.parametrize("width", [320, *(pytest.param(width, marks=pytest.mark.slow) for width in (390, 768))])
def test_a_phone_shows_everything_without_scrolling_sideways(saved: Page, width: int) -> None:
    saved.set_viewport_size({"width": width, "height": 844})
    assert saved.evaluate("document.documentElement.scrollWidth") <= width
    for row in saved.locator("#joints .joint, #aim .aim, #postures li").all():
        box = row.bounding_box()
        assert box is not None
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width


@pytest.mark.full
@pytest.mark.parametrize("name", ["firefox", "webkit"])
def test_other_browsers_compute_and_draw_the_same(name: str, file: Path, tmp_path: Path) -> None:
    """The driver runs its scripts with ``eval``, which the page itself forbids."""
    copy, policy = tmp_path / "saved.html", "script-src 'unsafe-inline'"
    copy.write_text(file.read_text("utf-8").replace(policy, f"{policy} 'unsafe-eval'"), encoding="utf-8")
    with web_driver.started(name, tmp_path) as page:
        page.resize(1280, 720)
        page.open(copy.as_uri())
        page.wait("!!window.kinboardArm")
        for robot in (UR5, kin.get_robot("scara"), kin.get_robot("panda")):
            assert page.run(f"return ({WORST})(arguments[0])", question(robot, 10_000)) < 1e-12
        assert page.run("return document.querySelector('#no-scene').hidden")
        page.wait("document.querySelectorAll('#postures button').length === 8")
        page.click("document.querySelector('#postures li:nth-child(3) button')")
        page.wait("document.querySelector('#postures li:nth-child(3) button').ariaPressed === 'true'")
        assert np.allclose(kin.fk(UR5, page.run("return kinboardArm.q()")), kin.fk(UR5, Q), atol=1e-9)
