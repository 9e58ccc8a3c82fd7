"""The programs of docs/integrate.md: they run as they stand, and what they write is right."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fastapi.testclient import TestClient

import kin
from app.service.main import create_app
from app.shared.settings import Settings

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "integrate.md").read_text(encoding="utf-8")
GRIPPER = kin.pose_from_xyz_rpy([0.0, 0.0, 0.12])


# Runs hour.py where nothing is installed but what `kin` needs.
WITH_THE_CORE_ALONE = """
import runpy, sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        package = name.partition(".")[0]
        ours = {"kin", "numpy", "tomli_w"}
        if package[0] != "_" and package not in ours | sys.stdlib_module_names:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Missing())
runpy.run_path("hour.py", run_name="__main__")
"""


def example(beginning: str) -> str:
    """The code block whose first line is this one."""
    (found,) = re.findall(rf"^```{re.escape(beginning)}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return found


@pytest.fixture
def folder(tmp_path):
    """A folder with a URDF, in which `kinboard` is the command line of this checkout."""
    shutil.copy(ROOT / "tests" / "data" / "urdf" / "ur5.urdf", tmp_path)
    program = tmp_path / "kinboard"
    program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m app.cli "$@"\n')
    program.chmod(0o755)
    return tmp_path


def run(folder, *words):
    environment = os.environ | {"PATH": f"{folder}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def arm_of(folder):
    return kin.load_robot(folder / "ur5.urdf", tip="tool0").with_mounted(GRIPPER)


def motion_of(folder):
    """The columns of the table that was written, by name."""
    with (folder / "motion.csv").open() as file:
        names = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",")
    return dict(zip(names, rows.T, strict=True))


def reached(folder, arm):
    """Tool poses ``(k, 4, 4)`` of the motion, by FK of its joint values; the table has the same places."""
    table = motion_of(folder)
    q = np.stack([table[f"q{i + 1}"] for i in range(arm.n)], axis=-1)
    T = kin.fk(arm, q)
    assert np.abs(T[:, :3, 3] - np.stack([table[axis] for axis in "xyz"], axis=-1)).max() < 1e-9
    assert (np.diff(table["t"]) > 0).all()
    return T


@pytest.mark.full
def test_the_hour_in_python(folder):
    code = example('python title="hour.py"')
    assert len(code.splitlines()) <= 40
    (folder / "hour.py").write_text(code)
    assert "1000 targets: 1000 solved" in run(folder, sys.executable, "-c", WITH_THE_CORE_ALONE)
    arm = arm_of(folder)
    home = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
    q = np.loadtxt(folder / "joints.csv", delimiter=",", skiprows=1)
    assert q.shape == (1000, 6)
    assert np.abs(q).max() <= np.pi
    T = kin.fk(arm, q)
    centre = kin.fk(arm, home)
    assert np.abs(np.linalg.norm(T[:, :2, 3] - centre[:2, 3], axis=1) - 0.1).max() < 1e-9
    assert np.abs(T[:, :3, :3] - centre[:3, :3]).max() < 1e-9
    driven = reached(folder, arm)
    assert np.abs(driven[0] - centre).max() < 1e-9
    assert np.abs(driven[-1] - T[750]).max() < 1e-5
    picture = ElementTree.fromstring((folder / "motion.svg").read_text())
    assert len(picture.findall("{*}path")) == 6


def test_the_page_names_what_the_core_needs_as_the_project_does():
    needed = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
    core = [f'"{each}"' for each in needed if each.startswith(("numpy", "tomli-w"))]
    assert f"pip install {' '.join(core)}\npip install --no-deps .\n" in PAGE
    assert f"the {len(needed)} packages that the service needs" in PAGE


def test_the_request_of_the_matlab_program_is_answered_with_the_field_that_it_shows():
    code = example("matlab")
    (numbers,) = re.findall(r'struct\("q", \[([\d. ]+)\]\)', code)
    (address,) = re.findall(r'webwrite\("http://127\.0\.0\.1:8000(\S+)"', code)
    answer = TestClient(create_app(Settings())).post(address, json={"q": list(map(float, numbers.split()))})
    shown = answer.json()
    for name in re.findall(r"disp\(answer\.([\w.]+)\)", code)[0].split("."):
        shown = shown[name]
    assert np.allclose(shown, kin.fk("pioneer5", np.fromstring(numbers, sep=" "))[:3, 3])


@pytest.mark.full
def test_the_hour_on_the_command_line(folder):
    code = example('sh title="hour.sh"')
    assert len(code.splitlines()) <= 10
    assert "1000 of 1000 targets have an exact solution" in run(folder, "bash", "-euo", "pipefail", "-c", code)
    arm = arm_of(folder)
    targets = np.loadtxt(folder / "targets.csv", delimiter=",", skiprows=1)
    lines = (folder / "joints.csv").read_text().splitlines()[1:]
    q = np.array([line.split(",")[1:7] for line in lines], dtype=float)
    assert np.abs(kin.fk(arm, q)[:, :3, 3] - targets[:, :3]).max() < 1e-8
    assert np.abs(q[:, [0, 5]]).max() <= np.pi
    driven = reached(folder, arm)
    assert np.abs(driven[-1, :3, 3] - [0.45, 0.2, 0.25]).max() < 1e-5
    assert np.abs(driven[-1, :3, 2] - [0.0, 0.0, -1.0]).max() < 1e-5
    ElementTree.fromstring((folder / "motion.svg").read_text(encoding="utf-8"))
