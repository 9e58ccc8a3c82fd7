"""The generated files as users have them: what they answer, what they refuse, and what their heads say."""

from __future__ import annotations

import ctypes
import dataclasses
import json
import math
import platform
import re
import subprocess

import numpy as np
import pytest
from emitted import ROBOTS, STRICT, Built, compiled, targets
from playwright._impl._driver import compute_driver_executable

import kin
from kin.codegen import c, entries, files, js
from kin.codegen.arm import arm_of
from kin.dh.tables import convert_dh
from kin.ik.candidates import OVERRUN, ROLL, Rows
from kin.solvers import closed_form_of

QUICK_C, QUICK_JS = "ur5", "pioneer5"
X87 = ["-mfpmath=387"] if platform.machine() in ("x86_64", "AMD64") else []
UNROUNDED = ["-funsafe-math-optimizations", *X87]
ROWS = [(0.3 * i, 0.1 + 0.1 * i, 0.3 - 0.05 * i, 0.7 + 0.1 * i) for i in range(8)]
SLIDES = [
    {"kind": kind, "theta": row[0], "d": row[1], "a": row[2], "alpha": row[3]}
    for kind, row in zip(("revolute", "revolute", "prismatic") * 2, ROWS, strict=False)
]
REFUSED = {
    "eight joints": (ROWS, "solved by descents from many starts"),
    "opposite slides": (SLIDES, "made of kernels alone"),
}


def others(quick):
    return [pytest.param(i, marks=() if i == quick else pytest.mark.full) for i in ROBOTS]


@pytest.mark.parametrize("arm", REFUSED)
def test_an_arm_that_cannot_be_emitted_is_refused_with_why(arm):
    rows, why = REFUSED[arm]
    with pytest.raises(kin.InputError, match=why) as refused:
        kin.generate(kin.Robot.from_dh(rows))
    assert refused.value.field == "robot"
    assert ".py" not in str(refused.value)
    assert "/" not in str(refused.value)
    assert "\\" not in str(refused.value)


def typed(robot_id):
    """An arm whose right angles are rounded."""
    return kin.load_robot(kin.robot_to_toml(robot_id).replace("90", "89.999").replace('id = "', 'id = "typed-'))


def test_a_table_that_is_near_a_family_is_refused_and_never_emitted_as_that():
    robot = typed("puma560")
    words = r"exact numbers.*numbers near right angles or 0 exactly: alpha of .+? as -?pi/2 \(-?90°\), alpha of"
    with pytest.raises(kin.InputError, match=words) as refused:
        kin.generate(robot)
    assert str(refused.value).count("alpha of ") == sum(abs(row.alpha) > 1.0 for row in robot.rows)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_numbers_before_the_first_axis_have_not_to_be_exact(convention):
    """They only place the base."""
    robot = typed("puma560")
    if convention == "modified":
        robot = convert_dh(robot, convention)
        rows = (dataclasses.replace(robot.rows[0], a=1e-6, alpha=math.radians(89.999)), *robot.rows[1:])
    else:
        rows = (kin.Joint("stand", 0.0, 0.0, 1e-6, math.radians(89.999), "fixed"), *robot.rows)
    with pytest.raises(kin.InputError, match="exactly: alpha of") as refused:
        kin.generate(dataclasses.replace(robot, rows=rows))
    assert f" of {rows[0].name} " not in str(refused.value)


@pytest.mark.parametrize(
    ("field", "arguments"),
    [
        ("language", {"language": "fortran"}),
        ("name", {"name": "2r"}),
        ("name", {"name": "double"}),
        ("name", {"name": "a b"}),
        ("name", {"name": "function"}),
        ("name", {"name": "Math"}),
        ("name", {"name": "RangeError"}),
        ("name", {"name": 5}),
    ],
)
def test_bad_arguments_are_named(field, arguments):
    with pytest.raises(kin.InputError) as refused:
        kin.generate("planar2r", **arguments)
    assert refused.value.field == field


