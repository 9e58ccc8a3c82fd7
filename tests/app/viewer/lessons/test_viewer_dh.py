"""The lesson on DH tables: the walk follows forward kinematics; page and scene show the same step."""

from __future__ import annotations

import itertools
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.lessons.dh import drawing, player, steps, views
from app.viewer.lessons.dh.lesson import DHLesson
from app.viewer.scene.meshes import body
from app.viewer.server import ViewerServer
from kin.dh.tables import convert_dh
from kin.units import DEFAULT_UNITS, Units

ROBOTS = [*kin.files.classic_robots().values()]
READINGS = [reading for robot in ROBOTS for reading in (robot, steps.reread(robot))]
PIONEER, PRINTED, CRAIG = (kin.get_robot(name) for name in ("pioneer5", "redundant7", "redundant7-craig"))
SCARA = kin.get_robot("scara")
RADIANS = Units(degrees=False)


def some_q(robot: kin.Robot) -> np.ndarray:
    return robot.random_q(np.random.default_rng(7))


def words(html: str) -> str:
    return re.sub(r"\s+", " ", "".join(ET.fromstring(f"<div>{html}</div>").itertext()))


# The walk


@pytest.mark.parametrize("robot", READINGS, ids=lambda r: f"{r.id}-{r.convention}")
def test_each_row_ends_at_its_frame(robot: kin.Robot) -> None:
    q = some_q(robot)
    frames = kin.link_frames(robot, q)
    for row, T in enumerate(frames):
        at = steps.place(robot, q, 4 * (row + 1))
        assert np.allclose(at.T_0_now, T, atol=1e-12)
        assert (at.row, at.motion, at.share, at.placed) == (row, 3, 1.0, row + 1)
    assert np.array_equal(steps.place(robot, q, 0.0).T_0_now, robot.T_world_base)


@pytest.mark.parametrize("robot", [PIONEER, CRAIG, SCARA], ids=lambda r: r.id)
def test_the_frame_moves_continuously_between_motions(robot: kin.Robot) -> None:
    q = some_q(robot)
    walk = [steps.place(robot, q, at).T_0_now for at in np.arange(0.0, steps.length(robot), 0.01)]
    largest = np.abs(np.diff(walk, axis=0)).max()
    assert largest < 0.02 * max(1.0, np.abs(q).max())


def test_a_fraction_of_a_motion_is_that_fraction_of_its_value() -> None:
    at = steps.place(PIONEER, PIONEER.q_home, 4.5)
    assert (at.row, at.motion, at.share, at.factor, at.placed) == (1, 0, 0.5, "theta", 1)
    assert np.allclose(at.A, steps.elementary("theta", np.radians(15)))
    assert np.allclose(at.T_0_before @ at.A, at.T_0_now)


@pytest.mark.parametrize("robot", READINGS, ids=lambda r: f"{r.id}-{r.convention}")
def test_symbols_with_numbers_inserted_give_the_matrix(robot: kin.Robot) -> None:
    q = some_q(robot)
    for row in range(len(robot.rows)):
        free = float(q[robot.joint_rows.index(row)]) if row in robot.joint_rows else 0.0
        numbers = {"1": 1.0, "cos": np.cos(free), "sin": np.sin(free), "q": free}
        for motions in range(1, 5):
            found = steps.symbolic(robot, row, motions)
            A = sum(numbers[name] * part for name, part in zip(found.names, found.constants, strict=True))
            assert np.allclose(A, steps.place(robot, q, 4 * row + motions).A, atol=1e-12)


