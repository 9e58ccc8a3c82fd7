"""Every field of the page and the command line read the same table of numbers, and refuse the same texts."""

from __future__ import annotations

import math
import re
from argparse import Namespace
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from number_cases import DEGREES, MM, READ, REFUSED

import kin
from app.cli.terminal import configuration, quantity, units_of
from app.exercises.questions import Number
from app.viewer.panel.entry import read_cell, read_value
from app.viewer.panel.readout import html
from app.viewer.tabs.program.typed import Fields
from app.viewer.tabs.robot.edits import quantity as quantity_of_cell
from kin import KinematicsError
from kin.motion import Circ, Ptp
from kin.poses import read_pose, roll_pitch_yaw
from kin.typed import EntryError, ReadError
from kin.units import PLAIN, Unit, Units

UR5 = kin.get_robot("ur5")
START = kin.fk(UR5, UR5.q_home)
# In a list, spaces, commas and brackets separate numbers: another reading, or one that is asked back.
LONE = ("1\u202f234,5", "pi/2 + 90", "35 cm + 50", "1,250", "1,250 m", ",5", "(1", "1)")


def units_with(unit: Unit) -> Units:
    """A choice of units that has this one."""
    return Units(unit.name != "rad", unit.name if unit.is_length else "mm")  # type: ignore[arg-type]


def in_target(text: str, unit: Unit) -> float:
    if unit.is_length:
        return float(read_pose("position", f"{text}; 0; 0", units_with(unit), START)[0][0, 3])
    if unit.is_angle:
        return roll_pitch_yaw(read_pose("angles", f"0; 0; {text}", units_with(unit), START)[0][:3, :3])[2]
    T = read_pose("pose", f"1 2 3 along 0; 3; {text}", Units(), START)[0]
    return float(3.0 * T[2, 2] / T[1, 2])


def in_table(text: str, unit: Unit) -> float:
    value, name = quantity_of_cell(text, units_with(unit), unit.is_angle).split()
    assert name == ("rad" if unit.is_angle else "m")
    return float(value)


def in_program(text: str, unit: Unit) -> float:
    fields = Fields(UR5, units_with(unit), np.eye(4), "pose")
    if unit.is_angle:
        (q0, *_) = fields.read("q0", text, Ptp(UR5.q_home), [UR5.q_home]).target.q
        return float(q0)
    via = fields.read("via", f"0; 0; {text}", Circ([0, 0, 0], UR5.q_home), [UR5.q_home]).via
    return float(via[2])


DOORS: dict[str, Callable[[str, Unit], float]] = {
    "joint field": lambda text, unit: read_value(text, "Joint 2", unit, (-900.0, 900.0)),
    "target": in_target,
    "cell": read_cell,
    "DH table": in_table,
    "program": in_program,
    "answer": lambda text, unit: Number("", 0.0, unit, 1.0, "").read_text(text),
    "command": lambda text, unit: quantity(text, unit, "q[0]"),
}
QUANTITIES = ("DH table", "program", "joint field")  # angles and lengths alone
LISTS = ("target", "program")


@pytest.mark.parametrize("door", DOORS)
def test_every_door_reads_every_text(door: str) -> None:
    for text, unit, value in READ:
        if (unit == PLAIN and door in QUANTITIES) or (door in LISTS and text in LONE):
            continue
        if door == "program" and unit.is_angle and not abs(value) <= 2.0 * math.pi:
            continue
        turn = door == "target" and unit.is_angle
        expected = math.remainder(value, 2.0 * math.pi) if turn else value
        found = DOORS[door](text, unit)
        off = math.remainder(found - expected, 2.0 * math.pi) if turn else found - expected
        assert off == pytest.approx(0.0, abs=1e-7), (door, text, unit.name)