def test_names_in_a_file_are_made_of_the_id():
    robot = kin.get_robot("redundant7-craig")
    assert files.name_for(robot, None) == "redundant7_craig"
    assert files.name_for(robot, "left_arm") == "left_arm"


def compare(robot, answers, targets_, value):
    """Statuses, joint values and branches beside `kin.solve_ik`."""
    worst = 0.0
    for (T, seed, q), (status, found, names) in zip(zip(*targets_, strict=True), answers, strict=True):
        options = {} if value is None else {"redundancy": float(q[value])}
        expected = kin.solve_ik(robot, T, q_seed=seed, **options)
        wanted = expected.status.value
        assert status == ("unmet" if wanted in ("orientation", "unreachable") else wanted)
        if wanted == "solved" and not expected.details.infinite:
            assert len(found) == len(expected.solutions)
            worst = max([worst, *(np.abs(a - b.q).max() for a, b in zip(found, expected.solutions, strict=True))])
            if closed_form_of(robot).named:
                assert names == [files._ascii(each.branch) for each in expected.solutions]
    return worst


@pytest.mark.parametrize("robot_id", others(QUICK_C))
def test_c_answers_as_the_core_does(robot_id, tmp_path):
    robot = ROBOTS[robot_id]
    arm = arm_of(robot)
    built = compiled(arm, tmp_path, "-O0")
    branch = built.library[f"{built.name}_branch"]
    branch.restype = ctypes.c_char_p
    names = [branch(k).decode() for k in range(arm.rows)]
    given = arm.parameter.joint if arm.alone.stepped else None
    asked = targets(robot, 40, 0)
    answers = []
    for T, seed, q in zip(*asked, strict=True):
        status, found, _, branches = built.ik(T, seed, math.nan if given is None else float(q[given]))
        answers.append((status, found, [names[b] for b in branches]))
        pose, J = np.empty((4, 4)), np.empty((6, robot.n))
        assert built.call("fk", q, pose) == built.call("jacobian", q, J) == 0
        assert np.abs(pose - T).max() < 1e-14
        assert np.abs(J - kin.jacobian(robot, q)).max() < 1e-14
    assert compare(robot, answers, asked, given) < 1e-7
    assert names == [files._ascii(each) for each in arm.form.branches]
    check_refusals(built)
    check_nearest(built, asked)


def test_of_postures_equally_far_outside_the_limits_the_first_branch_is_named_first(tmp_path):
    robot, rng = kin.get_robot("stanford"), np.random.default_rng(5)
    built = compiled(arm_of(robot, closest=False), tmp_path, "-O0")
    names = [files._ascii(each) for each in built.arm.form.branches]
    tied = 0
    for q in robot.random_q(rng, 30):
        q[1] = robot.upper[1] + rng.uniform(0.1, 0.15)
        T = kin.fk(robot, q)
        expected = kin.solve_ik(robot, T)
        status, _, _, branches = built.ik(T, robot.q_home)
        assert (status, expected.status.value) == ("limits", "limits")
        assert [names[k] for k in branches] == [files._ascii(each.branch) for each in expected.blocked]
        outside = [sum(abs(v.value - v.limit) for v in each.violations) for each in expected.blocked]
        first = [k for k, each in zip(branches, outside, strict=True) if each < outside[0] + 1e-13]
        assert first == sorted(first)
        tied += len(first) > 1
    assert tied > 5


@pytest.mark.parametrize(("column", "order"), [(OVERRUN, [2, 0, 1]), (ROLL, [2, 1, 0])])
def test_rounding_does_not_decide_between_postures_outside_the_limits(column, order):
    stats, closed = np.zeros((4, 5)), np.array([True, True, True, False])
    stats[:, column] = 0.1 + 0.2, 0.3, 0.3 - 1e-11, math.nan
    rows = Rows(np.arange(4.0)[:, None], stats, closed, closed, np.empty(4, np.int64))
    assert entries._ordered(rows, column) == 3
    assert rows.order[:3].tolist() == order