def test_captions_follow_the_order_of_the_convention() -> None:
    def captions(robot: kin.Robot, row: int) -> list[str]:
        return [
            steps.caption(robot, steps.place(robot, robot.q_home, 4 * row + k), DEFAULT_UNITS) for k in range(1, 5)
        ]

    assert captions(PIONEER, 0) == [
        "Row 1 of 6: turn 90.0° about z₀ (θ₁, joint 1).",
        "Row 1 of 6: slide 130.0 mm along z₀ (d₁).",
        "Row 1 of 6: slide 70.0 mm along x₁ (a₁).",
        "Row 1 of 6: turn −90.0° about x₁ (α₁). Frame 1 is placed.",
    ]
    assert captions(CRAIG, 1) == [
        "Row 2 of 8: turn −90.0° about x₁ (α₁).",
        "Row 2 of 8: a₁ = 0, no translation along x₁.",
        "Row 2 of 8: turn 30.0° about z₂ (θ₂, joint 2).",
        "Row 2 of 8: d₂ = 0, no translation along z₂. Frame 2 is placed.",
    ]
    assert captions(SCARA, 2)[1] == "Row 3 of 4: slide 150.0 mm along z₂ (d₃, joint 3)."


# The comparison


def test_the_two_built_in_conventions_convert_into_each_other() -> None:
    q = some_q(PRINTED)
    assert np.allclose(kin.fk(steps.reread(PRINTED), q), kin.fk(CRAIG, q))
    assert np.allclose(kin.fk(steps.reread(CRAIG), q), kin.fk(PRINTED, q))


def test_two_joints_of_the_printed_table_share_an_axis() -> None:
    assert steps.coaxial_joints(PRINTED) == [0]
    assert steps.coaxial_joints(CRAIG) == []
    for robot in (PRINTED, CRAIG):
        standard, craig = steps.verdict(robot, DEFAULT_UNITS)
        assert standard == (
            "Standard convention: row 1 (a₁ = 0, α₁ = 0) makes z₀ and z₁ coincide, so joints 1 and 2 turn about "
            "the same axis and only θ₁ + θ₂ matters: 7 joints, 6 degrees of freedom."
        )
        assert craig == (
            "Craig’s convention: row 2 (a₁ = 0, α₁ = −90.0°) leads from axis 1 to axis 2 and tilts it by "
            "−90.0°, so no two neighbouring axes coincide."
        )


@pytest.mark.parametrize("robot", READINGS, ids=lambda r: f"{r.id}-{r.convention}")
def test_degrees_of_freedom_are_the_rank_of_the_jacobian_where_axes_coincide(robot: kin.Robot) -> None:
    rank = np.linalg.matrix_rank(kin.jacobian(robot, some_q(robot)), tol=1e-9)
    assert rank <= steps.degrees_of_freedom(robot)
    if steps.coaxial_joints(robot):
        assert rank == min(steps.degrees_of_freedom(robot), 6)
    assert steps.verdict(robot, DEFAULT_UNITS)


def test_opposite_joints_on_one_axis_act_by_their_difference() -> None:
    text = """
id = "folded"
name = "folded"
source = "made up"
convention = "standard"
units = { length = "m", angle = "deg" }
rows = [
  { name = "a", d = 1, alpha = 180, limits = [-90, 90] }, { name = "b", a = 1, limits = [-90, 90] },
  { name = "c", a = 1, limits = [-90, 90] },
]
"""
    assert "θ₁ − θ₂ matters" in steps.verdict(kin.load_robot(text), DEFAULT_UNITS)[0]


# The page


@pytest.mark.parametrize("robot", READINGS, ids=lambda r: f"{r.id}-{r.convention}")
@pytest.mark.parametrize("symbols", [False, True])
def test_every_page_is_well_formed(robot: kin.Robot, symbols: bool) -> None:
    q = some_q(robot)
    for at in (0.0, 1.0, 2.5, 4.0, float(steps.length(robot))):
        here = steps.place(robot, q, at)
        text = words(
            views.caption_html(robot, here, DEFAULT_UNITS)
            + views.table_html(robot, q, here, RADIANS)
            + views.matrices_html(robot, here, symbols, DEFAULT_UNITS)
            + views.compare_html(robot, steps.reread(robot), q, here, 0.1, DEFAULT_UNITS)
            + views.nine_steps_html(robot.convention)
        )
        assert "-" not in re.sub(r"[a-z]-[a-z]", "", text), "every minus is a true one"
        assert "nan" not in text


