"""``kinboard calibrate``: a plan, a fit, files, and what is wrong with touches by the line of their file."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kin
from app.cli.parser import main
from app.exports.touch import sheet_svg
from app.shared.answers.inspection import inspect
from kin.robot import NominalTable


@pytest.fixture(scope="module")
def touches(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan, whose postures are taken for readings."""
    file = tmp_path_factory.mktemp("touches") / "plan.csv"
    assert main(["calibrate", "ur5e", "--bar", "150", "--plan", "10", "-o", str(file)]) == 0
    return file


def test_a_plan_is_printed_and_written(touches: Path, capsys) -> None:
    lines = touches.read_text().splitlines()
    assert lines[0] == "socket,q1,q2,q3,q4,q5,q6"
    assert len(lines) == 11
    assert {line.split(",")[0] for line in lines[1:]} == {"1", "2"}
    assert main(["calibrate", "ur5e", str(touches), "--bar", "150", "--plan", "3", "--json"]) == 0
    more = json.loads(capsys.readouterr().out)
    assert len(more["q"]) == 3
    assert more["expected"]["after"] < more["expected"]["before"]


def test_standard_output_has_the_file_alone(touches: Path, capfdbinary) -> None:
    words = ["--bar", "150", "-o", "-"]
    assert main(["calibrate", "ur5e", "--plan", "10", *words]) == 0
    out, err = capfdbinary.readouterr()
    assert out == touches.read_bytes()
    assert b"board 1  at about" in err
    assert main(["calibrate", "ur5e", *words, str(touches)]) == 0
    out, err = capfdbinary.readouterr()
    assert kin.robot_from_dict(tomllib.loads(out.decode())).nominal is not None
    assert b"touch  off by" in err


