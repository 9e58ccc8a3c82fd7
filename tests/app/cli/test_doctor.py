"""``kinboard doctor``: findings, the mended file, meshes beside the URDF, exit codes."""

from __future__ import annotations

import json
import os
import re
import struct
from pathlib import Path

import numpy as np
import pytest

import kin
from app.cli.parser import main

UR5 = (Path(__file__).parents[2] / "data" / "urdf" / "ur5.urdf").read_text(encoding="utf-8")


def stl(path: Path, side: float) -> None:
    """A binary STL with two triangles of a square."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]], "<f4") * side
    faces = b"".join(b"\0" * 12 + corners[k : k + 3].tobytes() + b"\0\0" for k in (0, 3))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"\0" * 80 + struct.pack("<I", 2) + faces)


@pytest.fixture
def sick(tmp_path: Path) -> Path:
    path = tmp_path / "arm" / "urdf" / "arm.urdf"
    path.parent.mkdir(parents=True)
    text = UR5.replace('<axis xyz="0 1 0" />', '<axis xyz="0 1.5 0" />', 1)
    for link, mesh in (("forearm_link", "meshes/a.stl"), ("tool0", "lost/b.stl")):
        body = f'<visual><geometry><mesh filename="package://arm/{mesh}"/></geometry></visual>'
        text = text.replace(f'<link name="{link}" />', f'<link name="{link}">{body}</link>')
    assert text.count("package://") == 2
    path.write_text(text, encoding="utf-8")
    return path


def test_findings_have_lines_and_the_mended_file_is_written(sick: Path, tmp_path: Path, capsys) -> None:
    stl(sick.parents[1] / "meshes" / "a.stl", 400.0)
    stl(sick.parents[1] / "other" / "b.stl", 0.1)
    mended = tmp_path / "mended.urdf"
    assert main(["doctor", str(sick), "--tip", "tool0", "-o", str(mended)]) == 1
    out = capsys.readouterr().out
    text = sick.read_text()
    lines = {part: text[: text.index(part)].count("\n") + 1 for part in ("0 1.5 0", "a.stl", "b.stl")}
    assert f"line {lines['b.stl']}, link tool0: visual: The mesh “package://arm/lost/b.stl” cannot be used" in out
    assert f"line {lines['a.stl']}, link forearm_link: visual: a.stl is 400 m large" in out
    assert "it is in millimetres" in out
    assert "has the length 1.5, not 1" in out
    assert f"{mended} has it mended." in out
    assert 'filename="../other/b.stl"' in mended.read_text()
    assert main(["doctor", str(sick), "--tip", "tool0", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["mended"] == mended.read_text()
    assert {each["rank"] for each in found["findings"]} == {"wrong", "suspicious", "left out"}
    assert found["moved"] == 0.0
    assert main(["doctor", str(sick), "--tip", "tool0", "-o", "-"]) == 1
    assert capsys.readouterr().out == found["mended"], "the report is on standard error"
    assert main(["doctor", str(mended), "--tip", "tool0"]) == 1  # meshes are looked for from where it is now


def test_a_healthy_file_ends_with_zero_and_is_not_written(tmp_path: Path, capsys) -> None:
    path, mended = tmp_path / "ur5.urdf", tmp_path / "mended.urdf"
    path.write_text(UR5)
    assert main(["doctor", str(path), "--tip", "tool0", "-o", str(mended)]) == 0
    assert "Nothing is wrong or suspicious. There is nothing to mend" in capsys.readouterr().out
    assert not mended.exists()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "no vertices"),
        (b"solid x\nvertex 1 2\n", "three numbers"),
        (b"solid x\nvertex 1 2 x\n", "three numbers"),
        (b"solid x\nendsolid", "no triangles"),
        (b"\0" * 80 + struct.pack("<I", 1000), "ends too early"),
        (b"\0" * 80 + struct.pack("<I", 1) + b"\xff" * 50, "no triangles"),
    ],
)
def test_a_mesh_that_is_none_is_a_finding(sick: Path, capsys, content: bytes, words: str) -> None:
    mesh = sick.parents[1] / "meshes" / "a.stl"
    mesh.parent.mkdir()
    mesh.write_bytes(content)
    main(["doctor", str(sick), "--tip", "tool0"])
    out = capsys.readouterr().out
    assert words.replace("no vertices", "is no STL") in out


def test_text_meshes_are_measured(sick: Path, capsys) -> None:
    mesh = sick.parents[1] / "meshes" / "a.stl"
    mesh.parent.mkdir()
    mesh.write_text("solid x\n facet\n vertex 0 0 0\n vertex 300 0 0\n vertex 0 20 0\n endfacet\nendsolid")
    main(["doctor", str(sick), "--tip", "tool0"])
    assert "a.stl is 300 m large" in capsys.readouterr().out


def test_what_is_no_file_is_invalid_input(tmp_path: Path, capsys) -> None:
    assert main(["doctor", str(tmp_path / "none.urdf")]) == 2
    assert "readable" in capsys.readouterr().err
    path = tmp_path / "ur5.urdf"
    path.write_text(UR5)
    assert main(["doctor", str(path), "--arg", "a:=1"]) == 2
    assert "only xacro" in capsys.readouterr().err


def test_what_the_examination_mends_is_read(sick: Path) -> None:
    text = sick.read_text().replace('lower="-6.28318530718"', 'lower="-360"', 1)
    found = kin.doctor.examine_urdf(text, tip="tool0")
    assert found.mended_arm is not None
    assert np.isclose(found.mended_arm.robot.lower.min(), -2 * np.pi)


def test_findings_are_mended_by_their_numbers(sick: Path, tmp_path: Path, capsys) -> None:
    stl(sick.parents[1] / "meshes" / "a.stl", 400.0)
    stl(sick.parents[1] / "other" / "b.stl", 0.1)
    assert main(["doctor", str(sick), "--tip", "tool0"]) == 1
    out = capsys.readouterr().out
    number = re.search(r"has the length 1.5, not 1.*\n    mended \((\d+)\)", out)
    assert number is not None
    mended = tmp_path / "mended.urdf"
    assert main(["doctor", str(sick), "--tip", "tool0", "--mend", number[1], "-o", str(mended)]) == 1
    out = capsys.readouterr().out
    assert out.count("    mended (") == 1
    assert "    left (" in out
    assert "1 of these is chosen" in out
    text = sick.read_text()
    assert mended.read_text() == text.replace('xyz="0 1.5 0"', 'xyz="0.0 1.0 0.0"')
    assert main(["doctor", str(sick), "--tip", "tool0", "--mend", "77"]) == 2
    assert "--mend: got 77, expected numbers of the report:" in capsys.readouterr().err


def test_missing_meshes_cost_one_look_per_folder(tmp_path: Path, monkeypatch, capsys) -> None:
    """A hundred meshes beside many files: each folder is read once for each of the two places."""
    urdf, meshes = tmp_path / "arm" / "urdf" / "arm.urdf", 100
    urdf.parent.mkdir(parents=True)
    for folder in range(5):
        there = tmp_path / "arm" / f"other{folder}"
        there.mkdir()
        for k in range(40):
            (there / f"{folder}-{k}.stl").touch()
    links = "".join(
        f'<link name="l{k}"><visual><geometry><mesh filename="package://arm/lost/{k // 40}-{k % 40}.stl"/>'
        "</geometry></visual></link>"
        for k in range(meshes)
    )
    joint = '<joint name="j" type="continuous"><parent link="l0"/><child link="l1"/><axis xyz="0 0 1"/></joint>'
    urdf.write_text(f'<robot name="r">{links}{joint}</robot>', encoding="utf-8")
    read: list[str] = []
    scandir = os.scandir

    def counted(path):
        read.append(str(path))
        return scandir(path)

    monkeypatch.setattr(os, "scandir", counted)
    main(["doctor", str(urdf), "--tip", "l1", "--json"])
    assert len(read) == len(set(read)) + 1 <= 8  # the folder of the URDF is also below the one above it
    mends = [each["mend"] for each in json.loads(capsys.readouterr().out)["findings"] if each["symptom"] == "mesh"]
    assert mends.count("Write “../other2/2-3.stl”: there it is.") == 1
    assert len(mends) == meshes
