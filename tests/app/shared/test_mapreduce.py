"""Blocks by threads and by real processes: a scheduler and two workers of Dask's, of which one is killed."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kin
from app.cli import parser
from app.exports.capability import WRITERS
from app.shared import mapreduce
from kin import InputError

distributed = pytest.importorskip("distributed")
ROOT = Path(__file__).parents[3]
# No file of a robot that the workers know: it travels with the grid.
OWN = replace(kin.get_robot("redundant7-craig"), id="own", home=(0.1, 0.4, 0.2, 1.0, 0.1, 0.5, 0.0))


def arrays(found):
    return {name: getattr(found, name) for name in ("index", "centres", "approachable", "share", "manipulability")}


def assert_same(a, b):
    for name, array in arrays(a).items():
        assert array.tobytes() == arrays(b)[name].tobytes(), name


class Cluster:
    """A scheduler and workers, each a process of its own; no nanny that would start a killed one again."""

    def __init__(self, folder):
        self.folder = folder
        self.file = folder / "scheduler.json"
        self.processes = {}
        self.start("scheduler", "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        self.address = self.wait_for_address()
        for name in ("one", "two"):
            self.start(name, "worker", "--no-nanny", "--nthreads", "1", "--name", name, "--no-dashboard")

    def start(self, name, *words):
        paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        with (self.folder / f"{name}.log").open("wb") as log:
            self.processes[name] = subprocess.Popen(
                [sys.executable, "-m", "dask", *words, "--scheduler-file", str(self.file)],
                cwd=self.folder,
                env={**os.environ, "PYTHONPATH": paths},
                stdout=log,
                stderr=log,
            )

    def wait_for_address(self):
        deadline = time.monotonic() + 60.0
        while time.monotonic() < deadline:
            assert self.processes["scheduler"].poll() is None, (self.folder / "scheduler.log").read_text()
            if self.file.exists() and self.file.read_text():
                return json.loads(self.file.read_text())["address"]
            time.sleep(0.05)
        raise AssertionError("the scheduler did not start")

    def stop(self):
        for process in self.processes.values():
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    found = Cluster(tmp_path_factory.mktemp("dask"))
    yield found
    found.stop()


def busy(client, name):
    """Whether this worker has blocks to compute."""
    workers = client.scheduler_info(n_workers=-1)["workers"]
    address = next((address for address, worker in workers.items() if worker["name"] == name), None)
    return bool(client.processing().get(address))


# Written to be run in this order: first one worker dies, at last the scheduler.


@pytest.mark.full
def test_a_worker_killed_in_mid_run_loses_nothing(cluster):
    grid = kin.workspace.capability_grid(OWN, resolution=14)
    with distributed.Client(cluster.address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
        blocks, killed = [], None
        for block in mapreduce.run_dask(grid, cluster.address):
            blocks.append(block)
            if killed is None and len(blocks) >= 2:
                assert busy(client, "one")
                assert busy(client, "two")
                cluster.processes["two"].kill()
                killed = len(blocks)
        assert killed < len(grid.blocks) - 2
        assert len(client.scheduler_info(n_workers=-1)["workers"]) == 1
    assert sorted(block.block for block in blocks) == list(range(len(grid.blocks)))
    there = kin.workspace.capability_join(grid, blocks)
    assert_same(there, kin.workspace.capability_join(grid, mapreduce.run_local(grid)))
    assert len(there.index) > 500


@pytest.mark.full
def test_the_command_line_gives_the_same_file_from_a_cluster(cluster, capsys, tmp_path):
    words = ["capability", "pioneer5", "--resolution", "8", "--directions", "12", "--json", "-o"]
    assert parser.main([*words, str(tmp_path / "here.npz")]) == 0
    here = capsys.readouterr()
    assert parser.main([*words, str(tmp_path / "there.npz"), "--dask", cluster.address]) == 0
    assert capsys.readouterr() == here
    assert here.err == ""
    assert (tmp_path / "here.npz").read_bytes() == (tmp_path / "there.npz").read_bytes()


def test_an_iterator_closed_early_leaves_the_cluster_free(cluster):
    grid = kin.workspace.capability_grid(OWN, resolution=14)
    blocks = mapreduce.run_dask(grid, cluster.address)
    next(blocks)
    blocks.close()
    with distributed.Client(cluster.address, set_as_default=False) as client:
        deadline = time.monotonic() + 30.0
        while busy(client, "one") and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not busy(client, "one")


@pytest.mark.full
def test_a_map_is_not_cut_short_when_the_scheduler_dies(cluster, caplog):
    grid = kin.workspace.capability_grid(OWN, resolution=14)
    blocks = mapreduce.run_dask(grid, cluster.address)
    next(blocks)
    cluster.processes["scheduler"].kill()
    with caplog.at_level(logging.CRITICAL, "distributed"), pytest.raises(InputError, match="scheduler"):
        list(blocks)


# Threads


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_do_not_change_a_bit(threads):
    grid = kin.workspace.capability_grid(kin.get_robot("puma560"), resolution=10)
    blocks = list(mapreduce.run_local(grid, threads))
    assert len(blocks) == len(grid.blocks) > 2
    assert_same(
        kin.workspace.capability_join(grid, blocks), kin.workspace.capability_map(grid.robot, resolution=10)
    )


def test_closing_the_iterator_cancels_what_has_not_begun(monkeypatch):
    grid = kin.workspace.capability_grid(kin.get_robot("pioneer5"), resolution=60, directions=12)
    begun = []

    def slow(grid, block):
        begun.append(block)
        time.sleep(0.02)
        return block

    monkeypatch.setattr(mapreduce, "capability_block", slow)
    blocks = mapreduce.run_local(grid, 2)
    next(blocks)
    blocks.close()
    assert len(begun) < len(grid.blocks) // 2


# The command line


@pytest.mark.parametrize(
    ("address", "expected"),
    [
        ("localhost", "the address of a running scheduler"),
        ("tcp://127.0.0.1:1", "the address of a running scheduler"),
    ],
)
def test_a_scheduler_that_is_not_there(monkeypatch, capsys, address, expected):
    monkeypatch.setattr(mapreduce, "_CONNECT", 0.3)
    assert parser.main(["capability", "pioneer5", "--resolution", "4", "--dask", address]) == 2
    assert expected in capsys.readouterr().err


def test_without_the_extra_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    grid = kin.workspace.capability_grid(kin.get_robot("pioneer5"), resolution=4)
    with pytest.raises(InputError, match=r"kinboard\[cluster\]"):
        next(mapreduce.run_dask(grid, "tcp://127.0.0.1:1"))


def test_the_summary_is_for_people(capsys):
    assert parser.main(["capability", "puma560", "--voxel", "200", "--directions", "12", "--lock", "1=30"]) == 0
    out, err = capsys.readouterr()
    assert err == ""  # progress is for terminals
    assert "voxels of 200.000 mm" in out
    assert "12, closed form" in out


@pytest.mark.full
@pytest.mark.parametrize("ending", WRITERS)
def test_files_hold_the_map(capsys, tmp_path, ending):
    path = tmp_path / f"map{ending}"
    words = ["capability", "puma560", "--resolution", "5", "--directions", "12", "-o", str(path), "--json"]
    assert parser.main(words) == 0
    answer = json.loads(capsys.readouterr().out)
    found = kin.workspace.capability_map(kin.get_robot("puma560"), resolution=5, directions=12)
    assert answer["reachable"] == len(found.index)
    assert answer["mean_share"] == pytest.approx(found.share.mean())
    assert answer["best_manipulability_at"] == found.centres[found.manipulability.argmax()].tolist()
    read(ending)(path, found)


def read(ending):
    def npz(path, found):
        with np.load(path) as data:
            for name, array in arrays(found).items():
                assert (data[name] == array).all()
            assert (data["directions"] == found.grid.directions).all()
            assert data["voxel"] == found.grid.voxel

    def csv(path, found):
        table = np.genfromtxt(path, delimiter=",", names=True)
        assert table.dtype.names == ("x", "y", "z", "share", "manipulability")
        assert np.allclose(table["z"], found.centres[:, 2], atol=1e-8)
        assert np.allclose(table["share"], found.share, rtol=1e-5)

    def ply(path, found):
        import trimesh

        cloud = trimesh.load(path)
        assert np.allclose(cloud.vertices, found.centres, atol=1e-6)
        best = int(found.share.argmax())
        assert cloud.colors[best][1] == 255

    return {".npz": npz, ".csv": csv, ".ply": ply}[ending]


@pytest.mark.full
@pytest.mark.parametrize("name", ["map.xls", "missing/map.npz", "map"])
def test_a_file_that_cannot_be_is_refused_before_the_work(capsys, monkeypatch, tmp_path, name):
    monkeypatch.setattr(mapreduce, "capability_block", None)
    assert parser.main(["capability", "pioneer5", "-o", str(tmp_path / name)]) == 2
    assert "--output" in capsys.readouterr().err
