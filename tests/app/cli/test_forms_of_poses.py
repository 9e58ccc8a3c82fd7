"""Targets typed on the command line in the forms of textbooks and makers, and poses printed so."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import kin
from app.cli import parser
from app.cli.arguments.kinematics import POSE_FORMS
from kin.poses import FORMS

DOWN = np.diag([1.0, -1.0, -1.0])


def run(capsys, *words):
    """Exit code, standard output and standard error of one command."""
    code = parser.main([str(word) for word in words])
    return code, *capsys.readouterr()


def test_the_forms_of_poses_are_those_of_the_core():
    assert set(POSE_FORMS) == set(FORMS)


@pytest.mark.parametrize("form", ["kuka", "abb", "polyscope", "rpy", "matrix"])
@pytest.mark.parametrize("unit", ["--deg", "--rad"])
def test_what_fk_prints_in_a_form_ik_reads(capsys, form, unit):
    q = [10, -90, 80, 20, 40, 0] if unit == "--deg" else [0.1745, -1.5708, 1.4, 0.35, 0.7, 0]
    code, out, _ = run(capsys, "fk", "kr6", *q, unit, "--form", form)
    text = out.partition("\n\n")[2].split("\n\n")[-1].removeprefix("tool").split()
    assert code == 0
    code, out, _ = run(capsys, "ik", "kr6", unit, "--form", form, "--json", "--seed", *q, "--pose", *text)
    found = json.loads(out)
    assert (code, found["status"]) == (0, "solved")
    typed = np.radians(q) if unit == "--deg" else q
    assert np.abs(np.array(found["solutions"][0]["q"]) - typed).max() < 2e-5


@pytest.mark.parametrize(
    ("words", "position", "R"),
    [
        (["--position", "400", "100", "300", "--rpy", "180", "0", "0"], (0.4, 0.1, 0.3), DOWN),
        (["--rad", "--position", "0.4", "0.1", "0.3", "--rpy", "pi", "0", "0"], (0.4, 0.1, 0.3), DOWN),
        (["--position", "400", "100", "300", "--xyzw", "1", "0", "0", "0"], (0.4, 0.1, 0.3), DOWN),
        (["--position", "400", "100", "300", "--rotvec", "180", "0", "0"], (0.4, 0.1, 0.3), DOWN),
        (["--pose", "X 400 Y 100 Z 300 W 180 P 0 R 0"], (0.4, 0.1, 0.3), DOWN),
        (["--pose", "p[0.4, 0.1, 0.3, pi, 0, 0]"], (0.4, 0.1, 0.3), DOWN),
        (["--pose", "400", "100", "300", "180", "0", "0"], (0.4, 0.1, 0.3), DOWN),
        (["--pose", "RX 3.14159265359 RY 0 RZ 0 X 400 Y 100 Z 300"], (0.4, 0.1, 0.3), DOWN),  # of an arm of UR
    ],
)
def test_a_target_is_typed_in_every_form(capsys, words, position, R):
    code, out, _ = run(capsys, "ik", "ur5", *words, "--json")
    assert code == 0
    T = kin.fk("ur5", json.loads(out)["solutions"][0]["q"])
    assert np.allclose(T[:3, 3], position, atol=1e-9)
    assert np.allclose(T[:3, :3], R, atol=1e-9)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--pose", "X 400 Y 100 Z 300 A 10 B 20 C 30"], "--pose: .*begin with kuka or doosan or mitsubishi"),
        (["--pose", "p[400, 100, 300, 0, 3.14, 0]"], "--pose: .*lengths look like mm"),
        (["--pose", "400 100 300", "--rpy", "0", "0", "0"], "no other orientation"),
        (["--pose", "400 100 300", "--task", "pose"], "an orientation such as --wxyz"),
        (["--position", "400", "100", "300", "--form", "kuka"], "--pose or --targets as well"),
        (["--position", "400", "100", "300", "--wxyz", "0", "0.24", "0", "0"], "--wxyz: .*has the length 0.24"),
        (["--position", "400", "100", "300", "--xyzw", "0", "0", "0", "0"], "--xyzw: .*is zero"),
        (
            ["--position", "400", "100", "300", "--rpy", "0", "0", "0", "--wxyz", "1", "0", "0", "0"],
            "not allowed with",
        ),
    ],
)
def test_a_target_that_is_none_is_named(capsys, words, said):
    code, _, err = run(capsys, "ik", "ur5", *words)
    assert code == 2
    assert re.search(said, err)
