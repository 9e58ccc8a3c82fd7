"""The disk cache of compiled kernels: what its machine code depends on, damaged files, quick loading.

numba compiles a kernel on first use and caches the machine code on disk. Its cache key is the text of the kernel's
own file only, although the machine code contains the kernels it calls: after an upgrade a cached kernel could
contain functions of the previous version. The cache here uses the text of that file and of all modules of the core
that it imports, directly or not, as its key: a change recompiles what depends on it and nothing else.

Damaged files are recognised by a checksum. The cache is optional: if it cannot be read, kernels are compiled
again; if it cannot be written, they are compiled in every process. A process warns of each once.

Loading is where a process with compiled kernels spends its time until the first result: so it neither prepares
numba's compiler, for which numba imports a hundred modules, nor reads the bitcode of a kernel, which only the
compilation of a caller needs. No machine code depends on the text of this module.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import pickle
import re
import sys
import warnings
import zlib
from collections.abc import Callable, Iterable
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from llvmlite import binding as llvm
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.environment import Environment, _rebuild_env, lookup_environment
from numba.core.runtime.nrt import rtsys

_ROOT = str(Path(__file__).parents[2])
_LEVEL = 4  # of compression: higher ones take longer and save 2 % more
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
        imports |= {place, *(_file_of(f"{module}.{name}") for name in names)} - {None, __file__}
    return hashlib.blake2b(text.encode(), digest_size=16).digest(), frozenset(map(str, imports))


@cache
def _file_of(module: str) -> str | None:
    """The file of a module or package of the core; None for another name. Plain strings: `Path` takes longer."""
    place = os.path.join(_ROOT, *module.split("."))  # noqa: PTH118
    return next((file for file in (f"{place}.py", f"{place}/__init__.py") if os.path.isfile(file)), None)  # noqa: PTH113


class DamagedFileError(Exception):
    """A file of the cache is not as it was written."""


class _CheckedFile(IndexDataCacheFile):
    """numba's files of one kernel, with a checksum at the end: damaged machine code would end the process.

    Machine code is compressed, which takes less than half the room.
    """

    def _dump(self, obj: Any) -> bytes:
        return _sealed(super()._dump(obj))  # unpickling ignores what follows

    def _save_data(self, name: str, data: Any) -> None:
        with self._open_for_write(self._data_path(name)) as file:
            file.write(_sealed(zlib.compress(super()._dump(data), _LEVEL)))

    def _load_index(self) -> Any:
        with contextlib.suppress(FileNotFoundError), Path(self._index_path).open("rb") as file:
            version, data = pickle.load(file), file.read()
            # Files of another version are not used, and may have no checksum.
            if version == self._version and not _intact(data) and pickle.loads(data)[0] == self._source_stamp:
                raise DamagedFileError(self._index_path)
        return super()._load_index()

    def _load_data(self, name: str) -> Any:
        path = self._data_path(name)
        data = Path(path).read_bytes()
        if not _intact(data):
            raise DamagedFileError(path)
        return _Unpickler(io.BytesIO(zlib.decompress(data[:-4]))).load()


def _sealed(data: bytes) -> bytes:
    return data + zlib.crc32(data).to_bytes(4, "little")


def _intact(data: bytes) -> bool:
    return _sealed(data[:-4]) == data


class _Unpickler(pickle.Unpickler):
    """Reads what numba keeps of a kernel without importing the modules of numba that its code came from."""

    def find_class(self, module: str, name: str) -> Any:
        """A class or function by its name."""
        found = super().find_class(module, name)
        return _environment if found is _rebuild_env else found


def _environment(module: str, constants: list[Any], name: str) -> Environment:
    """As numba's `_rebuild_env`. Compiled code reads the constants; only Python code would look up globals."""
    found: Environment | None = lookup_environment(name)
    if found is None:
        found = Environment(vars(sys.modules[module]) if module in sys.modules else {"__name__": module})
        found.consts[:] = constants
        found.env_name = name
        Environment._memo[name] = found
    return found


