"""The solver of saved pages, in Node: statuses, postures and sentences beside those of `kin.solve_ik`."""

from __future__ import annotations

import gzip
import json
import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from number_cases import DEGREES, READ, REFUSED
from playwright._impl._driver import compute_driver_executable

import kin
from app.shared.settings import static_folder
from app.viewer.scene.bodies.drawing import drawing
from app.viewer.takehome.page import SCRIPTS, SavedArm, web_page
from app.viewer.takehome.solver import solver_of
from kin.ik.details import OrientationNotMet, RotationError, Solved
from kin.ik.messages import explain
from kin.units import DEFAULT_UNITS, PLAIN, typeset

ARMS = (
    *("pioneer5", "redundant7-craig", "ur5e", "panda", "crx10ia", "so101", "puma560", "scara", "stanford"),
    "redundant7",
)
NUMBER = re.compile(r"\d[\d.]*(?:·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?")
ASK = """
const { about, T, seeds } = require("./asked.json");
const solver = kinboard.solver(kernels, about, (q) => kernels.fk(q).flat());
const words = kinboard.words(about, kinboard.numbers({ degrees: true, length: "mm" }).sentence);
console.log(JSON.stringify(T.map((target, i) => {
  let found = solver.answer(target, seeds[i]);
  if (!["solved", "approximate"].includes(found.status)) found = solver.why(target, seeds[i], found);
  const free = found.status === "solved" && about.parameter
    ? solver.intervals(target, seeds[i], found.rows[0].branch) : null;
  const value = free && solver.valueAt(target, found.rows[0]);
  const names = found.rows.map(({ row }) => about.branches[row]?.[0]);
  const last = free && solver.intervals(target, seeds[i], found.rows.at(-1).branch);
  return { ...found, text: words.text(found), names, free, value, last };
})));
"""


def targets(robot: kin.Robot):
    """Poses that can be met, poses turned by up to a whole turn, and points out of reach; seeds."""
    rng = np.random.default_rng(3)
    T = kin.fk(robot, robot.random_q(rng, 50))
    for k in range(30, 45):
        size = np.pi if robot.n > 5 or k > 40 else 0.4
        T[k] = T[k] @ kin.pose_from_xyz_rpy(np.zeros(3), rng.uniform(-size, size, 3))
    away = T[45:, :3, 3] / np.linalg.norm(T[45:, :3, 3], axis=1, keepdims=True)
    T[45:, :3, 3] = away * robot.reach * np.linspace(1.3, 4.0, 5)[:, None]
    return T, robot.random_q(rng, 50)


def in_node(script: str, asked, folder):
    """What a script prints that comes after those of the page, and reads `asked`."""
    parts = [(static_folder() / name).read_text("utf-8") for name in SCRIPTS[:2]]
    (folder / "run.js").write_text("\n".join([*parts, script]), "utf-8")
    (folder / "asked.json").write_text(json.dumps(asked), "utf-8")
    command = [compute_driver_executable()[0], "run.js"]
    done = subprocess.run(command, cwd=folder, check=True, capture_output=True, encoding="utf-8")
    return json.loads(done.stdout)


def answers(robot: kin.Robot, T, seeds, folder):
    """What the page finds and says."""
    script, about, _ = solver_of(robot)
    asked = {"about": about, "T": T.reshape(-1, 16).tolist(), "seeds": seeds.tolist()}
    return in_node(script + ASK, asked, folder)


def said(result: kin.IKResult) -> str:
    """The product's sentence, without what the page does not know: singularities, what does not fit, proofs."""
    details = result.details
    if isinstance(details, OrientationNotMet):
        details = details._replace(obstacle=None, gap=None)
    if isinstance(details, RotationError):
        details = details._replace(violation=None)
    if isinstance(details, Solved) and result.solver == "general6":
        details = details._replace(complete=False)
    return typeset(explain(details, result.cause, "pose", (), DEFAULT_UNITS).text)


@pytest.mark.parametrize("robot_id", ARMS)
def test_statuses_postures_and_sentences_are_those_of_the_product(robot_id, tmp_path):
    robot = kin.get_robot(robot_id)
    T, seeds = targets(robot)
    statuses = set()
    for target, seed, found in zip(T, seeds, answers(robot, T, seeds, tmp_path), strict=True):
        expected = kin.solve_ik(robot, target, q_seed=seed)
        status = {"rotation": "approximate"}.get(found["status"], found["status"])
        assert status == expected.status.value
        statuses.add(found["status"])
        if status == "solved" and found.get("held") is not None:
            expected = kin.solve_ik(robot, target, q_seed=seed, redundancy=found["held"])
        rows = np.array([row["q"] for row in found["rows"]])
        if status == "solved":
            assert found["names"] == [each.branch for each in expected.solutions]
            assert np.allclose(rows, [each.q for each in expected.solutions], atol=1e-7)
        elif status == "approximate" and len(rows):
            assert np.allclose(rows, [each.q for each in expected.solutions[: len(rows)]], atol=1e-7)
        elif status == "limits":
            names = [each.branch for each in expected.blocked]
            assert sorted(found["names"]) == sorted(names)
            first = found["rows"][found["names"].index(names[0])]
            assert first["outside"] == pytest.approx(found["rows"][0]["outside"], abs=1e-9)
            if found["names"][0] != names[0]:
                continue  # as far outside by all but rounding: either may be named
        wanted = said(expected)
        assert NUMBER.sub("#", found["text"]) == NUMBER.sub("#", wanted)
        numbers = [[float(x) for x in NUMBER.findall(text) if "·" not in x] for text in (found["text"], wanted)]
        assert np.allclose(*numbers, atol=0.11)
    assert "solved" in statuses
    assert len(statuses) > 2 or robot_id == "scara"


