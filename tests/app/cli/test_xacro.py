"""xacro on the command line: what it becomes, and that it reads nothing outside of its folder."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

import kin
from app.cli import xacro
from app.cli.parser import main
from kin import KinematicsError, RobotFileError

pytestmark = pytest.mark.full

XMLNS = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
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
    robot = kin.load_robot(capsys.readouterr().out)
    assert robot.reach == pytest.approx(0.7)
    assert main(["check", str(file)]) == 0
    assert "reach       400.000 mm" in capsys.readouterr().out


HOSTILE = {
    "a file outside": ("${xacro.load_yaml('../../secret.yaml')['length']}", "a file in the folder"),
    "a file of the system": ("${xacro.load_yaml('/etc/hostname')}", "a file in the folder"),
    "a private name": ("${().__class__.__base__.__subclasses__()}", "got '__subclasses__'"),
    "a private name in a lambda": ("${(lambda: ().__class__)()}", "got '__class__'"),
    "the attributes of a class": ("${python.vars(list)['append']}", "name 'vars' is not defined"),
    "the frame of a generator": ("${(x for x in [1]).gi_frame}", "got 'gi_frame'"),
    "a builtin of $(eval)": ("$(eval ${'[getattr]'})", "got 'getattr'"),
    "a variable of the environment": ("$(env PATH)", "no environment variable"),
    "a module in the folder": ("${'é'.encode('idna')}", "unknown encoding: idna"),
}


@pytest.mark.parametrize("what", HOSTILE)
def test_expressions_may_not_leave_the_folder(file: Path, what: str) -> None:
    expression, words = HOSTILE[what]
    (file.parent / "stringprep.py").write_text("raise SystemExit('imported')")
    file.write_text(ARM.replace('"$(arg length)"', quoteattr(expression)), encoding="utf-8")
    with pytest.raises(RobotFileError) as caught:
        xacro.expanded(file)
    assert words in str(caught.value)
    assert "robots/arm" not in str(caught.value.value), "the cause stands first"


def test_no_module_of_the_folder_is_imported(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (
        "json",
        "yaml",
        "xacro",
        "xacrodoc",
        "rospkg",
        "ament_index_python",
        "app",
        "kin",
        "sitecustomize",
    ):
        for folder in (file.parent, file.parents[1]):
            (folder / f"{name}.py").write_text("raise SystemExit('imported')")
    (file.parent / "length.yaml").write_text("length: 0.9")
    file.write_text(ARM.replace("$(arg length)", "${xacro.load_yaml('length.yaml').length}"))
    monkeypatch.chdir(file.parent)
    monkeypatch.setenv("PYTHONPATH", str(file.parent))
    for place in (".", "", str(file.parent), str(file.parents[1])):
        monkeypatch.syspath_prepend(place)
    assert kin.files.read_urdf(xacro.expanded(file)).robot.reach == pytest.approx(0.9)


def test_places_of_the_file_are_known(file: Path) -> None:
    """`$(dirname)` is the folder of the file that says it; `$(optenv)` knows no variable."""
    (file.parents[1] / "links/bar.xacro").write_text(LINK)
    (file.parents[1] / "links/link.xacro").write_text(
        f'<robot {XMLNS}><xacro:include filename="$(dirname)/bar.xacro"/></robot>'
    )
    file.write_text(
        ARM.replace("$(arg length)", "$(optenv PATH 0.3)").replace("$(find links)", "$(dirname)/../links")
    )
    assert kin.files.read_urdf(xacro.expanded(file)).robot.reach == pytest.approx(0.3)


MISSING = {
    "a package": (
        "$(find links)",
        "$(find my_gripper_description)",
        "got 'my_gripper_description', expected a package",
    ),
    "a file outside": (
        "$(find links)/link",
        "../../secret",
        "got '../secret.xacro', expected a file in the folder",
    ),
    "a file": ("link.xacro", "none.xacro", "got 'links/none.xacro', expected a file that can be read"),
    "an argument": (' default="0.4"', ' default="$(arg size)"', "(--arg size:=VALUE)"),
}


@pytest.mark.parametrize("what", MISSING)
def test_what_is_missing_is_named(file: Path, what: str) -> None:
    before, after, words = MISSING[what]
    file.write_text(ARM.replace(before, after))
    with pytest.raises(RobotFileError) as caught:
        xacro.expanded(file)
    assert words in str(caught.value)
    assert "Exception" not in str(caught.value)


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
