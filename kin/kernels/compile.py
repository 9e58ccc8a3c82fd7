"""Compile kernels, cache their machine code on disk, and call them without dispatch.

numba compiles a kernel on first use and caches the machine code on disk. Its cache key is the text of the kernel's
own file only, although the machine code contains the kernels it calls: after an upgrade a cached kernel could
contain functions of the previous version. The cache here uses the text of that file and of all modules of the core
that it imports, directly or not, as its key: a change recompiles what depends on it and nothing else.

Damaged files are recognised by a checksum. The cache is optional: if it cannot be read, kernels are compiled
again; if it cannot be written, they are compiled in every process.

With NUMBA_DISABLE_JIT=1 kernels are plain Python functions, which is faster for a command that computes one pose.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import re
import warnings
import zlib
from collections.abc import Callable
from functools import cache, cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import config, njit, types
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache

MODEL = "model"
PLAIN = bool(vars(config)["DISABLE_JIT"])
_unliteral: Any = types.unliteral
_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])


_ROOT = str(Path(__file__).parents[2])
_IMPORT = re.compile(r"^from (kin[\w.]*) import (?:\(([^)]*)\)|([^(\n]*))", re.MULTILINE)


@cache
def fingerprint(file: str) -> str:
    """Hash of the text of a Python file and of all modules of the core that it imports, directly or not."""
    found, waiting = {file}, [file]
    while waiting:
        new = _read(waiting.pop())[1] - found
        found |= new
        waiting += new
    return hashlib.blake2b(b"".join(sorted(_read(each)[0] for each in found)), digest_size=16).hexdigest()


@cache
def _read(file: str) -> tuple[bytes, frozenset[str]]:
    """Hash of the text of a file, and the files of the core that it imports at its top level."""
    text = Path(file).read_text(encoding="utf-8")
    imports = set()
    for module, several, one in _IMPORT.findall(text):
        place = _file_of(module)
        names = [name.split()[0] for name in (several or one).split(",") if name.split()]
        imports |= {place, *(_file_of(f"{module}.{name}") for name in names)} - {None}
    return hashlib.blake2b(text.encode(), digest_size=16).digest(), frozenset(map(str, imports))


@cache
def _file_of(module: str) -> str | None:
    """The file of a module or package of the core; None for another name. Plain strings: `Path` takes longer."""
    place = os.path.join(_ROOT, *module.split("."))  # noqa: PTH118
    return next((file for file in (f"{place}.py", f"{place}/__init__.py") if os.path.isfile(file)), None)  # noqa: PTH113


class DamagedFileError(Exception):
    """A file of the cache is not as it was written."""


class _CheckedFile(IndexDataCacheFile):
    """numba's files of one kernel, with a checksum at the end: damaged machine code would end the process."""

    def _dump(self, obj: Any) -> bytes:
        data: bytes = super()._dump(obj)
        return data + zlib.crc32(data).to_bytes(4, "little")  # unpickling ignores what follows

    def _load_index(self) -> Any:
        with contextlib.suppress(FileNotFoundError), Path(self._index_path).open("rb") as file:
            version, data = pickle.load(file), file.read()
            # Files of another version are not used, and may have no checksum.
            if version == self._version and not _intact(data) and pickle.loads(data)[0] == self._source_stamp:
                raise DamagedFileError(self._index_path)
        return super()._load_index()

    def _load_data(self, name: str) -> Any:
        path = self._data_path(name)
        if not _intact(Path(path).read_bytes()):
            raise DamagedFileError(path)
        return super()._load_data(name)


def _intact(data: bytes) -> bool:
    return zlib.crc32(data[:-4]).to_bytes(4, "little") == data[-4:]


