"""Poses as they stand on makers' pendants and in their programs, with numbers that these have shown."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import kin
from kin.poses import FORMS, read_target
from kin.typed import ReadError
from kin.units import Units

DOWN = np.diag([1.0, -1.0, -1.0])
UR5_STARTS_AT = [-1.6007, -1.7271, -2.203, -0.808, 1.5951, -0.031]  # in UR's simulator


def turned(axes: str, *angles: float) -> np.ndarray:
    """SciPy's rotation of angles in degrees: small letters for fixed axes, capitals for moving ones."""
    return Rotation.from_euler(axes, angles, degrees=True).as_matrix()


RAPID = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1]])  # the tool looks down, its x along −y
# The text, its form where it does not show it, the point in mm, and the rotation: None is that of UR's simulator.
SHOWN = [
    ("p[-0.12011, -0.43176, 0.14607, -0.001221, 3.116276, 0.038892]", None, (-120.11, -431.76, 146.07), None),
    ("X -120.11 Y -431.76 Z 146.07 RX -0.0012 RY 3.1163 RZ 0.0389 rad", "ur", (-120.11, -431.76, 146.07), None),
    # KR 6 R900 at home: the flange looks ahead. Then a line of javakuka.org/26.html.
    ("{X 525, Y 0, Z 890, A 0, B 90, C 0}", "kuka", (525, 0, 890), turned("y", 90)),
    ("PTP {X 280, Y 0, Z -10, A 30, B 90, C 0, S 2, T 35}", "kuka", (280, 0, -10), turned("ZYX", 30, 90, 0)),
    # tech-community.robotics.abb.com/t/robtarget-data/1541
    (
        "P1:=[[568,190,300],[0,0.707107,-0.707107,0],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,0]];",
        *(None, (568, 190, 300), RAPID),
    ),
    ("X 568 Y 190 Z 300 q1 0 q2 0.707107 q3 -0.707107 q4 0", None, (568, 190, 300), RAPID),
    ("568 190 300 0 0.707107 -0.707107 0", "abb", (568, 190, 300), RAPID),
    # A position in a FANUC program.
    (
        "P[1]{\n   GP1:\n  UF : 0, UT : 1,   CONFIG : 'N U T, 0, 0, 0',\n  X =   600.000  mm, Y =   100.000  mm, "
        "Z =   300.000  mm,\n  W =   180.000 deg, P =     0.000 deg, R =     0.000 deg\n};",
        *(None, (600, 100, 300), DOWN),
    ),
    # A program of a press shop, near W P R's singularity (gratownik.ls), and one of a palletiser.
    (
        "P[1]{\n   GP1:\n\tUF : 7, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\tX =   856.686  mm,\t"
        "Y =   197.400  mm,\tZ =   172.511  mm,\n\tW =  -126.099 deg,\tP =    87.946 deg,\tR =   142.594 deg\n};",
        *(None, (856.686, 197.4, 172.511), turned("xyz", -126.099, 87.946, 142.594)),
    ),
    (
        "P[1]{\n   GP1:\n\tUF : 5, UT : 3,\t\tCONFIG : 'N U T, 0, 0, -1',\n\tX = -1833.942  mm,\t"
        "Y =  1271.066  mm,\tZ = -1485.331  mm,\n"
        "\tW =   179.925 deg,\tP =     -.131 deg,\tR =   -38.673 deg\n};",
        *(None, (-1833.942, 1271.066, -1485.331), turned("xyz", 179.925, -0.131, -38.673)),
    ),
    ("X 600 Y 100 Z 300 W 170 P 20 R -35", None, (600, 100, 300), turned("xyz", 170, 20, -35)),
    # uniVAL: VAL_DefineTrsf(10, −13.125, 115.10, 45.5, 25.3, −90.25).
    (
        "{{10,-13.125,115.10,45.5,25.3,-90.25},{ssame,esame,wsame}}",
        *(None, (10, -13.125, 115.1), turned("XYZ", 45.5, 25.3, -90.25)),
    ),
    # Motoman arms with all axes at zero: the flange looks ahead.
    (
        "X 460.000 mm Y 0.000 mm Z 715.000 mm Rx 180.0000 deg. Ry -90.0000 deg. Rz 0.0000 deg.",
        *("yaskawa", (460, 0, 715), np.array([[0, 0, 1], [0, -1, 0], [1, 0, 0]])),
    ),
    # A job of a true Motoman arm, quoted in RoboDK's post processor: both rows stand for a tool along the x axis.
    ("0.001,0.006,-9.794,-170.32,90.00,-170.32", "yaskawa", (0.001, 0.006, -9.794), turned("y", 90)),
    ("0.000,0.000,0.000,180.00,90.00,180.00", "yaskawa", (0, 0, 0), turned("y", 90)),
    # What the controller of an A0509 answered (DoosanRobotics/doosan-robot2, issue 109).
    (
        "-390.9466857910156, -154.82888793945312, 113.21481323242188, 89.90401458740234, -89.98841857910156, "
        "-179.06837463378906",
        *("doosan", (-390.9466857910156, -154.82888793945312, 113.21481323242188)),
        turned("ZYZ", 89.90401458740234, -89.98841857910156, -179.06837463378906),
    ),
    ("posx(559, 34.5, 651.5, 0, 180, 0)", None, (559, 34.5, 651.5), np.diag([-1.0, 1.0, -1.0])),
    ("posx(559, 34.5, 651.5, 45, 170, -10)", None, (559, 34.5, 651.5), turned("ZYZ", 45, 170, -10)),
    # Taught points of an RS005L (nguyen1024/rs005la).
    (
        "495.507904 -83.463379 192.623932 -35.992920 112.299080 -179.965958",
        *("kawasaki", (495.507904, -83.463379, 192.623932), turned("ZYZ", -35.99292, 112.29908, -179.965958)),
    ),
    # Kawasaki programs of a tool for offline programming, beside the roll, pitch and yaw that it wrote them from.
    ("2.2 141.71 431.71 -90 -45 90", "kawasaki", (2.2, 141.71, 431.71), turned("x", -45)),
    (
        "TRANS (118.75, 1191.11, 1093.61, 90, -135, -90)",
        *(None, (118.75, 1191.11, 1093.61), turned("x", 135)),
    ),
    ("0 0 0 180 -135 -90", "kawasaki", (0, 0, 0), turned("xyz", 135, 0, 90)),
    ("TRANS(0, 500, 300, 90, 180, 0)", None, (0, 500, 300), turned("ZYZ", 90, 180, 0)),
    ("X 0 Y 500 Z 300 O 30 A 150 T -60", None, (0, 500, 300), turned("ZYZ", 30, 150, -60)),
    # rc8.tech-guild.com/000456.html, and 001939.html for the order of the turns.
    ("P(100,0,300,0,0,45,-1)", None, (100, 0, 300), turned("z", 45)),
    ("P(350, 0, 300, 180, 10, 90, 5)", None, (350, 0, 300), turned("ZYX", 90, 10, 180)),
    # Tool data of the MELFA manual BFP-A8787: z at a right angle to the flange, then turned about the tool's x.
    ("(0,0,100,0,-90,0)(0,0)", None, (0, 0, 100), turned("y", -90)),
    ("(0,0,100,90,-90,0)", "mitsubishi", (0, 0, 100), turned("YX", -90, 90)),
]