class _Library(JITCodeLibrary):
    """Machine code from the cache. Its bitcode, which only callers that are compiled need, is parsed for them."""

    _bitcode = b""

    @classmethod
    def of(cls, codegen: Any, state: tuple[str, str, tuple[bytes, bytes]], symbols: Iterable[str]) -> _Library:
        """The library of what numba has written; `symbols` are the functions in it that others look up."""
        name, _, (machine_code, bitcode) = state
        library = cls(codegen, name)
        library._bitcode = bitcode
        library.enable_object_caching()
        library._set_compiled_object(machine_code)
        library._finalize_final_module()
        codegen._engine._defined_symbols |= set(symbols)
        return library

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            self._shared_module = llvm.parse_bitcode(self._bitcode)
            self._codegen._engine._load_defined_symbols(self._shared_module)
            self._bitcode = b""
        return self._shared_module


class _Loading(CompileResultCacheImpl):
    """What is kept of a kernel, which numba decides, and how it is loaded."""

    def rebuild(self, target_context: Any, payload: tuple[Any, ...]) -> Any:
        """As numba's `CompileResult._rebuild`, with a library that parses its bitcode when that is needed."""
        state, described, environment, signature, objects, lifted, annotation, again, referenced = payload
        for each in again:
            each()
        codegen = target_context.codegen()
        wrapper = described.llvm_cpython_wrapper_name
        library = _Library.of(
            codegen, state, (described.llvm_func_name, wrapper, described.llvm_cfunc_wrapper_name)
        )
        fields: dict[str, Any] = {
            "target_context": target_context,
            "typing_context": target_context.typing_context,
            "library": library,
            "environment": environment,
            "entry_point": target_context.get_executable(library, described, environment),
            "fndesc": described,
            "type_annotation": annotation,
            "signature": signature,
            "objectmode": objects,
            "lifted": lifted,
            "typing_error": None,
            "call_helper": None,
            "metadata": None,
            "reload_init": again,
            "referenced_envs": referenced,
        }
        for each in referenced:
            codegen.set_env(each.env_name, each)
        return CompileResult(**fields)


class _Cache(FunctionCache):
    """numba's cache of one kernel, keyed by `fingerprint`; disk errors become warnings.

    It uses private attributes of numba; tests check that they still work.
    """

    _impl_class = _Loading

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        file = self._cache_file
        base = file._index_name.removesuffix(".nbi")
        self._cache_file = _CheckedFile(file._cache_path, base, fingerprint(function.__code__.co_filename))

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The cached machine code, or None if the kernel has to be compiled.

        numba would prepare its compiler first (`target_context.refresh`), which it also does when it compiles.
        """
        try:
            rtsys.initialize(target_context)  # allocation of arrays, which machine code calls
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)
        except Exception as error:  # noqa: BLE001 - unpickling a damaged file may raise anything
            _warn("cached machine code cannot be read and is compiled again", f"{self.cache_path}: {error!r}")
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
            _warn("machine code cannot be written to the cache", f"{self.cache_path}: {error!r}")


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


_warned: set[str] = set()  # what this process has warned of


def _warn(what: str, where: str = "") -> None:
    """Warn once per process: a service whose cache is damaged would otherwise write hundreds of lines."""
    if what in _warned:
        return
    _warned.add(what)
    first = f" (first in {where})" if where else ""
    warnings.warn(f"{what}{first}. Kernels are compiled on first use, which takes seconds.", stacklevel=2)


def is_cached(kernel: Any) -> bool:
    """Whether the cache has machine code of a kernel as its text is today; True without a cache to write to."""
    cache = getattr(kernel, "_cache", None)
    if isinstance(cache, LaterCache):
        cache = cache.opened
    if not isinstance(cache, _Cache) or not os.access(cache.cache_path, os.W_OK):
        return True
    file: Any = cache._cache_file
    try:
        names = file._load_index().values()
        return bool(names) and all(_intact(Path(file._data_path(name)).read_bytes()) for name in names)
    except Exception:  # noqa: BLE001 - unpickling a damaged file may raise anything, and it is compiled again
        return False
