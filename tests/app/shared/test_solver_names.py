"""The names of solvers that are kept for the built-in arms are those of the solvers that they get."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

import kin
from app.shared.solver_names import FILE, SolverNames, computed_names, solver_names


def test_the_file_names_no_other_arms():
    assert set(json.loads(FILE.read_text(encoding="utf-8"))) <= set(kin.builtin_robots())


@pytest.mark.parametrize("robot", kin.builtin_robots().values(), ids=list(kin.builtin_robots()))
def test_the_kept_names_are_those_of_the_solver(robot):
    assert solver_names(robot) == computed_names(robot)


def test_an_arm_of_the_same_id_with_another_table_gets_its_own_names():
    other = kin.Robot.from_dh([(0, 0.1, 0.3, 0), (0, 0, 0.2, 0)], robot_id="ur5")
    assert solver_names(other) == SolverNames("pair2", *computed_names(other)[1:])


@pytest.mark.full
def test_a_list_of_all_arms_solves_nothing():
    program = (
        "import kin, kin.solvers\n"
        "from app.shared.answers.robots import robot_answer\n"
        "from app.shared.finding import find_robots\n"
        "def refuse(robot): raise AssertionError(robot.id)\n"
        "import app.shared.solver_names as names\n"
        "names.family_of = names.branch_names = names.branch_meanings = refuse\n"
        "robots = kin.builtin_robots().values()\n"
        "assert len([robot_answer(robot) for robot in robots]) == len(robots)\n"
        "assert find_robots(robots, 'general6')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