def test_the_nine_steps_name_where_the_conventions_differ() -> None:
    standard, craig = (views.NINE_STEPS[convention] for convention in ("standard", "modified"))
    assert len(standard) == len(craig) == 9
    differing = [str(i) for i, (a, b) in enumerate(zip(standard, craig, strict=True), 1) if a != b]
    assert f"Steps {', '.join(differing[:-1])} and {differing[-1]} differ" in views.CRAIG_NOTE
    assert views.CRAIG_NOTE in words(views.nine_steps_html("modified"))
    assert views.CRAIG_NOTE not in words(views.nine_steps_html("standard"))


@pytest.mark.parametrize("robot", READINGS, ids=lambda r: f"{r.id}-{r.convention}")
def test_a_row_is_read_off_the_frames_as_step_seven_says(robot: kin.Robot) -> None:
    frames = np.concatenate([robot.T_world_base[None], kin.link_frames(robot, robot.q_home)])
    for row, (old, new) in enumerate(itertools.pairwise(frames)):
        theta, d, a, alpha = (steps.value(robot, row, f, robot.q_home) for f in ("theta", "d", "a", "alpha"))
        z, x = (old[:3, 2], new[:3, 0]) if robot.convention == "standard" else (new[:3, 2], old[:3, 0])
        between = new[:3, 3] - old[:3, 3]
        # d along z and a along x, which are perpendicular; a has a sign.
        assert between == pytest.approx(d * z + a * x, abs=1e-9)
        for axis, start, end, angle in ((x, old[:3, 2], new[:3, 2], alpha), (z, old[:3, 0], new[:3, 0], theta)):
            turned = np.arctan2(np.cross(start, end) @ axis, start @ end)
            assert np.remainder(turned - angle + np.pi, 2 * np.pi) - np.pi == pytest.approx(0.0, abs=1e-6)


def test_a_parameter_has_one_meaning_its_offset_is_written() -> None:
    def cells(robot: kin.Robot, row: int, units: Units = DEFAULT_UNITS) -> list[str | None]:
        html = views.table_html(robot, robot.q_home, None, units)
        return [cell.text for cell in [*ET.fromstring(html).iter("tr")][row]]

    assert cells(PIONEER, 3) == ["3", "θ₃ − 90", "0.0", "0.0", "−90.0", "−30.0°"]
    assert cells(PIONEER, 3, RADIANS)[1] == "θ₃ − 1.571"
    assert cells(PIONEER, 6) == ["6", "0.0", "120.0", "0.0", "0.0", None], "a fixed row has constants only"
    formula = words(views.caption_html(PIONEER, steps.place(PIONEER, PIONEER.q_home, 9), DEFAULT_UNITS))
    assert "θ3−90°" in formula.replace(" ", "")
    assert steps.expression(PIONEER, 2, "theta", DEFAULT_UNITS, -1.0) == "−90° − θ₃"
    assert steps.expression(PIONEER, 0, "theta", DEFAULT_UNITS, -1.0) == "−θ₁"


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda r: r.id)
def test_both_tables_of_one_arm_have_the_same_pairs_one_row_apart(robot: kin.Robot) -> None:
    html = views.same_arm_html(robot, DEFAULT_UNITS)
    rows = [[cell.text for cell in row] for row in ET.fromstring(f"<d>{html}</d>").iter("tr")][2:]
    assert len(rows) == len(robot.rows)
    for above, below in itertools.pairwise(rows):
        assert above[3:5] == below[5:7], "a and α of a standard row are in the next row of Craig’s"
    own = slice(3, 5) if robot.convention == "standard" else slice(5, 7)
    for shown, row in zip(rows, robot.rows, strict=True):
        a, alpha = DEFAULT_UNITS.lengths.number(row.a), DEFAULT_UNITS.angles.number(row.alpha)
        assert shown[own] == [a, alpha]


def test_what_no_row_takes_is_said() -> None:
    craig = convert_dh(PIONEER, "modified")
    assert "transform" not in views.same_arm_html(PIONEER, DEFAULT_UNITS), "the last row has no a and α"
    assert "transform" not in views.same_arm_html(craig, DEFAULT_UNITS)
    planar = kin.get_robot("planar2r")
    assert "a₂ = " in views.same_arm_html(planar, DEFAULT_UNITS)
    assert "goes into the tool transform" in views.same_arm_html(planar, DEFAULT_UNITS)


