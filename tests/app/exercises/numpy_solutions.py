"""Solves every built-in exercise with NumPy alone: from the numbers in its text and the tables of the robot files.

Nothing here imports the code that it checks. Angles are radians and lengths metres; typed answers are in degrees
and millimetres.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np

ROBOTS = Path(__file__).parents[3] / "kin" / "robots"
Numbers = dict[str, float]
Solver = Callable[[Numbers, "list[str]"], object]
DEG, MM = math.pi / 180, 1e-3
SOLVERS: dict[str, Solver] = {}


def solves(*ids: str) -> Callable[[Solver], Solver]:
    def register(solver: Solver) -> Solver:
        SOLVERS.update(dict.fromkeys(ids, solver))
        return solver

    return register


# An arm, from its file


def rows_of(robot: str) -> tuple[list[dict[str, Any]], np.ndarray]:
    """The rows in metres and radians, and the home configuration."""
    data = tomllib.loads((ROBOTS / f"{robot}.toml").read_text(encoding="utf-8"))
    length = {"m": 1.0, "cm": 0.01, "mm": MM}[data["units"]["length"]]
    angle = {"deg": DEG, "rad": 1.0}[data["units"]["angle"]]
    rows = []
    for row in data["rows"]:
        sliding = row.get("kind") == "prismatic"
        rows.append(
            {
                "theta": angle * row.get("theta", 0.0),
                "alpha": angle * row.get("alpha", 0.0),
                "d": length * row.get("d", 0.0),
                "a": length * row.get("a", 0.0),
                "kind": row.get("kind", "revolute"),
                "limits": [(length if sliding else angle) * x for x in row.get("limits", ())],
            }
        )
    moving = [row for row in rows if row["kind"] != "fixed"]
    home = [
        (length if row["kind"] == "prismatic" else angle) * value
        for row, value in zip(moving, data["home"]["q"], strict=True)
    ]
    return rows, np.array(home)


def turn(axis: str, t: float) -> np.ndarray:
    c, s = math.cos(t), math.sin(t)
    R = {
        "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }[axis]
    T = np.eye(4)
    T[:3, :3] = R
    return T


def slide(axis: str, by: float) -> np.ndarray:
    T = np.eye(4)
    T["xyz".index(axis), 3] = by
    return T


def frames(robot: str, q: Any, share: float = 1.0) -> list[np.ndarray]:
    """The frames after each row of a standard table, with all lengths times `share`."""
    rows, _ = rows_of(robot)
    values, found, T = iter(q), [], np.eye(4)
    for row in rows:
        value = 0.0 if row["kind"] == "fixed" else float(next(values))
        theta = row["theta"] + (value if row["kind"] == "revolute" else 0.0)
        d = share * row["d"] + (value if row["kind"] == "prismatic" else 0.0)
        T = T @ turn("z", theta) @ slide("z", d) @ slide("x", share * row["a"]) @ turn("x", row["alpha"])
        found.append(T)
    return found


def as_pose(T: np.ndarray) -> list[float]:
    """x, y, z and a quaternion w, x, y, z, by Bar-Itzhack's eigenvector."""
    R = T[:3, :3]
    K = np.array(
        [
            [R[0, 0] - R[1, 1] - R[2, 2], R[1, 0] + R[0, 1], R[2, 0] + R[0, 2], R[2, 1] - R[1, 2]],
            [R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], R[2, 1] + R[1, 2], R[0, 2] - R[2, 0]],
            [R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1], R[1, 0] - R[0, 1]],
            [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]],
        ]
    )
    x, y, z, w = np.linalg.eigh(K)[1][:, -1].tolist()
    return [*T[:3, 3].tolist(), w, x, y, z]


def mm(*values: float) -> list[str]:
    return [repr(1000.0 * float(v)) for v in values]


def deg(*values: float) -> list[str]:
    return [repr(math.degrees(float(v))) for v in values]


def plain(*values: float) -> list[str]:
    return [repr(float(v)) for v in values]


# Frames and DH tables


@solves("which-joint-goes-down")
def goes_down(v: Numbers, labels: list[str]) -> object:
    rows, home = rows_of("scara")
    before = frames("scara", home)[-1]
    for i in range(4):
        q = home.copy()
        q[i] -= 0.1
        after = frames("scara", q)[-1]
        moved = after[:3, 3] - before[:3, 3]
        if abs(moved[2]) > 0.05 and np.hypot(moved[0], moved[1]) < 1e-9:
            return labels.index(f"Joint {i + 1}")
    raise AssertionError(rows)


