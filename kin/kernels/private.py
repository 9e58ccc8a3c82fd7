"""Names of numba that its manual does not promise, each with what it is for.

A release of numba may rename or remove them, so they stand here and nowhere else in the core. They belong to two
gains. If a name is missing, its gain is done without, and importing this module warns of it once:

- `CACHE`: machine code is kept and loaded by :mod:`kin.kernels.cache`. Without: by numba's own cache, in one
  folder for each text of the core.
- `CALLS`: kernels are called without type dispatch and with borrowed arrays (:mod:`kin.kernels.arguments`), and
  compiled once for all constants that callers pass. Without: as numba does these by itself.

Attributes of objects that exist only while kernels are compiled cannot be looked up here. If one is missing,
machine code cannot be loaded: kernels are then compiled in each process, of which :mod:`kin.kernels.cache` warns.
The layout of NumPy's arrays is in :mod:`kin.kernels.layout`.
"""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import Any, Final

import numba

CACHE: Final = "cache"
CALLS: Final = "calls"
WITHOUT = {
    CACHE: "compiled kernels are kept by numba's own cache and load more slowly",
    CALLS: "calls of kernels take longer",
}
MISSING: dict[str, str] = {}  # the gains that are done without → the first name that is missing


def _find(gain: str, module: str, name: str, *members: str) -> Any:
    """What has this name, if it has these members too; an empty class in its place if something is missing."""
    found: Any
    try:
        found = getattr(import_module(module), name)
        for member in members:
            getattr(found, member)
    except (ImportError, AttributeError) as error:
        MISSING.setdefault(gain, str(error))
        found = type(name, (), {})
    return found


# Where a dispatcher looks for machine code before it compiles, and what it gives to `load_overload`.
_find(CACHE, "numba.core.dispatcher", "Dispatcher", "enable_caching")
_find(CACHE, "numba.core.cpu", "CPUContext", "codegen", "get_executable")
# The processor that machine code is for; constants of loaded kernels; symbols that the linker need not look for.
_find(CACHE, "numba.core.codegen", "JITCPUCodegen", "magic_tuple", "set_env")
_find(CACHE, "numba.core.codegen", "JitEngine", "_load_defined_symbols")
# Loaded machine code. `_get_module_for_linking` is what callers ask for its bitcode.
JITCodeLibrary = _find(
    CACHE,
    "numba.core.codegen",
    "JITCodeLibrary",
    *("enable_object_caching", "_set_compiled_object", "_finalize_final_module", "_get_module_for_linking"),
    *("has_dynamic_globals", "serialize_using_object_code"),
)
# A compiled kernel and what is kept of it: `_reduce` names it in the order that `kin.kernels.cache` unpacks.
CompileResult = _find(CACHE, "numba.core.compiler", "CompileResult", "_reduce", "_rebuild")
# Constants of a kernel, found by name (`_memo`) where machine code of several kernels has the same ones.
Environment = _find(CACHE, "numba.core.environment", "Environment", "_memo")
lookup_environment = _find(CACHE, "numba.core.environment", "lookup_environment")
rebuild_environment = _find(CACHE, "numba.core.environment", "_rebuild_env")
# Allocation of arrays in compiled code, to be prepared before machine code is loaded.
rtsys = _find(CACHE, "numba.core.runtime.nrt", "rtsys", "initialize")
# Pickles types and functions.
dumps = _find(CACHE, "numba.core.serialize", "dumps")

# The compiled function for given types; the function that chooses for which types a callee is compiled.
_find(CALLS, "numba.core.dispatcher", "Dispatcher", "compile", "get_call_template", "signatures")
# Machine code that reads an argument.
cgutils = _find(
    CALLS,
    "numba.core",
    "cgutils",
    *("alloca_once_value", "create_struct_proxy", "pack_array", "voidptr_t", "true_bit", "false_bit"),
)
models = _find(CALLS, "numba.extending", "models", "ArrayModel")
register_model = _find(CALLS, "numba.extending", "register_model")
lower_cast = _find(CALLS, "numba.extending", "lower_cast")
unbox = _find(CALLS, "numba.extending", "unbox")
NativeValue = _find(CALLS, "numba.extending", "NativeValue")

for _gain, _name in MISSING.items():
    warnings.warn(f"numba {numba.__version__}: {_name}. Answers stay; {WITHOUT[_gain]}.", stacklevel=2)