def test_the_table_marks_the_current_step_and_the_joint_variables() -> None:
    at = steps.place(CRAIG, CRAIG.q_home, 6.5)
    html = views.table_html(CRAIG, CRAIG.q_home, at, DEFAULT_UNITS)
    rows = [*ET.fromstring(html).iter("tr")]
    assert [words(ET.tostring(th, encoding="unicode")) for th in rows[0]] == [
        *(" row", "αᵢ₋₁ °", "aᵢ₋₁ mm", "θᵢ °", "dᵢ mm", "now"),
    ]
    assert [row.get("class") == "kb-here" for row in rows[1:]] == [i == 1 for i in range(8)]
    assert [cell.text for cell in rows[2]] == ["2", "−90.0", "0.0", "θ₂", "0.0", "30.0°"]
    assert ["--kb-mark" in cell.get("style", "") for cell in rows[2]] == [False, False, False, True, False, False]
    bold = [[c for c, cell in enumerate(row) if cell.get("class") == "kb-variable"] for row in rows[1:]]
    assert bold == [[3]] * 7 + [[]]


def test_symbols_insert_constants_and_keep_the_joint_variable() -> None:
    def entries(robot: kin.Robot, row: int) -> list[str]:
        html = views.matrices_html(robot, steps.place(robot, robot.q_home, 4 * row + 4), True, DEFAULT_UNITS)
        cells = [words(ET.tostring(c, encoding="unicode")) for c in ET.fromstring(f"<d>{html}</d>").iter("mtd")]
        return cells[:16]

    assert entries(PIONEER, 0) == [
        *("cosθ1", "0", "−sinθ1", "70cosθ1"),
        *("sinθ1", "0", "cosθ1", "70sinθ1"),
        *("0", "−1", "0", "130"),
        *("0", "0", "0", "1"),
    ]
    # θ3 is the joint's value: cos(θ3 − 90°) = sin θ3, sin(θ3 − 90°) = −cos θ3.
    assert entries(PIONEER, 2)[:4] == ["sinθ3", "0", "cosθ3", "0"]
    words_of_row = steps.caption(PIONEER, steps.place(PIONEER, PIONEER.q_home, 9), DEFAULT_UNITS)
    assert words_of_row == "Row 3 of 6: turn −30.0° about z₂ (θ₃ − 90°, joint 3 at 60.0°)."
    assert entries(SCARA, 2)[8:12] == ["0", "0", "1", "d3"]


def test_the_last_frame_is_the_tools() -> None:
    puma = kin.get_robot("puma560")
    last = steps.caption(puma, steps.place(puma, puma.q_home, 28), DEFAULT_UNITS)
    assert last == "Row 7 of 7: α₇ = 0, no rotation about x₇. Frame 7 (tool) is placed."
    assert steps.frames_name([4, 5, 6], 7) == "frames 4, 5, 6"
    assert steps.frames_name([7], 7) == "frame 7 (tool)"


@pytest.mark.parametrize("robot", READINGS, ids=lambda r: f"{r.id}-{r.convention}")
def test_frames_of_one_origin_have_one_label_and_labels_have_room(robot: kin.Robot) -> None:
    groups = steps.coinciding(robot)
    assert [number for group in groups for number in group] == list(range(len(robot.rows) + 1))
    for q in robot.random_q(np.random.default_rng(3), 20):
        frames = np.concatenate([robot.T_world_base[None], kin.link_frames(robot, q)])
        ends = [frames[group][:, :3, 3] for group in groups]
        assert max(float(np.ptp(origins, axis=0).max()) for origins in ends) < 1e-9, "one origin each"
    frames = np.concatenate([robot.T_world_base[None], kin.link_frames(robot, robot.q_home)])
    size = body(robot).size
    places = [
        frames[member, :3, 3] + height * drawing.PLACED * size * frames[member, :3, 2]
        for member, height in drawing.label_places(groups, frames, size)
    ]
    apart = [np.linalg.norm(a - b) for a, b in itertools.combinations(places, 2)]
    assert min(apart) > size


