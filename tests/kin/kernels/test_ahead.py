"""Which extension is loaded, when and by whom it is built again, and kernels without a compiler."""

from __future__ import annotations

import contextlib
import os
import stat
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import platformdirs
import platformdirs.macos
import platformdirs.windows
import pytest

import kin
from kin.kernels import ahead
from kin.kernels import compile as chosen


@pytest.fixture
def core(tmp_path, monkeypatch):
    """The core of a checkout."""
    monkeypatch.setenv("KINBOARD_CACHE", str(tmp_path / "cache"))
    found = tmp_path / "kin"
    (found / "solvers").mkdir(parents=True)
    (found / "solvers" / "one.py").write_text("x = 1\n")
    return found


@pytest.fixture
def asked(monkeypatch, tmp_path):
    """What kernels are in each process that has built the extension; the builder makes an empty file."""
    monkeypatch.setenv("PYTHONPATH", "numpy-is-there")
    found = []

    def builder(command, **options):
        assert command[1:4] == ["-P", "-m", ahead.BUILDER]
        found.append(options["env"]["KINBOARD_KERNELS"])
        paths = options["env"]["PYTHONPATH"].split(os.pathsep)
        assert paths == [str(tmp_path), "numpy-is-there"]
        file = Path(command[4]) / str(len(found)) / "_kernels.so"
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
    with pytest.raises(ImportError, match="need a Python with a GIL; KINBOARD_KERNELS=python"):
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
    with pytest.raises(ImportError, match=r"see above.*KINBOARD_KERNELS=python"):
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


def test_another_value_than_c_and_python_is_refused(monkeypatch):
    for value, plain in (("", False), ("c", False), ("python", True)):
        monkeypatch.setenv("KINBOARD_KERNELS", value)
        assert (chosen._chosen() == chosen.PYTHON) is plain
    monkeypatch.setenv("KINBOARD_KERNELS", "numba")
    with pytest.raises(ImportError, match="KINBOARD_KERNELS=numba: it is one of c, python"):
        chosen._chosen()


def test_who_needs_it_while_it_is_built_waits_and_says_so(core, asked, monkeypatch, capsys):
    build, sleep, waits = ahead.subprocess.run, time.sleep, threading.Event()
    monkeypatch.setattr(ahead, "WAIT", 0.0)
    monkeypatch.setattr(ahead.time, "sleep", lambda seconds: (waits.set(), sleep(seconds)))
    monkeypatch.setattr(ahead.subprocess, "run", lambda *a, **k: waits.wait(60) and build(*a, **k))
    with ThreadPoolExecutor(2) as threads:
        first, second = threads.map(lambda _: ahead.built(core, "level"), range(2))
    assert first == second
    assert len(asked) == 1
    assert capsys.readouterr().err == "Kinboard waits for another process that compiles its kernels\n"


def test_a_builder_that_was_killed_leaves_the_next_one_to_build(core, asked, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(ahead.subprocess, "run", lambda *_, **__: SimpleNamespace(returncode=-9, stdout=""))
        with pytest.raises(ImportError, match="cannot be compiled"):
            ahead.built(core, "level")
    assert ahead.built(core, "level").exists()
    assert len(asked) == 1


def test_where_nothing_can_be_written_what_is_there_is_used(core, asked):
    file = ahead.built(core, "level")
    lock = file.parents[1] / "lock"
    lock.unlink()
    lock.mkdir()  # so that it cannot be opened, not even by root
    assert ahead.built(core, "level") == file
    (core / "new.py").touch()
    with pytest.raises(ImportError, match=r"no folder to keep .*set KINBOARD_CACHE"):
        ahead.built(core, "level")


BUILDER = """
import os, sys, time
from pathlib import Path

folder = Path(sys.argv[1])
with (folder / "begun").open("a") as file:
    file.write("once\\n")
while not (folder / "go").exists():
    time.sleep(0.01)
(folder / "made.so").touch()
print(folder / "made.so")
"""


@pytest.fixture
def others(core):
    """A function that starts another process that needs the extension, which the builder above makes."""
    build = core / "codegen" / "extension" / "build.py"
    build.parent.mkdir(parents=True)
    for folder in (core, build.parents[1], build.parent):
        (folder / "__init__.py").touch()
    build.write_text(BUILDER)
    program = (
        "import sys; from pathlib import Path; from kin.kernels import ahead\n"
        "print(ahead.built(Path(sys.argv[1]), 'x'))"
    )
    path = str(Path(kin.__file__).parents[1])
    with contextlib.ExitStack() as stack:

        def start():
            command = [sys.executable, "-c", program, str(core)]
            environment = os.environ | {"PYTHONPATH": path}
            process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
            stack.callback(process.kill)
            return stack.enter_context(process)

        yield start


def wait_for(file):
    while not file.exists():
        time.sleep(0.01)


@pytest.mark.full
def test_processes_that_need_it_at_once_build_it_once(others, tmp_path):
    folder = tmp_path / "cache" / "extension"
    started = [others() for _ in range(3)]
    wait_for(folder / "begun")
    (folder / "go").touch()
    assert {process.communicate(timeout=60)[0].strip() for process in started} == {str(folder / "made.so")}
    assert (folder / "begun").read_text() == "once\n"


@pytest.mark.full
def test_a_process_that_is_killed_while_it_builds_does_not_block_others(others, tmp_path):
    folder = tmp_path / "cache" / "extension"
    killed = others()
    wait_for(folder / "begun")
    killed.kill()
    killed.wait()
    next_one = others()
    while (folder / "begun").read_text() != "once\nonce\n":
        time.sleep(0.01)
    (folder / "go").touch()  # for both builders: that of the killed process goes on
    assert next_one.communicate(timeout=60)[0].strip() == str(folder / "made.so")


@pytest.mark.parametrize("xdg", [None, "", "/somewhere/cache"])
def test_the_folder_is_that_of_platformdirs(monkeypatch, xdg):
    monkeypatch.delenv("KINBOARD_CACHE", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    if xdg is not None:
        monkeypatch.setenv("XDG_CACHE_HOME", xdg)
    assert ahead.user_folder() == platformdirs.user_cache_path("kinboard", appauthor=False)


@pytest.mark.parametrize(
    ("platform", "of"), [("darwin", platformdirs.macos.MacOS), ("win32", platformdirs.windows.Windows)]
)
def test_so_it_is_on_other_systems(monkeypatch, platform, of):
    monkeypatch.delenv("KINBOARD_CACHE", raising=False)
    monkeypatch.setenv("LOCALAPPDATA", "/home/user/AppData/Local")
    monkeypatch.setattr(platformdirs.windows, "get_win_folder", lambda name: "/home/user/AppData/Local")
    expected = of("kinboard", appauthor=False).user_cache_dir.replace("\\", "/")
    monkeypatch.setattr(sys, "platform", platform)
    assert ahead.user_folder() == Path(expected)
