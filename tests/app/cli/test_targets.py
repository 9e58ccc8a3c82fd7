"""``kinboard ik --targets``: a file of targets to a file of joint values."""

from __future__ import annotations

import csv
import json
import re
import sys

import distributed
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import kin
from app.cli import targets
from app.cli.parser import main
from app.cli.pipes import source
from app.cli.pipes.poses import PoseTable

COLUMNS = ["x", "y", "z", "qw", "qx", "qy", "qz"]


def poses(count):
    robot = kin.get_robot("ur5")
    T = kin.fk(robot, robot.random_q(np.random.default_rng(3), count))
    T[2, :3, 3] = 9.0
    return T


def wxyz(T):
    """A quaternion of a rotation, by its largest part."""
    K = np.array(
        [
            [T[0, 0] - T[1, 1] - T[2, 2], T[0, 1] + T[1, 0], T[0, 2] + T[2, 0], T[2, 1] - T[1, 2]],
            [0, T[1, 1] - T[0, 0] - T[2, 2], T[1, 2] + T[2, 1], T[0, 2] - T[2, 0]],
            [0, 0, T[2, 2] - T[0, 0] - T[1, 1], T[1, 0] - T[0, 1]],
            [0, 0, 0, T[0, 0] + T[1, 1] + T[2, 2]],
        ]
    )
    x, y, z, w = np.linalg.eigh(K, UPLO="U")[1][:, -1]
    return [w, x, y, z]


@pytest.fixture
def small(monkeypatch):
    """Pieces of four targets."""
    monkeypatch.setattr(targets, "AT_ONCE", 4)
    monkeypatch.setattr(source, "AT_ONCE", 4)


@pytest.mark.usefixtures("small")
def test_a_numpy_file_gets_what_solve_ik_many_gives(tmp_path, capsys):
    T = poses(11)
    np.save(tmp_path / "in.npy", T)
    out = tmp_path / "out.npy"
    assert main(["ik", "ur5", "--targets", str(tmp_path / "in.npy"), "-o", str(out)]) == 1
    assert "10 of 11 targets have an exact solution" in capsys.readouterr().out
    found = np.load(out)
    assert np.array_equal(found, kin.solve_ik_many("ur5", T).q, equal_nan=True)
    solved = np.delete(np.arange(11), 2)
    assert np.abs(kin.fk("ur5", found[solved]) - T[solved]).max() < 1e-9
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.npy", "out.npy"]


