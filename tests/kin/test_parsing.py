"""Texts of strangers: what is too large, too deep or has too many values is refused before it is parsed."""

from __future__ import annotations

import contextlib
import json
import time
import tomllib

import pytest

import kin
from kin import parsing
from kin.files.read import LIMITS
from kin.parsing import Limits, TextError, read_csv, read_json, read_toml, to_toml

SMALL = Limits(size=1000, values=10, depth=3)
WIDE = Limits(size=10_000_000, values=1_000_000)


@pytest.fixture
def unparsed(monkeypatch) -> None:
    """No parser may see the text."""

    def parse(text: str, **_: object) -> object:
        raise AssertionError(f"{len(text)} characters were parsed")

    monkeypatch.setattr(parsing.json, "loads", parse)
    monkeypatch.setattr(parsing.tomllib, "loads", parse)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (" " * 1001, r"1001 characters, expected at most 1000 characters"),
        (b" " * 1001, r"1001 bytes, expected at most 1000 bytes"),
        ("[" + "{}," * 10 + "0]", r"more than 10 values, expected at most 10 values"),
        ("]" * 11, r"more than 10 values"),
        ('{"a": [[[0]]]}', r"nested more than 3 deep, expected at most 3 deep"),
        ('["]]]", [[["[[", 0]]]]', r"nested more than 3 deep"),
        ('["\\"]]]", [[[0]]]]', r"nested more than 3 deep"),
        (b'\xff"', r"can't decode byte 0xff.*, expected JSON in UTF-8"),
    ],
)
@pytest.mark.usefixtures("unparsed")
def test_json_beyond_a_limit_is_not_parsed(text, message):
    with pytest.raises(TextError, match=message):
        read_json(text, SMALL)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("#" * 1001, r"1001 characters"),
        ("a=1\n" * 11, r"more than 10 values"),
        ("a = [[[[0]]]]", r"nested more than 3 deep"),
        ("a = '''\n[]]]''' # ]]]\nb = [[[[0]]]]", r"nested more than 3 deep"),
        ('a = """x"" \\""" ]]"""\nb = {c={c={c={}}}}', r"nested more than 3 deep"),
        ("a.b.c.d = 1", r"a key of more than 3 parts, expected at most 3 parts"),
        ("[a . \"b.b\"\t.'c'.d]", r"a key of more than 3 parts"),
        ("x = {a.b.c.d = 1}", r"a key of more than 3 parts"),
    ],
)
@pytest.mark.usefixtures("unparsed")
def test_toml_beyond_a_limit_is_not_parsed(text, message):
    with pytest.raises(TextError, match=message):
        read_toml(text, SMALL)


@pytest.mark.parametrize(
    "value",
    [
        {"a": ["[[[[", "]]]]", '"[{', "\\", ",,,,,,,,,,,,"], "b": {"c": [1.5, -2e300, None, True]}},
        {},
        "[[[[[",
        0,
    ],
)
def test_json_within_the_limits_is_read_as_python_reads_it(value):
    limits = Limits(1000, 30, 4)
    for text in (json.dumps(value), json.dumps(value, indent=2)):
        assert read_json(text, limits) == read_json(b"\xef\xbb\xbf" + text.encode(), limits) == value


@pytest.mark.parametrize(
    "text",
    [
        'a = "[[[[ a.b.c.d.e = 1, 2, 3, 4"  # and [[[[ here, , , , , , a.b.c.d.e',
        "a = 'C:\\[[[['\nb = '''it''s [[[[ '''''\n",
        'a = """\n"" \\""" [[[[ """""\nb.c."d.e" = [1.5, 1979-05-27T07:32:00.5Z]',
        "",
    ],
)
def test_toml_within_the_limits_is_read_as_python_reads_it(text):
    assert read_toml(text, SMALL) == tomllib.loads(text)


def test_toml_that_is_written_is_read_as_the_same_values_and_its_short_lists_are_on_one_line():
    row = {"name": "a [\n    1,\n]", "limits": [-1.5, 2], "matrix": [[1, 0], [0, 1]], "empty": [], "x.y": True}
    data = {"texts": ["q, \u2028[", "," * 100], "home": {"q": [0, 1]}, "rows": [row, {"points": [{"at": [1]}]}]}
    text = to_toml(data)
    assert tomllib.loads(text) == data
    for line in ("limits = [-1.5, 2]", "matrix = [", "    [1, 0],", "    [0, 1],", "]", "q = [0, 1]", "[[rows]]"):
        assert line in text.split("\n"), line