def check_refusals(built: Built):
    n = built.arm.robot.n
    turned = kin.pose_from_xyz_rpy([0.1, 0.2, 0.3], [0.3, 0.5, 0.7])
    assert built.ik(turned + np.diag([9e-7 / 2.0, 0.0, 0.0, 0.0]), np.zeros(n))[0] != "invalid"
    for T, seed in (
        (np.round(turned, 4), np.zeros(n)),
        (np.full((4, 4), math.nan), np.zeros(n)),
        (2.0 * np.eye(4), np.zeros(n)),
        (np.eye(4), np.full(n, math.inf)),
    ):
        assert built.ik(T, seed)[0] == "invalid"
    assert built.call("fk", np.full(n, math.nan), np.empty((4, 4))) == -1


def check_nearest(built: Built, asked):
    robot, one = built.arm.robot, type(built.found[0])()
    for T, seed in list(zip(*asked[:2], strict=True))[:2]:
        far = T.copy()
        far[:3, 3] += 3.0 * robot.reach
        status = built.call("nearest", far, seed, ctypes.c_bool(True), ctypes.byref(one))
        expected = kin.solve_ik(robot, far, q_seed=seed)
        assert status == 5
        if robot.revolute.all():  # a slide might reach it, outside its limits
            assert expected.status.value == "unreachable"
            assert one.s[0] == pytest.approx(expected.distance, abs=1e-6)
        assert built.call("nearest", T, seed, ctypes.c_bool(False), ctypes.byref(one)) == 0
        assert max(one.s[0], one.s[1]) < 1e-9
        status = built.call("nearest", T, seed, ctypes.c_bool(True), ctypes.byref(one))
        assert one.s[0] < 1e-7
        assert status == (0 if max(one.s[0], one.s[1]) <= 1e-9 else 4)


@pytest.mark.parametrize("robot_id", others(QUICK_JS))
def test_javascript_answers_as_the_core_does(robot_id, tmp_path):
    robot = ROBOTS[robot_id]
    arm = arm_of(robot)
    given = arm.parameter.joint if arm.alone.stepped else None
    T, seeds, q = targets(robot, 40, 0)
    (tmp_path / "arm.js").write_text(kin.generate(robot, "js", name="arm"))
    (tmp_path / "asked.json").write_text(json.dumps({"T": T.tolist(), "seeds": seeds.tolist(), "q": q.tolist()}))
    ask = "arm.ik(T, seeds[i])" if given is None else f"arm.ik_at(T, q[i][{given}], seeds[i])"
    run = f"""
const arm = require("./arm.js"), {{ T: poses, seeds, q }} = require("./asked.json");
const far = poses[0].map((row, r) => row.map((x, c) => (c === 3 && r < 3 ? x + 50 : x)));
const refused = [];
const scaled = far.map((row) => row.map((x) => 2 * x));
for (const [T, seed] of [[poses[0], [1]], [[[NaN]], seeds[0]], [scaled, seeds[0]]])
  try {{ arm.ik(T, seed); }} catch (error) {{ refused.push(error.message); }}
console.log(JSON.stringify({{
  answers: poses.map((T, i) => {ask}), fk: q.map((each) => arm.fk(each)), J: arm.jacobian(q[0]),
  near: arm.nearest(far, seeds[0], true), met: arm.nearest(poses[0], seeds[0]), refused,
}}));
"""
    (tmp_path / "run.js").write_text(run)
    command = [compute_driver_executable()[0], "run.js"]
    done = json.loads(subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True).stdout)
    answers = [
        (each["status"], [np.array(s["q"]) for s in each["solutions"]], [s["branch"] for s in each["solutions"]])
        for each in done["answers"]
    ]
    assert compare(robot, answers, (T, seeds, q), given) < 1e-7
    assert np.abs(np.array(done["fk"]) - T).max() < 1e-14
    assert np.abs(np.array(done["J"]) - kin.jacobian(robot, q[0])).max() < 1e-14
    assert done["near"]["status"] == "unreachable"
    assert done["met"]["status"] == "solved"
    assert len(done["refused"]) == 3
    assert "with a rotation within 1e-6" in done["refused"][2]