@solves("which-joint-moved")
def joint_moved(v: Numbers, labels: list[str]) -> object:
    _, home = rows_of("planar3r")
    goal = np.array([v["target_x"], v["target_y"]])
    for i in range(3):
        q = home.copy()
        q[i] += v["dt"]
        if np.allclose(frames("planar3r", q)[-1][:2, 3], goal, atol=1e-6):
            return plain(i + 1)
    raise AssertionError(goal)


@solves("turn-and-slide")
def turn_and_slide(v: Numbers, labels: list[str]) -> object:
    T = np.eye(4)
    T[:2, :2] = [[math.cos(v["t"]), -math.sin(v["t"])], [math.sin(v["t"]), math.cos(v["t"])]]
    T[:2, 3] = v["l"] * math.cos(v["t"]), v["l"] * math.sin(v["t"])
    return as_pose(T)


@solves("slide-and-turn")
def slide_and_turn(v: Numbers, labels: list[str]) -> object:
    T = turn("z", v["t"])
    T[0, 3] = v["l"]
    return as_pose(T)


@solves("two-turns")
def two_turns(v: Numbers, labels: list[str]) -> object:
    x = np.array([math.cos(v["t"]), math.sin(v["t"]), 0.0])
    y = np.array([-math.sin(v["t"]) * math.cos(v["u"]), math.cos(v["t"]) * math.cos(v["u"]), math.sin(v["u"])])
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[0, 3] = x, y, np.cross(x, y), v["l"]
    return as_pose(T)


def _motion(label: str) -> np.ndarray:
    """``turn by 30° about z`` or ``slide by 250 mm along x``, as a student reads it."""
    words = label.replace("−", "-").split()
    amount = float(words[2].rstrip("°"))
    return turn(words[-1], amount * DEG) if words[0] == "turn" else slide(words[-1], amount * MM)


def _order(labels: list[str], right: np.ndarray, fixed: bool) -> list[int]:
    for order in permutations(range(len(labels))):
        T = np.eye(4)
        for i in order:
            T = _motion(labels[i]) @ T if fixed else T @ _motion(labels[i])
        if np.allclose(T, right, atol=1e-4):
            return list(order)
    raise AssertionError(labels)


@solves("dh-order")
def dh_order(v: Numbers, labels: list[str]) -> object:
    ct, st, ca, sa = math.cos(v["t"]), math.sin(v["t"]), math.cos(v["al"]), math.sin(v["al"])
    A = np.array(  # the matrix of the textbooks
        [
            [ct, -st * ca, st * sa, v["a"] * ct],
            [st, ct * ca, -ct * sa, v["a"] * st],
            [0, sa, ca, v["d"]],
            [0, 0, 0, 1],
        ]
    )
    return _order(labels, A, fixed=False)


@solves("roll-pitch-yaw")
def roll_pitch_yaw(v: Numbers, labels: list[str]) -> object:
    return _order(labels, turn("z", v["y"]) @ turn("y", v["p"]) @ turn("x", v["r"]), fixed=True)


@solves("row-distance")
def row_distance(v: Numbers, labels: list[str]) -> object:
    return mm(np.linalg.norm((slide("z", v["d"]) @ slide("x", v["a"]))[:3, 3]))


@solves("pioneer-first-row")
def pioneer_first_row(v: Numbers, labels: list[str]) -> object:
    # Another legitimate choice than the arm's own: z of frame 1 the other way round.
    return [[*deg(v["t1"]), *mm(v["d1"], v["a1"]), "90"]]


@solves("scara-two-rows")
def scara_two_rows(v: Numbers, labels: list[str]) -> object:
    # All of the height in row 2, and no turn of z: the axes are the same lines.
    return [[*deg(v["t1"]), "0", *mm(v["a1"]), "0"], [*deg(v["t2"]), *mm(v["h"], v["a2"]), "0"]]


@solves("stanford-craig")
def stanford_craig(v: Numbers, labels: list[str]) -> object:
    return [[*deg(v["t1"]), *mm(v["h"], 0.0), "0"], [*deg(v["t2"]), *mm(v["s"], 0.0), "-90"]]


def own_rows(robot: str) -> object:
    """The table of the arm's file as it is typed."""
    return [[*deg(row["theta"]), *mm(row["d"]), *mm(row["a"]), *deg(row["alpha"])] for row in rows_of(robot)[0]]