def test_a_fit_is_printed_and_written(touches: Path, tmp_path: Path, capsys) -> None:
    arm, page = tmp_path / "mine.toml", tmp_path / "result.html"
    words = ["calibrate", "ur5e", str(touches), "--bar", "150", "-o", str(arm), "--html", str(page)]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert "The tip is expected to be off by" in out
    assert "touch  off by" in out
    found = kin.load_robot(arm)
    assert found.nominal is not None
    assert found.id == "ur5e-calibrated"
    assert found.source == f"Calibrated by touching. Nominal table: {kin.get_robot('ur5e').source}"
    q = found.random_q(np.random.default_rng(1), 20)
    assert np.abs(kin.fk_positions(found, q) - kin.fk_positions("ur5e", q)).max() < 1e-5
    html = page.read_text(encoding="utf-8")
    assert html.count("class=bar") > 30
    assert "http" not in html
    assert main([*words[:5], "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert len(answer["misses"]) == 10
    assert kin.robot_from_dict(answer["robot"]).nominal is not None
    assert main(["calibrate", str(arm), str(touches), "--bar", "150", "-o", str(arm)]) == 0
    again = kin.load_robot(arm)
    assert (again.id, again.source) == (found.id, found.source)


def test_axes_of_a_calibrated_table_are_meant_as_they_are() -> None:
    robot = kin.get_robot("ur5e")
    rows = tuple(replace(row, alpha=row.alpha + 1e-3) for row in robot.rows)
    typed = replace(robot, rows=rows)
    measured = replace(typed, nominal=NominalTable(robot.rows, robot.tool))
    assert any("almost parallel" in text for text in inspect(typed).warnings)
    assert not any("almost" in text for text in inspect(measured).warnings)


def test_a_contradiction_ends_with_1(touches: Path, tmp_path: Path, capsys) -> None:
    rows = [line.split(",") for line in touches.read_text().splitlines()]
    rows[4][2] = str(float(rows[4][2]) + 0.05)
    file = tmp_path / "wrong.csv"
    file.write_text("\n".join(",".join(row) for row in rows))
    assert main(["calibrate", "ur5e", str(file), "--bar", "150"]) == 1
    assert "Touch 4 does not fit the others" in capsys.readouterr().out


def test_touches_that_are_each_alone_on_a_board_say_nothing_of_themselves(tmp_path: Path, capsys) -> None:
    q = kin.get_robot("ur5e").random_q(np.random.default_rng(2), 7)
    file, page = tmp_path / "alone.csv", tmp_path / "report.html"
    file.write_text("".join(f"{k + 1},{','.join(map(str, row))}\n" for k, row in enumerate(q.tolist())))
    words = ["calibrate", "ur5e", str(file), "--pin", "--places", "7", "--html", str(page)]
    assert main(words) == 0
    assert "nan" not in capsys.readouterr().out + page.read_text(encoding="utf-8")
    assert main([*words, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["held_out"] == [None, None]
    assert "did not use" not in answer["text"]


def test_touches_of_mistaken_joints_end_with_1_and_a_report(touches: Path, tmp_path: Path, capsys) -> None:
    rows = [line.split(",") for line in touches.read_text().splitlines()]
    for row in rows[1:]:
        row[2], row[3] = str(-float(row[2])), str(-float(row[3]))
    file, page = tmp_path / "signs.csv", tmp_path / "report.html"
    file.write_text("\n".join(",".join(row) for row in rows))
    assert main(["calibrate", "ur5e", str(file), "--bar", "150", "--html", str(page)]) == 1
    assert "times as much as stated" in capsys.readouterr().out
    assert "times as much as stated" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("row", "column", "value", "said"),
    [
        (3, 0, "7", "TOUCHES line 4, socket: got 7.0, expected a socket of the fixture, 1 to 2"),
        (5, 2, "400", "TOUCHES line 6, q2: got 400.0, expected"),
        (5, 2, "x", "TOUCHES line 6"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(
    touches: Path, tmp_path: Path, capsys, row, column, value, said
) -> None:
    rows = [line.split(",") for line in touches.read_text().splitlines()]
    rows[row][column] = value
    file = tmp_path / "bad.csv"
    file.write_text("\n".join(",".join(row) for row in rows))
    for more in ([], ["--plan", "3"]):
        assert main(["calibrate", "ur5e", str(file), "--bar", "150", *more]) == 2
        assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda rows: rows[:6],
            "TOUCHES: got 6, expected 7 to 1000 touches: each gives three numbers, and about",
        ),
        (
            lambda rows: np.column_stack([rows[:, 0], np.tile(rows[0, 1:], (10, 1))]),
            "TOUCHES: got 'all in one posture', expected postures that differ by 5°",
        ),
        (
            lambda rows: np.column_stack([rows[:, 0], np.degrees(rows[:, 1:])]),
            "within its limits, -6.283 to 6.283; are these degrees? Joint values are radians",
        ),
        (lambda rows: np.roll(rows, -1, axis=1), "TOUCHES line 1, socket: got"),
    ],
    ids=["few", "one posture", "degrees", "columns exchanged"],
)
def test_what_is_wrong_with_all_touches_is_said(touches: Path, tmp_path: Path, capsys, change, said) -> None:
    rows = change(np.loadtxt(touches, delimiter=",", skiprows=1))
    file = tmp_path / "bad.csv"
    file.write_text("".join(",".join(map(repr, row)) + "\n" for row in rows.tolist()))
    assert main(["calibrate", "ur5e", str(file), "--bar", "150"]) == 2
    assert said in capsys.readouterr().err


def test_options_that_do_not_fit_are_refused(capsys, tmp_path: Path) -> None:
    assert main(["calibrate", "ur5e"]) == 2
    assert "--pin" in capsys.readouterr().err
    assert main(["calibrate", "ur5e", "--pin", "--marked"]) == 2
    assert "--place" in capsys.readouterr().err
    assert main(["calibrate", "ur5e", "--pin", "--print", str(tmp_path / "a.svg")]) == 2
    assert "--sheet" in capsys.readouterr().err
    for count in ("0", "1001"):
        assert main(["calibrate", "ur5e", "--pin", "--plan", count]) == 2
        assert f"--plan: got {count}, expected a whole number from 1 to 1000" in capsys.readouterr().err
    assert main(["calibrate", "palletiser", "--pin", "--waves"]) == 2
    assert "expected 0 for an arm with rows that follow joints" in capsys.readouterr().err


@pytest.mark.parametrize("place", [[], ["--place", "270:0:50"]])
def test_a_socket_that_cannot_be_touched_is_said_with_the_height_of_the_table(capsys, place: list[str]) -> None:
    assert main(["calibrate", "scara", "--pin", *place]) == 2
    said = capsys.readouterr().err
    assert "--table: got 'socket 1 at [0.2" in said
    assert "a height of the table (here 0 m)" in said


@pytest.mark.parametrize(("paper", "width", "height"), [("A5", 148, 210), ("A4", 210, 297), ("A3", 297, 420)])
def test_the_sheet_is_true_to_scale(paper: str, width: int, height: int) -> None:
    svg = sheet_svg(paper)
    assert f'width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}"' in svg
    board = kin.calibration.TouchBoard.sheet(paper)
    centres = np.array(re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', svg), float)
    assert np.abs(centres[:, 0] - 0.5 * width - 1000.0 * board.sockets[:, 0]).max() < 1e-3
    assert np.abs(0.5 * height - centres[:, 1] - 1000.0 * board.sockets[:, 1]).max() < 1e-3
    (line,) = re.findall(r"h(100)M", svg)
    assert "This line is 100 mm long" in svg
    assert line == "100"
