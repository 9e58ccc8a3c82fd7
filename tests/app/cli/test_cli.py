"""The command line: what it prints, and with which exit code it ends."""

import csv
import gc
import importlib.util
import inspect
import json
import math
import pkgutil
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import get_args
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from live_server import LISTENING
from zips import COLLISIONS, announced, robot_files

import kin
from app.cli import parser
from app.cli.bodies import MeshesBeside
from app.exports import progress
from app.exports.formats import FORMATS, encode
from app.shared.clouds import Cloud, Clouds
from app.shared.settings import Settings
from kin.codegen import vectors
from kin.solvers import closed_form_of
from kin.workspace import STRATEGIES, Measure

ROOT = Path(__file__).parents[3]
PIONEER = kin.get_robot("pioneer5")
FAR = kin.solve_ik(PIONEER, [2.0, 0.0, 0.0], task="position").distance


def run(capsys, *words):
    """Exit code, standard output and standard error of one command."""
    code = parser.main([str(word) for word in words])
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    return code, out, err


def answer(capsys, *words, code=0):
    got, out, err = run(capsys, *words, "--json")
    assert (got, err) == (code, "")
    return json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


SLIM = """
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("pydantic", "fastapi", "uvicorn", "viser", "msgspec", "trimesh"):
            raise ModuleNotFoundError(name, name=name)

sys.meta_path.insert(0, Missing())
from app.cli.parser import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.full
@pytest.mark.parametrize("command", ["serve", "robots"])
def test_without_its_dependencies_a_command_says_what_to_install(command):
    done = subprocess.run(
        [sys.executable, "-c", SLIM, command], cwd=ROOT, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert re.match(rf"kinboard: `kinboard {command}` needs \w+, which is not installed\. ", done.stderr)
    assert "`pip install .`" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_module_of_kinboard_that_is_missing_is_a_fault_and_no_advice(monkeypatch):
    monkeypatch.setitem(sys.modules, "app.cli.robots", None)
    with pytest.raises(ModuleNotFoundError):
        parser.main(["robots"])


# -- arguments -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("option", "choices"),
    [("--measure", get_args(Measure)), ("--strategy", STRATEGIES), ("--format", tuple(FORMATS))],
)
def test_the_choices_of_a_cloud_are_those_of_the_core(capsys, option, choices):
    """They are written out in the parser, which starts without importing the core."""
    code, _, err = run(capsys, "workspace", "pioneer5", option, "nonsense")
    assert code == 2
    assert set(re.findall(r"\w+", err.partition("choose from")[2])) == set(choices)


# -- fk --------------------------------------------------------------------------------------------------------


def test_fk_reads_degrees_and_answers_as_rest_does(capsys, client):
    q = [math.radians(x) for x in (90, 30, 60, 30, 30)]
    got = answer(capsys, "fk", "pioneer5", 90, 30, 60, 30, 30, "--frames")
    assert got == client.post("/api/v1/robots/pioneer5/fk", json={"q": q, "frames": True}).json()
    assert got["pose"]["matrix"] == kin.fk(PIONEER, q).tolist()


TABLE = "table=100:200:-300:0:0:90"


def test_poses_in_the_frame_of_a_workpiece_are_those_of_rest(capsys, client):
    asked = {"workpieces": {"table": {"xyz": [0.1, 0.2, -0.3], "rpy": [0, 0, math.pi / 2]}}}
    q = [math.radians(x) for x in (90, 30, 60, 30, 30)]
    got = answer(capsys, "fk", "pioneer5", 90, 30, 60, 30, 30, "--frame", "table", "--workpiece", TABLE)
    assert got == client.post("/api/v1/robots/pioneer5/fk", json={"q": q, "frame": "table", **asked}).json()
    place = [1000 * x for x in got["pose"]["position"]]
    where = ("--frame", "table", "--workpiece", TABLE)
    found = answer(capsys, "ik", "pioneer5", "--position", *place, "--wxyz", *got["pose"]["wxyz"], *where)
    assert np.allclose(kin.fk(PIONEER, found["solutions"][0]["q"]), kin.fk(PIONEER, q), atol=1e-9)
    assert "in the frame table:" in run(capsys, "fk", "pioneer5", 90, 30, 60, 30, 30, *where)[1]


def test_a_target_in_the_frame_of_the_tool_is_a_step_from_the_seed(capsys):
    seed = (0, -90, 90, 0, 90, 0)
    step = ("--position", 0, 0, 30, "--wxyz", 1, 0, 0, 0, "--frame", "tool", "--seed", *seed)
    found = answer(capsys, "ik", "ur5", *step)
    ur5 = kin.get_robot("ur5")
    expected = kin.fk(ur5, np.radians(seed)) @ kin.pose_from_xyz_rpy([0, 0, 0.03])
    assert np.allclose(kin.fk(ur5, found["solutions"][0]["q"]), expected, atol=1e-9)


def test_fk_in_radians(capsys):
    got = answer(capsys, "fk", "pioneer5", 1.5, 0.5, 1, 0.5, 0.5, "--rad")
    assert got["pose"]["matrix"] == kin.fk(PIONEER, [1.5, 0.5, 1, 0.5, 0.5]).tolist()


@pytest.mark.parametrize(
    "words",
    [
        ("-90", "-.5", "-1e-3", "−10", "+5"),
        ("-90.", "-0.5", "-1E-3", "-1e1", "5"),
        ("-pi/2", "-0,5", "-1/1000", "-(5+5)", "5deg"),
        ("-π/2 rad", "-0.5°", "-1e-3 deg", "-20/2", "5"),
    ],
)
def test_negative_numbers_are_numbers(capsys, words):
    q = np.radians([-90, -0.5, -0.001, -10, 5])
    assert np.allclose(answer(capsys, "fk", "pioneer5", *words)["pose"]["matrix"], kin.fk(PIONEER, q), atol=1e-15)


def test_fk_for_people_is_in_degrees_and_millimetres(capsys):
    code, out, err = run(capsys, "fk", "pioneer5", 90, 30, 160, 30, 30, "--frames")
    assert (code, err) == (0, "")
    x, y, z = kin.fk(PIONEER, np.radians([90, 30, 160, 30, 30]))[:3, 3] * 1e3
    tool = next(line for line in out.splitlines() if line.startswith("tool"))
    assert [float(word) for word in tool.split()[1:4]] == pytest.approx([x, y, z], abs=5e-4)
    assert re.search(r"^pivoting elbow +160\.000° +0\.000° … 150\.000° +outside limits$", out, re.MULTILINE)
    assert re.search(r"^rotating elbow +30\.000° +0\.000° … 150\.000°$", out, re.MULTILINE)
    assert all(f"\n{row.name} " in out for row in PIONEER.rows)


def test_a_sliding_joint_is_typed_in_millimetres(capsys, tmp_path):
    (tmp_path / "slider.toml").write_text(
        'id = "slider"\nname = "Slider"\nsource = "this test"\nconvention = "standard"\n'
        'units = { length = "mm", angle = "deg" }\n'
        '[[rows]]\nname = "turn"\na = 100\n[[rows]]\nname = "slide"\nkind = "prismatic"\nlimits = [0, 250]\n',
        encoding="utf-8",
    )
    got = answer(capsys, "fk", "slider", 90, 120, "--robots", tmp_path)
    assert got["pose"]["position"] == pytest.approx([0, 0.1, 0.12], abs=1e-15)
    code, out, _ = run(capsys, "fk", "slider", 90, 120, "--robots", tmp_path)
    assert code == 0
    assert re.search(r"^slide +120\.000 mm +0\.000 mm … 250\.000 mm$", out, re.MULTILINE)
    assert "slider" in run(capsys, "robots", "--robots", tmp_path)[1]


# -- ik --------------------------------------------------------------------------------------------------------


def test_ik_leads_back_to_the_pose_fk_printed(capsys):
    T = kin.fk(PIONEER, np.radians([80, 30, 50, 30, 25]))
    where = [f"{x * 1e3:.9f}" for x in T[:3, 3]]
    got = answer(capsys, "ik", "pioneer5", "--position", *where, "--approach", *T[:3, 2])
    assert got["task"] == "approach"
    assert got["status"] == "solved"
    assert np.allclose(np.degrees(got["solutions"][0]["q"]), [80, 30, 50, 30, 25], atol=1e-6)


def test_ik_prints_degrees_and_says_reached(capsys):
    words = ("--position", 45, 191, -211, "--approach", -0.31, -0.164, -0.936)
    code, out, err = run(capsys, "ik", "pioneer5", *words)
    assert (code, err) == (0, "")
    assert out.startswith("Reached")
    typed = re.findall(r"(-?\d+\.\d+)°", out.splitlines()[-1])[:5]
    T = kin.fk(PIONEER, np.radians([float(x) for x in typed]))
    assert T[:3, 3] * 1e3 == pytest.approx([45, 191, -211], abs=0.02)
    assert "shoulder front" in out


def test_ik_with_options_asks_the_core_the_same(capsys):
    robot = kin.get_robot("redundant7-craig")
    T = kin.fk(robot, robot.q_home)
    wxyz = kin.transforms.wxyz_from_rotation(T[:3, :3])
    seed = (10, 20, 0, 60, 0, 40, -90)
    options = ("--wxyz", *wxyz, "--seed", *seed, "--redundancy", -20, "--all", "--ignore-limits")
    got = answer(capsys, "ik", robot.id, "--position", *(T[:3, 3] * 1e3), *options)
    result = kin.solve_ik(robot, T, q_seed=np.radians(seed), redundancy=math.radians(-20), respect_limits=False)
    assert len(got["solutions"]) == len(result.solutions) > 1
    assert np.allclose([s["q"] for s in got["solutions"]], result.q, atol=1e-9)
    code, out, _ = run(capsys, "ik", robot.id, "--position", *(T[:3, 3] * 1e3), *options)
    assert code == 0
    assert f"{result.redundancy[0].label} = -20.000°" in out
    one = answer(capsys, "ik", robot.id, "--position", *(T[:3, 3] * 1e3), *options[:-2], "--max-solutions", 1)
    assert len(one["solutions"]) == 1


@pytest.mark.parametrize(
    ("words", "options"),
    [
        (("--branch", "elbow positive", "--branch", "seed"), {"branch": ["elbow positive", "seed"]}),
        (("--lock", "7=-30"), {"locked": [None] * 6 + [math.radians(-30)]}),
        (("--limit", "2=0:60", "--limit", "4=-100:100"), {"limits": {1: (0, 60), 3: (-100, 100)}}),
        (("--images", "all"), {"images": "all"}),
        (("--prefer", "limits"), {"prefer": "limits"}),
        (("--redundancy", "psi=20"), {"redundancy": {"psi": math.radians(20)}}),
        (("--mask", "x", "y", "z", "rz", "--mask-frame", "base"), {"mask": [True] * 3 + [False] * 2 + [True]}),
    ],
    ids=lambda words: words[0] if isinstance(words, tuple) else "",
)
def test_every_option_of_ik_reaches_the_core(capsys, words, options):
    robot = kin.get_robot("redundant7-craig")
    T = kin.fk(robot, robot.q_home)
    wxyz = kin.transforms.wxyz_from_rotation(T[:3, :3])
    if "limits" in options:
        options = {"limits": [np.radians(options["limits"][i]) if i in (1, 3) else None for i in range(7)]}
    if "mask" in options:
        options["mask_frame"] = "base"
    got = answer(capsys, "ik", robot.id, "--position", *(T[:3, 3] * 1e3), "--wxyz", *wxyz, "--all", *words)
    result = kin.solve_ik(robot, T, **options)
    assert len(got["solutions"]) == len(result.solutions) > 0
    assert np.allclose([s["q"] for s in got["solutions"]], result.q, atol=1e-6)


def test_blocked_branches_are_printed_with_what_they_need(capsys):
    words = ("ik", "pioneer5", "--position", 45, 191, 100, "--approach", 0, 0, 1)
    code, out, _ = run(capsys, *words)
    assert code == 1
    result = answer(capsys, *words, code=1)
    assert len(result["blocked"]) > 1
    for branch in result["blocked"]:
        (line,) = [x for x in out.splitlines() if x.startswith(branch["branch"])]
        for v in branch["violations"]:
            value, limit = math.degrees(v["value"]), math.degrees(v["limit"])
            assert f"q{v['joint'] + 1} = {value:.3f}° (limit {limit:.3f}°)" in line


def test_postures_without_names_are_numbered_as_they_are_listed(capsys):
    """Their numbers count all that the solver found, also those outside the limits."""
    words = ("ik", "crx10ia", "--position", 400, 100, 300, "--wxyz", 0, 1, 0, 0, "--all", "--limit")
    code, out, _ = run(capsys, *words, "3=-45:0")
    assert code == 0
    found = answer(capsys, *words, "3=-45:0")["solutions"]
    assert max(int(each["branch"].split()[1]) for each in found) > len(found)
    assert "solution" not in out
    assert [line.split()[0] for line in out.splitlines()[3:]] == [str(k + 1) for k in range(len(found))]
    code, out, _ = run(capsys, *words, "3=0:90")
    assert code == 1
    assert "solution" not in out
    assert [line.split()[0] for line in out.splitlines()[-2:]] == ["11", "12"]


@pytest.mark.parametrize(
    ("position", "extra", "status", "said"),
    [
        ((2000, 0, 0), (), "unreachable", f"by {1e3 * FAR:.1f} mm"),
        ((45, 191, 100), ("--approach", 0, 0, 1), "limits", "pivoting wrist"),
        ((45, 191, -211), ("--wxyz", 0, 0.9, 0.4, -0.2), "approximate", "5 joints"),
    ],
)
def test_no_exact_answer_is_exit_code_1_and_a_reason(capsys, position, extra, status, said):
    words = ("ik", "pioneer5", "--position", *position, *extra)
    assert answer(capsys, *words, code=1)["status"] == status
    code, out, err = run(capsys, *words)
    assert (code, err) == (1, "")
    assert said in out


def test_a_target_typed_in_metres_is_pointed_out(capsys):
    _, _, err = run(capsys, "ik", "pioneer5", "--position", 0.045, 0.191, -0.211)
    assert "millimetres" in err
    assert run(capsys, "ik", "pioneer5", "--position", 0.045, 0.191, -0.211, "--rad")[::2] == (0, "")


# -- robots and the rest ---------------------------------------------------------------------------------------


def test_robots_lists_all_and_describes_one(capsys, client):
    code, out, _ = run(capsys, "robots")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()[1:]] == list(kin.builtin_robots())
    assert answer(capsys, "robots") == client.get("/api/v1/robots").json()
    assert answer(capsys, "robots", "redundant7") == client.get("/api/v1/robots/redundant7").json()
    code, out, _ = run(capsys, "robots", "pioneer5")
    assert re.search(
        r"^rotating base +revolute +0\.000° +130\.000 +70\.000 +-90\.000° +0\.000° … 180\.000°$", out, re.M
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("fk", "puma", 1), "expected one of pioneer5"),
        (("fk", "pioneer5", 1, 2), "one for each of: rotating base"),
        (
            ("fk", "pioneer5", 1, 2, 3, 4, "x"),
            "q[4]: “x” is not a number (unknown: x); valid: a number such as -90 or pi/2; units: °, deg, rad",
        ),
        (("fk", "pioneer5", 1, 2, 3, 4, "nan"), "“nan” is not a number"),
        (("fk", "pioneer5", 1, 2, 3, 4, "-inf"), "“-inf” is not a number"),
        (("fk", "pioneer5", 1, 2, 3, 4, "1e308"), "too large"),
        (("fk", "pioneer5", 1, 2, 3, 4, "5mm"), "is not a unit of an angle"),
        (("ik", "pioneer5", "--position", "1,300", 2, 3), "--position: “1,300” may be written with thousands"),
        (("fk", "pioneer5"), "5 joint values, or --configurations FILE"),
        (("ik", "pioneer5"), "--position"),
        (("ik", "pioneer5", "--position", 1, 2), "expected 3 arguments"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--wxyz", 0, 0, 0, 0), "this one is zero"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--approach", 0, 0, 0), "not zero"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--task", "pose"), "--wxyz"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--task", "approach"), "--approach"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--seed", 1), "--seed"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--lock", "9=1"), "a joint from 1 to 5"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--lock", "1=1:2"), "JOINT=VALUE"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--limit", "1=5"), "JOINT=LOWER:UPPER"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--limit", "1=5:x"), "--limit: “x” is not a number"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--branch", "sideways"), "elbow positive"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--mask", "rx"), "--wxyz"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--mask", "x", "--task", "pose"), "no --task together"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--frame", "tool"), "--seed as well"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--frame", "table"), "one of world, base, tool"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--workpiece", "table=1:2"), "NAME=X:Y:Z"),
        (("ik", "pioneer5", "--position", 1, 2, 3, "--workpiece", "base=1:2:3"), "names other than world"),
        (("fk", "pioneer5", 1, 2, 3, 4, 5, "--frame", "tool"), "world, base or a workpiece"),
        (("robots", "puma"), "expected one of pioneer5"),
        (("robots", "--robots", "/no/such/folder"), "existing folder"),
        (("dance",), "invalid choice: 'dance'"),
        (("serve", "--port", "http"), "invalid whole number value"),
        (("serve", "--port", "８０００"), "invalid whole number value"),
        (("serve", "--workers", "9" * 5000), "invalid whole number value"),
        (("ik", "pioneer5", "--position", 100, 200, 300, "--lock", "２=30"), "a joint from 1 to 5"),
        (("serve", "--port", "99999"), "--port or KINBOARD_PORT: got 99999"),
    ],
)
def test_bad_input_is_exit_code_2_and_one_clear_message(capsys, words, said):
    code, out, err = run(capsys, *words)
    assert (code, out) == (2, "")
    assert said in err
    assert len(err.splitlines()) <= 6


def test_a_bad_environment_variable_is_named(capsys, monkeypatch):
    monkeypatch.setenv("KINBOARD_MAX_BATCH", "-1")
    code, _, err = run(capsys, "serve")
    assert code == 2
    assert "KINBOARD_MAX_BATCH: got '-1'" in err


def test_a_token_that_is_too_short_is_not_printed(capsys, monkeypatch):
    monkeypatch.setenv("KINBOARD_TOKEN", "hunter2")
    code, out, err = run(capsys, "serve")
    assert code == 2
    assert "KINBOARD_TOKEN" in err
    assert "at least 8" in err
    assert "hunter2" not in out + err


@pytest.mark.parametrize("name", ["CORS_ORIGINS", "ALLOWED_ORIGINS", "ALLOWED_HOSTS"])
@pytest.mark.parametrize(
    ("value", "names"),
    [
        ("http://x", ("http://x",)),
        ("http://x, https://y:1 ,", ("http://x", "https://y:1")),
        ('["http://x", "https://y"]', ("http://x", "https://y")),
        ("", ()),
        ("[]", ()),
    ],
)
def test_a_list_is_written_with_commas_or_in_json(served, monkeypatch, name, value, names):
    monkeypatch.setenv(f"KINBOARD_{name}", value)
    assert parser.main(["serve"]) == 0
    assert getattr(served[0][0], name.lower()) == names


@pytest.mark.parametrize("value", ["[http://x]", '["http://x"', "[1, 2]", "[[]]"])
def test_a_list_that_cannot_be_read_is_named(capsys, monkeypatch, value):
    monkeypatch.setenv("KINBOARD_CORS_ORIGINS", value)
    code, _, err = run(capsys, "serve")
    assert code == 2
    assert "kinboard: KINBOARD_CORS_ORIGINS: got " in err
    assert "Traceback" not in err


@pytest.fixture
def served(monkeypatch):
    """What the command line would have served, instead of serving it."""
    import app.service.main

    calls = []
    monkeypatch.setattr(
        app.service.main, "run", lambda settings, open_browser: calls.append((settings, open_browser)) or 0
    )
    return calls


@pytest.mark.parametrize("words", [(), ("serve",)])
def test_serving_is_the_default(served, words):
    assert parser.main(words) == 0
    assert served == [(Settings(), False)]


@pytest.mark.parametrize("first", [(), ("serve",)])
def test_flags_reach_the_settings_and_win_over_the_environment(served, monkeypatch, first, tmp_path):
    monkeypatch.setenv("KINBOARD_PORT", "1234")
    monkeypatch.setenv("KINBOARD_HOST", "0.0.0.0")
    words = (*first, "--port", "0", "--open", "--root-path", "/arms", "--robots", str(tmp_path))
    assert parser.main(words) == 0
    settings, opened = served[0]
    assert (settings.port, settings.host, settings.root_path, settings.robots) == (0, "0.0.0.0", "/arms", tmp_path)
    assert opened is True


def test_the_ways_out_of_a_singularity_are_printed(capsys):
    words = ("singularity", "ur5e", 20, -70, 80, -40, 0, 10)
    code, out, _ = run(capsys, *words)
    found = kin.leave_singularity("ur5e", np.radians(words[2:]))
    assert code == 0
    assert out.startswith(found.reason + "\n")
    rows = out.split("\n\n")[1].splitlines()[-len(found.exits) :]
    for row, each in zip(rows, found.exits, strict=True):
        numbers = [float(x) for x in re.findall(r"(-?[\d.]+)°", row)]
        assert numbers == pytest.approx(np.degrees(each.q[-1]), abs=1e-3)
    assert answer(capsys, *words)["exits"][0]["posture"] == found.exits[0].posture
    assert run(capsys, "singularity", "ur5e", 0, -90, 90, -90, 90, 0)[0] == 0
    assert answer(capsys, *words, "--margin", "0.9", code=1)["cause"]["code"] == "margin"
    code, _, err = run(capsys, *words, "--margin", "wide")
    assert code == 2
    assert "--margin" in err


def test_the_ways_out_may_be_as_the_pendant_shows_them(capsys):
    """FANUC counts J3 from the horizontal; the sentences are about the joint values of the table."""
    shown = [0, 30, 20, 0, 0, 0]
    words = ("singularity", "lrmate200id", *shown, "--pendant")
    found = kin.leave_singularity("lrmate200id", kin.motors.from_pendant("lrmate200id", np.radians(shown)))
    code, out, _ = run(capsys, *words)
    assert code == 0
    sentence, note = out.split("\n\n")[0].splitlines()
    assert sentence == found.reason
    assert note == "The sentences count joint values of the table; the rows below are as on the pendant."
    ends = [kin.motors.to_pendant("lrmate200id", each.q) for each in found.exits]
    row = out.split("\n\n")[1].splitlines()[-len(ends)]
    assert [float(x) for x in re.findall(r"(-?[\d.]+)°", row)] == pytest.approx(np.degrees(ends[0][-1]), abs=1e-3)
    for each, said, end in zip(found.exits, answer(capsys, *words)["exits"], ends, strict=True):
        assert np.allclose(said["q"], each.q)
        assert np.allclose(said["pendant"], end)
    plain = ("singularity", "ur5e", 20, -70, 80, -40, 0, 10)  # its pendant shows the table's values
    assert run(capsys, *plain, "--pendant") == run(capsys, *plain)


def test_each_row_of_the_commands_is_named_as_the_command():
    assert [name for name in parser.subcommands() if " " not in name] == [each.name for each in parser.COMMANDS]


def test_each_row_of_the_commands_names_a_function_that_runs_it():
    for command in parser.COMMANDS:
        assert list(inspect.signature(command.load()).parameters) == ["arguments"], command.name
        module, _, name = command.run.partition(":")
        beside = importlib.util.find_spec(importlib.util.resolve_name(module, "app.cli"))
        assert beside is not None
        folders = beside.submodule_search_locations or []
        names = {each.name for each in pkgutil.iter_modules(folders)}
        assert name not in names, f"{command.name}: the module would take the place of the function"


def test_version_and_help(capsys):
    assert run(capsys, "--version") == (0, f"kinboard {kin.__version__}\n", "")
    code, out, _ = run(capsys, "--help")
    assert code == 0
    assert "kinboard fk pioneer5 90 30 60 30 30" in out


@pytest.mark.full
def test_the_program_itself():
    """A process of its own: the same digits, and a start that does not load the server."""
    words = [
        sys.executable,
        "-X",
        "importtime",
        "-m",
        "app.cli",
        "fk",
        "pioneer5",
        "90",
        "-30",
        "60",
        "30",
        "30",
        "--json",
    ]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=60, check=True)
    T = kin.fk(PIONEER, np.radians([90, -30, 60, 30, 30]))
    assert np.allclose(json.loads(done.stdout)["pose"]["matrix"], T, rtol=0, atol=1e-15)
    imported = {line.rsplit("|", 1)[1].strip() for line in done.stderr.splitlines() if "|" in line}
    assert "kin.fk" in imported
    assert not imported & {"fastapi", "pydantic", "viser", "uvicorn"}


def test_a_reader_that_leaves_early_is_no_error():
    words = f"{sys.executable} -m app.cli.parser robots --json | true"
    done = subprocess.run(words, cwd=ROOT, shell=True, capture_output=True, text=True, timeout=60, check=True)
    assert done.stderr == ""


# -- check -----------------------------------------------------------------------------------------------------


def test_check_tells_what_an_arm_is(capsys):
    file = ROOT / "kin" / "robots" / "puma560.toml"
    code, out, err = run(capsys, "check", file)
    assert (code, err) == (0, "")
    assert "PUMA 560 (puma560)" in out
    assert re.search(r"^3 +elbow +revolute +-225\.000° +45\.000° +-180\.000°$", out, re.M)
    for line in (
        "axes 1 and 2: perpendicular, intersecting",
        "axes 2 and 3: parallel, 431.800 mm apart",
        "axes 3 and 4: perpendicular, 20.300 mm apart",
        "joints 2 to 3: parallel axes",
        "joints 4 to 6: axes through one point",
        "convention  standard",
        "No warnings.",
    ):
        assert line in out.splitlines()
    _, out, _ = run(capsys, "check", file, "--rad")
    assert "axes 2 and 3: parallel, 0.431800 m apart" in out
    _, out, _ = run(capsys, "check", ROOT / "kin" / "robots" / "scara.toml")
    assert re.search(r"^3 +quill +prismatic +0\.000 mm +210\.000 mm +150\.000 mm$", out, re.M)
    assert "joints      4, giving the tool 4 independent motions" in out


@pytest.mark.full
def test_check_names_the_solver_and_why(capsys):
    for robot in kin.files.classic_robots().values():
        got = answer(capsys, "check", ROOT / "kin" / "robots" / f"{robot.id}.toml")
        match = closed_form_of(robot)
        assert got["solver"] == ("numeric" if match is None else match.name)
        assert got["reason"]
        assert got["robot"]["branches"] == list(kin.branch_names(robot))
        assert got["motions"] == min(robot.n, 6)
        assert len(got["axes"]) == robot.n - 1
        assert not any("built-in" in text for text in got["warnings"])


ODD = """
id = "ur5"
name = "Odd"
source = "this test"
convention = "standard"
units = { length = "m", angle = "rad" }
[[rows]]
name = "around"
alpha = 1.5708
limits = [-7, 7]
[[rows]]
name = "up"
d = 300
[[rows]]
name = "nothing"
kind = "fixed"
[[rows]]
name = "again"
a = 200
[[rows]]
name = "last"
a = 200
[home]
q = [0, 0, 0, 0]
"""


def test_check_tells_what_looks_odd(capsys, tmp_path):
    file = tmp_path / "odd.toml"
    file.write_text(ODD, encoding="utf-8")
    code, out, _ = run(capsys, "check", file)
    assert code == 0
    said = [line for line in out.splitlines() if line.startswith("warning: ")]
    for number, words in enumerate(
        (
            '"ur5" is that of a built-in robot',
            "reaches 700 m",
            "Joint 1 (around) turns through 802°",
            "joints 1 and 2 are almost perpendicular",
            "Joints 2 and 3 turn about the same line",
            'row "nothing" changes nothing',
            "near a singularity",
        )
    ):
        assert words in said[number]
    assert len(said) == 7


def test_check_refuses_a_bad_file_as_everywhere(capsys, tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text(ODD.replace("a = 200", 'a = "long"', 1), encoding="utf-8")
    code, out, err = run(capsys, "check", file)
    assert (code, out) == (2, "")
    assert err.startswith(f"kinboard: {file}: rows[3].a: got 'long', expected a finite number")
    assert run(capsys, "check", tmp_path / "none.toml")[0] == 2


# -- import, export --------------------------------------------------------------------------------------------

URDF = ROOT / "tests" / "data" / "urdf"


def test_import_prints_or_writes_a_robot_file(capsys, tmp_path):
    panda = URDF / "panda.urdf"
    code, out, _ = run(capsys, "import", panda, "--tip", "panda_link8")
    assert code == 0
    robot = kin.load_robot(out)
    assert robot == kin.load_robot(panda, tip="panda_link8")
    file = tmp_path / "panda.toml"
    code, out, _ = run(capsys, "import", panda, "--tip", "panda_link8", "--base", "panda_link0", "-o", file)
    assert code == 0
    assert kin.load_robot(file).rows == robot.rows
    assert "links       panda_link0 to panda_link8" in out.splitlines()
    words = ("import", panda, "--tip", "panda_link8", "--base", "panda_link0", "-o", "-")
    assert run(capsys, *words)[1] == file.read_text(), "the report is on standard error"
    assert "units       m and rad in the file; commands read mm and deg, with --rad m and rad" in out.splitlines()
    got = answer(capsys, "import", panda, "--tip", "panda_link8")
    assert got["report"]["difference"] <= 1e-12
    assert got["robot"]["n"] == 7
    # The file stands for the robot in other commands.
    code, out, _ = run(capsys, "fk", file, *[0] * 7, "--json")
    assert json.loads(out)["pose"]["position"] == pytest.approx([0.088, 0, 0.926], abs=1e-12)


@pytest.mark.full
def test_import_reads_the_collision_meshes_beside_the_urdf(capsys, tmp_path):
    for name, content in robot_files(COLLISIONS).items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    urdf = tmp_path / "two/urdf/two.urdf"
    code, out, _ = run(capsys, "import", urdf)
    assert code == 0
    robot = kin.load_robot(out)
    assert {c.link for c in robot.capsules} == {0, 1, 2}
    assert not any(c.assumed for c in robot.capsules)
    assert robot.capsules_source == "Capsules around the collision bodies of the URDF, for every link."
    upper = [c for c in robot.capsules if c.link == 1]
    assert 0.04 <= max(c.radius for c in upper) < 0.09, "half the side of a rod of 80 mm, and its corners"
    got = answer(capsys, "import", urdf)
    assert [body["names"] for body in got["report"]["bodies"]] == [["base"], ["upper"], ["fore"]]
    (tmp_path / "two/meshes/fore.obj").unlink()
    (tmp_path / "two/meshes/upper.stl").write_bytes(b"noise")
    code, out, _ = run(capsys, "import", urdf, "-o", tmp_path / "two.toml")
    assert code == 0
    (line,) = [line for line in out.splitlines() if line.startswith("bodies ")]
    assert "link 1 has an assumed tube (upper: upper.stl: " in line
    assert "link 2 has no body (fore: fore.obj: no such file)" in line, "it has no length either"
    assert {c.link for c in kin.load_robot(tmp_path / "two.toml").capsules if c.assumed} == {1}


@pytest.mark.full
def test_a_collision_mesh_beyond_the_limits_refuses_the_import(capsys, tmp_path):
    files = {**robot_files(COLLISIONS), "two/meshes/upper.stl": announced(10**7) + bytes(50)}
    for name, content in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    code, out, err = run(capsys, "import", tmp_path / "two/urdf/two.urdf")
    assert (code, out) == (2, "")
    assert "upper.stl" in err
    assert "at most 600000" in err


ELSEWHERE = ("package:///etc/passwd", "http://127.0.0.1/x.stl", "file:///no.stl", "x", "package://two", "")


@pytest.mark.parametrize("named", ELSEWHERE)
def test_a_mesh_elsewhere_is_not_read(tmp_path, named):
    """Neither outside of the folders of the URDF's package by an odd path, nor over the network."""
    assert MeshesBeside(tmp_path / "two.urdf").file_of(named) is None