@solves("mistake-scara")
def mistake_scara(v: Numbers, labels: list[str]) -> object:
    # All of the height in row 2: axes 1 and 2 are parallel.
    rows: Any = own_rows("scara")
    rows[0][1], rows[1][1] = "0", rows[0][1]
    return rows


@solves("mistake-puma")
def mistake_puma(v: Numbers, labels: list[str]) -> object:
    return own_rows("puma560")


@solves("mistake-zeros")
def mistake_zeros(v: Numbers, labels: list[str]) -> object:
    return own_rows("irb120")


@solves("other-way-round")
def other_way_round(v: Numbers, labels: list[str]) -> object:
    T = slide("x", v["px"]) @ slide("y", v["py"]) @ turn("z", v["t"])
    return mm(*np.linalg.inv(T)[:2, 3])


# Forward kinematics


@solves("planar-tool-point")
def planar_tool_point(v: Numbers, labels: list[str]) -> object:
    return mm(*frames("planar2r", [v["t1"], v["t2"]])[-1][:2, 3])


@solves("planar-direction")
def planar_direction(v: Numbers, labels: list[str]) -> object:
    x = frames("planar3r", [v["t1"], v["t2"], v["t3"]])[-1][:2, 0]
    return deg(math.atan2(x[1], x[0]))


@solves("matrix-entry")
def matrix_entry(v: Numbers, labels: list[str]) -> object:
    return plain(frames("planar2r", [v["t1"], v["t2"]])[-1][0, 1])


@solves("scara-height")
def scara_height(v: Numbers, labels: list[str]) -> object:
    return mm(frames("scara", [0.3, 1.0, v["d3"], 0.0])[-1][2, 3])


def _wrong_term(labels: list[str], right: Callable[[str, np.ndarray], float], n: int) -> int:
    """The printed term whose value differs from the right one at some joint values."""
    rng = np.random.default_rng(1)
    for q in rng.uniform(-2, 2, (20, n)):
        for i, label in enumerate(labels):
            if abs(_evaluated(label, q) - right(str(i), q)) > 1e-6:
                return i
    raise AssertionError(labels)


LENGTHS = {"l₁": 1.0, "l₂": 0.6, "l₃": 0.3, "a₁": 0.325, "a₂": 0.275}


def _evaluated(label: str, q: np.ndarray) -> float:
    """The value of a printed term such as ``−a₂ cos(θ₁ + θ₂)``."""
    text = label.replace("−", "-")
    for i, name in enumerate(("θ₁", "θ₂", "θ₃")[: len(q)]):
        text = text.replace(name, f"({float(q[i])!r})")
    for name, value in LENGTHS.items():
        text = text.replace(name, f"{value!r}*")
    text = text.replace(" cos", "*cos").replace(" sin", "*sin").replace("**", "*").replace("* *", "*")
    return float(eval(text, {"cos": math.cos, "sin": math.sin}))


@solves("planar-misprint")
def planar_misprint(v: Numbers, labels: list[str]) -> object:
    sums = (lambda q: q[0], lambda q: q[0] + q[1], lambda q: q.sum())
    return _wrong_term(labels, lambda i, q: (1.0, 0.6, 0.3)[int(i)] * math.cos(sums[int(i)](q)), 3)


@solves("scara-misprint")
def scara_misprint(v: Numbers, labels: list[str]) -> object:
    def right(i: str, q: np.ndarray) -> float:
        s, c = np.sin(q), np.cos(q)
        return float((0.325 * s[0], 0.275 * s[0] * c[1], 0.275 * c[0] * s[1])[int(i)])

    return _wrong_term(labels, right, 2)


@solves("scara-frame")
def scara_frame(v: Numbers, labels: list[str]) -> object:
    return as_pose(frames("scara", [v["t1"], v["t2"], 0.15, 0.0])[1])


@solves("swing")
def swing(v: Numbers, labels: list[str]) -> object:
    _, home = rows_of("pioneer5")
    before = frames("pioneer5", home)[-1][:3, 3]
    home[0] += v["dt"]
    return mm(np.linalg.norm(frames("pioneer5", home)[-1][:3, 3] - before))


