"""The differential check finds nothing between a tree and itself, and whatever has been changed."""

from __future__ import annotations

import copy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from compiled import lend_kernels
from differential import trees
from differential.answers import ask
from differential.compare import CLOSE, Grade, compare, grade_of
from differential.intervals import parameter_of, without
from differential.questions import KINDS, PATH_EVERY, Question, pose
from differential.report import Tally, show
from differential.robots import all_robots, shares

import kin

ROBOTS = all_robots()
NUMBERS = range(len(KINDS))
PANDA = ROBOTS["panda"]
PROGRAM = Path(trees.__file__).parent


@pytest.fixture(scope="module")
def typical():
    """A question to an arm with feasible intervals, and its answer."""
    question = Question.of(PANDA, 0)
    answer = ask(question)
    assert answer.status == "solved"
    assert all(ranges for ranges in answer.ranges)
    return question, answer


def difference(typical, change):
    """The verdict if the new tree's answer has been changed."""
    question, answer = typical
    new = copy.deepcopy(answer)
    change(new)
    return compare(question.robot, question.number, answer, new)


@pytest.mark.parametrize("robot", [robot for robot in ROBOTS.values() if robot.id != "sawyer"], ids=lambda r: r.id)
def test_a_tree_answers_the_same_question_twice_alike(robot):
    for number in NUMBERS:
        answers = [ask(Question.of(robot, number)) for _ in range(2)]
        verdict = compare(robot, number, *answers)
        assert verdict.grade is Grade.IDENTICAL, f"{number}: {verdict}"


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=lambda r: r.id)
def test_questions_are_asked_without_the_kinematics_of_a_tree(robot):
    for number in NUMBERS:
        q = Question.of(robot, number).q
        assert pose(robot, q) == pytest.approx(kin.fk(robot, q), abs=1e-12)


def test_every_kind_is_asked_and_most_statuses_are_met():
    asked = [Question.of(PANDA, number) for number in range(200)]
    assert {question.kind for question in asked} == set(KINDS)
    assert {ask(question).status for question in asked} >= {"solved", "limits", "unreachable"}
    assert asked[0].target.shape == (4, 4)
    assert "path" in ask(Question.of(PANDA, PATH_EVERY)).arrays


def test_a_refused_question_is_an_answer_too():
    question = Question.of(PANDA, 0)
    question.options["position_tolerance"] = -1.0
    answer = ask(question)
    assert (answer.status, "position_tolerance" in answer.cause) == ("error", True)


def status(answer):
    answer.status = "unreachable"


def cause(answer):
    answer.cause = "too far"


def branch(answer):
    answer.branches = (*answer.branches[1:], answer.branches[0])


def tiny(answer):
    answer.arrays["solutions"][0, 0] += 0.5 * CLOSE


def small(answer):
    answer.arrays["solutions"][0, 0] += 2.0 * CLOSE


def bits(answer):
    answer.arrays["fk"][0, 3] = np.nextafter(answer.arrays["fk"][0, 3], 9.0)


def missing(answer):
    del answer.arrays["ik_branches"]


@pytest.mark.parametrize(
    ("change", "part", "grade"),
    [
        (status, "status", Grade.DIFFERENT),
        (cause, "cause", Grade.DIFFERENT),
        (branch, "branches", Grade.DIFFERENT),
        (tiny, "solutions", Grade.CLOSE),
        (small, "solutions", Grade.DIFFERENT),
        (bits, "fk", Grade.CLOSE),
        (missing, "ik_branches", Grade.DIFFERENT),
    ],
)
def test_what_has_changed_is_found_and_named(typical, change, part, grade, capsys):
    verdict = difference(typical, change)
    assert verdict.grades[part] is verdict.grade is grade
    tally = Tally("panda")
    tally.add(verdict)
    assert show([tally]) == (part == "status"), "the exit code"
    assert f"  0: {grade.name.lower()}: " in (out := capsys.readouterr().out)
    assert part in out


def ranges_of(answer, change):
    """Change the first interval on each branch."""
    answer.ranges = tuple(
        ((name, value, (*change(intervals[0]), *intervals[1:])),) for ((name, value, intervals),) in answer.ranges
    )


@pytest.mark.parametrize(
    ("change", "new", "wrong"),
    [
        (lambda x: [(x[0], 0.5 * (x[0] + x[1]))], False, True),
        (lambda x: [(x[0], x[1] + 0.01)], True, True),
        (lambda x: [x, (9.0, 9.1)], True, True),
    ],
    ids=["half is lost", "longer than feasible", "outside the limits"],
)
def test_intervals_are_judged_by_the_arm_inside_them(typical, change, new, wrong):
    verdict = difference(typical, lambda answer: ranges_of(answer, change))
    assert {judged.new for judged in verdict.judged} == {new}
    assert all(judged.wrong is wrong for judged in verdict.judged)
    assert ("lost" if not new else "new") in str(verdict)


