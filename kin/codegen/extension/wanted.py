"""What entries rely on beyond the types of their arguments, as C that checks it before a call.

A kernel looks at the length of one axis and indexes other arrays up to it. So ``entries.txt`` has the lengths in
brackets behind a type, ``f2[n,4]``: a name is one length wherever it stands in an entry.

=====================  ===========================================================================================
``n``, ``4``           this length; so are ``n+1`` and ``2*k``
``n|n+1``              one of these
``0<n``, ``3<=n<=4``   n, within bounds
``arm:n``              the numbers of an arm with n joints, see `kin.kernels.fk`; and indices into q
``31+arm:3``           the same behind 31 other numbers
``i[p]``               no length, but the value of a whole number
=====================  ===========================================================================================

Values that are used as indices have their range in braces, ``i{:n}`` from 0 and ``i1[k]{-1:n}`` from −1, each
below n; without an end there is none. ``{0@:m,1-3@:n}`` is about these places of the last axis. Floats are such
values too: rows of a table carry the numbers of branches and joints.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from kin.codegen import c
from kin.codegen.source import plain
from kin.codegen.types import ArrayOf, Scalar, TupleOf, Type
from kin.codegen.units import Prototype

DEMAND = re.compile(r"(?:\[(.*)\])?(?:\{(.*)\})?")
ARM = re.compile(r"(?:(\d+)\+)?arm:(\w)")
BOUNDED = re.compile(r"(?:(\d+)(<=?))?([a-z])(?:(<=?)(\w+))?")
RANGE = re.compile(r"(?:(\d+)(?:-(\d+))?@)?([^:]*):(.*)")


class _Item(NamedTuple):
    """A number or an array among the arguments: its name, the number of its argument, and its first slot."""

    name: str
    argument: int
    slot: int
    kind: Scalar | ArrayOf
    demand: str

    @property
    def lengths(self) -> Iterator[tuple[str, str]]:
        """Each length in C, or the value of a number, with what it is to be."""
        texts = (DEMAND.fullmatch(self.demand) or [""] * 2)[1]
        first = self.slot + isinstance(self.kind, ArrayOf)
        for k, text in enumerate(texts.split(",") if texts else ()):
            yield f"slots[{first + k}].i", text

    @property
    def ranges(self) -> list[str]:
        """The ranges of its values."""
        texts = (DEMAND.fullmatch(self.demand) or [""] * 3)[2]
        return texts.split(",") if texts else []


def demands(made: Prototype) -> str:
    """All that an entry wants, after the names of its arguments; empty if it takes whatever has the types."""
    return " ".join(f"{each.name}{each.demand}" for each in _items(made) if each.demand)


def check(made: Prototype) -> str:
    """The function ``wrong_NAME`` of the slots of a call: NULL, or which argument does not fit."""
    items, names, lines = list(_items(made)), dict[str, str](), ["  (void)slots;"]
    lengths = [(each, place, text) for each in items for place, text in each.lengths]
    for each, place, text in lengths:
        if (found := BOUNDED.fullmatch(text)) and found[3] not in names:
            names[found[3]] = place
            lines.append(f"  const int64_t {found[3]} = {place}; if ((uint64_t){place} >> 31) {_says(each)}")
    for each, place, text in lengths:  # names that no length is alone
        name, _, more = text.partition("+")
        if re.fullmatch("[a-z]", name) and name not in names:
            names[name] = place
            lines.append(f"  const int64_t {name} = {place} - {more}; if ((uint64_t){name} >> 31) {_says(each)}")
    lines += [f"  if (!({_fits(each, place, text)})) {_says(each)}" for each, place, text in lengths]
    lines += [f"  {_in_range(each, text)}" for each in items for text in each.ranges]
    head = f"static const char *wrong_{made.name}(const kinboard_slot *slots) {{"
    return "\n".join([head, *lines, "  return NULL;", "}"])


def _items(made: Prototype) -> Iterator[_Item]:
    code = plain(made.entry.kernel).__code__
    wanted, slot = iter(made.entry.wanted), 0

    def visit(name: str, argument: int, kind: Type) -> Iterator[_Item]:
        nonlocal slot
        if isinstance(kind, TupleOf):
            for k, each in enumerate(kind.items):
                yield from visit(f"{name}.{kind.names[k] if kind.names else k}", argument, each)
            return
        assert isinstance(kind, Scalar | ArrayOf)
        yield _Item(name, argument, slot, kind, next(wanted, ""))
        slot += 1 + (kind.ndim if isinstance(kind, ArrayOf) else 0)

    for k, (name, kind) in enumerate(zip(code.co_varnames, made.entry.kinds, strict=False)):
        yield from visit(name, k + 1, kind)


def _says(each: _Item) -> str:
    return f'return "argument {each.argument}, {each.name}{each.demand},";'


def _fits(each: _Item, place: str, text: str) -> str:
    """The condition of one length."""
    if arm := ARM.fullmatch(text):
        first = arm[1] or "0"
        return f"kinboard_is_arm((const double *)slots[{each.slot}].p + {first}, {place} - {first}, {arm[2]})"
    conditions = [f"{place} == {one}" for one in text.split("|")]
    if bounded := BOUNDED.fullmatch(text):
        low, above, name, below, high = bounded.groups()
        conditions = [f"{place} == {name}", *([f"{low} {above} {name}"] if low else [])]
        return " && ".join([*conditions, *([f"{name} {below} {high}"] if high else [])])
    return " || ".join(conditions)


def _in_range(each: _Item, text: str) -> str:
    """A statement that looks at values."""
    parts = RANGE.fullmatch(text)
    assert parts is not None
    first, last, low, high = parts.groups()
    outside = f"if (!(value >= {low or 0}{f' && value < {high}' if high else ''})) {_says(each)}"
    if isinstance(each.kind, Scalar):
        return f"{{ int64_t value = slots[{each.slot}].i; {outside} }}"
    lengths = [f"slots[{each.slot + 1 + k}].i" for k in range(each.kind.ndim)]
    item, size, step = c.NAMES[each.kind.item], " * ".join(lengths), lengths[-1]
    begin, end = (f"row + {first}", f"row + {last or first}") if first else ("row", f"row + {step} - 1")
    loops = f"for (int64_t row = 0; row < {size}; row += {step}) for (int64_t at = {begin}; at <= {end}; at++)"
    return f"{loops} {{ {item} value = ((const {item} *)slots[{each.slot}].p)[at]; {outside} }}"