def test_a_heap_that_overflows_is_an_error_of_its_own_and_leaves_the_solver_working(tmp_path):
    text = kin.generate("pioneer5", "js", name="arm", closest=False)
    text = text.replace(f"Float64Array({js.SIZE})", "Float64Array(800)")
    (tmp_path / "arm.js").write_text(text)
    run = """
const arm = require("./arm.js"), said = [];
for (let k = 0; k < 3; k++) {
  const T = arm.fk([0.3, 0.8, 0.1, 0.2, 0.3]);
  said.push(T[0][3].toFixed(9));
  try { arm.ik(T, [0, 0, 0, 0, 0]); } catch (error) { said.push(error.constructor.name + ": " + error.message); }
}
console.log(JSON.stringify(said));
"""
    command = [compute_driver_executable()[0], "-e", run]
    done = json.loads(subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True).stdout)
    assert done[::2] == [f"{kin.fk('pioneer5', [0.3, 0.8, 0.1, 0.2, 0.3])[0, 3]:.9f}"] * 3
    assert [each.partition(":")[0] for each in done[1::2]] == ["RangeError"] * 3
    assert "more memory" in done[1]


def test_javascript_reads_typed_arrays_and_refuses_what_is_no_number(tmp_path):
    (tmp_path / "arm.js").write_text(kin.generate("planar2r", "js", name="arm", closest=False))
    run = """
const arm = require("./arm.js"), T = arm.fk([0.3, 0.8]), seed = [0.1, 0.1];
const given = [T, T.map((row) => Float64Array.from(row)), Float64Array.from(T.flat()), T.flat()];
const bad = [null, "", "0", [], [1], true, undefined, {}, 1n].map((x) => [x, 0.1]);
const poses = [[null, ...T.slice(1)], [[null, ...T[0].slice(1)], ...T.slice(1)], null, "T"];
const said = (call) => { try { return call() && "answered"; } catch (error) { return error.message; } };
const refused = bad.flatMap((q) => [said(() => arm.fk(q)), said(() => arm.ik(T, q))]);
refused.push(...poses.map((T) => said(() => arm.ik(T, seed))));
console.log(JSON.stringify({ answers: given.map((T) => arm.ik(T, seed).solutions.length), refused }));
"""
    command = [compute_driver_executable()[0], "-e", run]
    done = json.loads(subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True).stdout)
    assert done["answers"] == [1] * 4
    assert len(done["refused"]) == 22
    assert all(re.match(r"(q|T|seed): ", each) for each in done["refused"]), done["refused"]


def test_large_arrays_are_in_a_buffer_of_the_caller_s_unless_they_are_few():
    sizes = {"double": 8, "int64_t": 8, "cplx": 16, "bool": 1}
    for robot_id, bytes_, closest in (("iiwa14", 30_000, False), ("planar2r", 4096, True), ("planar2r", 0, False)):
        text = kin.generate(robot_id, "c", closest=closest)
        here = re.findall(r"^  (double|int64_t|cplx|bool) room\d+\[(\d+)\];$", text, re.MULTILINE)
        assert max(sizes[kind] * int(count) for kind, count in here) <= 512
        buffer = re.search(r"double numbers\[(\d+)\];\n  int64_t wholes\[(\d+)\];\n}", text)
        assert (buffer is not None) == (f"{robot_id}_scratch" in text) == (bytes_ > 0)
        if buffer:
            assert bytes_ < 8 * int(buffer[1]) == 8 * int(buffer[2]) < 4 * bytes_


def test_an_es_module_and_its_types_name_the_same_functions():
    module, types = (kin.generate("iiwa14", language) for language in ("mjs", "d.ts"))
    assert "export { iiwa14 };\nexport default iiwa14;\n" in module
    for name in ("fk", "jacobian", "ik", "ik_at", "intervals", "nearest"):
        assert f"  {name}: entry(" in module
        assert f"  {name}(" in types
    assert "nearest(" not in kin.generate("iiwa14", "d.ts", closest=False)