@pytest.mark.parametrize("door", DOORS)
def test_every_door_refuses_every_wrong_text(door: str) -> None:
    for text, unit, words in REFUSED:
        if (unit == PLAIN and door in QUANTITIES) or (door in LISTS and text in LONE):
            continue
        with pytest.raises(KinematicsError) as caught:
            DOORS[door](text, unit)
        listed = door == "target" or (door == "program" and unit.is_length)
        assert listed or words.lower() in str(caught.value).lower(), (door, text)


def test_what_typed_ambiguously_moves_nothing_shows_both_readings() -> None:
    """`0,4 0,1 0,3` was six numbers."""
    for text, readings in {
        "0,4 0,1 0,3": ("0 4 0 1 0 3", "0.4 0.1 0.3"),
        "0,4, 0,1, 0,3": ("0 4 0 1 0 3", "0.4 0.1 0.3"),
        "1,250; 2,500; 3,750": ("1.250 2.500 3.750", "1250 2500 3750"),
        "1,250 2,500 3,750": ("1 250 2 500 3 750", "1.250 2.500 3.750", "1250 2500 3750"),
    }.items():
        with pytest.raises(EntryError) as caught:
            read_pose("pose", text, Units(), START)
        assert caught.value.readings == readings
        assert all(reading in caught.value.detail for reading in readings)
        found = [read_pose("pose", reading, Units(), START)[0] for reading in readings]
        assert not any(np.allclose(found[0], other) for other in found[1:])


@pytest.mark.parametrize(
    ("kind", "text", "numbers"),
    [
        ("position", "0,4 0,1 0,3", (0.4, 0.1, 0.3)),  # six numbers are no point
        ("position", "1,2,3", (1, 2, 3)),
        ("position", "100,200,300", (100, 200, 300)),
        ("position", "400 mm, 10 cm, 0.3 m", (400, 100, 300)),
        ("position", "2*200 -300/3 (100+200)", (400, -100, 300)),
        ("pose", "0.4 m 0.1 m 0.3 m", (400, 100, 300)),
        ("pose", "0 0 0.3 m", (0, 0, 300)),
        ("pose", "0,4; 0,1; 0,3", (0.4, 0.1, 0.3)),
        ("pose", "0,4 0,1 0,3 1 0 0 0", (0.4, 0.1, 0.3)),  # 7 numbers: ten are no pose
        ("pose", "400 100 300 90deg 0 pi/2", (400, 100, 300)),
        ("pose", "400 100 300 mm 0 pi/2 0 rad", (400, 100, 300)),
        ("pose", "0,4 m; 0,1 m; 0,3 m along 0 0 -1", (400, 100, 300)),
    ],
)
def test_a_list_has_one_reading_where_only_one_is_valid(kind: str, text: str, numbers: tuple[float, ...]) -> None:
    T, _ = read_pose(kind, text, Units(), START)  # type: ignore[arg-type]
    assert 1e3 * T[:3, 3] == pytest.approx(numbers, abs=1e-9)


def test_a_unit_after_the_last_number_may_hold_for_all() -> None:
    with pytest.raises(EntryError) as caught:
        read_pose("pose", "0.4 0.1 0.3 m", Units(), START)
    assert caught.value.readings == ("0.4 m 0.1 m 0.3 m", "0.4 mm 0.1 mm 0.3 m")
    for reading in caught.value.readings:
        read_pose("pose", reading, Units(), START)


@pytest.mark.parametrize("length", ["mm", "cm", "m"])
def test_a_pasted_matrix_is_in_the_units_on_screen(length: str) -> None:
    units = Units(length=length)  # type: ignore[arg-type]
    on_screen = START.copy()
    on_screen[:3, 3] *= units.lengths.scale
    for typed in (np.array2string(on_screen, precision=15), repr(on_screen), str(on_screen.tolist())):
        assert np.allclose(read_pose("pose", typed, units, np.eye(4))[0], START, atol=1e-7)
    in_metres = repr(START)
    for text in (
        f"{in_metres} m",
        f"{in_metres}m",
        "\n".join(" ".join(map(repr, row)) for row in START.tolist()) + " m",
    ):
        assert np.allclose(read_pose("pose", text, units, np.eye(4))[0], START, atol=1e-7)
    if length != "m":
        with pytest.raises(EntryError, match=f"look like metres; the unit on screen is {length}") as caught:
            read_pose("pose", in_metres, units, np.eye(4))
        as_metres, as_shown = (read_pose("pose", text, units, np.eye(4))[0] for text in caught.value.readings)
        assert np.allclose(as_metres, START, atol=1e-7)
        assert np.allclose(as_shown[:3, 3] * units.lengths.scale, START[:3, 3], atol=1e-7)