def test_import_offers_the_tips(capsys, tmp_path):
    code, out, err = run(capsys, "import", URDF / "ur5.urdf")
    assert (code, out) == (2, "")
    assert "one of ee_link (6 joints), tool0 (6 joints)" in err
    assert run(capsys, "fk", URDF / "ur5.urdf", *[0] * 6)[2] == err
    code, _, err = run(capsys, "import", URDF / "ur5.urdf", "--tip", "tool0", "-o", tmp_path / "no" / "file.toml")
    assert code == 2
    assert "--output" in err


@pytest.mark.full
def test_code_writes_a_file_and_names_bad_input(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = run(capsys, "code", "planar2r", "--no-closest")
    assert (code, out.startswith("planar2r.c: ")) == (0, True)
    assert Path("planar2r.c").read_text(encoding="utf-8") == kin.generate("planar2r", closest=False)
    _, out, _ = run(capsys, "code", "planar2r", "--language", "d.ts", "--name", "arm", "-o", "-")
    assert "export default arm;" in out
    typed = kin.robot_to_toml("puma560").replace("90", "89.999").replace('id = "', 'id = "typed-')
    Path("typed.toml").write_text(typed, encoding="utf-8")
    for words, field, valid in (
        (("typed.toml",), "robot: got 'typed-puma560'", "alpha of waist as pi/2 (90°)"),
        (("planar2r", "-o", "missing/arm.c"), "--output: got 'missing/arm.c'", "a file that can be written"),
        (("planar2r", "--name", "2r"), "name: got '2r'", "a letter, then at most 39 letters, digits and _"),
        (("planar2r", "--language", "fortran"), "invalid choice: 'fortran'", "'c', 'js', 'mjs', 'd.ts', 'c-test'"),
    ):
        code, _, error = run(capsys, "code", *words)
        assert (code, field in error, valid in error) == (2, True, True), error


def test_files_of_code_have_the_names_by_which_they_include_each_other(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(vectors, "COUNT", 2)
    for language in ("c", "c-test"):
        assert run(capsys, "code", "redundant7-craig", "--language", language, "--no-closest")[0] == 0
    assert sorted(file.name for file in tmp_path.iterdir()) == ["redundant7_craig.c", "redundant7_craig_test.c"]
    subprocess.run(["gcc", "-std=c99", "-O0", "redundant7_craig_test.c", "-o", "check", "-lm"], check=True)
    done = subprocess.run(["./check"], check=True, capture_output=True, text=True)
    assert "2 of 2 poses are right" in done.stdout


@pytest.mark.full
@pytest.mark.parametrize("form", ["toml", "dh", "mdh", "urdf", "mjcf"])
def test_export_in_every_format(capsys, tmp_path, form):
    code, out, _ = run(capsys, "export", "puma560", "--format", form)
    assert code == 0
    robot = kin.load_robot(out)
    assert robot.convention == ("modified" if form == "mdh" else "standard")
    q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    assert kin.fk(robot, q) == pytest.approx(kin.fk(kin.get_robot("puma560"), q), abs=1e-12)
    file = tmp_path / f"arm.{ {'urdf': 'urdf', 'mjcf': 'xml'}.get(form, 'toml') }"
    assert run(capsys, "export", "puma560", "--format", form, "-o", file)[1].startswith(f"{file}: ")
    assert file.read_text(encoding="utf-8") == out
    assert run(capsys, "robots", file)[0] == 0
    assert run(capsys, "check", file)[0] == 0


def test_check_of_a_urdf(capsys, tmp_path):
    code, out, _ = run(capsys, "check", URDF / "ur5.urdf", "--tip", "ee_link")
    assert code == 0
    assert "joints 2 to 4: parallel axes" in out.splitlines()
    assert re.search("^left out .*wrist_3_link-tool0_fixed_joint", out, re.M)
    spinning = (URDF / "ur5.urdf").read_text(encoding="utf-8").replace('"revolute"', '"continuous"')
    (tmp_path / "free.urdf").write_text(spinning, encoding="utf-8")
    code, out, _ = run(capsys, "check", tmp_path / "free.urdf", "--tip", "ee_link")
    assert re.search(r"^1 +shoulder_pan_joint +revolute +none +none ", out, re.M)
    file = ROOT / "kin" / "robots" / "ur5.toml"
    code, _, err = run(capsys, "check", file, "--tip", "ee_link")
    assert code == 2
    assert "only URDF, MJCF and xacro have links" in err


# -- workspace -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def clouds():
    made = Clouds(max_bytes=0, threads=1)
    yield made
    made.close()


@pytest.mark.full
@pytest.mark.parametrize("name", ["arm.mjcf", "ARM.URDF", "arm.Xml", "arm.TOML"])
def test_an_arm_may_be_named_by_any_file_that_holds_one(capsys, tmp_path, name):
    robot = kin.get_robot("planar2r")
    text = {".mjcf": kin.robot_to_mjcf, ".toml": kin.robot_to_toml}.get(
        Path(name).suffix.lower(), kin.robot_to_urdf
    )
    (tmp_path / name).write_text(text(robot))
    for words in (("fk", str(tmp_path / name), "10", "20", "--json"), ("check", str(tmp_path / name), "--json")):
        code, out, err = run(capsys, *words)
        assert code == 0, err
        assert json.loads(out)


def test_workspace_tells_sizes(capsys):
    facts = kin.workspace.workspace_facts(PIONEER, effort=2)
    code, out, err = run(capsys, "workspace", "pioneer5", "--effort", 2)
    assert (code, err) == (0, "")
    for name, span in (
        ("x", facts.x),
        ("from the axis of joint 1", facts.radius),
        ("from the shoulder", facts.reach),
    ):
        line = next(line for line in out.splitlines() if re.match(rf"{name}  +", line))
        assert [float(word) for word in line.split()[-2:]] == pytest.approx(
            [1e3 * e.value for e in span], abs=6e-4
        )
    assert f"{facts.volume.value:.4g} ± {facts.volume.error:.1g} m³: {facts.volume.method}" in out
    assert f"{facts.surface.value:.4g} ±" in out
    metres = run(capsys, "workspace", "pioneer5", "--effort", 2, "--rad")[1]
    assert f"{facts.x.largest.value:.6f}" in metres


def test_workspace_json_is_what_rest_says(capsys, client):
    got = answer(capsys, "workspace", "scara", "--lock", "1=45", "--limit", "3=0:100", "--effort", 2)
    address = f"/api/v1/robots/scara/workspace/summary?lock=1:{math.pi / 4}&limit=3:0:0.1&effort=2"
    assert got == client.get(address).json()


@pytest.mark.parametrize("name", FORMATS)
def test_a_cloud_is_written_by_the_name_of_its_file(capsys, tmp_path, clouds, name):
    file = tmp_path / f"cloud.{name}"
    words = ("-n", "3e3", "--seed", 5, "--strategy", "quasi", "--measure", "limits", "--q")
    code, out, err = run(
        capsys, "workspace", "pioneer5", *words, "--limit", "1=0:90", "--lock", "3=20", "-o", file
    )
    assert (code, err) == (0, "")
    assert out.startswith(f"{file}: 3000 points, ")
    limits, locked = ((0.0, math.radians(90)), *[None] * 4), (None, None, math.radians(20), None, None)
    cloud = Cloud(PIONEER, 3000, 5, "quasi", ("limits",), kin.JointConstraints(limits, locked))
    assert file.read_bytes() == b"".join(encode(name, clouds, cloud, True))
    assert list(tmp_path.iterdir()) == [file]
    bare = tmp_path / "cloud"
    assert run(capsys, "workspace", "pioneer5", "-n", 5, "-o", bare, "--format", name)[0] == 0
    assert bare.read_bytes() == b"".join(encode(name, clouds, Cloud(PIONEER, 5)))


def test_a_cloud_to_standard_output_and_the_format_by_option(capsys, tmp_path, clouds):
    expected = b"".join(encode("csv", clouds, Cloud(PIONEER, 100)))
    assert run(capsys, "workspace", "pioneer5", "-n", 100, "-o", "-", "--format", "csv") == (
        0,
        expected.decode(),
        "",
    )
    file = tmp_path / "cloud.txt"
    assert run(capsys, "workspace", "pioneer5", "-n", 100, "-o", file, "--format", "csv")[0] == 0
    assert file.read_bytes() == expected


def test_a_link_stays_a_link_and_a_device_a_device(capsys, tmp_path):
    real, link = tmp_path / "real.bin", tmp_path / "link.bin"
    real.write_bytes(b"old")
    link.symlink_to(real)
    assert run(capsys, "workspace", "pioneer5", "-n", 10, "-o", link)[0] == 0
    assert link.is_symlink()
    assert real.read_bytes().startswith(b"KINCLOUD")
    assert run(capsys, "workspace", "pioneer5", "-n", 10, "-o", "/dev/null", "--format", "bin")[0] == 0
    assert Path("/dev/null").is_char_device()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-o", "cloud.xyz"), "--output: got 'cloud.xyz', expected a name that ends in .ndjson"),
        (("-o", "-"), "--output: got '-'"),
        (("-o", "/no/such/folder/cloud.ply"), "cannot write /no/such/folder/cloud.ply: No such file"),
        (("-n", "1e20", "-o", "cloud.ply"), "n: got 100000000000000000000"),
        (("-n", "0", "-o", "cloud.ply"), "n: got 0"),
        (("-n", "1.5"), "argument -n: invalid whole number value: '1.5'"),
        (("-n", "１０００"), "argument -n: invalid whole number value: '１０００'"),
        (("-n", "inf"), "argument -n: invalid whole number value: 'inf'"),
        (("--seed", "-1", "-o", "cloud.ply"), "seed: got -1"),
        (("--seed", "x"), "argument --seed: invalid whole number value: 'x'"),
        (("--strategy", "even"), "argument --strategy: invalid choice"),
        (("--effort", "1"), "effort: got 1"),
        (("-o", "a.csv", "--picture", "a.png"), "--picture: got 'a.png', expected a name that ends in .svg"),
        (("--hull", "hull.doc"), "--hull: got 'hull.doc', expected a name that ends in .stl"),
        (("--picture", "/no/such/folder/a.svg", "-n", "10"), "cannot write /no/such/folder/a.svg: No such file"),
        (("--hull", "a.stl", "-n", "3"), "hull: got '3 points', expected at least four"),
        (("--limit", "9=0:1"), "--limit: got '9', expected a joint from 1 to 5"),
        (("--lock", "2=999", "-o", "cloud.ply"), "locked[1]: got"),
    ],
)
def test_workspace_refuses_what_it_cannot_do(capsys, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, "workspace", "pioneer5", *words)
    assert (code, out) == (2, "")
    assert said in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.full
