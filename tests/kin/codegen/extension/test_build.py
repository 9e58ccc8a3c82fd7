"""What is compiled again, what is said where it cannot be, and that declarations are those of Python."""

from __future__ import annotations

import os
import subprocess
import sysconfig
import time
from pathlib import Path

import pytest
import small

from kin.codegen.extension import build, wrappers
from kin.kernels import ahead

LEVEL = "x86_64_v2"
pytestmark = pytest.mark.skipif(LEVEL not in ahead.levels(), reason="a level of x86-64")


def texts(**changed):
    """Two units of small kernels."""
    units = {"one": small.ENTRIES[:2], "two": small.ENTRIES[2:4]}
    return [(name, wrappers.unit(name, entries) + changed.get(name, "")) for name, entries in units.items()]


def test_only_a_unit_that_has_changed_is_compiled_again(tmp_path, monkeypatch):
    monkeypatch.setattr(build, "compiler", lambda: (["gcc"], "12"))
    said = []

    def built(made):
        said.clear()
        file = build.build(made, tmp_path, LEVEL, build.LINUX, said.append)
        return file, sorted(what.split()[1] for what in said)

    first, compiled = built(texts())
    assert compiled == ["module", "one", "two"]
    assert [name for name, *_ in ahead.loaded(first).entries()] == [
        f"kin.small.{name}" for name in ("numbers", "nothing", "scaled", "last")
    ]
    assert built(texts()) == (first, [])
    second, compiled = built(texts(two="// changed\n"))
    assert compiled == ["two"]
    assert second.name == first.name
    assert second != first
    assert not list(tmp_path.rglob("*.c")), "nothing but objects is left"
    with pytest.raises(build.BuildError, match=r"cannot be compiled: gcc.*\n.*error"):
        built(texts(one="int x = ;\n"))


def test_without_a_compiler_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setattr(build.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(build.shutil, "which", lambda name: None)
    with pytest.raises(build.BuildError, match="pip install ziglang"):
        build.compiler()


@pytest.mark.parametrize(("level", "system"), [(LEVEL, build.WINDOWS), ("aarch64", build.LINUX)])
def test_other_machines_need_ziglang(level, system):
    with pytest.raises(build.BuildError, match="pip install ziglang"):
        build.options_for(level, system, zig=False)
    assert f"--target={level.split('_v')[0]}-{system}" in build.options_for(level, system, zig=True)


@pytest.mark.parametrize("level", ["x86_64_v3", "x86_64_v4"])
def test_the_machines_own_clang_tunes_for_the_machine(monkeypatch, level):
    """It may be older than 16, which does not know `-tune-cpu`."""
    monkeypatch.setattr(build, "levels", lambda: [level])
    monkeypatch.setattr(build, "own_system", lambda: build.LINUX)
    own, other = (build.options_for(level, build.LINUX, zig=zig) for zig in (False, True))
    assert {"-mtune=native", f"-march={level.replace('_', '-')}"} <= set(own)
    assert not {"-Xclang", "-tune-cpu", "znver4"} & set(own)
    assert {"-Xclang", "-tune-cpu", "znver4"} <= set(other)
    assert "-mtune=native" not in other


def test_windows_imports_what_is_declared():
    found = build.imports_of(build.module_of([]))
    assert {"PyExc_TypeError DATA", "_Py_NoneStruct DATA", "PyTuple_New", "Py_IncRef"} <= set(found)
    assert not {name for name in found if name.split()[0] in ("Py_ssize_t", "Py_buffer", "PyObject")}


def test_declarations_are_those_of_pythons_headers(tmp_path):
    headers = Path(sysconfig.get_paths()["include"])
    if not (headers / "Python.h").exists():
        pytest.skip("there are no headers of Python")
    (tmp_path / "module.c").write_text(build.module_of(["small"]))
    define = ["-DPy_LIMITED_API=0x030b0000", "-DKINBOARD_PYTHON_H=<Python.h>", f"-I{headers}"]
    command = ["gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", *define, "-c", "module.c"]
    subprocess.run(command, cwd=tmp_path, check=True)


OWN = [
    "texts/{}.c",
    "objects/{}.o",
    "{}/_kernels_x86_64_v3.abi3.so",
    "{}/_kernels_aarch64.pyd",
    "{}-x86_64_v3.txt",
    "{}-aarch64.txt.1234",
]
FOREIGN = [
    *("notes.txt", "thesis/main.c", "objects/old.o", "a.out/x.o", "objects/deep/{}.o", "{}.o", "{}/notes.txt"),
    "texts/{}.c/main.c",
]


def old(file, age=build.UNUSED + 60.0):
    file.parent.mkdir(exist_ok=True, parents=True)
    file.touch()
    os.utime(file, (0.0, time.time() - age))


@pytest.mark.parametrize("name", OWN)
def test_what_is_used_no_more_is_removed(tmp_path, name):
    first, second = (tmp_path / name.format(ahead.key_of(k)) for k in (1, 2))
    old(first)
    old(second, build.UNUSED - 3600.0)
    build.prune(tmp_path)
    assert not first.exists()
    assert second.exists()


@pytest.mark.parametrize("name", FOREIGN)
def test_files_that_others_have_put_into_the_folder_stay(tmp_path, name):
    file = tmp_path / name.format(ahead.key_of(1))
    old(file)
    for folder in file.relative_to(tmp_path).parents:
        os.utime(tmp_path / folder, (0.0, 0.0))
    build.prune(tmp_path)
    assert file.exists()


@pytest.mark.full
def test_a_user_without_a_home_can_build_and_nothing_of_the_compiler_stays(tmp_path, monkeypatch, capsys):
    for name in ("HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", "")
    monkeypatch.setattr(build, "texts", lambda *_: texts())
    monkeypatch.setattr(build.sys, "argv", ["build", str(tmp_path), "--level", LEVEL])
    assert build.main() == 0
    assert ahead.loaded(Path(capsys.readouterr().out.strip())).entries()
    kept = Path(os.environ["ZIG_GLOBAL_CACHE_DIR"])
    assert kept.is_absolute()
    assert not kept.exists()