@solves("which-fixture")
def which_fixture(v: Numbers, labels: list[str]) -> object:
    """The short table draws the points near the base by one share: of each fixture, what would contradict it."""
    q = np.random.default_rng(1).uniform(-1.5, 1.5, (20, 6))
    true, short = (np.array([frames("ur5", each, share)[-1][:3, 3] for each in q]) for share in (1.0, 0.996))
    assert np.allclose(short, 0.996 * true)
    # A point stays one point, and a plane stays a plane: only a known distance is another one.
    assert abs(0.996 * 0.150 - 0.1494) < 1e-12
    return next(i for i, label in enumerate(labels) if "150 mm apart" in label)


# Inverse kinematics


def planar2(x: float, y: float, l1: float, l2: float) -> list[tuple[float, float]]:
    """Both elbows, by the cosine rule; none if the point is out of reach."""
    c = (x * x + y * y - l1 * l1 - l2 * l2) / (2 * l1 * l2)
    if abs(c) > 1.0:
        return []
    return [
        (math.atan2(y, x) - math.atan2(l2 * math.sin(t), l1 + l2 * math.cos(t)), t)
        for t in (math.acos(c), -math.acos(c))
    ]


def wrapped(t: float) -> float:
    return math.remainder(t, 2 * math.pi)


@solves("move-to-point")
def move_to_point(v: Numbers, labels: list[str]) -> object:
    return list(map(wrapped, planar2(v["target_x"], v["target_y"], 1.0, 0.6)[0]))


@solves("elbow-angle")
def elbow_angle(v: Numbers, labels: list[str]) -> object:
    return deg(planar2(v["r"], 0.0, 1.0, 0.6)[0][1])


@solves("two-elbows", "in-reach-or-not")
def two_elbows(v: Numbers, labels: list[str]) -> object:
    return [deg(wrapped(a), b) for a, b in planar2(v["px"], v["py"], 1.0, 0.6)]


@solves("scara-solutions")
def scara_solutions(v: Numbers, labels: list[str]) -> object:
    rows, _ = rows_of("scara")
    found = []
    for a, b in planar2(v["px"], v["py"], 0.325, 0.275):
        for c in (a + b - v["phi"] + 2 * math.pi * k for k in (-1, 0, 1)):
            q = [wrapped(a), b, 0.387 - v["pz"], c]
            if all(low <= x <= high for x, (low, high) in zip(q, (row["limits"] for row in rows), strict=False)):
                found.append([*deg(q[0], q[1]), *mm(q[2]), *deg(c)])
                break
    return found


@solves("other-wrist")
def other_wrist(v: Numbers, labels: list[str]) -> object:
    """The wrist's rotation R = A4 A5 A6, solved for the other sign of its bend."""

    def wrist(q: Any) -> np.ndarray:
        return (
            turn("z", q[0]) @ turn("x", math.pi / 2) @ turn("z", q[1]) @ turn("x", -math.pi / 2) @ turn("z", q[2])
        )

    R = wrist([v["t4"], v["t5"], v["t6"]])
    t5 = -v["t5"]
    s = math.sin(t5)
    # R[:2, 2] = −sin t5 (cos t4, sin t4) and R[2, :2] = sin t5 (cos t6, −sin t6)
    t4 = math.atan2(-R[1, 2] / s, -R[0, 2] / s)
    t6 = math.atan2(-R[2, 1] / s, R[2, 0] / s)
    assert np.allclose(wrist([t4, t5, t6]), R)
    return deg(t4, t5, t6)


@solves("count-postures")
def count_postures(v: Numbers, labels: list[str]) -> object:
    T = frames("planar3r", [v["t1"], v["t2"], v["t3"]])[-1]
    wrist = T[:2, 3] - 0.3 * T[:2, 0]
    length = float(np.hypot(*wrist))
    return plain(1 if length > 1.6 - 1e-9 else len(planar2(wrist[0], wrist[1], 1.0, 0.6)))


@solves("reach-elbow")
def reach_elbow(v: Numbers, labels: list[str]) -> object:
    phi = v["t1"] + v["t2"] + v["t3"]
    x, y = v["target_x"] - 0.3 * math.cos(phi), v["target_y"] - 0.3 * math.sin(phi)
    a, b = planar2(x, y, 1.0, 0.6)[1]
    return [wrapped(a), b, wrapped(phi - a - b)]


