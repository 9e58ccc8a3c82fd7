"""The extension `kin._kernels`: kernels that were compiled before the program began.

A wheel has the extension beside the package, one file for each level of processors. In a checkout it is built
when it is first needed (:mod:`kin.codegen.extension.build`), and again when a file of the core has changed, which
takes seconds; it is kept in `extension` in the user's cache folder, which nobody else may change. One process
builds, and others that need the extension meanwhile wait for it.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import stat
import subprocess
import sys
import sysconfig
import time
from collections.abc import Callable, Iterator
from functools import cache
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import IO, Any

import numpy as np

from kin.kernels import layout

BUILDER = "kin.codegen.extension.build"
WITHOUT = "KINBOARD_KERNELS=python runs without compiled kernels, a thousand times slower"
WAIT = 2.0  # s for another process, after which it is said
_CORE = Path(__file__).parents[1]
_DTYPES = ("f8", "i8", "?", "u8", "f4", "c16")  # in the order of `items` in module.c
# What NumPy calls the instructions of a level of processors; those of v2 are in each that NumPy runs on.
_FEATURES = {"v4": ("AVX512_SKX",), "v3": ("AVX2", "FMA3")}


@cache
def entries() -> dict[str, Callable[..., Any]]:
    """The functions of the extension by the names of their kernels; each refuses what ``entries.txt`` excludes.

    Raises:
        ImportError: there is no extension, and it cannot be built; says what to do.
    """
    module = loaded(_file())
    return {name: module.entry(k) for k, (name, *_) in enumerate(module.entries())}


def loaded(file: Path, readable: bool = layout.READABLE) -> Any:
    """The extension in a file.

    Args:
        readable: whether it reads the fields of arrays, rather than asking each for its buffer.

    Raises:
        ImportError: objects of this Python are others than those that it is compiled for.
    """
    if sysconfig.get_config_var("Py_GIL_DISABLED"):
        raise ImportError(f"compiled kernels need a Python with a GIL; {WITHOUT}")
    spec = spec_from_file_location("kin._kernels", file, loader=ExtensionFileLoader("kin._kernels", str(file)))
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    module.set_up(np.ndarray, np.bool_, np.empty, tuple(map(np.dtype, _DTYPES)), readable)
    return module


def levels() -> Iterator[str]:
    """The levels of processors that this machine runs, the best first."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(name := platform.machine().lower(), name)
    if machine != "x86_64":
        yield machine
        return
    features = getattr(getattr(np, "_core", None), "_multiarray_umath", None)
    there = getattr(features, "__cpu_features__", {})
    yield from (f"x86_64_{k}" for k, names in _FEATURES.items() if all(there.get(name) for name in names))
    yield "x86_64_v2"


def _file() -> Path:
    """The extension for this machine."""
    suffix = "pyd" if sys.platform == "win32" else "abi3.so"
    for level in levels():
        if (packaged := _CORE / f"_kernels_{level}.{suffix}").exists():
            return packaged
    if not (_CORE.parent / "pyproject.toml").exists():
        raise ImportError(f"this installation has no compiled kernels for the processor; {WITHOUT}")
    return built(_CORE, next(levels()))


def built(core: Path, level: str) -> Path:
    """The extension of a checkout, built again if a file of its core has changed since the last time.

    Raises:
        ImportError: it cannot be built; says why, or that others may change the folder where it is kept.
    """
    folder = _folder()
    index = folder / f"{key_of(str(core))}-{level}.txt"
    if (found := _known(folder, index, _state(core))) is not None:
        return found
    with _alone(folder):
        state = _state(core)
        if (found := _known(folder, index, state)) is not None:  # by another process, meanwhile
            return found
        # -P: the core in the working folder may be another one.
        command = [sys.executable, "-P", "-m", BUILDER, str(folder), "--level", level]
        paths = [str(core.parent), *filter(None, [os.environ.get("PYTHONPATH")])]  # NumPy may be there
        environment = os.environ | {"KINBOARD_KERNELS": "python", "PYTHONPATH": os.pathsep.join(paths)}
        ran = subprocess.run(command, stdout=subprocess.PIPE, text=True, env=environment, check=False)
        said = ran.stdout.strip()
        if ran.returncode:
            raise ImportError(f"{said or 'kernels cannot be compiled (see above)'}; {WITHOUT}")
        beside = index.with_name(f"{index.name}.{os.getpid()}")
        beside.write_text(f"{state}\n{Path(said).relative_to(folder)}", "utf-8")
        beside.replace(index)
        return Path(said)


