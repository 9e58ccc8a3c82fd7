"""The disk cache of compiled kernels: where it is, what its machine code depends on, damaged files, quick loading.

numba compiles a kernel on first use and caches the machine code on disk, beside the source. Its cache key is the
text of the kernel's own file only, although the machine code contains the kernels it calls: after an upgrade a
cached kernel could contain functions of the previous version. The cache here uses the text of that file and of
all modules of the core that it imports, directly or not, as its key: a change recompiles what depends on it and
nothing else. The place of the source is no part of it, so all copies of the core on a machine share one folder.
Only tracebacks of errors that kernels raise, and numba's annotations, name the copy that was compiled.

There is one file for each kernel, signature, text, processor, numba and Python. It is written beside its place and
moved there, and never changed: processes need no lock. Files that were not used for longest are removed when all
together exceed `CAPACITY`.

Machine code and pickles are executed, so the folder must belong to the user, and to nobody else (`kernel_folder`).
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
import time
import uuid
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from llvmlite import binding as llvm
from numba import config

from kin.kernels.private import (
    CompileResult,
    Environment,
    JITCodeLibrary,
    dumps,
    lookup_environment,
    rebuild_environment,
    rtsys,
)
from kin.kernels.sources import fingerprint, shared_with, user_folder

CAPACITY = 512 << 20  # bytes; all kernels of one version take 25 MB
_DAY = 86400.0  # s: a file that is used says so at most once a day
_FORMAT = 1  # of the files: a change of what is written, or of how, needs another number
_OPTIONS = (
    "OPT",
    "LOOP_VECTORIZE",
    "SLP_VECTORIZE",
    "BOUNDSCHECK",
    "DEBUGINFO_DEFAULT",
)  # they change machine code
_LEVEL = 4  # of compression: higher ones take longer and save 2 % more


def kernel_folder() -> Path | None:
    """The folder of machine code, made if it is missing; None if there is none that can be trusted.

    It is `kernels` in the user's cache folder, or in the folder that KINBOARD_CACHE names. NUMBA_CACHE_DIR takes
    precedence, as for numba's own cache. Its owner and mode are not checked, and it may be read-only.
    """
    given = str(vars(config)["CACHE_DIR"])
    hint = "set KINBOARD_CACHE to another folder"
    try:
        folder = Path(given, "kinboard") if given else user_folder() / "kernels"
        folder.mkdir(mode=0o777 if given else 0o700, parents=True, exist_ok=True)
        owned = "" if given else shared_with(folder, 0o077)
    except (OSError, RuntimeError) as error:
        _warn(f"there is no folder to keep machine code in: {error}; {hint}")
        return None
    if owned:
        _warn(f"{folder} may be changed or read by others ({owned}) and is not used: chmod 700, or {hint}")
        return None
    return folder


def prune(folder: Path) -> None:
    """Remove the files that were not used for longest, until all together take at most `CAPACITY`."""
    found = []
    for path in folder.glob("*.nbc*"):
        with contextlib.suppress(FileNotFoundError):  # another process has moved or removed it
            about = path.stat()
            found.append((about.st_mtime, about.st_size, path))
    total = 0
    for _, size, path in sorted(found, reverse=True):
        total += size
        if total > CAPACITY:
            path.unlink(missing_ok=True)


class DamagedFileError(Exception):
    """A file of the cache is not as it was written."""


def _sealed(data: bytes) -> bytes:
    return data + zlib.crc32(data).to_bytes(4, "little")


def _intact(data: bytes) -> bool:
    return _sealed(data[:-4]) == data


class _Unpickler(pickle.Unpickler):
    """Reads what numba keeps of a kernel without importing the modules of numba that its code came from."""

    def find_class(self, module: str, name: str) -> Any:
        """A class or function by its name."""
        found = super().find_class(module, name)
        return _environment if found is rebuild_environment else found


def _environment(module: str, constants: list[Any], name: str) -> Environment:
    """As numba's `_rebuild_env`. Compiled code reads the constants; only Python code would look up globals."""
    found: Environment | None = lookup_environment(name)
    if found is None:
        found = Environment(vars(sys.modules[module]) if module in sys.modules else {"__name__": module})
        found.consts[:] = constants
        found.env_name = name
        Environment._memo[name] = found
    return found


class _Library(JITCodeLibrary):  # type: ignore[misc]
    """Machine code from the cache. Its bitcode, which only callers that are compiled need, is parsed for them."""

    _bitcode = b""
    _parsed: Any = None
    _engine: Any

    @classmethod
    def of(cls, codegen: Any, state: tuple[str, str, tuple[bytes, bytes]], symbols: Iterable[str]) -> _Library:
        """The library of what numba has written; `symbols` are the functions in it that others look up."""
        name, _, (machine_code, bitcode) = state
        library = cls(codegen, name)
        library._bitcode, library._engine = bitcode, codegen._engine
        library.enable_object_caching()
        library._set_compiled_object(machine_code)
        library._finalize_final_module()
        library._engine._defined_symbols |= set(symbols)
        return library

    def _get_module_for_linking(self) -> Any:
        if self._parsed is None:
            self._parsed = llvm.parse_bitcode(self._bitcode)
            self._engine._load_defined_symbols(self._parsed)
            self._bitcode = b""
        return self._parsed


