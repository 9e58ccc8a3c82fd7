"""Worked examples: true in every frame, on an arm of their own, and nothing of the visitor's is touched.

Numbers in the words are compared with the arm at the end of the step, computed by NumPy alone from its table.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import numpy_arm
import pytest
from fake_browser import FakeBrowser
from lesson_arms import arms_of
from live_server import serve_viewer

from app.exercises.fields import ExerciseFileError
from app.exercises.lesson_text import parse_lesson, texts_of
from app.exercises.worked import WorkedText, configuration
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.example import REST, Example, ExampleStep, Player, example_of
from app.viewer.lessons.guide.example_drawing import walked
from app.viewer.panel.joints import label
from app.viewer.server import ViewerServer
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
UNITS = Units()
KEYS = [lesson.key for lesson in LESSONS]
N = r"([−-]?\d+(?:\.\d+)?)"
P = rf"\({N} mm, {N} mm, {N} mm\)"
V = rf"\({N}, {N}, {N}\)"


def text_in(key: str) -> WorkedText:
    return texts_of(key).example


def example_in(key: str) -> Example:
    return example_of(text_in(key), UNITS)


def marks(step: ExampleStep) -> dict[str, np.ndarray]:
    return {mark.name: np.array([each.value({}) for each in mark.at]) for mark in step.drawn.marks}


# Words


class Here:
    """The arm at the end of a step."""

    def __init__(self, key: str, number: int) -> None:
        self.example = example_in(key)
        self.robot, self.step = self.example.robot, self.example.steps[number]
        self.q, self.first = self.step.way[-1], self.example.steps[0].way[-1]

    @property
    def T(self) -> np.ndarray:
        return numpy_arm.pose(self.robot, self.q)

    @property
    def p(self) -> np.ndarray:
        return 1e3 * self.T[:3, 3]

    @property
    def J(self) -> np.ndarray:
        return numpy_arm.jacobian(self.robot, self.q)

    @property
    def elbow(self) -> np.ndarray:
        return 1e3 * numpy_arm.frames(self.robot, self.q)[0][:3, 3]

    @property
    def shoulder(self) -> np.ndarray:
        """Where the links of the arm with four postures begin: on axis 2, beside axis 1."""
        T = numpy_arm.frames(self.robot, self.q)[0]
        return 1e3 * (T[:3, 3] + self.robot.rows[1].d * T[:3, 2])

    def deg(self, *joints: int) -> list[float]:
        return [math.degrees(self.q[joint - 1]) for joint in joints]

    @property
    def heading(self) -> float:
        return math.degrees(math.atan2(self.T[1, 0], self.T[0, 0]))

    def error(self) -> np.ndarray:
        return marks(self.step)["T"] - self.T[:3, 3]

    def newton(self) -> list[float]:
        return np.degrees(np.linalg.solve(self.J[:2], self.error()[:2])).tolist()

    def triangle(self) -> tuple[float, float]:
        """The direction of T, and the angle at the base between T and the elbow."""
        T, e = marks(self.step)["T"][:2], self.elbow[:2]
        inside = math.acos(float(T @ e) / float(np.linalg.norm(T) * np.linalg.norm(e)))
        return math.degrees(math.atan2(T[1], T[0])), math.degrees(inside)


Sentence = tuple[str, Callable[[Here, Sequence[str]], Sequence[float]]]
SENTENCES: dict[str, tuple[Sentence, ...]] = {
    "rotations": (
        (rf"It has turned by {N}°. The first column .*: {V}, that is y", lambda h, m: [*h.deg(1), *h.T[:3, 0]]),
        (rf"After {N}°, the third column, .* is {V}", lambda h, m: [*h.deg(2), *h.T[:3, 2]]),
        (
            rf"After {N}°, it is still {V}, and the first one is {V}",
            lambda h, m: [*h.deg(3), *h.T[:3, 2], *h.T[:3, 0]],
        ),
        (rf"Rz\({N}°\) Ry\({N}°\) Rz\({N}°\)", lambda h, m: h.deg(1, 2, 3)),
        (
            rf"trace is {N}, the cosine \(trace − 1\)/2 = {N}, and the angle {N}°",
            lambda h, m: [
                trace := float(np.trace(h.T[:3, :3])),
                (trace - 1) / 2,
                math.degrees(math.acos((trace - 1) / 2)),
            ],
        ),
        (rf"about z by their sum, {N}°", lambda h, m: [h.heading]),
    ),
    "dh": (
        (rf"θ₁ = {N}°", lambda h, m: h.deg(1)),
        (rf"θ₂ = {N}°", lambda h, m: h.deg(2)),
        (rf"d₁ = {N} mm", lambda h, m: [h.elbow[2]]),
        (rf"a₁ = {N} mm", lambda h, m: [math.hypot(*h.elbow[:2])]),
        (rf"a₂ = {N} mm", lambda h, m: [float(np.linalg.norm(h.p - h.elbow))]),
        (
            rf"α₁ = {N}°",
            lambda h, m: [math.degrees(math.acos(numpy_arm.frames(h.robot, h.q)[0][2, 2]))],
        ),
        (rf"Frame 2 is at the tool: {P}|frame 2 is at {P}", lambda h, m: [*h.p, *h.p]),
    ),
    "screws": (
        (rf"(?:at|the tool is at|The tool is at) {P}", lambda h, m: h.p),
        (rf"ω = {V}, and passes through p, {N} mm", lambda h, m: [0, 0, 1, h.elbow[0]]),
        (rf"v = p × ω = {V}", lambda h, m: np.cross(h.elbow / 1e3, [0, 0, 1])),
        (rf"Axis 3 slides: ω = 0 and v = {V}", lambda h, m: h.J[:3, 2]),
        (rf"Turned by {N}°", lambda h, m: h.deg(2 if abs(h.q[0]) < 1e-9 else 1)),
    ),
    "equations": (
        (rf"Link 1 is turned by θ₁ = {N}°", lambda h, m: h.deg(1)),
        (rf"Link 2 is turned by θ₂ = {N}°.* it is turned by {N}°", lambda h, m: [*h.deg(2), h.heading]),
        (rf"With θ₂ = {N}°, link 2 is turned by {N}°", lambda h, m: [*h.deg(2), h.heading]),
        (rf"x = a₁ cos θ₁ = {N} mm and y = a₁ sin θ₁ = {N} mm", lambda h, m: h.elbow[:2]),
        (rf"= {N} mm along x, and .* = {N} mm along y", lambda h, m: (h.p - h.elbow)[:2]),
        (
            rf"the tool is at x = {N} mm and y = {N} mm|The tool is at x = {N} mm and y = {N} mm",
            lambda h, m: [*h.p[:2], *h.p[:2]],
        ),
        (rf"x = a₁ \+ a₂ = {N} mm, and y = {N} mm", lambda h, m: h.p[:2]),
        (rf"x = {N} mm, and y = a₁ \+ a₂ = {N} mm", lambda h, m: h.p[:2]),
    ),
    "inverse": (
        (rf"T, which is {N} mm from the base", lambda h, m: [1e3 * float(np.linalg.norm(marks(h.step)["T"]))]),
        (rf"cos θ₂ = {N}, so θ₂ = {N}°", lambda h, m: [math.cos(h.q[1]), *h.deg(2)]),
        (
            rf"direction of T is {N}°, and .* {N}°: θ₁ is the difference, {N}°",
            lambda h, m: [*h.triangle(), *h.deg(1)],
        ),
        (
            rf"θ₂ = {N}°, and θ₁ is the sum of the two angles: {N}° and {N}° make {N}°",
            lambda h, m: [*h.deg(2), *h.triangle(), *h.deg(1)],
        ),
        (rf"x = {N} mm and y = {N} mm: that is T", lambda h, m: h.p[:2]),
    ),
    "postures": (
        (rf"P is at {P}", lambda h, m: h.p),
        (rf"θ₃ = {N}°", lambda h, m: h.deg(3)),
        (rf"θ₁ = {N}°", lambda h, m: h.deg(1)),
        (rf"2 × 2 = {N} postures", lambda h, m: [1 + len(h.step.drawn.ghosts)]),
        (rf"The tool is {N} mm from the shoulder", lambda h, m: [float(np.linalg.norm(h.p - h.shoulder))]),
    ),
    "numeric": (
        (rf"θ₁ = {N}° and θ₂ = {N}°", lambda h, m: h.deg(1, 2)),
        (
            rf"error e, {N} mm along x and {N} mm along y: {N} mm in all",
            lambda h, m: [*(1e3 * h.error()[:2]), 1e3 * float(np.linalg.norm(h.error()))],
        ),
        (rf"{N} mm are left", lambda h, m: [1e3 * float(np.linalg.norm(h.error()))]),
        (rf"joint 1 is to turn by {N}°, joint 2 by {N}°", lambda h, m: h.newton()),
        (rf"next step is {N}° and {N}°", lambda h, m: h.newton()),
    ),
    "redundancy": (
        (rf"at x = {N} mm, y = {N} mm", lambda h, m: h.p[:2]),
        (rf"(?:points along|its direction,) {N}°", lambda h, m: [h.heading]),
        (
            rf"Joint 2 must turn at {N} times the speed of joint 1, and joint 3 at {N} times",
            lambda h, m: (lambda v: [v[1] / v[0], v[2] / v[0]])(np.linalg.svd(h.J[:2])[2][2]),
        ),
    ),
    "velocity": (
        (rf"Joint 1 is at {N}°, joint 2 at {N}°", lambda h, m: h.deg(1, 2)),
        (rf"the tool point is {N} mm from axis 1", lambda h, m: [float(np.linalg.norm(h.p))]),
        (rf"perpendicular to r, and {N} m/s long", lambda h, m: [float(np.linalg.norm(h.J[:3, 0]))]),
        (rf"perpendicular to the forearm, and {N} m/s long", lambda h, m: [float(np.linalg.norm(h.J[:3, 1]))]),
        (rf"its radius is the forearm, {N} mm", lambda h, m: [float(np.linalg.norm(h.p - h.elbow))]),
        (rf"determinant is {N}(?: m²)?", lambda h, m: [abs(float(np.linalg.det(h.J[:2])))]),
        (rf"the sine of {N}°", lambda h, m: h.deg(2)),
    ),
    "trajectories": (
        (
            rf"B is {N} mm away",
            lambda h, m: [1e3 * float(np.linalg.norm(marks(h.step)["B"] - marks(h.step)["A"]))],
        ),
        (rf"{N}° and {N}°", lambda h, m: h.deg(1, 2)),
    ),
}
# The numbers that belong to names and formulas.
ALWAYS = (
    r"[Jj]oints? \d",
    r"[Ll]ink \d",
    r"[Aa]xis \d",
    r"[Rr]ow \d",
    r"[Ff]rame \d",
    r"[Cc]olumn \d",
    r"1 rad/s",
    r"3 s² − 2 s³",
    r"[ωv] = 0\b",
    r"2 × 2",
    r"sine is 0",
    r"cosine 1",
    r"1\.5 times",
)


@pytest.mark.parametrize("key", KEYS)
def test_every_number_is_true_where_it_is_said(key: str) -> None:
    wrong, used = [], set()
    for number in range(len(example_in(key).steps)):
        here = Here(key, number)
        left = f"{here.step.text} {here.step.then}"
        for pattern, true in SENTENCES[key]:
            for match in re.finditer(pattern, left):
                used.add(pattern)
                for given, expected in zip(match.groups(), true(here, match.groups()), strict=True):
                    if given is None:
                        continue
                    value = float(given.replace("−", "-"))
                    if abs(value - expected) > 0.6 * 10.0 ** -len(given.partition(".")[2]) + 1e-6:
                        wrong.append(f"{number + 1}: {match[0]} ({expected:.5g})")
        for pattern in (*(each for each, _ in SENTENCES[key]), *ALWAYS):
            left = re.sub(pattern, " ", left)
        wrong += [f"{number + 1}: {x} is not listed" for x in re.findall(r"(?<![\w.])[−-]?\d+(?:\.\d+)?", left)]
    assert wrong == []
    assert used == {pattern for pattern, _ in SENTENCES[key]}, "sentences that nobody says"


def words(key: str, number: int, pattern: str) -> ExampleStep:
    """The step of this number, which says this."""
    step = example_in(key).steps[number - 1]
    assert re.search(pattern, f"{step.text} {step.then}"), (step.text, step.then)
    return step


def tools(key: str, way: np.ndarray) -> np.ndarray:
    return np.array([numpy_arm.pose(example_in(key).robot, q) for q in way])


@pytest.mark.full
def test_what_is_said_of_a_whole_motion_is_true_in_every_frame() -> None:
    shares = np.linspace(0.0, 1.0, 97)  # between the samples, too

    def motion(key: str, number: int, pattern: str) -> np.ndarray:
        step = words(key, number, pattern)
        return tools(key, np.array([step.at(share) for share in shares]))

    turned = motion("rotations", 4, "So the third column stays")
    assert np.allclose(turned[:, :3, 2], turned[0, :3, 2], atol=1e-9)
    circle = motion("velocity", 2, "goes along a circle about axis 1")
    assert np.allclose(np.linalg.norm(circle[:, :3, 3], axis=1), 0.5, atol=1e-9)
    far = motion("inverse", 3, "The distance stays")
    assert np.allclose(np.linalg.norm(far[:, :3, 3], axis=1), 0.5, atol=1e-9)
    for number, pattern in ((2, "the tool point stays"), (3, "though its end stays")):
        held = motion("redundancy", number, pattern)
        assert np.allclose(held[:, :3, 3], held[0, :3, 3], atol=1e-4)
        assert np.ptp(np.arctan2(held[:, 1, 0], held[:, 0, 0])) > 0.1, "the last link turns"
    ahead = motion("redundancy", 5, "the sum of their angles stays")
    assert np.allclose(ahead[:, :3, :3], ahead[0, :3, :3], atol=1e-9)
    line = motion("trajectories", 4, "the tool goes straight")[:, :3, 3]
    ptp = motion("trajectories", 2, "PTP.*bent")[:, :3, 3]
    assert gap(line) < 1e-4
    assert gap(ptp) > 0.02
    for number in (3, 5):  # back the same way
        back = motion("trajectories", number, "[Bb]ack")[::-1, :3, 3]
        assert np.allclose(back, ptp, atol=1e-9)


def gap(points: np.ndarray) -> float:
    """How far points leave the line from the first to the last."""
    way = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
    return float(np.linalg.norm(np.cross(points - points[0], way), axis=1).max())


def test_the_walk_ends_in_the_frames_of_the_arm() -> None:
    text, q = text_in("dh"), np.array([0.7, 0.4])
    robot = text.robot
    frames = np.array([np.eye(4), *numpy_arm.frames(robot, q)])
    for number, frame in enumerate(frames):
        assert np.allclose(walked(frames, robot, q, 4.0 * number), frame, atol=1e-12)
    steps = [walked(frames, robot, q, at) for at in (0.0, 1.0, 2.0, 3.0)]
    moved = [np.linalg.inv(one) @ other for one, other in itertools.pairwise(steps)]
    assert np.allclose(moved[0][:3, 3], 0.0)
    assert np.allclose(moved[1][:3, 3], [0.0, 0.0, robot.rows[0].d])
    assert np.allclose(moved[2][:3, 3], [robot.rows[0].a, 0.0, 0.0])
    half = walked(frames, robot, q, 0.5)
    assert math.atan2(half[1, 0], half[0, 0]) == pytest.approx(q[0] / 2)


def test_iterates_are_those_of_newton() -> None:
    steps = example_in("numeric").steps
    qs = [step.way[-1] for step in steps if step.way is not steps[1].way]
    for number, (before, after) in enumerate(itertools.pairwise(qs)):
        here = Here("numeric", 0)
        here.q = before
        assert np.allclose(np.degrees(after - before), here.newton(), atol=1e-5), number


def test_all_postures_hold_the_point() -> None:
    for key, name, numbers in (("postures", "P", range(1, 6)), ("inverse", "T", range(4, 7))):
        example, found = example_in(key), []
        for step in (example.steps[number - 1] for number in numbers):
            point = marks(step)[name]
            found += [step.way[-1], *(configuration(each) for each in step.drawn.ghosts)]
            for q in found:
                assert np.allclose(numpy_arm.pose(example.robot, q)[:3, 3], point, atol=1e-9)
        assert len(np.unique(np.round(found, 6), axis=0)) == (4 if key == "postures" else 2)


@pytest.mark.parametrize("key", KEYS)
def test_the_arm_is_none_that_questions_are_about(key: str) -> None:
    rows = text_in(key).robot.rows
    shapes = [[(row.kind, row.theta, row.d, row.a, row.alpha) for row in robot.rows] for robot in STORE.robots]
    assert [(row.kind, row.theta, row.d, row.a, row.alpha) for row in rows] not in shapes


@pytest.mark.parametrize("key", KEYS)
def test_examples_are_short_and_move_within_the_limits(key: str) -> None:
    example = example_in(key)
    assert 5 <= len(example.steps) <= 8
    assert sum(step.moves for step in example.steps) >= 2
    for step, following in itertools.pairwise(example.steps):
        assert np.allclose(step.way[-1], following.way[0], atol=1e-12), "no jump"
    for step in example.steps:
        assert example.robot.in_limits(step.way, 1e-6).all()
        assert not re.search(r"[{}]|\bnan\b|−0\b(?!\.)", step.text + step.then)


@pytest.mark.parametrize("key", KEYS)
def test_other_units_change_nothing_but_the_numbers(key: str) -> None:
    for one, other in zip(
        example_in(key).steps, example_of(text_in(key), Units(degrees=False, length="m")).steps, strict=True
    ):
        assert np.array_equal(one.way, other.way)
        assert not re.search(r"\d(?:°| mm)", other.text + other.then)


# The player


def test_the_player_shows_each_motion_rests_and_ends() -> None:
    player = Player(example_in("velocity"))
    seen = [(player.at, player.arrived)]
    while player.goes_on or not player.arrived:
        player = player.followed() if player.arrived else player.after(0.02)
        seen.append((player.at, player.arrived))
    moving = [(number, arrived) for number in range(6) for arrived in (False, True)]
    assert [at for at, _ in itertools.groupby(seen)] == [at for at in moving if at not in [(0, False), (3, False)]]
    player = player.toggled()
    assert (player.at, player.playing) == (0, True), "again from the beginning"


def test_turning_pages_pauses_and_back_shows_the_end_of_a_step() -> None:
    player = Player(example_in("velocity")).turned(1)
    assert (player.at, player.playing, player.arrived, player.share) == (1, False, False, 0.0)
    shares = [player.share]
    for _ in range(1, 200):
        player = player.after(0.02)
        shares.append(player.share)
    assert shares == sorted(shares)
    assert player.arrived
    assert not player.goes_on, "it waits for the visitor"
    player = player.turned(1).turned(-1)
    assert (player.at, player.arrived) == (1, True)
    player = player.turned(-1).turned(-1)
    assert player.at == 0
    for _ in range(20):
        player = player.turned(1)
    assert player.is_last


def test_words_that_are_longer_are_shown_longer() -> None:
    player = Player(example_in("velocity"))
    rests = {len(player.step.text + player.step.then): player.rest}
    while not player.is_last:
        player = player.turned(1)
        rests[len(player.step.text + player.step.then)] = player.rest
    assert min(rests.values()) >= REST
    assert [rests[length] for length in sorted(rests)] == sorted(rests.values())


# The page


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port:
        yield port


def press(tab: FakeBrowser, kind: str, value: int | None = None) -> None:
    tab.say("feature", ["guide", [kind, len(tab.log)], value])


def seen(tab: FakeBrowser) -> dict[str, bool]:
    """Which nodes at the top of the scene are seen."""
    return {name: tab.visible.get(name, True) for name in tab.nodes if name.count("/") == 1}


def of_example(names: dict[str, bool]) -> set[str]:
    return {name for name, on in names.items() if on and name.startswith("/worked-")}


def lamps(tab: FakeBrowser) -> set[str]:
    """Those without a place: they light the example too."""
    kinds = ("AmbientLight", "DirectionalLight", "HemisphereLight")
    return {name for name in seen(tab) if tab.nodes[name]["type"].startswith(kinds)}


@pytest.mark.full
@pytest.mark.parametrize("key", ["velocity", "dh", "numeric"])
def test_only_the_example_is_seen_and_everything_comes_back(server: int, key: str) -> None:
    lesson = next(each for each in LESSONS if each.key == key)
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", lesson.title)
        tab.wait(lambda: "Watch a worked example" in tab.html)
        tab.settle()
        tab.set(label(arms_of(key)[0], 0), 20.0)
        tab.settle()
        tab.say("undo", None)  # so that there is something to redo
        tab.settle()
        before, pose = seen(tab), tab.tool_pose()
        history = [tab.script[name] for name in ("undo", "redo")]
        assert all(history)
        assert any(before.values())
        press(tab, "watch", 0)
        tab.wait(lambda: "<b>1 of" in tab.html and bool(of_example(seen(tab))))
        for number in range(2, 5):
            press(tab, "watch", 1)
            tab.wait(lambda number=number: f"<b>{number} of" in tab.html and 'data-arrived="1"' in tab.html)
        during = seen(tab)
        assert {name for name, on in during.items() if on} == of_example(during) | lamps(tab)
        assert "Your own arm is hidden" in tab.html
        press(tab, "leave")
        tab.wait(lambda: "Watch a worked example" in tab.html and "Your own arm is hidden" not in tab.html)
        tab.settle()
        assert seen(tab) == before
        assert np.array_equal(tab.tool_pose(), pose)
        assert [tab.script[name] for name in ("undo", "redo")] == history


@pytest.mark.full
@pytest.mark.parametrize("way", ["step", "answer", "lesson", "arm", "joint", "undo"])
def test_whatever_else_is_done_ends_the_example(server: int, way: str) -> None:
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "Watch a worked example" in tab.html)
        tab.settle()
        press(tab, "watch", 0)
        tab.wait(lambda: bool(of_example(seen(tab))))
        match way:
            case "step":
                press(tab, "go", 1)
            case "answer":
                tab.say("feature", ["guide", ["reveal", "1", len(tab.log)], None])
            case "lesson":
                tab.set("Lesson", "None")
            case "arm":
                tab.choose("UR5")
            case "joint":
                tab.set(label(STORE.robots[0], 0), 33.0)
            case "undo":
                tab.say("undo", None)
        tab.wait(lambda: not of_example(seen(tab)) and "Worked example:" not in tab.html)
        tab.wait(lambda: any(name.startswith("/arm-") and on for name, on in seen(tab).items()))


def test_a_wrong_button_is_refused_and_changes_nothing(server: int) -> None:
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "Watch a worked example" in tab.html)
        for value in (7, True, None, "0", 1e300):
            tab.say("feature", ["guide", ["watch", 1], value])
            tab.wait(lambda: "example" in tab.html and "expected 0, 1 or -1" in tab.html.replace("−", "-"))
        assert not of_example(seen(tab))


# The file

SMALL = """
arms = ["pioneer5"]
goal = "You can count."
[facts]
[[steps]]
title = "One"
text = "One."
[[check]]
kind = "choice"
prompt = "One?"
options = [{ text = "Yes", right = true, reason = "A." }, { text = "No", reason = "B." }]
[example]
title = "one link"
rows = [{ a = 0.4 }]
lengths = { far = "hypot(x, y)" }
[[example.steps]]
q = ["30*deg"]
text = "It is {far} long."
axes = [1]
[[example.steps]]
q = [0]
text = "It turns."
[[example.steps]]
text = "It rests."
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("{far} long", "{fare} long", "example.steps[0].text: got '{fare}', expected a name from [lengths]"),
        ("hypot(x, y)", "hypot(x, yy)", "example.lengths.far: got 'yy', expected a name of the arm"),
        ('q = ["30*deg"]', "q = [0, 0]", "example.steps[0].q: got 2, expected 1 values"),
        ('q = ["30*deg"]', 'q = ["x"]', "example.steps[0].q: got 'x', expected numbers"),
        ('q = ["30*deg"]', "q = [4]", "example.steps[0].q: got ['4'], expected values within the limits"),
        ('q = ["30*deg"]', "", "example.steps[0].q: got None, expected 1 values"),
        ("axes = [1]", "axes = [2]", "example.steps[0].axes[0]: got 2, expected a whole number from 1 to 1"),
        ("axes = [1]", "axis = [1]", "example.steps[0].axis: got [1], expected no such field"),
        ("axes = [1]", 'way = "round"', "example.steps[0].way: got 'round', expected one of"),
        ("axes = [1]", "marks = [{ at = [0, 0], name = 'A' }]", "example.steps[0].marks[0].at: got"),
        ("axes = [1]", "walk = 5", "example.steps[0].walk: got 5, expected a whole number from 0 to 4"),
        ("axes = [1]", "rulers = [{ from = 0, to = 2, name = 'r' }]", "example.steps[0].rulers[0].to: got 2"),
        ("rows = [{ a = 0.4 }]", "rows = [{ a = 'x' }]", "example.rows[0].a: got 'x', expected a number"),
        ("rows = [{ a = 0.4 }]", "rows = []", "example.rows: got [], expected a list of 1"),
        ('[[example.steps]]\ntext = "It rests."', "", "example.steps: got"),
    ],
)
def test_a_mistake_in_the_file_is_named(old: str, new: str, message: str) -> None:
    assert parse_lesson(SMALL).example.steps
    with pytest.raises(ExerciseFileError, match=re.escape(message)):
        parse_lesson(SMALL.replace(old, new))