@pytest.mark.parametrize("text", ["", "{", "[1,", '"open', "1" * 5000, "nul", "'", "\\"])
def test_what_is_no_json_is_refused_with_its_reason(text):
    with pytest.raises(TextError, match="expected valid JSON"):
        read_json(text, WIDE)


@pytest.mark.parametrize("text", ["a", "a = [", 'a = "open', "a = " + "1" * 5000, '"""', "'''", "a = 1 ]"])
def test_what_is_no_toml_is_refused_with_its_reason(text):
    with pytest.raises(TextError, match="expected valid TOML"):
        read_toml(text, WIDE)


def test_numbers_that_are_no_json_are_refused_where_that_is_asked_for():
    assert read_json("[Infinity]", SMALL) == [float("inf")]
    with pytest.raises(TextError, match="'NaN' is no finite number"):
        read_json("[NaN]", SMALL, finite=True)


@pytest.mark.parametrize("unit", ['"', "'", '\\"', "a.", "a ", "[", "#", '"""', "'''", "\\", '"\\', "{a=", "\n"])
def test_looking_for_strings_and_keys_takes_linear_time(unit, monkeypatch):
    """A few hundredths of a second; half a minute, if the end of an open string were searched again and again."""
    monkeypatch.setattr(parsing.tomllib, "loads", len)
    monkeypatch.setattr(parsing.json, "loads", lambda text, **_: len(text))
    text = unit * (200_000 // len(unit))
    began = time.thread_time()
    for read in (read_json, read_toml):
        with contextlib.suppress(TextError):
            read(text, WIDE)
    assert time.thread_time() - began < 3.0


def rows(data: bytes) -> list[tuple[int, list[str]]]:
    return list(read_csv(data, Limits(1000, 100)))


def test_rows_of_csv_have_the_numbers_of_their_last_lines():
    assert rows(b'\xef\xbb\xbfa,b\r\n"1\n2",3\n') == [(1, ["a", "b"]), (3, ["1\n2", "3"])]
    assert rows(b"") == []


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"," * 101, "a row of more than 100 characters, expected at most 100 characters"),
        (b"a\n" + b'"\n",' * 40, "a row of more than 100 characters"),
        (b"a" * 1001, "1001 bytes, expected at most 1000 bytes"),
        (b'"a"b', "expected valid CSV"),
        (b"\xff", "expected CSV in UTF-8"),
    ],
)
def test_a_row_of_csv_is_bounded(data, message):
    with pytest.raises(TextError, match=message):
        rows(data)


# The doors of `kin`


def test_a_robot_file_with_a_key_of_many_parts_is_refused():
    """`tomllib` needs memory that grows with the square of their number: 200 MB for 16 kB."""
    with pytest.raises(
        kin.RobotFileError, match="mine: file: got 'a key of more than 16 parts', expected at most"
    ):
        kin.files.parse_robot("a" + ".a" * 500 + " = 1", "mine")


@pytest.mark.parametrize("text", ["a" + ".a" * 500 + " = 1", '{"a": ' + "[" * 500 + "]" * 500 + "}"])
def test_a_program_that_is_nested_deeply_is_refused(text):
    with pytest.raises(kin.InputError, match=r"program: got '.* more than 16 (parts|deep)', expected at most 16"):
        kin.motion.parse_program(text)


def test_a_calibration_that_is_nested_deeply_is_refused():
    with pytest.raises(kin.InputError, match="calibration: got 'nested more than 4 deep', expected at most"):
        kin.motors.motors_from_lerobot("so101", '{"a": ' + "[" * 100 + "]" * 100 + "}")
    with pytest.raises(kin.InputError, match="expected LeRobot's calibration"):
        kin.motors.motors_from_lerobot("so101", "{")


def test_the_arms_of_the_library_are_far_from_the_limits():
    few = Limits(LIMITS.size // 10, LIMITS.values // 10, LIMITS.depth // 2)
    for robot in kin.builtin_robots().values():
        data = kin.robot_to_dict(robot)
        assert read_json(json.dumps(data), few) == json.loads(json.dumps(data))