def test_numbers_follow_the_units() -> None:
    at = steps.place(PIONEER, PIONEER.q_home, 4.5)
    assert "30.0" in views.table_html(PIONEER, PIONEER.q_home, at, DEFAULT_UNITS)
    radians = words(views.table_html(PIONEER, PIONEER.q_home, at, RADIANS))
    assert "0.524" in radians
    assert "rad" in radians
    assert "turn 0.524 rad about z₁" in steps.caption(PIONEER, at, RADIANS)


@pytest.mark.parametrize(
    ("length", "d", "d_short"), [("mm", "130.0", "130"), ("cm", "13.00", "13"), ("m", "0.1300", "0.13")]
)
def test_lengths_follow_the_units(length: str, d: str, d_short: str) -> None:
    units, q = Units(length=length), PIONEER.q_home
    at = steps.place(PIONEER, q, 2.0)
    assert f"slide {d} {length} along z₀ (d₁)" in steps.caption(PIONEER, at, units)
    table = words(views.table_html(PIONEER, q, at, units))
    assert f"dᵢ {length}" in table
    assert d in table
    assert f"lengths in {length}" in views.matrices_html(PIONEER, at, False, units)
    assert f">{d}<" in views.matrices_html(PIONEER, at, False, units)
    assert f">{d_short}<" in views.matrices_html(PIONEER, at, True, units)
    apart = views.compare_html(PIONEER, steps.reread(PIONEER), q, at, 0.13, units)
    assert f"{d} {length} apart" in apart


# The drawing


@pytest.mark.parametrize("robot", READINGS, ids=lambda r: f"{r.id}-{r.convention}")
def test_a_skeleton_is_connected_and_bends_at_right_angles(robot: kin.Robot) -> None:
    frames = kin.link_frames(robot, some_q(robot))
    bones = drawing.skeleton(robot, frames)
    assert np.allclose(bones[1:, 0], bones[:-1, 1], atol=1e-6)
    assert np.allclose(bones[1::2, 1], frames[:, :3, 3], atol=1e-6)
    lengths = np.linalg.norm(bones[:, 1] - bones[:, 0], axis=1)
    q = some_q(robot)
    first, second = ("d", "a") if robot.convention == "standard" else ("a", "d")
    for i in range(len(robot.rows)):
        assert lengths[2 * i] == pytest.approx(abs(steps.value(robot, i, first, q)), abs=1e-6)
        assert lengths[2 * i + 1] == pytest.approx(abs(steps.value(robot, i, second, q)), abs=1e-6)


# The lesson in a visitor's page


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[ViewerServer, int]]:
    server = ViewerServer(Store(), Settings(), Clouds())
    with serve_viewer(server) as port:
        yield server, port


@pytest.fixture
def tab(served: tuple[ViewerServer, int]) -> Iterator[FakeBrowser]:
    with FakeBrowser(served[1]) as opened:
        opened.settle()
        opened.set("Lesson", DHLesson.title)
        opened.wait(lambda: "Row" in opened.sliders)
        opened.settle()
        yield opened


def lesson_of(server: ViewerServer) -> DHLesson:
    """The lesson of the newest visitor."""
    session = server.pages[max(server.pages)]
    shown = session.lessons.shown
    assert isinstance(shown, DHLesson)
    return shown


def moving(tab: FakeBrowser) -> np.ndarray:
    """The moving frame on the arm."""
    name = next(n for n in tab.nodes if re.fullmatch(r"/dh-\d+/moving", n))
    return tab.local(name)


def walks(tab: FakeBrowser) -> bool:
    """Whether the moving frame is on show."""
    names = [name for name in tab.nodes if re.fullmatch(r"/dh-\d+/moving", name)]
    return any(tab.visible.get(name, True) for name in names)


def shows(tab: FakeBrowser, T: np.ndarray) -> bool:
    return np.allclose(moving(tab), T, atol=5e-5)