@pytest.mark.parametrize(("text", "form", "point", "R"), SHOWN, ids=[row[0][:24] for row in SHOWN])
def test_what_a_maker_shows_is_read(
    text: str, form: str | None, point: tuple[float, ...], R: np.ndarray | None
) -> None:
    T = kin.pose_from_text(text, form)
    assert np.allclose(T[:3, 3] * 1e3, point, atol=1e-9)
    if R is None:
        assert np.allclose(T, kin.fk("ur5", UR5_STARTS_AT), atol=1e-4)
    else:
        assert np.allclose(T[:3, :3], R, atol=1e-6)


def test_the_arms_of_the_makers_are_where_their_pendants_say() -> None:
    ahead = np.radians([0, -90, 90, 0, 0, 0])
    assert kin.pose_to_text(kin.fk("kr6", ahead), "kuka") == "{X 525, Y 0, Z 890, A 0, B 90, C 0}"
    # tool0 of ROS-Industrial's descriptions is the flange as the controller has it: rpy = "pi -pi/2 0" at zero.
    for fanuc in ("lrmate200id", "crx10ia"):
        T = kin.fk(fanuc, [0.0] * 6)
        assert np.allclose(T[:3, :3], kin.pose_from_text("X 0 Y 0 Z 0 W 180 P -90 R 0")[:3, :3], atol=1e-12)
    shown = "p[-0.120113, -0.431763, 0.146073, -0.001221, 3.116277, 0.038892]"
    assert kin.pose_to_text(kin.fk("ur5", UR5_STARTS_AT), "ur") == shown


