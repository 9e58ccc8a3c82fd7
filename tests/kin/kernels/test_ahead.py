"""Which extension is loaded, when it is built again, and kernels without a compiler."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import kin
from kin.kernels import ahead
from kin.kernels.ahead import Wanted


@pytest.fixture
def core(tmp_path, monkeypatch):
    """The core of a checkout."""
    monkeypatch.setenv("KINBOARD_CACHE", str(tmp_path / "cache"))
    found = tmp_path / "kin"
    (found / "solvers").mkdir(parents=True)
    (found / "solvers" / "one.py").write_text("x = 1\n")
    return found


@pytest.fixture
def asked(monkeypatch):
    """What kernels are in each process that has built the extension; the builder makes an empty file."""
    found = []

    def builder(command, **options):
        assert command[1:3] == ["-m", ahead.BUILDER]
        found.append(options["env"]["KINBOARD_KERNELS"])
        file = Path(command[3]) / str(len(found)) / "_kernels.so"
        file.parent.mkdir(parents=True)
        file.touch()
        return SimpleNamespace(returncode=0, stdout=f"{file}\n")

    monkeypatch.setattr(ahead.subprocess, "run", builder)
    return found


def test_it_is_built_again_only_when_a_file_has_changed(core, asked):
    first = ahead.built(core, "level")
    assert ahead.built(core, "level") == first
    assert asked == ["python"]
    file = core / "solvers" / "one.py"
    os.utime(file, ns=(0, file.stat().st_mtime_ns + 1))
    second = ahead.built(core, "level")
    assert second != first
    second.unlink()
    assert ahead.built(core, "level") != second
    (core / "new.py").touch()
    ahead.built(core, "level")
    assert len(asked) == 4


def test_a_link_to_nothing_in_the_core_is_no_error(core, asked):
    """Editors make such links beside a file that has changes."""
    first = ahead.built(core, "level")
    (core / ".#one.py").symlink_to("user@host.1234")
    assert ahead.built(core, "level") == first


def test_a_python_without_a_gil_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(ahead.sysconfig, "get_config_var", {"Py_GIL_DISABLED": 1}.get)
    with pytest.raises(ImportError, match="need a Python with a GIL: set KINBOARD_KERNELS=numba"):
        ahead.loaded(tmp_path / "missing.so")


def test_what_is_used_says_so(core, asked):
    """Else the builder removes it."""
    file = ahead.built(core, "level")
    (index,) = file.parents[1].glob("*-level.txt")
    for each in (file, index):
        os.utime(each, (0.0, 0.0))
    assert ahead.built(core, "level") == file
    assert min(each.stat().st_mtime for each in (file, index)) > 0.0
    assert len(asked) == 1


def test_an_index_names_only_files_of_its_folder(core, asked, tmp_path):
    file = ahead.built(core, "level")
    (index,) = file.parents[1].glob("*-level.txt")
    other = tmp_path / "other.so"
    other.touch()
    state = index.read_text().partition("\n")[0]
    for k, name in enumerate((str(other), "../../other.so", ".", "")):
        index.write_text(f"{state}\n{name}")
        assert ahead.built(core, "level").parents[1] == file.parents[1]
        assert len(asked) == k + 2


def of_somebody_else(folder, monkeypatch):
    if os.geteuid() == 0:
        os.chown(folder, 12345, -1)
    else:
        monkeypatch.setattr(os, "geteuid", lambda: folder.stat().st_uid + 1)


def mode(bits):
    return lambda folder, monkeypatch: folder.chmod(bits)


def linked(folder, monkeypatch):
    folder.rename(folder.with_name("elsewhere"))
    folder.symlink_to(folder.with_name("elsewhere"))


@pytest.mark.skipif(sys.platform == "win32", reason="has no modes")
@pytest.mark.parametrize("make", [of_somebody_else, linked, *map(mode, (0o720, 0o702, 0o777))])
def test_a_folder_that_others_may_have_written_is_not_read(core, asked, monkeypatch, make):
    folder = ahead.built(core, "level").parents[1]
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    make(folder, monkeypatch)
    with pytest.raises(ImportError, match=r"may be changed by others .*: chmod 700, or set KINBOARD_CACHE"):
        ahead.built(core, "level")
    assert len(asked) == 1


def test_a_folder_that_others_may_read_is_read(core, asked):
    file = ahead.built(core, "level")
    file.parents[1].chmod(0o755)
    assert ahead.built(core, "level") == file


def test_where_there_is_no_folder_it_is_said_what_to_set(core, asked, tmp_path):
    (tmp_path / "cache").touch()
    with pytest.raises(ImportError, match=r"no folder to keep .*set KINBOARD_CACHE"):
        ahead.built(core, "level")
    assert not asked


def test_where_it_cannot_be_built_it_is_said_what_to_set(core, monkeypatch):
    monkeypatch.setattr(ahead.subprocess, "run", lambda *_, **__: SimpleNamespace(returncode=1, stdout=""))
    with pytest.raises(ImportError, match="KINBOARD_KERNELS=numba"):
        ahead.built(core, "level")


@pytest.mark.parametrize(
    ("machine", "features", "expected"),
    [
        ("arm64", (), ["aarch64"]),
        ("AMD64", (), ["x86_64_v2"]),
        ("x86_64", ("AVX2", "FMA3"), ["x86_64_v3", "x86_64_v2"]),
        ("x86_64", ("AVX2", "FMA3", "AVX512_SKX"), ["x86_64_v4", "x86_64_v3", "x86_64_v2"]),
        ("x86_64", ("AVX2",), ["x86_64_v2"]),
    ],
)
def test_the_best_level_comes_first(monkeypatch, machine, features, expected):
    monkeypatch.setattr(ahead.platform, "machine", lambda: machine)
    module = SimpleNamespace(_multiarray_umath=SimpleNamespace(__cpu_features__=dict.fromkeys(features, True)))
    monkeypatch.setattr(ahead.np, "_core", module)
    assert list(ahead.levels()) == expected


def test_plain_functions_check_arrays_as_compiled_ones_do():
    total = ahead.checked(lambda a, x: a.sum() * x, [Wanted((2, None)), None])
    assert total(np.ones((2, 3)), 2.0) == 12.0
    for wrong in (np.ones((3, 2)), np.ones((2, 3), int), [[1.0], [2.0]], np.ones((2, 4))[:, ::2]):
        with pytest.raises(TypeError, match=r"array \(2, None\)"):
            total(wrong, 2.0)


PROGRAM = """
import json, sys
import kin
from kin.kernels.elsewhere import compile_elsewhere
compile_elsewhere(lambda line: True)  # as a service does
T = kin.fk("ur5", [0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
(cloud,) = kin.workspace.sample_workspace("ur5", 3)
answers = [len(kin.solve_ik("ur5", T).solutions), cloud.points.tolist()]
print(json.dumps([*answers, "numba" in sys.modules, "llvmlite" in sys.modules]))
"""


@pytest.mark.full
@pytest.mark.parametrize(
    ("kernels", "answer"), [("python", [False, False]), ("fortran", "one of numba, c, python")]
)
def test_numba_is_not_imported_where_nothing_needs_it(kernels, answer):
    environment = os.environ | {"KINBOARD_KERNELS": kernels, "PYTHONPATH": str(Path(kin.__file__).parents[1])}
    ran = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False
    )
    if isinstance(answer, str):
        assert answer in ran.stderr
        return
    solutions, points, *imported = json.loads(ran.stdout)
    (cloud,) = kin.workspace.sample_workspace("ur5", 3)
    assert (solutions, imported) == (8, answer)
    assert np.allclose(points, cloud.points, atol=1e-6)