@pytest.mark.parametrize(
    "robot_id", ["iiwa14", *(pytest.param(i, marks=pytest.mark.full) for i in ("panda", "xarm7", "redundant7"))]
)
def test_the_intervals_of_a_redundancy_parameter_are_those_of_the_core(robot_id, tmp_path):
    robot = kin.get_robot(robot_id)
    built = compiled(arm_of(robot, closest=False), tmp_path, "-O0")
    count, out = ctypes.c_int(), np.empty((files._INTERVALS, 3))
    for T, seed in list(zip(*targets(robot, 12, 0)[:2], strict=True)):
        assert built.call("intervals", T, seed, out, ctypes.byref(count)) == 0
        found = {built.arm.form.branches[int(row)]: [] for row, _, _ in out[: count.value]}
        for row, low, high in out[: count.value].tolist():
            found[built.arm.form.branches[int(row)]].append((low, high))
        for solution in kin.solve_ik(robot, T, q_seed=seed).solutions:
            expected = solution.redundancy[0].intervals
            assert np.allclose(found[solution.branch], expected, atol=1e-9)


@pytest.mark.full
@pytest.mark.parametrize("robot_id", ["gen3", "sawyer"])
def test_a_joint_without_intervals_is_at_the_first_step_from_the_seed_with_a_solution(robot_id, tmp_path):
    robot = kin.get_robot(robot_id)
    built, step = compiled(arm_of(robot, closest=False), tmp_path, "-O1"), math.pi / entries.HALF_TURN
    joint, moved = built.arm.parameter.joint, 0
    for T, seed in list(zip(*targets(robot, 20, 0)[:2], strict=True)):
        status, found, *_ = built.ik(T, seed)
        assert status == "solved"
        value = float(found[0, joint])
        again = kin.solve_ik(robot, T, q_seed=seed, redundancy=value).solutions
        assert np.allclose(found, [each.q for each in again], atol=1e-7)
        steps = round(abs(value - seed[joint]) / step)
        assert abs(value - seed[joint]) == pytest.approx(steps * step)
        moved += steps > 0
        for k in range(1 - steps, steps):
            at = float(seed[joint] + k * step)
            assert built.ik(T, seed, at)[0] != "solved" or not robot.lower[joint] <= at <= robot.upper[joint]
    assert moved > 1
    stretched = np.zeros(robot.n)  # the formulas miss it for one of these arms
    status, found, *_ = built.ik(kin.fk(robot, stretched), stretched)
    assert status == "solved"
    assert np.array_equal(found[0], stretched)
    far = T + 9.0 * np.eye(4, k=3)
    assert built.ik(far, seed)[0] == "unmet"


@pytest.mark.parametrize("language", ["c", "js", "d.ts"])
def test_names_of_arms_and_joints_stay_in_their_comment(language):
    hostile = 'a\nint evil;\r\u2028b\\??/ */ "'
    robot = kin.get_robot("planar2r")
    rows = (dataclasses.replace(robot.rows[0], name=hostile), *robot.rows[1:])
    text = kin.generate(dataclasses.replace(robot, name=hostile, rows=rows), language)
    found = [line for line in text.splitlines() if "evil" in line]
    assert len(found) == 2
    for line in found:
        assert line.startswith("// ")
        assert line.isascii()
        assert "\\" not in line
        assert "??" not in line


def test_what_would_make_wrong_answers_is_an_error_of_the_compiler(tmp_path):
    narrow = c.RUNTIME.replace("#include <math.h>", "#undef DBL_MANT_DIG\n#define DBL_MANT_DIG 24", 1)
    nan = 'without -ffast-math and -ffinite-math-only"'
    file = tmp_path / "runtime.c"
    for text, option, words in (
        (c.RUNTIME, "-ffast-math", nan),
        (c.RUNTIME, "-ffinite-math-only", nan),
        (narrow, "-O1", '#error "double must have 64 bits"'),
        (c.RUNTIME, "-O1", ""),
    ):
        file.write_text(text)
        command = ["gcc", "-std=c99", "-fsyntax-only", option, file]
        done = subprocess.run(command, capture_output=True, text=True)
        assert (done.returncode != 0) == bool(words)
        assert words in done.stderr