def test_a_doosan_arm_is_where_its_manual_says() -> None:
    """An M1013 (lengths 152.5, 620, 34.5, 559, 121 mm) at posj(0, 0, 90, 0, 90, 0)."""
    quarter = math.pi / 2
    rows = [
        *((0.0, 0.1525, 0.0, -quarter), (-quarter, 0.0345, 0.62, 0.0), (quarter, 0.0, 0.0, quarter)),
        *((0.0, 0.559, 0.0, -quarter), (0.0, 0.0, 0.0, quarter), (0.0, 0.121, 0.0, 0.0)),
    ]
    arm = kin.Robot.from_dh(rows)
    shown = kin.pose_from_text("posx(559.0, 34.5, 651.5, 45.0, 180.0, 45.0)")
    assert np.allclose(kin.fk(arm, np.radians([0, 0, 90, 0, 90, 0])), shown, atol=1e-9)
    turned_base = kin.fk(arm, np.radians([30, 0, 90, 0, 90, 0]))
    assert np.allclose(turned_base[:3, 2], [0, 0, -1], atol=1e-9)


@pytest.mark.parametrize("key", FORMS)
def test_what_is_printed_is_read(key: str) -> None:
    rng = np.random.default_rng(3)
    for turn in (*Rotation.random(20, rng=rng).as_matrix(), np.eye(3), DOWN):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = turn, rng.uniform(-0.9, 0.9, 3)
        text = kin.pose_to_text(T, key)
        for read in (kin.pose_from_text(text, key), kin.pose_from_text(f"{key} {text}")):
            assert np.abs(read - T).max() < 3e-6
        assert "-0 " not in f"{text} ", "no negative zero"


@pytest.mark.parametrize("key", FORMS)
def test_every_form_says_where_it_is_defined(key: str) -> None:
    form = FORMS[key]
    assert bool(form.maker) == bool(form.source)
    assert form.written.replace("{{", "").count("{}") == len(form.units_of(Units()))


def test_the_documents_list_every_form() -> None:
    page = (Path(__file__).parents[3] / "docs" / "poses.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \| ([^|]*) \| ([^|]*) \| ([^|]*) \|", page, re.MULTILINE)
    assert [key for key, *_ in rows] == list(FORMS)
    for key, title, names, definition, units in rows:
        form = FORMS[key]
        assert title == form.title
        assert key == "matrix" or names == f"x y z and {form.rotation.names}"
        assert key == "matrix" or definition.strip("`") in form.rotation.definition
        assert bool(units) == (form.units is not None)
        assert not units or units.split(", ")[0] == form.units_of(Units())[0].name
        assert form.source in page


def test_labels_of_several_makers_are_those_of_the_maker_or_asked_for() -> None:
    text = "X 600 Y 100 Z 300 A 10 B 20 C 30"
    with pytest.raises(ReadError, match="KUKA, Doosan or Mitsubishi") as caught:
        read_target(text)
    assert [each.split()[0] for each in caught.value.readings] == ["kuka", "doosan", "mitsubishi"]
    for reading in caught.value.readings:
        assert np.allclose(read_target(reading)[0], kin.pose_from_text(text, reading.split()[0]))
    assert np.allclose(read_target(text, maker="KUKA")[0], kin.pose_from_text(text, "kuka"))
    assert np.allclose(read_target(text, maker="Doosan Robotics")[0], kin.pose_from_text(text, "doosan"))
    # All three turn about y alone.
    assert np.allclose(
        read_target("X 600 Y 100 Z 300 A 0 B 90 C 0")[0],
        kin.pose_from_text(text.replace("10 B 20 C 30", "0 B 90 C 0"), "kuka"),
    )
    with pytest.raises(ReadError, match="staubli or yaskawa"):
        read_target("X 600 mm Y 100 mm Z 300 mm Rx 10 deg Ry 20 deg Rz 30 deg")


MM, M = Units(), Units(degrees=False, length="m")


