"""How a kernel is compiled, kept and entered.

numba turns a kernel into machine code when it is first called and keeps that on disk. It goes by the text of the
kernel's own file, although the code holds that of the kernels it calls, too: after an upgrade some of it would be
that of the version before. Here it goes by the text of all modules with kernels.

With NUMBA_DISABLE_JIT=1 kernels are plain Python: a command that answers one question is sooner done so.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import config, njit, types

MODEL = "model"
PLAIN = bool(vars(config)["DISABLE_JIT"])
_unliteral: Any = types.unliteral
_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])


def _fingerprint() -> str:
    """Of the text of every module of the core that has kernels."""
    digest = hashlib.blake2b(digest_size=16)
    for file in sorted(Path(__file__).parent.rglob("*.py")):
        text = file.read_bytes()
        if b"@jit" in text or b"@inlined" in text:
            digest.update(text)
    return digest.hexdigest()


_FINGERPRINT = _fingerprint()


def _compiled(function: _Kernel, **options: Any) -> _Kernel:
    if PLAIN:
        return function
    kernel: Any = njit(cache=True, nogil=True, error_model="numpy", **options)(function)
    # Private to numba; tests see to it that it works.
    kernel._cache._cache_file._source_stamp = _FINGERPRINT
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
