"""Finding robots by what one knows of them: the words, and the two doors that take them."""

from __future__ import annotations

import pytest

import kin
from app.cli.parser import main
from app.shared.finding import LONGEST, find_robots
from kin.solvers import family_of

ROBOTS = tuple(kin.builtin_robots().values())


def found(query):
    return {robot.id for robot in find_robots(ROBOTS, query)}


@pytest.mark.parametrize(
    ("query", "fits"),
    [
        ("", lambda robot: True),
        ("KUKA", lambda robot: "KUKA" in robot.maker),
        ("maker:kuka joints:7", lambda robot: "KUKA" in robot.maker and robot.n == 7),
        ("joints:3..5", lambda robot: 3 <= robot.n <= 5),
        ("joints:6..", lambda robot: robot.n >= 6),
        ("reach:..0.5", lambda robot: robot.reach <= 0.5),
        ("reach:1.0..1.2 solver:wrist6", lambda robot: 1.0 <= robot.reach <= 1.2 and family_of(robot) == "wrist6"),
        ("solver:slides", lambda robot: family_of(robot).startswith("slides")),
        ("robotics maker:rethink", lambda robot: robot.id in ("sawyer", "baxter")),
    ],
)
def test_a_query_finds_all_that_fit_and_no_others(query, fits):
    expected = {robot.id for robot in ROBOTS if fits(robot)}
    assert expected
    assert found(query) == expected


def test_nothing_is_found_where_nothing_fits():
    assert found("no-such-robot") == set()
    assert found("kuka joints:5") == set()


def test_the_order_is_kept():
    assert [robot.id for robot in find_robots(ROBOTS, "joints:6")] == [r.id for r in ROBOTS if r.n == 6]


WRONG = [
    "joints:",
    "joints:six",
    "reach:1.2.3",
    "reach:..",
    "maker:",
    "colour:red",
    "reach:nan",
    "x" * (LONGEST + 1),
]


@pytest.mark.parametrize("query", WRONG)
def test_a_word_that_cannot_be_read_is_named(query):
    with pytest.raises(kin.InputError) as refused:
        found(query)
    assert refused.value.field == "find"
    assert query[:20] in str(refused.value)


def test_rest_finds_the_same_robots(client):
    listed = client.get("/api/v1/robots", params={"find": "joints:7 solver:general7"}).json()["robots"]
    assert {robot["id"] for robot in listed} == found("joints:7 solver:general7")
    assert {robot["solver"] for robot in listed} == {"general7"}


@pytest.mark.parametrize("query", WRONG)
def test_rest_refuses_what_cannot_be_read(client, query):
    answer = client.get("/api/v1/robots", params={"find": query})
    assert answer.status_code == 422
    assert "find" in answer.text


def test_the_command_line_finds_the_same_robots(capsys):
    assert main(["robots", "--find", "reach:..0.5"]) == 0
    assert {line.split()[0] for line in capsys.readouterr().out.splitlines()[1:]} == found("reach:..0.5")
    assert main(["robots", "--find", "joints:six"]) == 2
    assert "joints:six" in capsys.readouterr().err


def test_the_facts_of_a_maker_are_printed(capsys):
    assert main(["robots", "gen3"]) == 0
    assert "maker: Kinova\npayload: 4 kg\n" in capsys.readouterr().out
