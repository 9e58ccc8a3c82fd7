"""xacro on the command line: what it becomes, and that it reads nothing outside of its folder."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

import kin
from app.cli import xacro
from app.cli.parser import main
from kin import KinematicsError, RobotFileError

ARM = """<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="length" default="0.4"/><xacro:property name="L" value="$(arg length)"/>
<xacro:include filename="$(find links)/link.xacro"/>
<xacro:bar name="base"/><xacro:bar name="upper"/><xacro:bar name="hand"/>
<joint name="a" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/></joint>
<joint name="b" type="continuous"><parent link="upper"/><child link="hand"/><origin xyz="${L} 0 0"/>
<axis xyz="0 1 0"/></joint></robot>"""
LINK = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:macro name="bar" params="name"><link name="${name}"/></xacro:macro></robot>"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    for name in ("arm", "links"):
        (tmp_path / "robots" / name).mkdir(parents=True)
        (tmp_path / "robots" / name / "package.xml").write_text("<package/>")
    (tmp_path / "robots/links/link.xacro").write_text(LINK)
    (tmp_path / "secret.yaml").write_text("length: 1.5")
    path = tmp_path / "robots/arm/arm.urdf.xacro"
    path.write_text(ARM)
    return path


def test_xacro_becomes_a_robot_file(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", str(file), "--arg", "length:=0.7"]) == 0
    robot = kin.parse_robot(capsys.readouterr().out)
    assert robot.reach == pytest.approx(0.7)
    assert main(["check", str(file)]) == 0
    assert "reach       400.000 mm" in capsys.readouterr().out


HOSTILE = {
    "a file outside": ("xacro.load_yaml('../../secret.yaml')['length']", "is not in the folder"),
    "a file of the system": ("xacro.load_yaml('/etc/hostname')", "is not in the folder"),
    "a private name": ("().__class__", "invalid name"),
}


@pytest.mark.parametrize("what", HOSTILE)
def test_expressions_may_not_leave_the_folder(file: Path, what: str) -> None:
    expression, words = HOSTILE[what]
    file.write_text(ARM.replace('"$(arg length)"', quoteattr("${" + expression + "}")))
    with pytest.raises(RobotFileError) as caught:
        xacro.expanded(file)
    assert words in str(caught.value.value)


WRONG = {
    "--arg": (["length"], None, "NAME:=VALUE"),
    "--folder": ([], "/nowhere", "a folder with arm.urdf.xacro in it"),
}


@pytest.mark.parametrize("field", WRONG)
def test_a_wrong_option_is_named(file: Path, field: str) -> None:
    arguments, folder, expected = WRONG[field]
    with pytest.raises(KinematicsError, match=field) as caught:
        xacro.expanded(file, arguments, folder)
    assert expected in str(caught.value)


def test_options_of_xacro_need_a_xacro_file(capsys: pytest.CaptureFixture[str]) -> None:
    for command, name in (("import", "arm.urdf"), ("check", "arm.toml")):
        assert main([command, name, "--arg", "a:=1"]) == 2
        assert "--arg" in capsys.readouterr().err


def test_without_the_extra_one_sentence_says_what_to_do(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["import", str(file)]) == 2
    said = capsys.readouterr().err
    assert "pip install 'kinboard[xacro]'" in said
    assert "`xacro FILE.xacro > FILE.urdf`" in said
