"""Kernels that were compiled before the program began: the extension `kin._kernels`.

KINBOARD_KERNELS says what kernels are: ``numba`` (the default) compiles them on first use, ``c`` calls the
extension, ``python`` runs them as they are written, for debugging and for a command that computes one pose.

A wheel has the extension beside the package, one file for each level of processors. In a checkout it is built when
it is first needed (:mod:`kin.codegen.extension.build`), and again when a file of the core has changed, which takes
seconds; it is kept in `extension` in the user's cache folder, which nobody else may change.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Iterator
from functools import cache, cached_property, update_wrapper
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from kin.kernels import layout
from kin.kernels.sources import shared_with, user_folder
from kin.transforms import is_plain

NUMBA, C, PYTHON = "numba", "c", "python"
BUILDER = "kin.codegen.extension.build"
_CORE = Path(__file__).parents[1]
_DTYPES = ("f8", "i8", "?", "u8", "f4", "c16")  # in the order of `items` in module.c
# What NumPy calls the instructions of a level of processors; those of v2 are in each that NumPy runs on.
_FEATURES = {"v4": ("AVX512_SKX",), "v3": ("AVX2", "FMA3")}


def _chosen() -> str:
    uncompiled = os.environ.get("NUMBA_DISABLE_JIT", "") not in ("", "0")
    found = os.environ.get("KINBOARD_KERNELS") or (PYTHON if uncompiled else NUMBA)
    if found not in (NUMBA, C, PYTHON):
        raise ValueError(f"KINBOARD_KERNELS={found}: it is one of {NUMBA}, {C}, {PYTHON}")
    return found


CHOSEN: Final = _chosen()


class Wanted(NamedTuple):
    """An array as a kernel wants it: its shape, None for an axis of any length, and what it has in it.

    Attributes:
        checked: whether it is checked before a call where the kernel does not do it.
    """

    shape: tuple[int | None, ...]
    checked: bool = True
    item: type = float


class Kernel:
    """A kernel of the extension. One that Python never calls has no entry there, and is called as it is written.

    Attributes:
        py_func: the function itself.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        self.name = f"{function.__module__}.{function.__qualname__}"
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        return self._call(*arguments)

    @cached_property
    def _call(self) -> Callable[..., Any]:
        entry = entries().get(self.name)
        return self.py_func if entry is None else entry.function(())


class Entry(NamedTuple):
    """An entry of the extension, with the arguments that it takes as described in ``unit.h``."""

    module: Any
    place: int
    takes: str

    def function(self, shapes: tuple[int, ...]) -> Callable[..., Any]:
        """The function; it demands these lengths of the axes of its arrays, −1 for any, () for any of all."""
        found: Callable[..., Any] = self.module.entry(self.place, shapes)
        return found


def loaded(file: Path, readable: bool = layout.READABLE) -> Any:
    """The extension in a file.

    Args:
        readable: whether it reads the fields of arrays, rather than asking each for its buffer.

    Raises:
        ImportError: objects of this Python are others than those that it is compiled for.
    """
    if sysconfig.get_config_var("Py_GIL_DISABLED"):
        raise ImportError("compiled kernels need a Python with a GIL: set KINBOARD_KERNELS=numba, or python")
    spec = spec_from_file_location("kin._kernels", file, loader=ExtensionFileLoader("kin._kernels", str(file)))
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    module.set_up(np.ndarray, np.bool_, np.empty, tuple(map(np.dtype, _DTYPES)), readable)
    return module


@cache
def entries() -> dict[str, Entry]:
    """The entries of the extension by the names of their kernels.

    Raises:
        ImportError: there is no extension, and it cannot be built; says what to do.
    """
    module = loaded(_file())
    return {name: Entry(module, k, takes) for k, (name, takes, _) in enumerate(module.entries())}


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
        raise ImportError(
            "this installation has no compiled kernels for the processor: set KINBOARD_KERNELS=numba"
        )
    return built(_CORE, next(levels()))