def at(robot: kin.Robot, q: np.ndarray, motions: float) -> np.ndarray:
    return steps.place(robot, q, motions).T_0_now


def test_the_slider_moves_the_frame_and_updates_the_caption(tab: FakeBrowser) -> None:
    tab.set("Row", 1.9)
    tab.wait(lambda: shows(tab, at(PIONEER, PIONEER.q_home, 7.6)))
    tab.wait(lambda: "Row 2 of 6: α₂ = 0" in tab.html)
    tab.set("Row", 1.125)
    tab.wait(lambda: "Row 2 of 6: turn 30.0° about z₁ (θ₂, joint 2)." in tab.html)
    tab.wait(lambda: shows(tab, at(PIONEER, PIONEER.q_home, 4.5)))
    labels = [m["props"]["text"] for m in tab.nodes.values() if "text" in m["props"]]
    assert "frame 1" in labels


def test_a_row_that_is_not_a_number_is_refused(tab: FakeBrowser) -> None:
    tab.set("Row", float("nan"))
    tab.wait(lambda: "a number from 0 to 6" in tab.html)


def test_next_and_back_go_to_the_ends_of_motions(tab: FakeBrowser) -> None:
    # Every one of several quick clicks takes effect.
    for _ in range(5):
        tab.set("Motion", "Next")
    tab.wait(lambda: tab.value("Row") == 1.25)
    tab.set("Row", 0.6)
    tab.settle()
    tab.set("Motion", "Back")
    tab.wait(lambda: tab.value("Row") == 0.5)
    tab.set("Motion", "Back")
    tab.wait(lambda: tab.value("Row") == 0.25)
    tab.wait(lambda: shows(tab, at(PIONEER, PIONEER.q_home, 1)))


