"""Rows from files and standard input, their answers, and JSON that is what REST answers."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from versions import needs_ompl

import kin
from app.cli import parser
from app.cli.pipes import source
from app.cli.pipes.sink import opened_output
from app.shared.problems import Problem

ROOT = Path(__file__).parents[3]
UR5 = kin.get_robot("ur5")
TARGETS = [
    {"position": [0.4, 0.1, 0.3], "wxyz": [0.0, 1.0, 0.0, 0.0]},
    {"position": [9.0, 0.0, 0.0]},
    {"position": [0.3, -0.2, 0.4], "approach": [0.0, 0.0, -2.0]},
    {"matrix": kin.pose_from_position_wxyz([0.2, 0.4, 0.3], [0.3, 0.9, 0.1, 0.2]).tolist()},
]


def wxyz(T):
    return kin.wxyz_from_rotation(T[:3, :3]).tolist()


@pytest.fixture
def run(capsysbinary, monkeypatch):
    """Runs one command with bytes as standard input: exit code, standard output and standard error."""

    def command(*words, given=b""):
        text = given if isinstance(given, bytes) else given.encode()
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text)))
        code = parser.main([str(word) for word in words])
        out, err = capsysbinary.readouterr()
        return code, out, err.decode()

    return command


def lines(values):
    return "".join(json.dumps(value) + "\n" for value in values)


def array(values):
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


# -- rows ------------------------------------------------------------------------------------------------------


def test_targets_as_json_lines_get_the_answers_of_rest(run, client):
    code, out, err = run("ik", "ur5", "--targets", "-", given=lines(TARGETS))
    assert (code, err) == (1, "")
    found = [json.loads(line) for line in out.splitlines()]
    assert found == client.post("/api/v1/robots/ur5/ik", json={"target": TARGETS}).json()["results"]
    assert [len(each["solutions"]) for each in found][:2] == [8, 0]


@pytest.mark.parametrize("task", ["position", "approach"])
def test_a_task_that_is_named_holds_for_all_lines(run, client, task):
    some = [TARGETS[0], TARGETS[3]]
    _, out, _ = run("ik", "ur5", "--targets", "-", "--task", task, "--max-solutions", 2, given=lines(some))
    asked = {"target": some, "task": task, "max_solutions": 2}
    assert [json.loads(line) for line in out.splitlines()] == client.post(
        "/api/v1/robots/ur5/ik", json=asked
    ).json()["results"]


def test_lines_in_frames_of_their_own_are_those_of_rest(run, client):
    rounded = np.round(kin.pose_from_position_wxyz([0.1, 0.0, 0.2], [0.3, 0.9, 0.1, 0.2]), 5).tolist()
    some = [{**TARGETS[0], "frame": "table"}, TARGETS[0], {"matrix": rounded, "frame": "table"}]
    words = ("--workpiece", "table=100:0:50:0:0:90", "--tool", "0:0:120", "--base", "0:0:10:0:0:45")
    _, out, _ = run("ik", "ur5", "--targets", "-", *words, given=lines(some))
    asked = {
        "target": some,
        "workpieces": {"table": {"xyz": [0.1, 0, 0.05], "rpy": [0, 0, np.pi / 2]}},
        "tool": {"xyz": [0, 0, 0.12]},
        "base": {"xyz": [0, 0, 0.01], "rpy": [0, 0, np.pi / 4]},
    }
    assert [json.loads(line) for line in out.splitlines()] == client.post(
        "/api/v1/robots/ur5/ik", json=asked
    ).json()["results"]
    framed = UR5.with_base(kin.pose_from_xyz_rpy([0, 0, 0.01], [0, 0, np.pi / 4])).with_mounted(
        kin.pose_from_xyz_rpy([0, 0, 0.12])
    )
    table = kin.pose_from_xyz_rpy([0.1, 0, 0.05], [0, 0, np.pi / 2])
    first = json.loads(out.splitlines()[0])["solutions"][0]["q"]
    expected = table @ kin.pose_from_position_wxyz(TARGETS[0]["position"], TARGETS[0]["wxyz"])
    assert np.abs(kin.fk(framed, first) - expected).max() < 1e-9


@pytest.mark.parametrize("form", ["csv", "npy", "ndjson"])
def test_what_one_command_writes_the_other_reads(run, form):
    q = UR5.random_q(np.random.default_rng(5), 9)
    rows = "q6,q5,note,q4,q3,q2,q1\n" + "".join(
        ",".join([*map(repr, each[:3:-1].tolist()), "x", *map(repr, each[3::-1].tolist())]) + "\n" for each in q
    )
    given = {"csv": rows, "npy": array(q), "ndjson": lines(q.tolist())}[form]
    code, poses, _ = run("fk", "ur5", "--configurations", "-", given=given)
    assert code == 0
    code, solved, err = run("ik", "ur5", "--targets", "-", given=poses)
    assert (code, err) == (0, "")
    code, again, _ = run("fk", "ur5", "--configurations", "-", "--format", "npy", given=solved)
    assert code == 0
    assert np.abs(np.load(io.BytesIO(again)) - kin.fk(UR5, q)).max() < 1e-9


def parquet(columns):
    """A Parquet file in which groups of rows are smaller than pieces."""
    file = io.BytesIO()
    pq.write_table(pa.table(columns), file, row_group_size=3)
    return file.getvalue()


def test_a_parquet_file_is_answered_as_the_same_table_in_csv(run, tmp_path, monkeypatch):
    monkeypatch.setattr(source, "AT_ONCE", 4)
    T = kin.fk(UR5, UR5.random_q(np.random.default_rng(8), 9))
    T[2, :3, 3] = 9.0
    names = ["x", "y", "z", "qw", "qx", "qy", "qz"]
    rows = [[*pose[:3, 3].tolist(), *wxyz(pose)] for pose in T]
    table = ",".join(names) + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows)
    file = tmp_path / "in.parquet"
    columns = dict(zip(names, np.transpose(rows), strict=True))
    file.write_bytes(parquet({"note": ["x"] * 9, **columns}))
    expected = run("ik", "ur5", "--targets", "-", given=table)
    assert expected[0] == 1
    assert len(expected[1].splitlines()) == 10
    assert run("ik", "ur5", "--targets", file) == expected
    assert run("ik", "ur5", "--targets", "-", given=file.read_bytes()) == expected
    assert run("ik", "ur5", "--targets", file, "-o", tmp_path / "out.ndjson")[0] == 1
    answers = list(map(json.loads, (tmp_path / "out.ndjson").read_text().splitlines()))
    assert [each["status"] for each in answers] == ["solved"] * 2 + ["unreachable"] + ["solved"] * 6
    # What ik writes into a Parquet file, fk reads.
    run("ik", "ur5", "--targets", file, "-o", tmp_path / "out.parquet")
    _, poses, _ = run("fk", "ur5", "--configurations", tmp_path / "out.parquet", "--format", "npy")
    found = np.load(io.BytesIO(poses))
    assert np.isnan(found[2]).all()
    assert np.abs(np.delete(found, 2, 0) - np.delete(T, 2, 0)).max() < 1e-8


def test_without_the_extra_a_parquet_file_is_refused_with_what_is_missing(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    (tmp_path / "in.parquet").write_bytes(b"PAR1")
    code, _, err = run("ik", "ur5", "--targets", tmp_path / "in.parquet")
    assert code == 2
    assert "pip install 'kinboard[parquet]'" in err


def test_what_was_not_solved_has_no_pose(run):
    _, solved, _ = run("ik", "ur5", "--targets", "-", "--format", "csv", given=lines(TARGETS))
    rows = list(csv.DictReader(solved.decode().splitlines()))
    assert [row["status"] for row in rows] == ["solved", "unreachable", "solved", "solved"]
    assert rows[1]["q1"] == ""
    _, poses, _ = run("fk", "ur5", "--configurations", "-", given=solved)
    found = list(csv.DictReader(poses.decode().splitlines()))
    assert found[1] == dict.fromkeys(found[1], "")
    assert [float(found[2][axis]) for axis in "xyz"] == pytest.approx(TARGETS[2]["position"])
    _, poses, _ = run("fk", "ur5", "--configurations", "-", "--format", "ndjson", given=solved)
    assert json.loads(poses.splitlines()[1]) is None


def test_rows_without_a_heading_are_numbers_in_order(run, client):
    q = [[0.1, -1.0, 1.2, 0.3, 1.1, 0.2], [9.0, 0, 0, 0, 0, 0]]
    given = "".join(",".join(map(str, each)) + "\r\n" for each in q)
    _, out, _ = run("fk", "ur5", "--configurations", "-", "--format", "ndjson", "--frames", given=given)
    asked = {"q": q, "frames": True}
    assert [json.loads(line) for line in out.splitlines()] == client.post(
        "/api/v1/robots/ur5/fk", json=asked
    ).json()["results"]


def test_the_form_of_a_file_is_seen_from_its_content_and_written_when_complete(run, tmp_path):
    (tmp_path / "in.txt").write_text(lines(TARGETS[:1]) * 3)
    out = tmp_path / "out.npy"
    code, said, _ = run("ik", "ur5", "--targets", tmp_path / "in.txt", "-o", out, "--format", "npy")
    assert (code, said.decode()) == (0, f"{out}: 3 of 3 targets have an exact solution\n")
    T = kin.fk(UR5, np.load(out))
    assert np.abs(T[:, :3, 3] - TARGETS[0]["position"]).max() < 1e-9
    (tmp_path / "in.txt").write_text(lines([TARGETS[0], {"position": [0, "a", 0]}]))
    kept = out.read_bytes()
    assert run("ik", "ur5", "--targets", tmp_path / "in.txt", "-o", out, "--format", "npy", "--strict")[0] == 2
    assert out.read_bytes() == kept
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.txt", "out.npy"]


@pytest.mark.parametrize("mark", [";", "\t"])
@pytest.mark.parametrize("heading", [True, False])
def test_a_table_with_decimal_commas_is_the_table_with_points(run, mark, heading):
    """As spreadsheets write it in most of Europe."""
    names, row = "x,y,z,qw,qx,qy,qz\n" * heading, "0.4,0.1,0.3,0,1,0,0\n"
    expected = run("ik", "ur5", "--targets", "-", given=names + row)
    given = names.replace(",", mark) + row.replace(",", mark).replace(".", ",")
    assert run("ik", "ur5", "--targets", "-", given=given) == expected
    assert expected[0] == 0


@pytest.mark.parametrize("to_file", [False, True])
@pytest.mark.parametrize(
    "given",
    [
        "sep=;\nx;y;z;qw;qx;qy;qz\n0,4;0,1;0,3;0;1;0;0\n",
        "# exported by a spreadsheet\n#\nx,y,z,qw,qx,qy,qz\n0.4,0.1,0.3,0,1,0,0\n",
        "x y z  qw qx qy qz\n 0.4  0.1 0.3 0 1 0 0\n",
        "x, y, z, qw, qx, qy, qz\n0.4, 0.1, 0.3, 0, 1, 0, 0\n",
        "x\ty\tz\tqw\tqx\tqy\tqz\n0,4\t0,1\t0,3\t0\t1\t0\t0\n".encode("utf-16"),
        "note,x,y,z,qw,qx,qy,qz\nGröße,0.4,0.1,0.3,0,1,0,0\n".encode("latin-1"),
    ],
    ids=["sep", "comment", "spaces", "comma and space", "UTF-16", "a column in Latin-1"],
)
def test_what_programs_write_around_a_table_is_read(run, tmp_path, given, to_file):
    expected = run("ik", "ur5", "--targets", "-", given="x,y,z,qw,qx,qy,qz\n0.4,0.1,0.3,0,1,0,0\n")[1]
    if not to_file:
        assert run("ik", "ur5", "--targets", "-", given=given)[:2] == (0, expected)
        return
    (tmp_path / "in.csv").write_bytes(given if isinstance(given, bytes) else given.encode())
    assert run("ik", "ur5", "--targets", tmp_path / "in.csv", "-o", tmp_path / "out.csv")[0] == 0
    assert (tmp_path / "out.csv").read_bytes() == expected


@pytest.mark.parametrize("to_file", [False, True])
def test_a_row_behind_comments_is_named_by_its_line(run, tmp_path, to_file):
    given = "# a\nx,y,z,qw,qx,qy,qz\n0.4,0.1,0.3,0,1,0,b\n"
    (tmp_path / "in.csv").write_text(given)
    words = (tmp_path / "in.csv", "-o", tmp_path / "out.csv") if to_file else ("-",)
    code, _, err = run("ik", "ur5", "--strict", "--targets", *words, given=given)
    assert (code, "--targets line 3:" in err) == (2, True), err


def test_more_rows_than_one_piece_are_answered_in_order(run, monkeypatch):
    monkeypatch.setattr(source, "AT_ONCE", 4)
    monkeypatch.setattr(source, "_CHUNK", 100)
    q = UR5.random_q(np.random.default_rng(6), 23)
    given = "q1,q2,q3,q4,q5,q6\n" + "".join(",".join(map(repr, each)) + "\n" for each in q.tolist())
    _, out, _ = run("fk", "ur5", "--configurations", "-", "--format", "npy", given=given)
    assert np.array_equal(np.load(io.BytesIO(out)), kin.fk(UR5, q))


@pytest.mark.full
def test_each_line_is_answered_before_the_next_one_is_sent():
    words = [sys.executable, "-m", "app.cli", "fk", "ur5", "--configurations", "-"]
    with subprocess.Popen(
        words, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=os.environ | {"PYTHONPATH": str(ROOT)}
    ) as process:
        for q in UR5.random_q(np.random.default_rng(7), 3).tolist():
            process.stdin.write(json.dumps(q).encode() + b"\n")
            process.stdin.flush()
            found = json.loads(process.stdout.readline())
            assert found["pose"]["matrix"] == kin.fk(UR5, q).tolist()
        process.stdin.close()
        assert process.wait(30) == 0


@pytest.mark.parametrize(
    ("command", "given", "said"),
    [
        ("ik", "", "at least one row"),
        ("ik", "x,y,z,qw,qx,qy,qz\n", "at least one row"),
        ("ik", "a,b\n1,2\n", "a heading with the columns x, y, z, qw, qx, qy, qz"),
        ("ik", "x,y,z,roll,pitch,yaw\n1,2,3,0,0,0\n", "--form reads other columns"),
        ("ik", "# nothing else\n", "at least one row"),
        ("ik", "0.4,0.1,0.3,0,1,0,0\n0.4,0.1,0.3,0,1,0,b\n", r"--targets line 2"),
        ("ik", "0.4,0.1,0.3,0,0,0,0\n", r"--targets line 1.* norm of w x y z is 0; valid is 1"),
        ("ik", "0.4,0.1,0.3,0,0.24,0,0\n", r"--targets line 1.*qw, qx, qy, qz. The norm of w x y z is 0.24"),
        ("ik", "0,4,0,1,0,3,0,0,1,0,0,0,0,0\n", "semicolons separate the numbers"),
        ("ik", "x;y;z;qw;qx;qy;qz\n\n0,4;0.1;0,3;0;1;0;b\n", r"--targets line 3"),
        ("ik", "0.4,0.1,nan,0,1,0,0\n", r"--targets line 1.*7 finite numbers"),
        ("ik", lines([TARGETS[0], {"position": [1, 2]}]), r"--targets line 2\.position"),
        ("ik", lines([TARGETS[0], [1, 2]]), r"--targets line 2: .*a target such as"),
        ("ik", lines([{"position": [1, 2, 3], "pose": 1}]), r"--targets line 1\.pose"),
        ("ik", lines([{"position": [1, 2, 3], "frame": "moon"}]), "moon"),
        ("ik", lines([{"wxyz": [1, 0, 0, 0]}]), "position, with one of wxyz"),
        ("ik", lines([{"position": [1, 2, 3], "rpy": [0, 0]}]), r"--targets line 1\.rpy"),
        ("ik", lines([{"text": "X 1 Y 2 Z 3 A 10 B 20 C 30"}]), "begin with kuka or doosan or mitsubishi"),
        ("ik", lines([{"matrix": [[1, 0], [0, 1]]}]), r"--targets line 1\.matrix"),
        ("ik", lines([{"position": [1e999, 0, 0]}]), r"--targets line 1\.position"),
        ("ik", '{"position": [0.4, 0.1', "a line of JSON"),
        ("ik", "[" * 100_000, "a line of JSON"),
        ("ik", b'{"text": "\xff"}', "text in UTF-8"),
        ("ik", array(np.eye(4)), "an array of poses"),
        ("ik", array(np.array([object()])), "a broken .npy file"),
        ("ik", b"\x93NUMPY\x01\x00", "a broken .npy file"),
        ("ik", b"PAR1", "a Parquet file with the columns x, y, z"),
        ("ik", parquet({"x": [1.0]}), "a Parquet file with the columns x, y, z"),
        (
            "ik",
            parquet({name: [0.5, None] for name in ("x", "y", "z", "qw", "qx", "qy", "qz")}),
            r"--targets\[1\]",
        ),
        ("fk", parquet({f"q{i + 1}": ["a"] for i in range(6)}), r"--configurations\[0\]"),
        ("fk", parquet({f"q{i + 1}": np.zeros(0) for i in range(6)}), "at least one row"),
        ("fk", lines([[1, 2, 3]]), "6 joint values"),
        ("fk", lines([[[1, 2, 3, 4, 5, 6]]]), "a list of 6 joint values"),
        ("fk", lines([{"x": 1}]), "a list of 6 joint values"),
        ("fk", "1,2,3,4,5,inf\n", r"--configurations line 1"),
        ("fk", "1,2,3,4,5,6\n１,2,3,4,5,6\n", r"--configurations line 2"),
        ("fk", array(np.array([[1, 2, 3, 4, 5, 6], [np.nan, 0, 0, 0, 0, 0]])), r"--configurations\[1\]"),
        ("fk", array(np.zeros((0, 6))), "at least one row"),
        ("fk", "x" * (1 << 21), "shorter lines"),
    ],
)
def test_a_row_that_is_none_is_named(run, command, given, said):
    option = {"ik": "--targets", "fk": "--configurations"}[command]
    code, _, err = run(command, "ur5", option, "-", "--strict", given=given)
    assert code == 2
    assert re.search(said, err), err
    assert len(err) < 500
    assert "Traceback" not in err


ROWS = (
    "x,y,z,qw,qx,qy,qz\n0.4,0.1,0.3,0,1,0,0\n\n0.4,0.1,0.3,0,1,0,b\n400,100,300,0,1,0,0\n0.4,0.1,0.3,0,0.24,0,0\n"
    "0.4,2e6,0.3,0,1,0,0\n0.3,0.1,0.4,0,1,0,0\n"
)
REASONS = [
    "",
    r"--targets line 4: .*7 numbers: x, y, z, qw, qx, qy, qz",
    r"too far away\. Targets are in metres\.",
    r"--targets line 6: .*0\.24; valid is 1",
    r"--targets line 7 position: .*coordinates below 1e6 m",
    "",
]


@pytest.mark.parametrize("output", ["-", "csv", "ndjson", "npy", "parquet"])
def test_a_row_that_is_none_loses_no_other(run, tmp_path, output):
    source, out = tmp_path / "in.csv", tmp_path / f"out.{output}"
    source.write_text(ROWS)
    code, said, err = run("ik", "ur5", "--targets", source, "-o", "-" if output == "-" else out)
    assert code == 1
    solved, statuses = [0, 5], ["solved", "invalid", "unreachable", "invalid", "invalid", "solved"]
    if output == "-":
        assert "3 rows are no target (column reason)" in err
        table = list(csv.DictReader(io.StringIO(said.decode())))
    else:
        assert "2 of 6 targets have an exact solution; 3 rows are no target (column reason)" in said.decode()
    if output == "npy":
        assert np.flatnonzero(~np.isnan(np.load(out)).any(axis=1)).tolist() == solved
        return
    if output == "csv":
        table = list(csv.DictReader(out.read_text().splitlines()))
    elif output == "parquet":
        table = pq.read_table(out).to_pylist()
    elif output == "ndjson":
        table = [json.loads(line) for line in out.read_text().splitlines()]
    assert [row["status"] for row in table] == statuses
    for row, expected in zip(table, REASONS, strict=True):
        assert re.search(expected, row["reason"]) if expected else row["reason"] == "" or output == "ndjson"
    if output == "csv":
        poses = list(csv.DictReader(io.StringIO(run("fk", "ur5", "--configurations", out)[1].decode())))
        assert [row["x"] and round(float(row["x"]), 9) for row in poses] == [0.4, "", "", "", "", 0.3]


@pytest.mark.parametrize("form", ["csv", "ndjson", "npy"])
def test_a_configuration_that_cannot_be_read_loses_no_other(run, form):
    given = "q1,q2,q3,q4,q5,q6\n0,-1,1,0,1,0\n\n0,-1,1,0,1,b\n,,,,,\n0,-1,1,0,inf,0\n0,-1,1,0,1,0\n"
    code, out, err = run("fk", "ur5", "--configurations", "-", "--format", form, given=given)
    assert code == 1
    assert "of 5 configurations 2 rows are no configuration (column reason)" in err
    if form == "npy":
        assert np.flatnonzero(~np.isnan(np.load(io.BytesIO(out))).any(axis=(1, 2))).tolist() == [0, 4]
        return
    if form == "ndjson":
        found = list(map(json.loads, out.splitlines()))
        assert [None if each is None else each.get("status", "read") for each in found] == [
            *("read", "invalid", None, "invalid", "read")
        ]
        reasons = ["" if each is None else each.get("reason", "") for each in found]
    else:
        rows = list(csv.DictReader(io.StringIO(out.decode())))
        assert [bool(row["x"]) for row in rows] == [True, False, False, False, True]
        reasons = [row["reason"] for row in rows]
    assert [reason.partition(": ")[0] for reason in reasons] == [
        *("", "--configurations line 4", "", "--configurations line 6[4]", "")
    ], reasons


def test_configurations_may_be_as_the_pendant_shows_them(run):
    q = np.radians([[0, 10, 20, 0, -90, 0], [5, 30, 50, 0, -90, 0]])
    given = lines(kin.motors.to_pendant("lrmate200id", q).tolist())
    _, out, _ = run("fk", "lrmate200id", "--configurations", "-", "--pendant", "--format", "npy", given=given)
    assert np.abs(np.load(io.BytesIO(out)) - kin.fk("lrmate200id", q)).max() < 1e-12
    answers = "".join(json.dumps({"q": each.tolist()}) + "\n" for each in q)  # those of ik, with joint values
    _, again, _ = run("fk", "lrmate200id", "--configurations", "-", "--pendant", "--format", "npy", given=answers)
    assert again == out


def test_a_reader_that_leaves_is_no_file_that_cannot_be_written(tmp_path):
    with pytest.raises(BrokenPipeError), opened_output(str(tmp_path / "out.csv")):
        raise BrokenPipeError
    with (
        pytest.raises(kin.InputError, match="a file that can be written"),
        opened_output("missing/out.csv"),
    ):
        pass


def test_solutions_may_be_as_the_pendant_shows_them(run, tmp_path):
    arm, q = kin.get_robot("lrmate200id"), np.radians([[0, 10, 20, 0, -90, 0], [5, 30, 50, 0, -90, 0]])
    np.save(tmp_path / "in.npy", kin.fk(arm, q))
    shown = kin.motors.to_pendant(arm, kin.solve_ik_many(arm, kin.fk(arm, q)).q)
    asked = "ik", arm.id, "--pendant", "--targets", tmp_path / "in.npy"
    for words in (("--format", "npy"), ("-o", tmp_path / "out.npy")):
        code, out, err = run(*asked, *words)
        assert code == 0, err
        written = out if "--format" in words else (tmp_path / "out.npy").read_bytes()
        assert np.load(io.BytesIO(written)) == pytest.approx(shown, abs=1e-12)
    _, answers, _ = run(*asked, "--format", "ndjson")
    for line, each in zip(answers.splitlines(), shown, strict=True):
        assert json.loads(line)["solutions"][0]["pendant"] == pytest.approx(each, abs=1e-9)
    _, table, _ = run(*asked, "--format", "csv")
    _, poses, _ = run("fk", arm.id, "--pendant", "--configurations", "-", "--format", "npy", given=table)
    assert np.load(io.BytesIO(poses)) == pytest.approx(kin.fk(arm, q), abs=1e-9)


def test_rows_that_end_in_a_space_and_empty_lines_before_a_table_are_read_from_files_too(run, tmp_path):
    (tmp_path / "in.csv").write_text("\n# a comment\n0.4 0.1 0.3 0 1 0 0 \n")
    code, _, err = run("ik", "ur5", "--targets", tmp_path / "in.csv", "-o", tmp_path / "out.csv")
    assert code == 0, err
    assert (tmp_path / "out.csv").read_text().count("solved") == 1


@pytest.mark.parametrize("mark", [",", ";"])
def test_a_table_in_the_form_of_a_maker_goes_both_ways(run, tmp_path, mark):
    decimal = str.maketrans(".", ",") if mark == ";" else {}
    given = "Y,X,Z,A,B,C,name\n100,400.5,300,10,20,180,a\n-100,350,250,0,90,0,b\n".replace(",", mark).translate(
        decimal
    )
    for words in (("-",), (tmp_path / "in.csv", "-o", tmp_path / "out.csv")):
        (tmp_path / "in.csv").write_text(given)
        code, out, err = run("ik", "ur5", "--form", "kuka", "--targets", *words, given=given)
        assert code == 0, err
        text = out.decode() if words == ("-",) else (tmp_path / "out.csv").read_text()
        rows = list(csv.DictReader(io.StringIO(text)))
        q = np.array([[float(row[f"q{i + 1}"]) for i in range(6)] for row in rows])
        meant = [kin.pose_from_text(f"kuka {each}") for each in ("400.5 100 300 10 20 180", "350 -100 250 0 90 0")]
        assert np.abs(kin.fk(UR5, q) - meant).max() < 1e-9
        back = run("fk", "ur5", "--form", "kuka", "--configurations", "-", given=text)[1].decode()
        first, second = csv.DictReader(io.StringIO(back))
        assert [float(first[name]) for name in ("x", "y", "z", "a", "b", "c")] == pytest.approx(
            [400.5, 100, 300, 10, 20, 180]
        ) or float(first["c"]) == pytest.approx(-180)
        assert float(second["b"]) == pytest.approx(90)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("ik", "ur5", "--targets", "-", "--form", "matrix"), "a form whose numbers have names"),
        (("fk", "ur5", "0", "--configurations", "-"), "no joint values besides"),
        (("fk", "ur5", "0", "-o", "x.csv"), "--configurations FILE as well"),
        (("fk", "ur5", "--configurations", "none.csv"), "a file that can be read"),
        (("fk", "ur5", "--configurations", "-", "-o", "out.txt"), "a name that ends in"),
        (("ik", "ur5", "--position", "1", "2", "3", "--format", "csv"), "--targets FILE as well"),
        (("ik", "ur5", "--targets", "-", "--frame", "tool"), "a frame that does not move"),
        (("ik", "ur5", "--targets", "-", "--tool", "1:2"), "is not X:Y:Z"),
        (("move", "ur5"), "either a program or --programs"),
        (("move", "ur5", "a.toml", "--programs", "-"), "either a program or --programs"),
        (("move", "ur5", "--programs", "-", "--format", "csv"), "no --format besides"),
    ],
)
def test_options_that_do_not_go_together_are_refused(run, words, said):
    code, _, err = run(*words, given=lines([TARGETS[0]]) if words[0] == "ik" else lines([[0.0] * 6]))
    assert (code, said in err) == (2, True), err


# -- programs --------------------------------------------------------------------------------------------------

PROGRAM = {"units": {"angle": "deg"}, "segments": [{"kind": "ptp", "q": [30, -80, 80, 10, 70, 20]}]}


def test_a_program_may_be_json_and_its_answer_is_that_of_rest(run, client, tmp_path):
    file = tmp_path / "program.json"
    file.write_text("\ufeff " + json.dumps(PROGRAM, indent=2), encoding="utf-8")
    _, out, _ = run("move", "ur5", file, "--json", "--rate", 10)
    expected = client.post("/api/v1/robots/ur5/motion", json={"program": PROGRAM, "rate": 10.0}).json()
    assert json.loads(out) == expected
    assert len(expected["samples"]["t"]) > 5
    _, out, _ = run("move", "ur5", "-", "--json", "--no-samples", given=json.dumps(PROGRAM))
    assert json.loads(out) == {key: value for key, value in expected.items() if key != "samples"}


def test_many_programs_are_answered_line_by_line(run, client):
    programs = [PROGRAM, {"segments": [{"kind": "ptp", "q": [9, 0, 0, 0, 0, 0]}]}, PROGRAM]
    code, out, _ = run("move", "ur5", "--programs", "-", "--tool", "0:0:50", given=lines(programs))
    assert code == 1
    found = [json.loads(line) for line in out.splitlines()]
    assert [each["planned"] for each in found] == [True, False, True]
    asked = {"program": PROGRAM, "tool": {"xyz": [0, 0, 0.05]}}
    assert found[2] == client.post("/api/v1/robots/ur5/motion", json=asked).json()
    broken = {"segments": [{"kind": "ptp", "q": [9]}]}
    code, out, err = run("move", "ur5", "--programs", "-", given=lines([PROGRAM, broken]))
    assert (code, len(out.splitlines())) == (2, 1)
    assert "--programs line 2.segments[0].q" in err


@pytest.mark.parametrize(("text", "said"), [("{", "valid JSON"), ("x = ", "valid TOML"), ("[]", "valid TOML")])
def test_a_program_that_is_neither_is_refused(run, text, said):
    code, _, err = run("move", "ur5", "-", given=text)
    assert (code, said in err) == (2, True), err


# -- JSON ------------------------------------------------------------------------------------------------------


def test_json_lists_all_solutions_as_rest_does(run, client):
    words = ("ik", "ur5", "--position", 400, 100, 300, "--wxyz", 0, 1, 0, 0, "--tool", "0:0:120:0:0:90")
    code, out, _ = run(*words, "--json")
    asked = {"target": TARGETS[0], "tool": {"xyz": [0, 0, 0.12], "rpy": [0, 0, np.pi / 2]}}
    assert code == 0
    assert json.loads(out) == client.post("/api/v1/robots/ur5/ik", json=asked).json()
    assert len(json.loads(out)["solutions"]) == 8


@pytest.mark.parametrize(
    ("words", "kind", "field"),
    [
        (("ik", "ur5", "--position", "a", "2", "3"), "invalid-input", None),
        (("ik", "nobody", "--position", "1", "2", "3"), "unknown-robot", "robot_id"),
        (("fk", "ur5", "1"), "invalid-input", "q"),
        (("fk", "ur5", "--configurations", "-", "--strict"), "invalid-input", "--configurations line 1"),
        (("move", "ur5", "none.toml"), "invalid-input", "PROGRAM"),
        (("ik", "ur5"), "bad-request", None),
        (("ik", "ur5", "--nonsense", "1", "--position", "1", "2", "3"), "bad-request", None),
        (("workspace", "ur5", "--strategy", "nonsense"), "bad-request", None),
    ],
)
def test_errors_in_json_are_problem_documents(run, words, kind, field):
    code, out, err = run(*words, "--json", given="[1]")
    assert (code, err) == (2, "")
    document = json.loads(out)
    assert Problem.model_validate(document, strict=True, extra="forbid").model_dump() == document
    assert document["type"] == f"urn:kinboard:problem:{kind}"
    assert document["hint"].startswith("Robots: " if kind == "unknown-robot" else f"`kinboard {words[0]} --help`")
    assert [each["field"] for each in document["errors"]] == ([field] if field else [])
    code, out, err = run(*words, given="[1]")
    assert (code, out) == (2, b"")
    assert document["detail"] in err or kind == "unknown-robot"


def test_an_unknown_robot_is_refused_as_in_rest(run, client):
    document = json.loads(run("robots", "nobody", "--json")[1])
    rest = client.get("/api/v1/robots/nobody").json()
    assert {**document, "hint": ""} == {**rest, "hint": ""}


@needs_ompl
def test_a_way_is_piped_to_the_motion_of_its_program(run):
    words = ("way", "ur5", "--start", 0, -90, 90, 0, 90, 0, "--goal", 60, -90, 90, 0, 90, 0, "-o", "-")
    code, program, err = run(*words)
    assert code == 0
    assert "A way was found" in err
    _, out, _ = run("move", "ur5", "-", "--json", "--start", 0, -90, 90, 0, 90, 0, given=program)
    assert json.loads(out)["samples"]["q"][-1] == pytest.approx(np.radians([60, -90, 90, 0, 90, 0]).tolist())


@pytest.mark.full
def test_limits_that_are_wider_than_the_arm_are_intersected_in_rest_and_here(run, client):
    words = ("ik", "panda", "--position", 400, 100, 500, "--wxyz", 0, 1, 0, 0, "--limit", "1=-180:180", "--json")
    code, out, _ = run(*words)
    assert code == 2
    assert "wider_limits" in json.loads(out)["detail"]
    _, out, _ = run(*words, "--wider-limits", "intersect")
    asked = {"target": {"position": [0.4, 0.1, 0.5], "wxyz": [0, 1, 0, 0]}, "wider_limits": "intersect"}
    asked["limits"] = [[-np.pi, np.pi], *[None] * 6]
    assert json.loads(out) == client.post("/api/v1/robots/panda/ik", json=asked).json()
    address = "/api/v1/robots/panda/workspace/summary"
    assert client.get(f"{address}?limit=1:-9:9").status_code == 422
    assert client.get(f"{address}?limit=1:-9:9&wider_limits=intersect&effort=2").status_code == 200


def test_a_program_in_the_frame_of_a_workpiece(run):
    segment = {"kind": "lin", "frame": "table", "position": [0.0, 0.0, 0.02]}
    start = (0, -90, 90, 0, 90, 0)
    T = kin.fk(UR5, np.radians(start))
    x, y, z = 1e3 * T[:3, 3]
    words = ("move", "ur5", "-", "--json", "--start", *start, "--workpiece", f"table={x}:{y}:{z}")
    code, out, _ = run(*words, given=json.dumps({"segments": [segment]}))
    assert code == 0
    assert json.loads(out)["samples"]["position"][-1] == pytest.approx(
        (T[:3, 3] + [0, 0, 0.02]).tolist(), abs=1e-6
    )