def built(core: Path, level: str) -> Path:
    """The extension of a checkout, built again if a file of its core has changed since the last time.

    Raises:
        ImportError: it cannot be built, and what the compiler says is on the standard error; or others may change
            the folder where it is kept.
    """
    folder = _folder()
    index = folder / f"{_hash(str(core))}-{level}.txt"
    state = _state(core)
    if index.exists():
        known, _, name = index.read_text("utf-8").partition("\n")
        if known == state and _is_within(folder, file := folder / name):
            with contextlib.suppress(OSError):  # a folder that is only read
                os.utime(file)  # they are used
                os.utime(index)
            return file
    command = [sys.executable, "-m", BUILDER, str(folder), "--level", level]
    environment = os.environ | {"KINBOARD_KERNELS": PYTHON, "PYTHONPATH": str(core.parent)}
    ran = subprocess.run(command, stdout=subprocess.PIPE, text=True, env=environment, check=False)
    if ran.returncode:
        raise ImportError("kernels cannot be compiled (see above): set KINBOARD_KERNELS=numba, or python")
    file = Path(ran.stdout.strip())
    beside = index.with_name(f"{index.name}.{os.getpid()}")
    beside.write_text(f"{state}\n{file.relative_to(folder)}", "utf-8")
    beside.replace(index)
    return file


def _folder() -> Path:
    """The folder of extensions, made if it is missing."""
    hint = "set KINBOARD_CACHE to another folder"
    try:
        folder = user_folder() / "extension"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        owned = shared_with(folder, 0o022, owners=frozenset({0}))
    except (OSError, RuntimeError) as error:
        raise ImportError(f"there is no folder to keep compiled kernels in: {error}; {hint}") from error
    if owned:
        raise ImportError(f"{folder} may be changed by others ({owned}): chmod 700, or {hint}")
    return folder


def _is_within(folder: Path, file: Path) -> bool:
    return file.is_file() and file.resolve().is_relative_to(folder.resolve())


def _state(core: Path) -> str:
    """Changes when a file of the core does."""
    found = []
    for place, folders, files in os.walk(core):
        folders[:] = [each for each in folders if each != "__pycache__"]
        for each in os.scandir(place):
            if each.name in files:
                with contextlib.suppress(FileNotFoundError):  # a link to nothing, as editors make
                    found.append((each.path, each.stat().st_mtime_ns))
    return _hash(sorted(found))


def _hash(*parts: object) -> str:
    return hashlib.blake2b(repr(parts).encode(), digest_size=16).hexdigest()


def direct(kernel: Kernel, wanted: list[Wanted | None]) -> Callable[..., Any]:
    """The entry of a kernel that demands the shapes of its arrays; None stands for a number.

    Raises:
        ImportError: the extension has no such entry, or for arrays with other numbers of axes.
    """
    shapes = [each.shape for each in wanted if each is not None]
    entry = entries().get(kernel.name)
    if entry is None or [int(each) for each in entry.takes if each.isdigit()] != list(map(len, shapes)):
        raise ImportError(f"the extension has no entry {kernel.name} for arrays with {[*map(len, shapes)]} axes")
    return entry.function(tuple(-1 if n is None else n for shape in shapes for n in shape))


def checked(function: Callable[..., Any], wanted: list[Wanted | None]) -> Callable[..., Any]:
    """A function that checks the arrays that it is given as an entry does."""

    def call(*arguments: Any) -> Any:
        for value, array in zip(_flat(arguments), wanted, strict=True):
            if array is not None and array.checked and not fits(value, array.shape):
                raise TypeError(f"{value!r} is not a C-contiguous float64 array {array.shape}")
        return function(*arguments)

    return call


def _flat(arguments: tuple[Any, ...]) -> Iterator[Any]:
    for each in arguments:
        yield from _flat(each) if isinstance(each, tuple) else (each,)


def fits(value: object, shape: tuple[int | None, ...]) -> bool:
    """Whether a value is a C-contiguous array of floats with this shape."""
    if not is_plain(value) or value.ndim != len(shape):
        return False
    return all(wanted in (None, there) for wanted, there in zip(shape, value.shape, strict=True))