class _Cache(FunctionCache):
    """numba's cache of one kernel, keyed by `fingerprint`; disk errors become warnings.

    It uses private attributes of numba; tests check that they still work.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        file = self._cache_file
        base = file._index_name.removesuffix(".nbi")
        self._cache_file = _CheckedFile(file._cache_path, base, fingerprint(function.__code__.co_filename))

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The cached machine code, or None if the kernel has to be compiled."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:  # noqa: BLE001 - unpickling a damaged file may raise anything
            _warn(f"machine code in {self.cache_path} cannot be read ({error!r}) and is compiled again")
            # New entries could not be added to a damaged index either.
            with contextlib.suppress(OSError):
                Path(self._cache_file._index_path).unlink()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write machine code to the cache."""
        try:
            super().save_overload(sig, data)
        except Exception as error:  # noqa: BLE001 - as above
            self.disable()
            _warn(f"machine code cannot be written to {self.cache_path} ({error!r})")


class LaterCache:
    """The cache of a kernel, opened when the kernel is first used: a process uses few of them."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    @cached_property
    def opened(self) -> Any:
        """The cache; one that is always empty if there is no place for it."""
        try:
            return _Cache(self._function)
        except RuntimeError:  # numba found no writable folder
            _warn("no cache folder for machine code is writable; set NUMBA_CACHE_DIR to one that is")
            return NullCache()

    def __getattr__(self, name: str) -> Any:
        """What numba asks of a cache."""
        return getattr(self.opened, name)


def _warn(what: str) -> None:
    warnings.warn(f"{what}. Kernels are compiled on first use, which takes seconds.", stacklevel=2)


def _compiled(function: _Kernel, kept: bool = True, **options: Any) -> _Kernel:
    if PLAIN:
        return function
    kernel: Any = njit(nogil=True, error_model="numpy", **options)(function)
    if kept:
        kernel._cache = LaterCache(function)
    template = kernel.get_call_template

    def plain(arguments: tuple[types.Type, ...], keywords: dict[str, types.Type]) -> Any:
        """Compile a callee once, not again for every constant passed to it."""
        return template(tuple(map(_unliteral, arguments)), {k: _unliteral(v) for k, v in keywords.items()})

    kernel.get_call_template = plain
    return cast(_Kernel, kernel)


def jit(function: _Kernel) -> _Kernel:
    """Compile a kernel that releases the GIL, divides as numpy does, and is cached on disk."""
    return _compiled(function)


def inlined(function: _Kernel) -> _Kernel:
    """Compile a kernel that is always inlined, so that loops over calls to it can be vectorised."""
    return _compiled(function, forceinline=True)


def joined(function: _Kernel) -> _Kernel:
    """As `inlined`, for a kernel with kernels as arguments: it is cached only as a part of its callers."""
    return _compiled(function, kept=False, forceinline=True)


def direct(kernel: Any, *arguments: Any) -> Callable[..., Any]:
    """The compiled function of a kernel, called without numba's type dispatch.

    Type dispatch costs as much as a small kernel. Arguments are not checked. The caller ensures that each array is
    C-contiguous float64 with the number of axes given in `arguments` (it may be read-only unless the kernel writes
    to it). `float`, `int` and `bool` stand for a number, `MODEL` for `Robot.model`, which is always read-only, so
    that there is only one type to compile for; `row_of` makes arrays of other numbers, `record` named tuples.
    """
    if PLAIN:
        return cast(Callable[..., Any], kernel)
    entry: Callable[..., Any] = kernel.compile(tuple(map(_type_of, arguments)))
    return entry


def row_of(kind: type) -> Any:
    """The type of an array with one axis of `int` or `bool` values, for `direct`."""
    return types.Array(_NUMBERS[kind], 1, "C")


def record(cls: type, *fields: Any) -> Any:
    """The type of a named tuple `cls` whose fields are described as the arguments of `direct` are."""
    return types.NamedTuple(tuple(map(_type_of, fields)), cls)


_NUMBERS: dict[type, Any] = {float: types.float64, int: types.int64, bool: types.boolean}


def _type_of(argument: Any) -> Any:
    if isinstance(argument, types.Type):
        return argument
    if argument == MODEL:
        return types.Array(types.float64, 1, "C", readonly=True)
    if isinstance(argument, type):
        return _NUMBERS[argument]
    return types.Array(types.float64, argument, "C")