def _rebuild(target_context: Any, payload: tuple[Any, ...]) -> Any:
    """As numba's `CompileResult._rebuild`, with a library that parses its bitcode when that is needed."""
    state, described, environment, signature, objects, lifted, annotation, again, referenced = payload
    for each in again:
        each()
    codegen = target_context.codegen()
    wrapper = described.llvm_cpython_wrapper_name
    symbols = described.llvm_func_name, wrapper, described.llvm_cfunc_wrapper_name
    library = _Library.of(codegen, state, symbols)
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


class KernelCache:
    """What numba asks of the cache of a kernel; errors of the disk become warnings."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The cached machine code, or None if the kernel has to be compiled.

        numba would prepare its compiler first (`target_context.refresh`), which it also does when it compiles.
        """
        folder = kernel_folder()
        if folder is None:
            return None
        path = folder
        try:
            rtsys.initialize(target_context)  # allocation of arrays, which machine code calls
            path = folder / self.file_name(sig, target_context.codegen())
            data = path.read_bytes()
            if not _intact(data):
                raise DamagedFileError("damaged")
            written_for, payload = _Unpickler(io.BytesIO(zlib.decompress(data[:-4]))).load()
            found = _rebuild(target_context, payload) if written_for == sig else None
        except FileNotFoundError:
            return None
        except Exception as error:  # noqa: BLE001 - unpickling a damaged file may raise anything
            _warn("cached machine code cannot be read and is compiled again", f"{path}: {error!r}")
            return None
        with contextlib.suppress(OSError):  # removed meanwhile, or a folder that is only read
            if time.time() - path.stat().st_mtime > _DAY:
                os.utime(path)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write machine code to the cache, unless it contains addresses of this process."""
        folder = kernel_folder()
        if folder is None or data.lifted or data.library.has_dynamic_globals:
            return
        try:
            path = folder / self.file_name(sig, data.codegen)
            content = _sealed(zlib.compress(dumps((sig, data._reduce())), _LEVEL))
            beside = path.with_name(f"{path.name}.{uuid.uuid4().hex}")
            try:
                beside.write_bytes(content)
                beside.replace(path)
            finally:
                beside.unlink(missing_ok=True)
            prune(folder)
        except Exception as error:  # noqa: BLE001 - as above
            _warn("machine code cannot be written to the cache", f"{folder}: {error!r}")

    @property
    def cache_path(self) -> str | None:
        """The folder, for numba's statistics."""
        return None if (folder := kernel_folder()) is None else str(folder)

    def flush(self) -> None:
        """numba asks for it when a kernel is compiled again by hand: the file is then written again."""

    def stem(self, codegen: Any) -> str:
        """What the names of all files of this kernel begin with: its text, and what the machine code is for."""
        function = self._function
        code = function.__code__
        parts = (fingerprint(code.co_filename), function.__module__, function.__qualname__, code.co_firstlineno)
        name = re.sub(r"[^\w.]", "", f"{function.__module__}.{function.__qualname__}")[-100:]
        return f"{name}-{_hash(parts, _target(codegen.magic_tuple()))}"

    def file_name(self, sig: Any, codegen: Any) -> str:
        """The name of the file for a signature. Functions of one line differ in their code, closures in cells."""
        cells = [cell.cell_contents for cell in self._function.__closure__ or ()]
        parts = *map(str, sig), self._function.__code__.co_code, dumps(cells) if cells else b""
        return f"{self.stem(codegen)}-{_hash(*parts)}.nbc"


@contextlib.contextmanager
def numbas_own(function: Callable[..., Any]) -> Iterator[bool]:
    """Within the context, numba's own cache of a kernel goes to a folder for all of the text that it depends on.

    Yields whether there is a place for such folders: numba raises an error where it can write to none.
    """
    folder, before = kernel_folder(), vars(config)["CACHE_DIR"]
    usable = folder is not None and os.access(folder, os.W_OK)
    if folder is not None and usable:
        vars(config)["CACHE_DIR"] = str(folder / fingerprint(function.__code__.co_filename))
    try:
        yield usable
    finally:
        vars(config)["CACHE_DIR"] = before


@lru_cache(maxsize=8)
def _target(processor: tuple[str, ...]) -> str:
    """What all machine code of this process depends on besides its text."""
    python = sys.implementation.cache_tag, getattr(sys, "abiflags", "")
    options = [vars(config).get(name) for name in _OPTIONS]
    return _hash(_FORMAT, processor, numba.__version__, python, options)


def _hash(*parts: object) -> str:
    return hashlib.blake2b(repr(parts).encode(), digest_size=12).hexdigest()


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
    if not isinstance(cache, KernelCache) or (folder := kernel_folder()) is None or not os.access(folder, os.W_OK):
        return True
    try:
        files = [path.read_bytes() for path in folder.glob(f"{cache.stem(kernel.targetctx.codegen())}-*.nbc")]
    except OSError:  # removed meanwhile
        return False
    return bool(files) and all(map(_intact, files))