@pytest.mark.parametrize(
    ("defined", "fused"),
    [
        ([], False),
        (["-D__FMA__"], True),
        (["-D__ARM_FEATURE_FMA", "-D__ARM_FP=6"], False),  # a Cortex-M4
        (["-D__ARM_FEATURE_FMA", "-D__ARM_FP=14"], True),
    ],
)
def test_operations_are_fused_where_the_processor_does_so_in_double(defined, fused, tmp_path):
    file = tmp_path / "runtime.c"
    file.write_text(c.RUNTIME)
    none = ["-U__FP_FAST_FMA", "-U__FMA__", "-U__ARM_FEATURE_FMA", "-U__ARM_FP"]
    command = ["gcc", "-std=c99", "-E", *none, *defined, file]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert ("return fma(a, b, c)" in done.stdout) == fused


@pytest.mark.full
@pytest.mark.parametrize("robot_id", ["pioneer5", "irb120", "panda", "redundant7-craig"])
def test_vectors_check_the_file_and_notice_a_wrong_one(robot_id, tmp_path):
    text = kin.generate(robot_id, "c", name="arm")
    (tmp_path / "arm_test.c").write_text(kin.generate(robot_id, "c-test", name="arm"))
    wrong = text.replace("to->q[j] = q[j]", "to->q[j] = q[j] + 1e-3")
    for source, code in ((text, 0), (wrong, 1)):
        (tmp_path / "arm.c").write_text(source)
        command = ["gcc", "-std=c99", "-O1", *STRICT, "arm_test.c", "-o", "check", "-lm"]
        subprocess.run(command, cwd=tmp_path, check=True)
        done = subprocess.run(["./check"], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == code
        assert ("50 of 50 poses are right" in done.stdout) == (code == 0)


@pytest.mark.full
@pytest.mark.parametrize("option", UNROUNDED)
def test_sums_that_are_not_rounded_one_by_one_change_no_answer(option, tmp_path):
    (tmp_path / "arm.c").write_text(kin.generate("ur5", "c", name="arm"))
    (tmp_path / "arm_test.c").write_text(kin.generate("ur5", "c-test", name="arm"))
    command = ["gcc", "-std=gnu99", "-O2", option, "arm_test.c", "-o", "check", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run(["./check"], cwd=tmp_path, capture_output=True, text=True)
    assert "50 of 50 poses are right" in done.stdout


@pytest.mark.parametrize("language", ["c", "d.ts"])
def test_all_configurations_are_claimed_only_where_there_is_no_continuum_of_them(language):
    claims = (
        "All configurations of a pose",
        "One configuration of each branch, at the value of",
        "at one value of theta7",
    )
    for robot_id, found in (("ur5", "all"), ("iiwa14", "one"), ("gen3", "stepped")):
        text = kin.generate(robot_id, language, closest=False)
        there = [words in text for words in claims]
        assert there == [found == "all", found == "one", found == "stepped"]
        assert ("at this value" in text) == (found != "all")
        assert ("Nor all configurations" in text) == (found != "all")
        assert "there is none" in text
        assert "the limits, nearest to the seed first." in text


def test_a_head_says_what_is_promised_and_what_not():
    text = kin.generate("crx10ia", "c")
    head = text.partition("#ifndef")[0]
    limits = "Nor that the list is complete"
    for words in ("MIT License", "Promised:", "Not promised:", limits, kin.__version__, "-DCRX10IA_EXAMPLE"):
        assert words in head
    assert "rotations must have R^T R = I within 1e-6" in head
    assert "rounded beyond 1e-9 is approximate at best" in kin.generate("pioneer5", "d.ts")
    assert "rounded beyond 1e-9" not in head
    assert all(len(line) <= 115 for line in head.splitlines())
    assert head.isascii()