@solves("reach-locked")
def reach_locked(v: Numbers, labels: list[str]) -> object:
    """Links 2 and 3 are one link, bent by a fixed angle."""
    t3 = v["t3"]
    l2, bend = (
        math.hypot(0.6 + 0.3 * math.cos(t3), 0.3 * math.sin(t3)),
        math.atan2(0.3 * math.sin(t3), 0.6 + 0.3 * math.cos(t3)),
    )
    a, b = planar2(v["target_x"], v["target_y"], 1.0, l2)[0]
    return [wrapped(a), wrapped(b - bend), t3]


@solves("reach-margin")
def reach_margin(v: Numbers, labels: list[str]) -> object:
    """A search over the elbow and the wrist's bend, with the waist towards the point and a descent to it."""
    rows, _ = rows_of("irb120")
    limits = np.array([row["limits"] for row in rows])
    goal = np.array([v["target_x"], v["target_y"], v["target_z"]])
    inset = 0.205 * (limits[:, 1] - limits[:, 0])
    low, high = limits[:, 0] + inset, limits[:, 1] - inset
    rng = np.random.default_rng(3)
    for _ in range(60):
        q = rng.uniform(low, high)
        for _ in range(60):
            error = goal - frames("irb120", q)[-1][:3, 3]
            if np.linalg.norm(error) < 1e-6:
                return q.tolist()
            J = np.array([(frames("irb120", q + 1e-6 * e)[-1][:3, 3] - goal + error) / 1e-6 for e in np.eye(6)]).T
            q = np.clip(q + J.T @ np.linalg.solve(J @ J.T + 1e-6 * np.eye(3), error), low, high)
    raise AssertionError(goal)


@solves("line-across")
def line_across(v: Numbers, labels: list[str]) -> object:
    """Both elbows at the start; the one with which joint 1 stays within half a turn along the line."""
    start, end = np.array([v["target_x"], v["target_y"]]), np.array([v["ex"], v["ey"]])
    for elbow in range(2):
        ways = [planar2(*(start + s * (end - start)), 1.0, 0.6)[elbow] for s in np.linspace(0.0, 1.0, 200)]
        angles = np.unwrap([wrapped(first) for first, _ in ways])
        if np.abs(angles).max() <= math.pi:
            return [float(angles[0]), ways[0][1]]
    raise AssertionError(start)


@solves("line-wrist")
def line_wrist(v: Numbers, labels: list[str]) -> object:
    """Postures by descents from random configurations; each is followed along the line until a limit is passed."""
    rows, _ = rows_of("irb120")
    low, high = np.array([row["limits"] for row in rows]).T
    q = np.array([v["s"] * 30 * DEG + v["b"], 20 * DEG, -10 * DEG, v["s"] * 60 * DEG, 30 * DEG, 0.0])
    T, end = frames("irb120", q)[-1], np.array([v["ex"], v["ey"], v["ez"]])

    def met(q: np.ndarray, point: np.ndarray) -> np.ndarray | None:
        for _ in range(30):
            now = frames("irb120", q)[-1]
            turned = sum(np.cross(now[:3, k], T[:3, k]) for k in range(3))
            error = np.concatenate([point - now[:3, 3], 0.5 * turned])
            if np.linalg.norm(error) < 1e-9:
                return q
            q = q + np.linalg.lstsq(jacobian("irb120", q), error, rcond=1e-6)[0]
        return None

    rng = np.random.default_rng(5)
    for _ in range(200):
        start = met(rng.uniform(low, high), T[:3, 3])
        if start is None:
            continue
        start = np.array([wrapped(x) for x in start])
        at: np.ndarray | None = start
        for share in np.linspace(0.0, 1.0, 60):
            at = None if at is None else met(at, T[:3, 3] + share * (end - T[:3, 3]))
            if at is None or (at < low).any() or (at > high).any():
                at = None
                break
        if at is not None:
            return start.tolist()
    raise AssertionError(end)


@solves("no-solution")
def no_solution(v: Numbers, labels: list[str]) -> object:
    assert planar2(v["r"], 0.0, 1.0, 0.6) == []
    word = "too far" if v["r"] > 1.0 else "too near"
    return next(i for i, label in enumerate(labels) if word in label)


@solves("five-joints")
def five_joints(v: Numbers, labels: list[str]) -> object:
    """The Jacobian of the arm has rank five almost everywhere: one of six coordinates is missing."""
    rng = np.random.default_rng(0)
    assert np.linalg.matrix_rank(jacobian("pioneer5", rng.uniform(0.3, 0.7, 5)), tol=1e-6) == 5
    return next(i for i, label in enumerate(labels) if "five joints" in label)


