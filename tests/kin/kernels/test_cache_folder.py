"""Where compiled kernels are kept: which folder, whose it must be, how large it becomes, what names its files."""

from __future__ import annotations

import os
import stat
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
import platformdirs
import platformdirs.macos
import platformdirs.windows
import pytest
from numba import config

from kin.kernels import cache

DAY = 86400.0


def kernel(x: float) -> float:
    return 2.0 * x


CODEGEN = SimpleNamespace(magic_tuple=lambda: ("x86_64", "znver3", "+avx2"))


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """The folder of a user without any compiled kernels."""
    monkeypatch.setenv("KINBOARD_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setattr(cache, "_warned", set())
    return tmp_path / "cache" / "kernels"


# -- which folder ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("xdg", [None, "", "/somewhere/cache"])
def test_the_folder_is_that_of_platformdirs(monkeypatch, xdg):
    monkeypatch.delenv("KINBOARD_CACHE")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    if xdg is not None:
        monkeypatch.setenv("XDG_CACHE_HOME", xdg)
    assert cache.user_folder() == platformdirs.user_cache_path("kinboard", appauthor=False)


@pytest.mark.parametrize(
    ("platform", "of"), [("darwin", platformdirs.macos.MacOS), ("win32", platformdirs.windows.Windows)]
)
def test_so_it_is_on_other_systems(monkeypatch, platform, of):
    monkeypatch.delenv("KINBOARD_CACHE")
    monkeypatch.setenv("LOCALAPPDATA", "/home/user/AppData/Local")
    monkeypatch.setattr(platformdirs.windows, "get_win_folder", lambda name: "/home/user/AppData/Local")
    expected = of("kinboard", appauthor=False).user_cache_dir.replace("\\", "/")
    monkeypatch.setattr(sys, "platform", platform)
    assert cache.user_folder() == Path(expected)


def test_it_is_made_for_its_user_alone(folder):
    assert cache.kernel_folder() == folder
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_numbas_own_setting_takes_precedence_and_need_not_be_private(folder, tmp_path, monkeypatch):
    given = tmp_path / "given" / "kinboard"
    given.mkdir(parents=True)
    given.chmod(0o777)
    monkeypatch.setattr(config, "CACHE_DIR", str(given.parent))
    assert cache.kernel_folder() == given
    assert not folder.exists()


def test_numbas_own_cache_has_a_folder_for_each_text(folder, monkeypatch):
    for text in ("one", "two"):
        monkeypatch.setattr(cache, "fingerprint", lambda file, text=text: text)
        with cache.numbas_own(kernel) as usable:
            assert usable
            assert vars(config)["CACHE_DIR"] == str(folder / text)
        assert vars(config)["CACHE_DIR"] == ""
    monkeypatch.setattr(os, "access", lambda place, mode: False)
    with cache.numbas_own(kernel) as usable:
        assert not usable
        assert vars(config)["CACHE_DIR"] == ""


# -- whose it is -----------------------------------------------------------------------------------------------


def of_somebody_else(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: folder.stat().st_uid + 1)


def linked(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder.rename(folder.with_name("elsewhere"))
    folder.symlink_to(folder.with_name("elsewhere"))


def mode(bits: int) -> Any:
    return lambda folder, monkeypatch: folder.chmod(bits)


OTHERS = [of_somebody_else, linked, *map(mode, (0o720, 0o702, 0o777, 0o755))]


@pytest.mark.skipif(sys.platform == "win32", reason="has no modes")
@pytest.mark.parametrize("make", OTHERS)
def test_a_folder_that_others_may_have_written_is_not_read(folder, monkeypatch, make):
    """The file would be loaded if the folder were trusted: reading it raises an error."""
    of = cache.KernelCache(kernel)
    assert cache.kernel_folder() == folder
    monkeypatch.setattr(cache, "_intact", lambda data: pytest.fail("read"))
    (folder / of.file_name((), CODEGEN)).write_bytes(b"anything")
    make(folder, monkeypatch)
    target = SimpleNamespace(codegen=lambda: CODEGEN)
    with pytest.warns(UserWarning, match="is not used.*chmod 700.*KINBOARD_CACHE"):
        assert of.load_overload((), target) is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # said once
        of.save_overload((), SimpleNamespace())
    assert len(list(folder.iterdir())) == 1
    assert of.cache_path is None
    assert cache.is_cached(SimpleNamespace(_cache=of)), "there is nothing to wait for"


# -- how large it becomes --------------------------------------------------------------------------------------


def files(folder: Path, ages: dict[str, float], now: float = 1e9) -> None:
    for name, age in ages.items():
        (folder / name).write_bytes(bytes(100))
        os.utime(folder / name, (now - age, now - age))


def test_files_that_were_not_used_for_longest_are_removed_when_there_are_too_many(folder, monkeypatch):
    cache.kernel_folder()
    files(folder, {"a.nbc": 3 * DAY, "b.nbc": DAY, "c.nbc": 2 * DAY, "d.nbc.0123": 9 * DAY, "not ours": 10 * DAY})
    monkeypatch.setattr(cache, "CAPACITY", 400)
    cache.prune(folder)
    assert len(list(folder.iterdir())) == 5
    monkeypatch.setattr(cache, "CAPACITY", 299)
    cache.prune(folder)
    assert sorted(file.name for file in folder.iterdir()) == ["b.nbc", "c.nbc", "not ours"]


def test_files_that_another_process_removes_meanwhile_are_no_error(folder, monkeypatch):
    cache.kernel_folder()
    files(folder, {"a.nbc": DAY, "b.nbc": 2 * DAY})
    glob = Path.glob
    monkeypatch.setattr(Path, "glob", lambda self, pattern: [*glob(self, pattern), folder / "gone.nbc"])
    monkeypatch.setattr(cache, "CAPACITY", 100)
    cache.prune(folder)
    assert [file.name for file in folder.iterdir()] == ["a.nbc"]


# -- what names a file -----------------------------------------------------------------------------------------


@pytest.fixture
def name(monkeypatch):
    """The name of the file for one kernel and signature, whose text is known."""
    monkeypatch.setattr(cache, "fingerprint", lambda file: "text")

    def found(signature: tuple[Any, ...] = (numba.float64,), codegen: Any = CODEGEN) -> str:
        cache._target.cache_clear()
        return cache.KernelCache(kernel).file_name(signature, codegen)

    yield found
    cache._target.cache_clear()


def test_files_of_other_texts_processors_versions_and_signatures_have_other_names(name, monkeypatch):
    before = name()
    assert before == name()
    assert before != name((numba.int64,))
    assert before != name(codegen=SimpleNamespace(magic_tuple=lambda: ("x86_64", "znver3", "+avx512f")))
    for place, changed, value in (
        (numba, "__version__", "0.99"),
        (config, "OPT", 0),
        (sys.implementation, "cache_tag", "cpython-399"),
        (cache, "_FORMAT", 99),
        (cache, "fingerprint", lambda file: "another text"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(place, changed, value)
            assert before != name(), changed
    assert before == name()


# -- a file is written, read, and said to be used --------------------------------------------------------------

TARGET = SimpleNamespace(codegen=lambda: CODEGEN)
COMPILED = SimpleNamespace(
    lifted=(),
    library=SimpleNamespace(has_dynamic_globals=False),
    codegen=CODEGEN,
    _reduce=lambda: "machine code",
)


@pytest.fixture
def kept(monkeypatch):
    """The cache of one kernel, whose machine code is a text."""
    monkeypatch.setattr(cache, "_rebuild", lambda target, payload: payload)
    monkeypatch.setattr(cache.rtsys, "initialize", lambda target: None)
    return cache.KernelCache(kernel)


def test_what_is_written_is_read_for_the_same_signature(kept, folder):
    assert kept.load_overload(("float64",), TARGET) is None
    kept.save_overload(("float64",), COMPILED)
    assert kept.load_overload(("float64",), TARGET) == "machine code"
    assert kept.load_overload(("int64",), TARGET) is None
    (file,) = folder.iterdir()
    file.rename(folder / kept.file_name(("int64",), CODEGEN))
    assert kept.load_overload(("int64",), TARGET) is None, "the file says what it is for"


def test_machine_code_with_addresses_of_this_process_is_not_written(kept, folder):
    kept.save_overload(
        (), SimpleNamespace(**{**vars(COMPILED), "library": SimpleNamespace(has_dynamic_globals=True)})
    )
    assert list(folder.iterdir()) == []


def test_a_file_that_is_used_says_so_once_a_day(kept, folder):
    kept.save_overload((), COMPILED)
    (file,) = folder.iterdir()
    now = file.stat().st_mtime
    for age, renewed in ((0.5 * DAY, False), (2.0 * DAY, True)):
        os.utime(file, (now - age, now - age))
        assert kept.load_overload((), TARGET) == "machine code"
        assert (file.stat().st_mtime >= now - 1.0) is renewed


def test_a_file_that_cannot_be_moved_to_its_place_leaves_nothing(kept, folder, monkeypatch):
    def refuse(self: Path, target: Path) -> None:
        assert self.read_bytes(), "it is complete before it is moved"
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.warns(UserWarning, match="cannot be written.*No space left"):
        kept.save_overload((), COMPILED)
    assert list(folder.iterdir()) == []
