"""`Answer`: what the core found, in the fields that REST and the command line publish.

Each field is declared once: its name, its type and, in the string under it, its description. `Answer.of` fills the
fields from an object of the core, `as_json` writes an answer, and REST makes its OpenAPI schemas from the same
declarations. Answers are not validated at run time, so ten thousand poses cost little more than their digits.
"""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Callable, Iterable
from functools import cache, partial
from itertools import pairwise
from types import UnionType
from typing import Annotated, Any, ClassVar, NotRequired, Self, Union, get_args, get_origin

import msgspec
import numpy as np
from msgspec import UNSET, UnsetType
from typing_extensions import TypedDict

Function = Callable[[Any], Any]
_Array = np.ndarray


class From:
    """In ``Annotated``: where in an object of the core a field is found that has another name there.

    Args:
        where: name of an attribute, with dots for an attribute of it; or a function of the object.
        unless_empty: whether the field is absent where its value is 0 or holds nothing.
    """

    def __init__(self, where: str | Function, unless_empty: bool = False) -> None:
        self.where, self.unless_empty = where, unless_empty


class Answer(msgspec.Struct, gc=False):
    """A part of an answer. A field that may be absent is declared as ``… | UnsetType = UNSET``."""

    _makers: ClassVar[dict[type, Callable[..., Any]]] = {}  # by the type of what they are filled from

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls._makers = {}

    @classmethod
    def of(cls, source: object, **given: object) -> Self:
        """The answer with the values that `source` has; arrays and tuples become lists.

        Args:
            source: an object of the core.
            given: values of the fields that `source` does not have; always the same fields.

        Raises:
            AttributeError: neither has a field that must not be absent.
        """
        make = cls._makers.get(type(source))
        if make is None:
            make = cls._makers[type(source)] = _maker(cls, source, given)
        made: Self = make(source, **given)
        return made

    @classmethod
    def __get_pydantic_core_schema__(cls, _source: object, handler: Function) -> Any:
        return handler(_published(cls))


def as_json(content: object) -> bytes:
    """Answers, or lists and dicts of them, as JSON; null stands for NaN and infinity."""
    return _encode(content)


def as_plain(content: object) -> Any:
    """The same as dicts and lists."""
    return msgspec.to_builtins(content)


_encode = msgspec.json.Encoder().encode


# -- filling ---------------------------------------------------------------------------------------------------


def _maker(cls: type[Answer], source: object, given: dict[str, object]) -> Callable[..., Any]:
    """A function that fills an answer from objects of the type of `source`.

    It is compiled from text, as a dataclass's ``__init__`` is: looking fields up one by one would take longer than
    the core takes to find their values.
    """
    names: dict[str, Any] = {"cls": cls, "UNSET": UNSET}
    values = []
    for name, declared in _fields(cls).items():
        kind, place = _parts(declared, From(name))
        where = place.where
        if name in given:
            values.append(name)
        elif not isinstance(where, str):
            names[f"get_{name}"] = where
            values.append(_converted(f"get_{name}(source)", name, kind, names))
        elif UnsetType in get_args(kind) and not hasattr(source, where.partition(".")[0]):
            values.append("UNSET")
        else:
            value = f"(source.{where} or UNSET)" if place.unless_empty else f"source.{where}"
            values.append(_converted(value, name, kind, names))
    parameters = "".join(f", {name}" for name in given)
    make: Callable[..., Any] = eval(f"lambda source{parameters}: cls({', '.join(values)})", names)
    return make


def _converted(value: str, name: str, kind: Any, names: dict[str, Any]) -> str:
    """The expression `value` as one of this type; the functions it needs are added to `names`."""
    convert = _conversion(kind)
    if convert is None:
        return value
    names[f"convert_{name}"] = convert
    if type(None) in get_args(kind) or UnsetType in get_args(kind):
        return f"None if (value := {value}) is None else UNSET if value is UNSET else convert_{name}(value)"
    return f"convert_{name}({value})"


def _conversion(kind: Any) -> Function | None:
    """What makes a value of this type from one of the core; None: it is one already."""
    if get_origin(kind) in (Union, UnionType):
        return next((found for part in get_args(kind) if (found := _conversion(part)) is not None), None)
    if isinstance(kind, type) and issubclass(kind, Answer):
        return kind.of
    if get_origin(kind) is not list:
        return None
    item = get_args(kind)[0]
    if isinstance(item, type) and issubclass(item, Answer):
        return partial(_answers, item, item._makers)
    convert = _conversion(item)
    if convert is None:
        return _listed
    return lambda values: values.tolist() if type(values) is _Array else [convert(each) for each in values]


def _answers(cls: type[Answer], makers: dict[type, Callable[..., Any]], sources: Iterable[object]) -> list[Answer]:
    """`Answer.of` for each; without its call where the type has been met."""
    return [makers[kind](each) if (kind := type(each)) in makers else cls.of(each) for each in sources]


def _listed(values: Any) -> Any:
    return values.tolist() if type(values) is _Array else list(values)


def _fields(cls: type[Answer]) -> dict[str, Any]:
    """The declared types of the fields, in order."""
    declared = inspect.get_annotations(cls, eval_str=True)
    return {name: declared[name] for name in cls.__struct_fields__}


def _parts(declared: Any, otherwise: From) -> tuple[Any, From]:
    """The type of a field, and where its value is found."""
    if get_origin(declared) is not Annotated:
        return declared, otherwise
    kind, *notes = get_args(declared)
    return kind, next((note for note in notes if isinstance(note, From)), otherwise)


# -- publishing ------------------------------------------------------------------------------------------------


@cache
def _published(cls: type[Answer]) -> Any:
    """The answer as a type that pydantic knows."""
    fields = {}
    for name, declared in _fields(cls).items():
        kind, _ = _parts(declared, From(name))
        parts = get_args(kind)
        if UnsetType in parts:
            kind = NotRequired[Union[tuple(part for part in parts if part is not UnsetType)]]  # noqa: UP007
        fields[name] = kind
    make: Any = TypedDict
    shape = make(cls.__name__, fields)
    shape.__doc__, shape.__module__ = cls.__doc__, cls.__module__
    # By name, so that the command line need not import pydantic. Its own `use_attribute_docstrings` would read the
    # source at each start of the service, which takes 0.25 s.
    shape.__pydantic_config__ = {"json_schema_extra": _describe}
    return shape


def _describe(schema: dict[str, Any], cls: type) -> None:
    """Puts the strings under the fields of `cls` into its JSON schema."""
    for name, text in _field_texts(cls.__module__)[cls.__name__].items():
        schema["properties"][name]["description"] = text


@cache
def _field_texts(module: str) -> dict[str, dict[str, str]]:
    """For each class of a module, its fields and the string under each."""
    classes = [
        node for node in ast.parse(inspect.getsource(sys.modules[module])).body if isinstance(node, ast.ClassDef)
    ]
    return {
        node.name: {
            field.target.id: inspect.cleandoc(text.value.value)
            for field, text in pairwise(node.body)
            if isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(text, ast.Expr)
            and isinstance(text.value, ast.Constant)
            and isinstance(text.value.value, str)
        }
        for node in classes
    }