@pytest.mark.usefixtures("small")
def test_a_csv_file_in_a_frame_gets_the_status_of_each(tmp_path, capsys):
    T = poses(6)
    with (tmp_path / "in.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows([*map(float, each[:3, 3] - (0.1, 0.0, 0.2)), *map(float, wxyz(each))] for each in T)
    out = tmp_path / "out.csv"
    words = ["ik", "ur5", "--targets", str(tmp_path / "in.csv"), "-o", str(out), "--json"]
    assert main([*words, "--frame", "table", "--workpiece", "table=100:0:200"]) == 1
    assert json.loads(capsys.readouterr().out) == {"targets": 6, "solved": 5, "invalid": 0}
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert [row["status"] for row in rows] == ["solved"] * 2 + ["unreachable"] + ["solved"] * 3
    assert rows[2]["q1"] == ""
    q = [float(rows[4][f"q{i + 1}"]) for i in range(6)]
    assert np.abs(kin.fk("ur5", q) - T[4]).max() < 1e-8


def table(path, T, rows=3):
    """A Parquet file of targets, with row groups of a few."""
    columns = np.array([[*each[:3, 3], *wxyz(each)] for each in T]).T
    made = pa.table({"note": ["x"] * len(T), **dict(zip(COLUMNS, columns, strict=True))})
    pq.write_table(made, path, row_group_size=rows)


@pytest.mark.usefixtures("small")
def test_a_parquet_file_gets_a_table_with_the_status_of_each(tmp_path, capsys):
    T = poses(11)
    table(tmp_path / "in.parquet", T)
    out = tmp_path / "out.parquet"
    assert main(["ik", "ur5", "--targets", str(tmp_path / "in.parquet"), "-o", str(out)]) == 1
    assert "10 of 11 targets have an exact solution" in capsys.readouterr().out
    found = pq.read_table(out)
    assert found.column_names == ["status", *(f"q{i + 1}" for i in range(6)), "reason"]
    assert found["status"].to_pylist() == ["solved"] * 2 + ["unreachable"] + ["solved"] * 8
    assert found["q1"][2].as_py() is None
    q = np.array([found[f"q{i + 1}"].to_pylist() for i in range(6)], dtype=float).T
    solved = np.delete(np.arange(11), 2)
    assert np.abs(kin.fk("ur5", q[solved]) - T[solved]).max() < 1e-8
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.parquet", "out.parquet"]


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("first", [0, 2, 3, 7, 11])
def test_a_parquet_file_is_read_from_any_row_on(tmp_path, first):
    T = poses(11)
    table(tmp_path / "in.parquet", T)
    found = [read().T for read in targets._targets(tmp_path / "in.parquet", first, PoseTable())]
    assert len(found) == 11 - first
    assert not found or np.abs(found - T[first:]).max() < 1e-12


def test_without_the_extra_a_sentence_says_what_is_missing(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    np.save(tmp_path / "in.npy", poses(3))
    (tmp_path / "in.parquet").write_bytes(b"PAR1")
    words = ["ik", "ur5", "--targets"]
    assert main([*words, str(tmp_path / "in.npy"), "-o", str(tmp_path / "out.parquet")]) == 2
    assert "pip install 'kinboard[parquet]'" in capsys.readouterr().err
    assert main([*words, str(tmp_path / "in.parquet"), "-o", str(tmp_path / "out.npy")]) == 2
    assert "pip install 'kinboard[parquet]'" in capsys.readouterr().err


@pytest.mark.full
@pytest.mark.usefixtures("small")
def test_what_is_no_parquet_file_of_targets_is_refused_by_name(tmp_path, capsys):
    source, out = tmp_path / "in.parquet", tmp_path / "out.npy"
    given = [
        (b"no table", "a heading with the columns x, y, z"),
        ({"x": [1.0]}, "the columns x, y, z"),
        ({name: ["a"] for name in COLUMNS}, r"--targets\[0\]"),
        ({name: [0.5, 0.5, None] for name in COLUMNS}, r"--targets\[2\]"),
        ({name: [0.5] * 5 + [0.0] for name in COLUMNS}, r"--targets\[5\]"),
    ]
    for content, message in given:
        if isinstance(content, bytes):
            source.write_bytes(content)
        else:
            pq.write_table(pa.table(content), source)
        assert main(["ik", "ur5", "--targets", str(source), "-o", str(out), "--strict"]) == 2
        assert re.search(message, capsys.readouterr().err), message
        assert not out.exists()


@pytest.mark.full
@pytest.mark.usefixtures("small")
def test_a_cluster_writes_the_same_file(tmp_path, capsys):
    np.save(tmp_path / "in.npy", poses(30))
    words = ["ik", "ur5", "--targets", str(tmp_path / "in.npy"), "-o"]
    assert main([*words, str(tmp_path / "here.csv")]) == 1
    with distributed.LocalCluster(1, processes=False, protocol="tcp", dashboard_address=None) as cluster:
        assert main([*words, str(tmp_path / "there.csv"), "--dask", cluster.scheduler_address]) == 1
    assert (tmp_path / "there.csv").read_bytes() == (tmp_path / "here.csv").read_bytes()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--targets", "in.npy", "-o", "out.npy", "--dask", "nowhere"], "the address of a running scheduler"),
        (["--targets", "in.npy", "-o", "-", "--dask", "tcp://127.0.0.1:1"], "as .npy, .csv or .parquet files"),
        (["--position", "100", "0", "0", "--dask", "tcp://127.0.0.1:1"], "--targets FILE as well"),
    ],
)
def test_a_cluster_that_cannot_help_is_refused(tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    np.save("in.npy", poses(3))
    assert main(["ik", "ur5", *words]) == 2
    said = capsys.readouterr().err
    assert "--dask" in said
    assert message in said


@pytest.mark.full
@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("ending", ["npy", "csv", "parquet"])
def test_an_interrupted_run_goes_on_where_it_ended(tmp_path, monkeypatch, ending):
    T = poses(18)
    np.save(tmp_path / "in.npy", T)
    words = ["ik", "ur5", "--targets", str(tmp_path / "in.npy"), "-o"]
    whole = tmp_path / f"whole.{ending}"
    main([*words, str(whole)])
    asked = []

    def interrupted(self, some):
        first = int(re.search(r"\d+", some[0].place)[0])
        if first == 8 and not asked.count(8):
            asked.append(first)
            raise KeyboardInterrupt
        asked.append(first)
        return answers(self, some)

    answers = targets.Question.answers
    monkeypatch.setattr(targets, "processors", lambda: 1)
    monkeypatch.setattr(targets.Question, "answers", interrupted)
    out = tmp_path / f"out.{ending}"
    assert main([*words, str(out)]) == 130
    assert not out.exists()
    asked.clear()
    asked.append(8)  # it does not happen again
    assert main([*words, str(out)]) == 1
    assert min(asked) == 8
    assert out.read_bytes() == whole.read_bytes()
    # Another question begins anew, whatever is left of the first.
    (tmp_path / f"out.{ending}.part").write_bytes(b"left over")
    (tmp_path / f"out.{ending}.state").write_text('{"key": "other", "done": 8, "solved": 8, "size": 4}')
    asked.clear()
    main([*words, str(out)])
    assert min(asked) == 0
    assert out.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize(
    ("content", "words", "message"),
    [
        (np.eye(3), [], "an array of poses"),
        (np.empty((0, 4, 4)), [], "at least one row"),
        (np.full((5, 4, 4), np.nan), [], r"--targets\[0\]"),
        (np.stack([np.eye(4)] * 5 + [np.zeros((4, 4))]), [], r"--targets\[5\]"),
        (np.eye(4)[None], ["--wxyz", "1", "0", "0", "0"], "no --wxyz: the file has the orientations"),
        (np.eye(4)[None], ["--frame", "tool"], "a frame that does not move"),
        ("a,b\n1,2\n", [], "the columns x, y, z"),
        ("[]\n", [], "a .npy file of poses"),
        ("x,y,z,qw,qx,qy,qz\n0,0,0,1,0,0\n", [], r"--targets line 2.*7 numbers"),
    ],
)
@pytest.mark.usefixtures("small")
def test_what_is_no_file_of_targets_is_refused_by_name(tmp_path, capsys, content, words, message):
    source = tmp_path / ("in.csv" if isinstance(content, str) else "in.npy")
    source.write_text(content) if isinstance(content, str) else np.save(source, content)
    out = tmp_path / "out.npy"
    assert main(["ik", "ur5", "--targets", str(source), "-o", str(out), "--strict", *words]) == 2
    assert re.search(message, capsys.readouterr().err)
    assert not out.exists()


@pytest.mark.parametrize("out", ["out.txt", "nowhere/out.npy"])
def test_an_output_that_cannot_be_written_is_refused_first(tmp_path, monkeypatch, capsys, out):
    monkeypatch.chdir(tmp_path)  # long paths are shortened in messages
    np.save("in.npy", poses(3))
    assert main(["ik", "ur5", "--targets", "in.npy", "-o", out]) == 2
    assert "--output" in capsys.readouterr().err
    assert main(["ik", "ur5", "--targets", "none.npy", "-o", "out.npy"]) == 2
    assert "none.npy" in capsys.readouterr().err