def test_an_interval_that_was_missed_before_is_not_a_fault(typical):
    question, answer = typical
    old = copy.deepcopy(answer)
    ranges_of(old, lambda x: [(x[0], 0.5 * (x[0] + x[1]))])
    verdict = compare(PANDA, question.number, old, answer)
    assert verdict.judged
    assert not any(judged.wrong for judged in verdict.judged)
    assert all(judged.new and judged.feasible == 1.0 for judged in verdict.judged)


def test_a_solution_that_is_missing_is_a_lost_interval(typical):
    def drop(answer):
        answer.branches, answer.ranges = answer.branches[1:], answer.ranges[1:]

    judged = difference(typical, drop).judged
    assert judged
    assert {(each.new, each.wrong, each.branch) for each in judged} == {(False, True, typical[1].branches[0])}


@pytest.mark.parametrize("kind", ["approach", "position", "locked", "manipulability"])
def test_intervals_are_judged_only_where_the_whole_arm_may_move(kind):
    question = Question.of(PANDA, list(KINDS).index(kind))
    assert (parameter_of(question) is None) == (kind != "manipulability")
    assert parameter_of(Question.of(ROBOTS["ur5"], 0)) is None


def test_what_intervals_do_not_cover():
    assert without([(0.0, 1.0)], []) == [(0.0, 1.0)]
    assert without([(0.0, 1.0)], [(-1.0, 2.0)]) == []
    assert without([(0.0, 4.0)], [(3.0, 9.0), (1.0, 2.0)]) == [(0.0, 1.0), (2.0, 3.0)]
    assert without([(0.0, 1.0)], [(1e-10, 1.0)]) == [], "too narrow to judge"


def test_arrays_are_alike_only_with_nan_at_the_same_places():
    a = np.array([[0.0, np.nan], [1.0, 2.0]])
    assert grade_of(a, a.copy()) is Grade.IDENTICAL
    assert grade_of(a, np.nan_to_num(a)) is Grade.DIFFERENT
    assert grade_of(a, a[:1]) is Grade.DIFFERENT


def test_the_questions_are_shared_out():
    asked = shares(100_000)
    assert [robot.id for robot, _ in asked] == list(ROBOTS)
    assert sum(count for _, count in asked) == pytest.approx(100_000, rel=1e-3)
    assert shares(10, ["ur5"]) == [(ROBOTS["ur5"], 10)]
    with pytest.raises(ValueError, match="no such arm: ur6"):
        shares(10, ["ur6"])


@pytest.mark.full
def test_a_tree_is_a_folder_or_a_commit(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert trees.tree_of(str(trees.ROOT)) == trees.ROOT
    with pytest.raises(ValueError, match="neither a folder that contains kin/ nor a commit"):
        trees.tree_of("no such thing")
    if (trees.ROOT / ".git").exists():  # not in a source archive
        found = trees.tree_of("HEAD")
        assert (found / "kin" / "fk.py").is_file()
        assert trees.tree_of("HEAD") == found, "unpacked once"


def changed_tree(folder):
    """A tree in which `solve_ik` calls a target whose first solution turns joint 1 to the left out of reach."""
    (folder / "kin").mkdir()
    for entry in Path(kin.__file__).parent.iterdir():
        if entry.name not in ("__init__.py", "__pycache__"):
            (folder / "kin" / entry.name).symlink_to(entry)
    lend_kernels(folder / "kin")
    change = (
        "_solve = solve_ik\n"
        "def solve_ik(*arguments, **options):\n"
        "    found = _solve(*arguments, **options)\n"
        "    if found.solutions and found.solutions[0].q[0] > 0.0:\n"
        "        found.status = Status.UNREACHABLE\n"
        "    return found\n"
    )
    source = Path(kin.__file__).read_text("utf-8")
    (folder / "kin" / "__init__.py").write_text(f"{source}\n{change}", "utf-8")
    return folder


@pytest.mark.full
def test_the_command_compares_two_trees(tmp_path):
    """The same kernels for both, so that nothing has to be compiled."""
    numbers = list(map(str, NUMBERS))
    command = [
        sys.executable,
        PROGRAM,
        trees.ROOT,
        changed_tree(tmp_path),
        "--only",
        "planar2r",
        "--numbers",
        *numbers,
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    lines = done.stdout.splitlines()
    title = next(i for i, line in enumerate(lines) if line.startswith("Old against new"))
    names, values = lines[title + 1].replace("within 1e-9", "close").split(), lines[title + 2].split()
    row = dict(zip(names, values, strict=False))
    changed = int(row["status"])
    assert 2 < changed < len(NUMBERS)
    assert (int(row["questions"]), int(row["identical"])) == (len(NUMBERS), len(NUMBERS) - changed)
    first = next(line for line in lines if line.endswith("different: status")).split(":")[0].strip()
    place = lines.index(next(line for line in lines if line.startswith(f"planar2r {first} (")))
    assert lines[place + 1].startswith("old: Answer(status='solved'")
    assert "new: Answer(status='unreachable'" in done.stdout


def test_the_command_refuses_what_is_no_tree():
    done = subprocess.run([sys.executable, PROGRAM, "no-such-commit"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "'no-such-commit' is neither" in done.stderr