def test_what_is_typed_is_read_as_in_the_product(tmp_path):
    cases = [*READ, *((text, unit, None) for text, unit, _ in REFUSED)]
    cases = [each for each in cases if each[1] is not PLAIN]
    asked = [
        (text, unit.is_angle, {"degrees": unit is DEGREES, "length": "mm" if unit.is_angle else unit.name})
        for text, unit, _ in cases
    ]
    script = """
const read = ([text, turns, units, limits]) => kinboard.numbers(units).read(text, turns, limits);
console.log(JSON.stringify(require("./asked.json").map(read)));
"""
    limited = [("1,250", False, {"degrees": True, "length": "mm"}, limits) for limits in ((0.0, 1.0), (0.0, 2.0))]
    *found, small, unclear = in_node(script, [*asked, *limited], tmp_path)
    for (text, _, value), number in zip(cases, found, strict=True):
        assert number == (None if value is None else pytest.approx(value, rel=1e-14)), text
    assert (small, unclear) == (pytest.approx(1.25e-3), None)


@pytest.mark.full
@pytest.mark.parametrize("robot_id", ["redundant7-craig", "panda", "iiwa14"])
def test_the_bar_of_the_redundancy_parameter_is_that_of_the_product(robot_id, tmp_path):
    robot = kin.get_robot(robot_id)
    T, seeds = (values[:12] for values in targets(robot))
    for target, seed, found in zip(T, seeds, answers(robot, T, seeds, tmp_path), strict=True):
        q = np.array(found["rows"][0]["q"])
        own = kin.solve_ik(robot, target, q_seed=q).solutions[0]
        assert np.allclose(own.q, q, atol=1e-7)
        assert found["value"] == pytest.approx(own.redundancy[0].value, abs=1e-6)
        assert np.allclose(found["free"], own.redundancy[0].intervals, atol=1e-6)
        assert seed is not None


@pytest.mark.full
def test_the_bar_of_an_arm_without_intervals_is_of_all_postures_and_has_the_present_value(tmp_path):
    gen3 = kin.get_robot("gen3")
    q = gen3.q_home + np.array([0.1, 0.2, -0.3, 0.4, 0.5, -0.6, 0.0123])
    T = kin.fk(gen3, q)
    (found,) = answers(gen3, T[None], q[None], tmp_path)
    assert found["value"] == pytest.approx(q[6])
    assert len(found["rows"]) > 1
    assert found["last"] == found["free"], "whatever the posture is called"
    for value in np.radians(np.arange(-178.0, 180.0, 4.0)):
        solved = kin.solve_ik(gen3, T, q_seed=q, redundancy=value).status.value == "solved"
        assert any(low <= value <= high for low, high in found["free"]) or not solved
    seeds = np.array([[*q[:6], value] for value in np.radians(np.arange(179.3, -180.0, -9.1))])
    for each in answers(gen3, np.repeat(T[None], len(seeds), axis=0), seeds, tmp_path):
        assert each["last"] == each["free"], "whatever the posture is called"
        assert any(low <= each["held"] <= high for low, high in each["free"])


@pytest.mark.parametrize(
    "bad",
    [
        "</script><!--<script>{a1}",
        "const kernels = 0</script><script>window.evil=1</script>",
        "\nconst kernels = 0</script><script>window.evil=1</script>",
    ],
)
def test_names_of_joints_are_no_scripts(bad):
    robot = kin.get_robot("planar2r")
    joints = tuple(replace(joint, name=f"{bad}{i}") for i, joint in enumerate(robot.joints))
    solver = solver_of(replace(robot, name=bad, rows=joints))
    assert solver.about is not None
    assert solver.script == solver_of(robot).script
    assert "<!--" not in solver.script
    assert "</" not in solver.script
    assert bad in solver.about["words"]["needs"][0][0]
    page = web_page(SavedArm(replace(robot, name=bad, rows=joints), robot.q_home))
    assert bad not in page
    assert len(re.findall("</script", page, re.IGNORECASE)) == 4  # data, kernels, three.js, and the page's own


def test_an_arm_whose_kernels_cannot_be_generated_says_why_and_keeps_its_saved_postures():
    robot = kin.Robot.from_dh([(0.3 * i, 0.1, 0.3 - 0.05 * i, 0.7) for i in range(8)])
    T = kin.fk(robot, robot.q_home)
    page = web_page(SavedArm(robot, robot.q_home, target=T))
    assert "This page does not solve for targets" in page
    assert '"solver":null' in page
    assert '"postures":[{"q"' in page


def test_what_does_not_count_for_other_targets_is_said(tmp_path):
    ball = kin.Obstacle("sphere", [0.0, 0.4, 0.5], radius=0.1)
    assert "obstacles are drawn, not avoided" in kin.save_page(
        "ur5", tmp_path / "a.html", obstacles=[ball]
    ).read_text("utf-8")
    ur5 = kin.get_robot("ur5")
    page = web_page(SavedArm(ur5, ur5.q_home, options=kin.IKOptions(task="position")))
    assert "a chosen posture" in page
    assert "do not count" not in web_page(SavedArm(ur5, ur5.q_home))


@pytest.mark.parametrize("robot_id", kin.builtin_robots())
def test_a_page_is_small(robot_id):
    robot = kin.get_robot(robot_id)
    page = web_page(SavedArm(robot, robot.q_home, drawing(robot), target=kin.fk(robot, robot.q_home))).encode()
    assert len(page) < 1_000_000
    assert len(gzip.compress(page)) < 250_000