# Velocity


def jacobian(robot: str, q: Any) -> np.ndarray:
    """The geometric Jacobian of a standard table, column by column from its axes."""
    rows, _ = rows_of(robot)
    T = [np.eye(4), *frames(robot, q)]
    tool = T[-1][:3, 3]
    columns = []
    for i, row in enumerate(rows):
        z, p = T[i][:3, 2], T[i][:3, 3]
        if row["kind"] == "revolute":
            columns.append(np.concatenate([np.cross(z, tool - p), z]))
        elif row["kind"] == "prismatic":
            columns.append(np.concatenate([z, np.zeros(3)]))
    return np.array(columns).T


@solves("tool-speed")
def tool_speed(v: Numbers, labels: list[str]) -> object:
    return plain(np.linalg.norm(jacobian("planar2r", [v["t1"], v["t2"]])[:3, 0]) * v["w"])


@solves("jacobian-column")
def first_column(v: Numbers, labels: list[str]) -> object:
    return plain(*jacobian("planar2r", [v["t1"], v["t2"]])[:2, 0])


@solves("second-column")
def second_column(v: Numbers, labels: list[str]) -> object:
    return plain(*jacobian("planar2r", [v["t1"], v["t2"]])[:2, 1])


@solves("planar-manipulability")
def planar_manipulability(v: Numbers, labels: list[str]) -> object:
    return plain(np.linalg.det(jacobian("planar2r", [v["t1"], v["t2"]])[:2, :2]))


@solves("name-the-singularity")
def name_the_singularity(v: Numbers, labels: list[str]) -> object:
    q = [30 * DEG, v["t2"], 0.7, 25 * DEG, v["t5"], 0.0]
    J = jacobian("stanford", q)
    assert np.linalg.matrix_rank(J, tol=1e-9) == 5
    wrist = abs(np.cross(J[3:, 3], J[3:, 5])).max() < 1e-9  # axes 4 and 6 in line
    word = "axes 4 and 6" if wrist else "as near to axis 1"
    return next(i for i, label in enumerate(labels) if word in label.lower())


@solves("puma-wrist")
def puma_wrist(v: Numbers, labels: list[str]) -> object:
    J = jacobian("puma560", [20 * DEG, 50 * DEG, -150 * DEG, v["t4"], 0.0, 0.0])
    assert np.allclose(J[:, 3], J[:, 5])
    return next(i for i, label in enumerate(labels) if "axes 4 and 6" in label.lower())


@solves("lost-direction")
def lost_direction(v: Numbers, labels: list[str]) -> object:
    J = jacobian("scara", [v["t1"], 0.0, 0.1, 0.0])[:3]
    values, vectors = np.linalg.eigh(J @ J.T)
    assert values[0] < 1e-12 < 1e-3 < values[1]
    return plain(*vectors[:, 0])


@solves("holding-torque")
def holding_torque(v: Numbers, labels: list[str]) -> object:
    J = jacobian("planar2r", [v["t1"], v["t2"]])
    return plain(*(-J[:3].T @ np.array([0.0, -v["f"], 0.0])))


@solves("self-motion")
def self_motion(v: Numbers, labels: list[str]) -> object:
    """The S-R-S arm in its own convention: Craig's rows, by finite differences."""
    rows, _ = rows_of("redundant7-craig")

    def pose(q: np.ndarray) -> np.ndarray:
        values, T = iter(q), np.eye(4)
        for row in rows:
            value = 0.0 if row["kind"] == "fixed" else next(values)
            T = (
                T
                @ turn("x", row["alpha"])
                @ slide("x", row["a"])
                @ turn("z", row["theta"] + value)
                @ slide("z", row["d"])
            )
        return T[:3].ravel()

    q, h = np.linspace(0.3, 0.9, 7), 1e-6
    J = np.array([(pose(q + h * e) - pose(q - h * e)) / (2 * h) for e in np.eye(7)]).T
    return plain(7 - np.linalg.matrix_rank(J, tol=1e-6))