@pytest.mark.full
def test_playing_goes_to_the_end_and_stops(tab: FakeBrowser, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(player, "MOTION_TIME", 0.05)
    monkeypatch.setattr(player, "REST", 0.01)
    tab.set("Motion", "Play")
    tab.wait(lambda: "Pause" in tab.gui[tab.element("Motion")]["props"]["options"])
    tab.wait(lambda: tab.value("Row") == 6.0)
    tab.wait(lambda: shows(tab, kin.link_frames(PIONEER, PIONEER.q_home)[-1]))
    tab.wait(lambda: "Frame 6 (tool) is placed" in tab.html)
    tab.settle()
    assert "Play" in tab.gui[tab.element("Motion")]["props"]["options"]
    monkeypatch.setattr(player, "MOTION_TIME", 5.0)
    tab.set("Motion", "Play")
    tab.wait(lambda: 0.0 < tab.value("Row") < 1.0)
    tab.set("Motion", "Pause")
    tab.settle()
    assert tab.value("Row") < 1.0


@pytest.mark.full
def test_moving_the_arm_updates_the_lesson(tab: FakeBrowser) -> None:
    tab.set("Row", 3)
    tab.settle()
    tab.set("1 rotating base", 20.0)
    q = PIONEER.q_home
    q = np.array([np.radians(20.0), *q[1:]])
    tab.wait(lambda: shows(tab, at(PIONEER, q, 12)))
    tab.settle()
    assert ">20.0°<" in tab.html
    tab.set("Radians", True)
    tab.wait(lambda: ">0.349 rad<" in tab.html)


def test_another_arm_restarts_the_walk_in_its_own_convention(tab: FakeBrowser) -> None:
    tab.set("Row", 3)
    tab.settle()
    tab.set("Robot", CRAIG.name)
    tab.wait(lambda: "Craig’s convention" in tab.html)
    tab.settle()
    assert tab.value("Row") == 0.0
    assert tab.gui[tab.element("Row")]["props"]["max"] == 8
    tab.set("Row", 8)
    tab.wait(lambda: shows(tab, kin.link_frames(CRAIG, CRAIG.q_home)[-1]))


def test_symbols_and_comparison_are_optional_and_removed_with_the_lesson(tab: FakeBrowser) -> None:
    tab.set("Robot", PRINTED.name)
    tab.wait(lambda: "Standard convention" in tab.html)
    tab.settle()
    assert "cos" not in tab.html
    tab.set("Symbols", True)
    tab.set("Row", 2)
    tab.wait(lambda: "cos" in tab.html)
    tab.set("Compare conventions", True)
    tab.wait(lambda: "7 joints, 6 degrees of freedom" in tab.html)
    other = next(n for n in tab.nodes if n.endswith("/other/moving"))
    tab.wait(lambda: np.allclose(tab.local(other), at(CRAIG, PRINTED.q_home, 8), atol=5e-5))
    texts = [m["props"]["text"] for n, m in tab.nodes.items() if n.startswith("/dh-") and "text" in m["props"]]
    assert "joints 1 and 2: one axis" in texts
    tab.set("Lesson", "None")
    tab.wait(lambda: "Row" not in tab.sliders)
    tab.settle()
    assert not [n for n in tab.nodes if n.startswith("/dh-")]


def test_a_reopened_lesson_starts_at_the_base(tab: FakeBrowser) -> None:
    tab.set("Row", 3)
    tab.wait(lambda: shows(tab, at(PIONEER, PIONEER.q_home, 12)))
    tab.set("Lesson", "None")
    tab.wait(lambda: "Row" not in tab.sliders)
    tab.set("Lesson", DHLesson.title)
    tab.wait(lambda: "Row" in tab.sliders)
    tab.settle()
    assert shows(tab, np.eye(4)), "and does not take over the pose of a node of the same name"


def test_a_shared_address_restores_the_settings_and_ignores_invalid_ones(
    served: tuple[ViewerServer, int], tab: FakeBrowser
) -> None:
    lesson = lesson_of(served[0])
    settings = {"at": 6.5, "symbols": True, "compare": True, "speed": "Double", "lines": False, "assign": None}
    lesson.restore(settings)
    kept = lesson.state()
    assert kept == settings
    for hostile in (
        {"at": float("nan")},
        {"at": 1e9},
        {"at": True},
        {"at": [1]},
        {"speed": ["x"]},
        {"symbols": 1},
        {"lines": "yes"},
        {"assign": 3},
    ):
        lesson.restore(hostile)
        assert lesson.state() == kept
    tab.wait(lambda: tab.value("Row") == 6.5 / 4)
    assert tab.value("Compare conventions") is True


@pytest.mark.full
def test_assigning_replaces_the_walk_and_follows_the_arm_in_place(tab: FakeBrowser) -> None:
    tab.set("Assign it yourself", True)
    tab.wait(lambda: "Which line is z₀?" in tab.html)
    tab.settle()
    assert not walks(tab)
    for number in range(9):
        tab.say("feature", ["dh", ["show", number], None])
        tab.settle()
    tab.wait(lambda: "Fill in row 1" in tab.html)
    tab.say("feature", ["dh", ["check", 10], {"theta": "1", "d": "2", "a": "3", "alpha": "4"}])
    tab.wait(lambda: "are wrong" in tab.html)
    tab.settle()
    before = {name for name in tab.nodes if name.startswith("/dh-")}
    axis = next(n for n, m in tab.nodes.items() if m["props"].get("text") == "joint 3")
    place = tab.local(axis)
    tab.set("1 rotating base", 20.0)
    tab.wait(lambda: not np.allclose(tab.local(axis), place))
    tab.settle()
    assert {name for name in tab.nodes if name.startswith("/dh-")} == before, "nothing is made anew"
    tab.say("feature", ["dh", ["choose", "axis", 11], 0])
    tab.wait(lambda: "the row is typed" in tab.html)
    tab.set("Robot", CRAIG.name)
    tab.wait(lambda: "Frame 0 of 7" in tab.html)
    tab.set("Assign it yourself", False)
    tab.wait(lambda: walks(tab))
    tab.set("Lesson", "None")
    tab.wait(lambda: "Row" not in tab.sliders)
    tab.settle()
    assert not [n for n in tab.nodes if n.startswith("/dh-")]
