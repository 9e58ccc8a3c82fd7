"""Private names of libraries: what each is used for, and what happens where a version of the library lacks it.

A library may rename what it does not document, in any release. Each improvement that relies on such names is a
`PrivateUse`. Where one of its names is missing, the improvement is left out, and the log says so once: the
library's own behaviour takes its place.
"""

from __future__ import annotations

import dataclasses
import dis
import importlib
import importlib.metadata
import inspect
import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

logger = logging.getLogger("kinboard.libraries")


@dataclass(frozen=True)
class PrivateUse:
    """An improvement that relies on private names of a library.

    Attributes:
        library: its name in the package index.
        purpose: what the improvement is for.
        without: what happens where it is left out.
        names: ``module:Class.attribute``, ``module:Class`` or ``module:function``. Those with parameters, as in
            ``module:function(a, b)``, must have exactly these; of a class, those of its constructor, or the fields
            of a dataclass. An attribute may be one that the class or one of its bases sets in ``__init__``.
    """

    library: str
    purpose: str
    without: str
    names: tuple[str, ...]

    @cached_property
    def is_there(self) -> bool:
        """Whether the installed version has all names; if not, the log says so, once."""
        missing = self.missing()
        if missing:
            version = importlib.metadata.version(self.library)
            logger.warning("%s %s lacks %s. %s", self.library, version, ", ".join(missing), self.without)
        return not missing

    def missing(self) -> list[str]:
        """The names that the installed version does not have, or not with these parameters."""
        return [name for name in self.names if not _exists(name)]


def _exists(name: str) -> bool:
    place, _, parameters = name.rstrip(")").partition("(")
    module, path = place.split(":")
    try:
        found: object = importlib.import_module(module)
    except ImportError:
        return False
    *owners, last = path.split(".")
    for owner in owners:
        found = getattr(found, owner, None)
    if not parameters:
        return hasattr(found, last) or (isinstance(found, type) and last in _set_by_instances(found))
    function = getattr(found, last, None)
    return callable(function) and ", ".join(_parameters(function)) == parameters


def _parameters(function: Callable[..., object]) -> list[str]:
    if dataclasses.is_dataclass(function):
        return [field.name for field in dataclasses.fields(function)]
    return list(inspect.signature(function).parameters)


def _set_by_instances(kind: type) -> set[str]:
    """The names of a dataclass's fields, or of the attributes that `__init__` of a class and of its bases sets."""
    names = set(getattr(kind, "__dataclass_fields__", ()))
    for each in kind.__mro__:
        if (code := getattr(vars(each).get("__init__"), "__code__", None)) is not None:
            names |= {step.argval for step in dis.get_instructions(code) if step.opname == "STORE_ATTR"}
    return names
