"""``kinboard compare``."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

import kin
from app.cli.parser import main


def test_equal_arms_end_with_zero(tmp_path, capsys):
    kin.save_robot(kin.dh.convert_dh("ur5", "modified"), tmp_path / "mine.toml")
    assert main(["compare", "ur5", str(tmp_path / "mine.toml")]) == 0
    assert capsys.readouterr().out == "Identical: equal joint values give equal poses.\n"


def test_other_zeros_are_a_table(tmp_path, capsys):
    arm = kin.get_robot("ur5")
    rows = [replace(row, theta=row.theta + 0.5) if i == 2 else row for i, row in enumerate(arm.rows)]
    kin.save_robot(replace(arm, rows=tuple(rows)), tmp_path / "mine.toml")
    assert main(["compare", "ur5", str(tmp_path / "mine.toml"), "--free"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("The same arm: joint 3 counts from −28.6°.")
    assert "-28.648°" in out


def test_a_mistake_is_named_and_ends_with_one(tmp_path, capsys):
    arm = kin.get_robot("ur5")
    rows = [replace(row, a=-0.4) if i == 1 else row for i, row in enumerate(arm.rows)]
    kin.save_robot(replace(arm, rows=tuple(rows)), tmp_path / "mine.toml")
    assert main(["compare", "ur5", str(tmp_path / "mine.toml")]) == 1
    out = capsys.readouterr().out
    assert "Likely a of row 2 is wrong (−425 mm, not −400 mm); equal joint values then give equal poses." in out
    assert main(["compare", "ur5", str(tmp_path / "mine.toml"), "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["explanations"][0]["changes"][0]["now"] == pytest.approx(-0.425)


def test_a_tolerance_is_in_the_units_of_the_command(tmp_path, capsys):
    arm = kin.get_robot("ur5")
    rows = [replace(row, alpha=round(row.alpha, 3), a=round(row.a, 3)) for row in arm.rows]
    kin.save_robot(replace(arm, rows=tuple(rows)), tmp_path / "mine.toml")
    words = ["compare", "ur5", str(tmp_path / "mine.toml")]
    assert main(words) == 1
    capsys.readouterr()
    assert main([*words, "--tolerance", "3", "0.3"]) == 0
    assert capsys.readouterr().out.startswith("Nearly the same arm, with poses up to ")
    assert main([*words, "--tolerance", "0.003", "0.005", "--rad"]) == 0
    assert main([*words, "--tolerance", "3mm", "0.3deg", "--rad"]) == 0


def test_every_refusal_names_the_tolerance_that_would_do(tmp_path, capsys):
    """A right angle typed as 1.571: with the words of the answer, the arms are one."""
    arm = kin.get_robot("ur5")
    kin.save_robot(replace(arm, rows=(replace(arm.rows[0], alpha=1.571), *arm.rows[1:])), tmp_path / "mine.toml")
    words = ["compare", "ur5", str(tmp_path / "mine.toml")]
    for units, within in (([], "0.2 mm"), (["--rad"], "0.0002 m")):
        assert main([*words, *units]) == 1
        (line,) = [line for line in capsys.readouterr().out.splitlines() if "--tolerance" in line]
        assert line.startswith(f"They are the same within {within}")
        length, angle = line.partition("--tolerance ")[2].split()[:2]
        assert main([*words, *units, "--tolerance", length, angle]) == 0
        capsys.readouterr()
    assert main([*words, "--json"]) == 1
    assert "They are the same within 0.2 mm and 0.1°." in json.loads(capsys.readouterr().out)["text"]
    assert main(["compare", "ur5", "ur10"]) == 1
    assert "--tolerance LENGTH ANGLE takes arms for one whose poses differ by no more" in capsys.readouterr().out


def test_an_unknown_arm_is_invalid_input(capsys):
    assert main(["compare", "ur5", "ur55"]) == 2
    assert "expected one of" in capsys.readouterr().err
