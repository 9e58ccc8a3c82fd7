"""How a kernel is compiled, kept and entered.

numba turns a kernel into machine code when it is first called and keeps that on disk. It goes by the text of the
kernel's own file, although the code holds that of the kernels it calls, too: after an upgrade some of it would be
that of the version before. Here it goes by the text of all modules with kernels.

Nothing depends on the disk: what cannot be read there is compiled, and what cannot be written is not kept.

With NUMBA_DISABLE_JIT=1 kernels are plain Python: a command that answers one question is sooner done so.
"""

from __future__ import annotations

import contextlib
import hashlib
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import config, njit, types
from numba.core.caching import FunctionCache

MODEL = "model"
PLAIN = bool(vars(config)["DISABLE_JIT"])
_unliteral: Any = types.unliteral
_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])


def _fingerprint() -> str:
    """Of the text of every module of the core that has kernels."""
    digest = hashlib.blake2b(digest_size=16)
    for file in sorted(Path(__file__).parents[1].rglob("*.py")):
        text = file.read_bytes()
        if any(mark in text for mark in (b"@jit", b"@inlined", b"@joined")):
            digest.update(text)
    return digest.hexdigest()


_FINGERPRINT = _fingerprint()


class _Cache(FunctionCache):
    """numba's cache of one kernel, by our fingerprint; a disk that fails costs time and no more.

    Most of it is private to numba; tests see to it that it works.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file._source_stamp = _FINGERPRINT

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The machine code, None if it has to be compiled."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:  # noqa: BLE001 - what is left of a file may raise anything
            _warn(f"machine code in {self.cache_path} cannot be read ({error!r}) and is compiled anew")
            # An index that cannot be read could not be added to either.
            with contextlib.suppress(OSError):
                Path(self._cache_file._index_path).unlink()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code."""
        try:
            super().save_overload(sig, data)
        except Exception as error:  # noqa: BLE001 - as above
            self.disable()
            _warn(f"machine code cannot be kept in {self.cache_path} ({error!r})")


def _warn(what: str) -> None:
    warnings.warn(f"{what}. Kernels are compiled when they are first used, which takes seconds.", stacklevel=2)


def _compiled(function: _Kernel, kept: bool = True, **options: Any) -> _Kernel:
    if PLAIN:
        return function
    kernel: Any = njit(nogil=True, error_model="numpy", **options)(function)
    try:
        kernel._cache = _Cache(function) if kept else kernel._cache
    except RuntimeError:  # numba found no folder to write to
        _warn("no folder for machine code can be written to; NUMBA_CACHE_DIR names one")
    template = kernel.get_call_template

    def plain(arguments: tuple[types.Type, ...], keywords: dict[str, types.Type]) -> Any:
        """Compile a callee once, not anew for every constant that is passed to it."""
        return template(tuple(map(_unliteral, arguments)), {k: _unliteral(v) for k, v in keywords.items()})

    kernel.get_call_template = plain
    return cast(_Kernel, kernel)


def jit(function: _Kernel) -> _Kernel:
    """A kernel: without the interpreter's lock, division as in numpy, machine code kept on disk."""
    return _compiled(function)


def inlined(function: _Kernel) -> _Kernel:
    """A kernel that becomes a part of whatever calls it, so that loops over it turn into vector instructions."""
    return _compiled(function, forceinline=True)


def joined(function: _Kernel) -> _Kernel:
    """As `inlined`, for a kernel that takes kernels: on disk it is a part of what calls it, and only so."""
    return _compiled(function, kept=False, forceinline=True)


def direct(kernel: Any, *arguments: Any) -> Callable[..., Any]:
    """The compiled function of a kernel, entered without numba's look at the type of every argument.

    That look costs as much as a small kernel. Nothing stands guard instead: the caller has made sure that every
    array is C-contiguous float64 with the number of axes given here (read-only is fine unless it is written to);
    `float` stands for a float, and `MODEL` for a robot's model, which is read-only everywhere: one type, one
    compilation.
    """
    if PLAIN:
        return cast(Callable[..., Any], kernel)
    known = {float: types.float64, MODEL: types.Array(types.float64, 1, "C", readonly=True)}
    signature = [known[a] if a in known else types.Array(types.float64, a, "C") for a in arguments]
    entry: Callable[..., Any] = kernel.compile(tuple(signature))
    return entry