def test_workspace_draws_and_encloses(capsys, tmp_path):
    picture, body, cloud = tmp_path / "a.svg", tmp_path / "a.stl", tmp_path / "a.csv"
    words = ["workspace", "pioneer5", "-n", 20_000, "--effort", 2, "--limit", "1=0:90"]
    code, out, err = run(capsys, *words, "--picture", picture, "--hull", body, "-o", cloud)
    assert (code, err) == (0, "")
    assert [line.split(":")[0] for line in out.splitlines()] == [str(cloud), str(picture), str(body)]
    assert picture.read_text().startswith("<svg")
    hull = trimesh.load(body)
    points = np.loadtxt(cloud, delimiter=",", skiprows=1)
    assert hull.is_watertight
    assert np.allclose(hull.bounds, [points.min(axis=0), points.max(axis=0)], atol=1e-6)
    whole = trimesh.convex.convex_hull(points)
    assert hull.volume == pytest.approx(whole.volume, rel=1e-5)


def test_an_arm_whose_first_joint_slides_is_drawn_without_a_section(capsys, tmp_path):
    file = tmp_path / "rail.toml"
    file.write_text(
        'id = "rail"\nname = "Rail"\ndescription = ""\nsource = "test"\nconvention = "standard"\n'
        'units = { length = "m", angle = "rad" }\n'
        '[[rows]]\nname = "rail"\nkind = "prismatic"\nalpha = 1.5707963267948966\nlimits = [0, 1]\n'
        '[[rows]]\nname = "arm"\na = 0.3\nlimits = [-1, 1]\n'
    )
    picture = tmp_path / "b.svg"
    words = ["workspace", "rail", "--robots", tmp_path, "-n", 1000, "--picture", picture]
    assert run(capsys, *words) == (0, f"{picture}: 1000 points\n", "")
    assert "section" not in picture.read_text()