lists = st.lists(st.integers(-999_999, 999_999), min_size=3, max_size=3)
separators = st.sampled_from([" ", "  ", "; ", ", ", "\n", "\u00a0", " | "])


@given(lists, separators, st.booleans(), st.sampled_from(["mm", "cm", "m"]))
def test_a_point_in_any_spelling_is_that_point_or_refused(
    thousandths: list[int], separator: str, comma: bool, length: str
) -> None:
    units = Units(length=length)  # type: ignore[arg-type]
    text = separator.join(f"{x / 1000:.3f}".replace(".", "," if comma else ".") for x in thousandths)
    expected = [units.lengths.read(x / 1000) for x in thousandths]
    for kind in ("position", "pose"):
        try:
            T, _ = read_pose(kind, text, units, START)  # type: ignore[arg-type]
        except EntryError as error:
            readings = error.readings
        else:
            assert T[:3, 3] == pytest.approx(expected, abs=1e-12)
            continue
        assert comma
        found = [read_pose(kind, reading, units, START)[0][:3, 3] for reading in readings]  # type: ignore[arg-type]
        assert any(np.allclose(each, expected, rtol=0.0, atol=1e-12) for each in found)


@pytest.mark.parametrize("units", [Units(), Units(False, "cm"), Units(True, "m")], ids=str)
def test_the_readout_can_be_pasted_into_the_target(units: Units) -> None:
    rows = re.findall(r"<tr.*?</tr>", html(START, units), re.DOTALL)
    shown = [re.findall(r">([−\d.]+)</span>", row) for row in rows]
    T, _ = read_pose("pose", "  ".join(shown[0]) + "\n" + "  ".join(shown[1]), units, np.eye(4))
    assert np.allclose(T[:3, 3], START[:3, 3], atol=1e-4)
    assert np.allclose(T[:3, :3], START[:3, :3], atol=3e-3)
    T, _ = read_pose("quaternion", "  ".join(shown[2]), units, np.eye(4))
    assert np.allclose(T[:3, :3], START[:3, :3], atol=3e-3)


def test_commands_take_each_value_in_its_own_unit() -> None:
    arguments = Namespace(rad=False)
    q = configuration(UR5, ["90", "pi/2", "90deg", "1,5 rad", " -1/3", "0"], "q", units_of(arguments))
    assert q == pytest.approx([*[math.pi / 2] * 3, 1.5, math.radians(-1 / 3), 0.0])
    with pytest.raises(KinematicsError, match=r"q\[1\]: “x” is not a number \(unknown: x\); valid: .*°, deg, rad"):
        configuration(UR5, ["0", "x", *"0000"], "q", units_of(arguments))
    with pytest.raises(KinematicsError, match=re.escape("--position: “1,300” may be written with thousands")):
        quantity("1,300", MM, "--position")


def test_an_error_of_a_field_keeps_its_readings() -> None:
    with pytest.raises(ReadError) as caught:
        read_cell("1,250", MM)
    assert caught.value.readings == ("1.250", "1250")
    with pytest.raises(EntryError) as caught_entry:
        read_value("1,250", "Joint 1", MM, (0.0, 2.0))
    assert caught_entry.value.readings == ("1.250", "1250")
    assert read_value("1,250", "Joint 1", DEGREES, (0.0, 2.0)) == math.radians(1.25)