def _known(folder: Path, index: Path, state: str) -> Path | None:
    """The extension that an index names, if it was built from what the core is now."""
    if not index.exists():
        return None
    built_from, _, name = index.read_text("utf-8").partition("\n")
    file = folder / name
    if built_from != state or not (file.is_file() and file.resolve().is_relative_to(folder.resolve())):
        return None
    with contextlib.suppress(OSError):  # a folder that is only read
        os.utime(file)  # they are used
        os.utime(index)
    return file


def _folder() -> Path:
    """The folder of extensions, made if it is missing."""
    try:
        folder = user_folder() / "extension"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        owned = _shared_with(folder)
    except (OSError, RuntimeError) as error:
        raise _no_folder(error) from error
    if owned:
        raise ImportError(f"{folder} may be changed by others ({owned}): chmod 700, or {_ELSEWHERE}")
    return folder


_ELSEWHERE = "set KINBOARD_CACHE to another folder"


def _no_folder(error: Exception) -> ImportError:
    return ImportError(f"there is no folder to keep compiled kernels in: {error}; {_ELSEWHERE}")


def _shared_with(folder: Path) -> str:
    """Who besides this user may change a folder, as its owner and mode; empty: nobody.

    Code from a folder that others may change is not executed. A link counts as a folder of others.
    """
    found = folder.lstat()
    if sys.platform == "win32":  # there, the user's cache folder is private by its access list
        return ""
    private = stat.S_ISDIR(found.st_mode) and not found.st_mode & 0o022
    return (
        ""
        if private and found.st_uid in {os.geteuid(), 0}
        else f"owner {found.st_uid}, {stat.filemode(found.st_mode)}"
    )


def user_folder() -> Path:
    """The user's cache folder for Kinboard, that of `platformdirs`, which the core does without."""
    if named := os.environ.get("KINBOARD_CACHE"):
        return Path(named)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "kinboard" / "Cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "kinboard"
    return Path(os.environ.get("XDG_CACHE_HOME", "").strip() or Path.home() / ".cache") / "kinboard"


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Within the context no other process builds in a folder. The system ends the lock of a process that dies."""
    try:
        file = (folder / "lock").open("ab")
    except OSError as error:
        raise _no_folder(error) from error
    with file:
        started, waits = time.monotonic(), False
        while not _locked(file):
            if not waits and time.monotonic() - started > WAIT:
                waits = True
                print("Kinboard waits for another process that compiles its kernels", file=sys.stderr, flush=True)
            time.sleep(0.05)
        yield


if sys.platform == "win32":
    import msvcrt

    def _locked(file: IO[bytes]) -> bool:
        """Lock a file until it is closed, unless another process has locked it."""
        with contextlib.suppress(OSError):
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            return True
        return False
else:
    import fcntl

    def _locked(file: IO[bytes]) -> bool:
        """Lock a file until it is closed, unless another process has locked it."""
        with contextlib.suppress(BlockingIOError):
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        return False


def _state(core: Path) -> str:
    """Changes when a file of the core does."""
    found = []
    for place, folders, files in os.walk(core):
        folders[:] = [each for each in folders if each != "__pycache__"]
        for each in os.scandir(place):
            if each.name in files:
                with contextlib.suppress(FileNotFoundError):  # a link to nothing, as editors make
                    found.append((each.path, each.stat().st_mtime_ns))
    return key_of(sorted(found))


def key_of(*parts: object) -> str:
    """A name for what depends on some values."""
    return hashlib.blake2b(repr(parts).encode(), digest_size=16).hexdigest()