def test_a_hull_without_scipy_says_what_to_install(capsys, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)
    code, out, err = run(capsys, "workspace", "pioneer5", "-n", 100, "--hull", tmp_path / "a.stl")
    assert (code, out) == (2, "")
    assert "pip install 'kinboard[hull]'" in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.full
def test_an_interrupted_cloud_leaves_nothing_behind(tmp_path):
    old = tmp_path / "cloud.bin"
    old.write_bytes(b"old")
    words = ["workspace", "pioneer5", "-n", "1e10", "-o", str(old), "--progress"]
    command = [
        sys.executable,
        "-c",
        f"{LISTENING}; import sys; from app.cli.parser import main; sys.exit(main())",
        *words,
    ]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        deadline = time.monotonic() + 60
        while not any(file.stat().st_size > 1e6 for file in tmp_path.iterdir()):
            assert time.monotonic() < deadline
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=120)
    assert (process.returncode, out) == (130, b"")
    assert err.decode().splitlines()[-1] == "kinboard: interrupted; nothing was written"
    assert b" points/s" in err
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [("cloud.bin", b"old")]


def test_progress_counts_every_pass(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr("app.exports.formats.KEPT", 0)
    monkeypatch.setattr(progress, "INTERVAL", 0.0)
    file = tmp_path / "cloud.npz"
    code, _, err = run(capsys, "workspace", "pioneer5", "-n", 2e5, "--measure", "limits", "-o", file, "--progress")
    assert code == 0
    parts = [int(part) for part in re.findall(r"(\d+)%", err)]
    assert parts == sorted(parts)
    assert parts[-1] == 100
    assert len(set(parts)) > 4, "two passes of four slices each"
    assert "points/s" in err
    assert run(capsys, "workspace", "pioneer5", "-n", 100, "-o", file)[2] == ""  # no terminal, no progress


def test_the_search_for_garbage_goes_on_after_a_command(capsys):
    assert gc.isenabled()
    assert parser.main(["fk", "pioneer5", "90", "30", "60", "30", "30"]) == 0
    assert gc.isenabled()


# Motions

PICK, SIX = str(ROOT / "tests" / "data" / "pick.toml"), str(ROOT / "tests" / "data" / "six.toml")


def test_move_answers_as_the_core_and_writes_each_format(capsys, tmp_path):
    panda = kin.get_robot("panda")
    expected = kin.plan_motion(panda, kin.motion.parse_program(Path(PICK).read_text(encoding="utf-8"), panda))
    got = answer(capsys, "move", "panda", PICK)
    assert got["duration"] == pytest.approx(expected.duration)
    assert got["reason"] == expected.reason
    for suffix, begin in (
        (".csv", "t,q1"),
        (".json", '{"planned":true'),
        (".ndjson", '{"planned":true'),
        (".py", "import kin"),
    ):
        file = tmp_path / f"motion{suffix}"
        code, out, _ = run(capsys, "move", "panda", PICK, "-o", file, "--rate", 50)
        assert (code, file.read_text(encoding="utf-8")[: len(begin)]) == (0, begin)
        assert f"{file.stat().st_size} bytes" in out
    rows = np.loadtxt(tmp_path / "motion.csv", delimiter=",", skiprows=1)
    assert np.allclose(rows[:, 1:8], expected.sample(rows[:, 0]).q, atol=1e-12)


@pytest.mark.full
def test_move_prints_segments_and_peaks_and_draws_a_picture(capsys, tmp_path):
    picture = tmp_path / "motion.svg"
    code, out, _ = run(capsys, "move", "panda", PICK, "--picture", picture)
    assert code == 0
    assert "above the part" in out
    assert "100.0 %" in out
    root = ElementTree.fromstring(picture.read_text(encoding="utf-8"))
    assert len(root.findall(".//{*}path[@fill='none']")) == 14, "values and speeds of seven joints"


def test_move_starts_at_a_given_place_and_writes_to_standard_output(capsys):
    code, out, _ = run(
        capsys, "move", "ur5", SIX, "--start", 0, -90, 90, 0, 90, 0, "-o", "-", "--format", "urscript"
    )
    assert code == 0
    assert out.startswith("def six_joints():\n")
    assert "movej([0, -1.57079633, 1.57079633, 0, 1.57079633, 0])  # the start" in out


def test_move_says_how_far_the_gripper_opens(capsys, tmp_path):
    file = tmp_path / "grip.toml"
    file.write_text('[[segments]]\nkind = "gripper"\nopening = 0.25\nname = "grip"\n', encoding="utf-8")
    code, out, _ = run(capsys, "move", "so101", file)
    assert code == 0
    assert re.search(r"1 +gripper +to 25 % grip +0\.000 +2\.000", out)
    code, out, _ = run(capsys, "move", "so101", file, "-o", "-", "--format", "csv", "--rate", 1)
    assert out.splitlines()[-1].endswith(",0.25")


def test_a_program_that_cannot_be_driven_is_exit_code_1_and_a_reason(capsys, tmp_path):
    file = tmp_path / "far.toml"
    file.write_text('[[segments]]\nkind = "ptp"\nq = [9, 0, 0, 0, 0, 0]\n', encoding="utf-8")
    code, out, _ = run(capsys, "move", "ur5", file)
    assert code == 1
    assert "cannot be driven: the target is outside the limits: joint 1" in out
    code, out, err = run(capsys, "move", "ur5", file, "-o", "-", "--format", "csv")
    assert (code, out) == (1, "")
    assert "joint 1" in err


def test_move_reports_what_can_be_driven_and_writes_it_where_that_is_asked_for(capsys, tmp_path):
    file, table = tmp_path / "far.toml", tmp_path / "far.csv"
    file.write_text(
        '[[segments]]\nkind = "ptp"\nq = [0.5, -1.2, 1.4, 0.2, 1.2, 0.1]\n'
        '[[segments]]\nkind = "lin"\nposition = [9, 0, 1]\n'
    )
    code, out, _ = run(capsys, "move", "ur5", file, "-o", table)
    assert code == 1
    assert not table.exists()
    assert "Segment 2 (LIN) cannot be driven" in out
    assert "Up to there: 2 motions in" in out
    assert "1  ptp          0.000" in out
    code, out, _ = run(capsys, "move", "ur5", file, "-o", table, "--partial")
    assert code == 1
    rows = list(csv.DictReader(table.read_text().splitlines()))
    part = kin.plan_motion("ur5", kin.motion.parse_program(file.read_text())).part
    assert float(rows[-1]["t"]) == pytest.approx(part.duration)
    assert float(rows[-1]["x"]) == pytest.approx(part.sample(part.duration).T[0, 3])


@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        ("nonsense", (), "valid TOML"),
        ('[[segments]]\nkind = "ptp"\nq = [0]', (), "segments[0].q"),
        ('[[segments]]\nkind = "dwell"\nseconds = 1\nspeed = 1', (), "segments[0].speed"),
        ('[[segments]]\nkind = "dwell"\nseconds = 1', ("-o", "motion.pdf"), ".csv"),
        ('[[segments]]\nkind = "dwell"\nseconds = 1', ("--rate", 0), "0.1 to 10000"),
        ('[[segments]]\nkind = "dwell"\nseconds = 1', ("--start", 1, 2), "--start"),
        (
            '[[segments]]\nkind = "dwell"\nseconds = 1',
            ("-o", "/no/such/folder/motion.csv"),
            "a file that can be written",
        ),
        (
            '[[segments]]\nkind = "dwell"\nseconds = 1',
            ("--picture", "/no/such/folder/m.svg"),
            "a file that can be written",
        ),
        ('[[segments]]\nkind = "dwell"\nseconds = 1', ("--picture", "m.png"), "a name that ends in .svg"),
    ],
)
def test_a_malformed_program_or_option_is_exit_code_2(capsys, tmp_path, text, words, said):
    file = tmp_path / "program.toml"
    file.write_text(text, encoding="utf-8")
    code, _, err = run(capsys, "move", "ur5", file, *words)
    assert code == 2
    assert said in err


def test_a_missing_program_is_named(capsys):
    code, _, err = run(capsys, "move", "ur5", "/no/such/program.toml")
    assert (code, "a readable text file" in err) == (2, True)