@solves("dexterous-point")
def dexterous_point(v: Numbers, labels: list[str]) -> object:
    """Of all directions of the last link, the one with the largest manipulability of the pose in the plane."""
    best, found = -1.0, [0.0] * 3
    for phi in np.linspace(-math.pi, math.pi, 721):
        x, y = v["target_x"] - 0.3 * math.cos(phi), v["target_y"] - 0.3 * math.sin(phi)
        for a, b in planar2(x, y, 1.0, 0.6):
            q = [wrapped(a), b, wrapped(phi - a - b)]
            w = math.sqrt(max(np.linalg.det((J := jacobian("planar3r", q)[:2]) @ J.T), 0.0))
            if w > best:
                best, found = w, q
    return found


# Motions


@solves("ptp-or-lin")
def ptp_or_lin(v: Numbers, labels: list[str]) -> object:
    return next(i for i, label in enumerate(labels) if label.startswith("PTP"))


def _profile(distance: float, v: float, a: float, dt: float = 1e-4) -> tuple[float, float]:
    """Time and peak speed of the fastest motion from rest to rest, stepped through."""
    x = speed = time = peak = 0.0
    while x < distance - 1e-9 and time < 60.0:
        braking = speed * speed / (2 * a)
        speed = max(speed - a * dt, 1e-6) if distance - x <= braking else min(speed + a * dt, v)
        x, time, peak = x + speed * dt, time + dt, max(peak, speed)
    return time, peak


@solves("trapezoid-time")
def trapezoid_time(v: Numbers, labels: list[str]) -> object:
    return plain(round(_profile(v["dq"], v["v"], v["acc"])[0], 2))


@solves("triangle-speed")
def triangle_speed(v: Numbers, labels: list[str]) -> object:
    return plain(_profile(v["dq"], math.inf, v["acc"])[1] / DEG)


@solves("cubic-peak")
def cubic_peak(v: Numbers, labels: list[str]) -> object:
    t = v["t"]
    c = np.linalg.solve(
        np.array([[1, 0, 0, 0], [0, 1, 0, 0], [1, t, t**2, t**3], [0, 1, 2 * t, 3 * t**2]]), [0, 0, v["dq"], 0]
    )
    times = np.linspace(0, t, 1001)
    return plain((c[1] + 2 * c[2] * times + 3 * c[3] * times**2).max() / DEG)


@solves("slowest-joint")
def slowest_joint(v: Numbers, labels: list[str]) -> object:
    times = {1: v["d1"] / 250, 4: v["d4"] / 320, 6: v["d6"] / 420}
    return plain(max(times, key=lambda joint: times[joint]))


@solves("drive-a-line", "drive-slowly")
def drive(v: Numbers, labels: list[str]) -> object:
    x, y, z = (round(1000 * v[name], 1) for name in ("px", "py", "pz"))
    speed = f"tool_speed = {1000 * v['v']}\n" if "v" in v else ""
    return (
        'units = { length = "mm", angle = "deg" }\n[[segments]]\nkind = "lin"\n'
        f"position = [{x}, {y}, {z}]\n{speed}"
    )


@solves("screw-moment")
def screw_moment(v: Numbers, labels: list[str]) -> object:
    p, angle = np.array([v["px"], v["py"], 0.0]), 1e-6  # the origin, turned about the axis by a small angle
    moved = turn("z", angle)[:3, :3] @ -p + p
    return plain(*(moved / angle)[:2])


@solves("newton-step")
def newton_step(v: Numbers, labels: list[str]) -> object:
    step = 1e-6
    J = (turn("z", step) @ np.array([v["r"], 0.0, 0.0, 1.0]))[1] / step
    return plain(v["e"] / J / DEG)


@solves("axis-counterexample")
def axis_counterexample(v: Numbers, labels: list[str]) -> object:
    (one, two), _ = rows_of("planar2r")
    first = v["t"] + 2 * DEG
    lowered = math.asin(-one["a"] * math.sin(first) / two["a"])  # of link 2, so that it ends on the axis
    return [first, lowered - first]


@solves("joints-by-speed")
def joints_by_speed(v: Numbers, labels: list[str]) -> object:
    J = jacobian("ur5", [0.0, v["t2"], v["t3"], -math.pi / 2, -math.pi / 2, 0.0])
    speeds = [float(np.linalg.norm(J[:3, int(label.removeprefix("Joint ")) - 1])) for label in labels]
    return sorted(range(len(labels)), key=speeds.__getitem__)


@solves("sketch-profile")
def sketch_profile(v: Numbers, labels: list[str]) -> object:
    top = 1.5 * v["way"] / 3.0 / DEG  # two thirds of the time at it, by area
    return plain(0.0, top / 2, top, top, top, top / 2, 0.0)