@pytest.mark.parametrize(
    ("text", "units", "looks", "meant"),
    [
        ("p[600, 100, 300, 0, 3.14, 0]", MM, "lengths look like mm;", "p[0.6, 0.1, 0.3, 0, 3.14, 0]"),
        ("p[0.6, 0.1, 0.3, 0, 180, 0]", MM, "angles look like deg;", "p[0.6, 0.1, 0.3, 0, pi, 0]"),
        ("ur 0.65 0.1 0.3 0 3.14 0", MM, "lengths look like m;", "p[0.65, 0.1, 0.3, 0, 3.14, 0]"),
        ("600 100 300 0 3.14 0", MM, "angles look like rad;", "rpy 600 100 300 0 3.14rad 0"),
        ("600 1 3 0 180 0", M, "lengths look like mm and the angles look like deg;", "rpy 0.6 1mm 3mm 0 pi 0"),
        ("0.60 0.10 0.30 0 10 0", MM, "lengths look like m;", "0.6 m 0.1 m 0.3 m 0° 10° 0°"),
    ],
)
def test_unlikely_sizes_are_asked_about(text: str, units: Units, looks: str, meant: str) -> None:
    with pytest.raises(ReadError, match=looks) as caught:
        read_target(text, units=units)
    first, second = (read_target(each, units=units)[0] for each in caught.value.readings[:2])
    assert np.allclose(first, read_target(meant, units=units)[0], atol=1e-12)
    assert not np.allclose(second, first)


@pytest.mark.parametrize(
    ("text", "form", "said"),
    [
        ("X 600 Y 100 Z 300 A 0 B 90", None, "Found x y z a b"),
        ("X 600 Y 100 Z 300 X 5", None, "“x” is given twice"),
        ("X 600 Y 100 Z 300 W 0 P 90 R zero", None, "Found x y z w p. Valid: x y z qw qx qy qz; "),
        ("X 600 Y 100 Z 300 W 0 P 90 R 0", "kuka", "Found x y z w p r. Valid: x y z a b c"),
        ("600 100 300 0 90", "kuka", "Six numbers are needed for KUKA: Found 5. Valid: x y z A B C in mm and °"),
        ("posx(1, 2)", None, "Six numbers are needed for Doosan"),
        ("xyzw 0.1 0.2 0.3 0.1 0.1 0.1 0.1", None, "The norm of x y z w is 0.2; valid is 1"),
        ("0.1 0.2 0.3 0.4", "matrix", "12 or 16 numbers"),
        ("kuka", None, "“kuka” is not a number"),
        ("0.4 0 0.3", None, "no orientation"),
        ("kuka 2000000 0 0 0 0 0", None, "too far away"),
        ("1" * 3000, None, "too long"),
    ],
)
def test_what_is_no_pose_is_named(text: str, form: str | None, said: str) -> None:
    with pytest.raises(ReadError) as caught:
        kin.pose_from_text(text, form)
    assert said in str(caught.value)


def test_an_unknown_form_is_refused_with_the_known_ones() -> None:
    calls = (lambda: kin.pose_from_text("1 2 3 0 0 0", "kukka"), lambda: kin.pose_to_text(np.eye(4), "kukka"))
    for call in calls:
        with pytest.raises(kin.InputError, match=r'form: got .kukka.*"wxyz".*"mitsubishi"'):
            call()
    with pytest.raises(kin.InputError, match="text: got 5"):
        read_target(5)


def test_points_directions_and_commas_are_read_as_elsewhere() -> None:
    assert read_target("0,4; 0; 0,3")[1] == "position"
    assert read_target("X 0,4 Y 0 Z 0,3")[1] == "position"
    T, task = read_target("0.4 0 0.3 along 0 0 -1")
    assert task == "approach"
    assert T[2, 2] == pytest.approx(-1.0)
    decimal = kin.pose_from_text("X 600,5 Y 100,25 Z 300 A 0 B 90 C 0", "kuka")
    assert np.allclose(decimal[:3, 3], (0.6005, 0.10025, 0.3))
    assert kin.pose_from_text("kuka X 2*300 Y 10cm Z 0.3m A 0 B pi/2 C 0")[0, 3] == pytest.approx(0.6)
    assert math.isclose(kin.pose_from_text("KUKA: x=600; y=100; z=300; a=0; b=90; c=0")[0, 2], 1.0)
