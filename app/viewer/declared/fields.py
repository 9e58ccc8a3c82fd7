"""Settings as frozen dataclasses: each field declares its control, what is valid, and its entry in a link.

    @dataclass(frozen=True)
    class Jog(Settings):
        frame: Frame = choice("Frame", {"Base": "base", "Tool": "tool"}, "base", hint="Whose axes")
        step: float = number("Step", 0.005, (1e-4, 0.1), "length", hint="Length of one step")
        runs: bool = flag("Run", hint="Moves the arm", link=False)

A `path` names a field from outside: ``"step"``, ``"statics.on"`` within a part, ``"force.0"`` in a vector.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Any, Literal, Self, TypeGuard

from app.viewer.panel.fields import limit_marks
from kin import InputError, Robot
from kin.typed import EntryError, ReadError, cut, read
from kin.units import Unit, Units

Options = Mapping[str, object]
Measure = Literal["", "length", "angle", "s", "%"]
_NONE, _SECONDS, _PERCENT = Unit("", 1.0, 0), Unit("s", 1.0, 3), Unit("%", 100.0, 0)
_DECIMALS = 6  # of a degree or a millimetre, in a field of a form
LONGEST = 100  # characters of a text in a link


@dataclass(frozen=True, kw_only=True)
class Spec:
    """What a field declares.

    Attributes:
        label, hint: of the control.
        default: on a fresh page; a function of the robot: taken anew for each robot.
        link: whether it is in links, and restored by undo.
        undo: what undo calls a change; "": the feature's title.
        names: its name in messages, if not that of the field.
        renew: whether another robot resets it to the default.
    """

    label: str = ""
    hint: str | None = None
    default: Any = None
    link: bool = True
    undo: str = ""
    names: str = ""
    renew: bool = False

    kind = ""  # of the control, as viser's `add_…`

    def first(self, robot: Robot) -> Any:
        """The default for a robot."""
        return self.default(robot) if callable(self.default) else self.default

    def unit(self, units: Units) -> Unit | None:
        """The unit that the control shows; an event of a control in another unit is void."""
        return None

    def read(self, name: str, posted: object, robot: Robot, units: Units) -> Any:
        """The value that a control has sent; raises `InputError`."""
        return self.unpack(name, posted, robot)

    def shown(self, value: Any, robot: Robot, units: Units) -> Any:
        """The value as the control shows it."""
        return value

    def props(self, robot: Robot, units: Units) -> dict[str, Any]:
        """Further properties of the control."""
        return {}

    def fixed(self, robot: Robot, units: Units) -> dict[str, Any]:
        """Properties that only a new control can have."""
        return {}

    def pack(self, value: Any) -> object:
        """The value as JSON."""
        return value

    def unpack(self, name: str, entry: object, robot: Robot) -> Any:
        """The value of an entry of a link; raises `InputError`."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Flag(Spec):
    """A check box."""

    kind = "checkbox"

    def unpack(self, name: str, entry: object, robot: Robot) -> bool:
        if not isinstance(entry, bool):
            raise InputError(name, entry, "true or false")
        return entry


@dataclass(frozen=True, kw_only=True)
class Text(Spec):
    """A line of text of at most `longest` characters; longer ones are cut to one more, so that it can be seen."""

    longest: int = 400
    kind = "text"

    def unpack(self, name: str, entry: object, robot: Robot) -> str:
        if not isinstance(entry, str):
            raise InputError(name, entry, "a text")
        return entry[: self.longest + 1]


@dataclass(frozen=True, kw_only=True)
class Choice(Spec):
    """A drop-down list; `options` are values by their labels, or a function of the robot that gives them.

    `none` is the entry of a link for the value None, `old` are entries of earlier links. `anything`: the options
    follow from facts, so a link may hold any text.
    """

    options: Options | Callable[[Robot], Options] = field(default_factory=dict)
    none: object = None
    old: Mapping[str, object] = field(default_factory=dict)
    anything: bool = False
    kind = "dropdown"

    def narrowed(self, options: Options) -> Choice:
        """The same with options that follow from facts."""
        return replace(self, options=options)

    def offered(self, robot: Robot) -> Options:
        """The values by their labels."""
        return self.options(robot) if callable(self.options) else self.options

    def read(self, name: str, posted: object, robot: Robot, units: Units) -> Any:
        offered = self.offered(robot)
        if not isinstance(posted, str) or posted not in offered:
            raise InputError(name, posted, "one of " + ", ".join(offered))
        return offered[posted]

    def shown(self, value: Any, robot: Robot, units: Units) -> Any:
        return next(label for label, one in self.offered(robot).items() if one == value)

    def props(self, robot: Robot, units: Units) -> dict[str, Any]:
        return {"options": tuple(self.offered(robot))}

    def pack(self, value: Any) -> object:
        return self.none if value is None else value

    def unpack(self, name: str, entry: object, robot: Robot) -> Any:
        entry = self.old.get(entry, entry) if isinstance(entry, str) else entry
        if self.anything and isinstance(entry, str) and len(entry) <= LONGEST:
            return entry
        for value in self.offered(robot).values():
            if type(entry) is type(self.pack(value)) and entry == self.pack(value):
                return value
        raise InputError(name, entry, "one of " + ", ".join(str(v) for v in self.offered(robot).values()))


@dataclass(frozen=True, kw_only=True)
class Number(Spec):
    """A number within limits (radians, metres, or as it is) in a field or a slider; `clip`: limits cut it.

    Forms of our own HTML show it as a `cell`, and read what is `typed` into it.

    Controls show its unit if it has a `measure`, otherwise `scale` of it, with `digits`; a step of the control is
    `step`, or one of the last digit.

    Attributes:
        coarse: the step is one of this digit instead.
        slider: the ends of the slider, if it is not a field.
        within: the limits for a robot, and the ends of its slider, if they are not the same for all.
        marks: whether the ends below the slider are written by us: viser writes a hyphen for a minus.
        named: whether the label ends with the unit.
        rate: in a form, whether it is per second.
        empty, nothing: what an empty field of a form means, and its value; "": it must not be empty.
    """

    limits: tuple[float, float] = (-math.inf, math.inf)
    measure: Measure = ""
    digits: int = 1
    scale: float = 1.0
    step: float | None = None
    coarse: int | None = None
    slider: tuple[float, float] | None = None
    clip: bool = False
    whole: bool = False
    marks: bool = False
    named: bool = True
    rate: bool = False
    empty: str = ""
    nothing: float | None = None
    within: Callable[[Robot], tuple[float, float]] | None = None

    def of(self, robot: Robot) -> Number:
        """What is valid for a robot."""
        if self.within is None:
            return self
        ends = self.within(robot)
        return replace(self, limits=ends, slider=ends if self.slider else None, within=None)

    @property
    def kind(self) -> str:  # type: ignore[override]
        """A slider, or a field."""
        return "slider" if self.slider else "number"

    def unit(self, units: Units) -> Unit | None:
        own = {"length": units.lengths, "angle": units.angles, "s": _SECONDS, "%": _PERCENT, "": None}
        return own[self.measure]

    def shown(self, value: Any, robot: Robot, units: Units) -> Any:
        if (slider := self.of(robot).slider) is not None:
            value = min(max(value, slider[0]), slider[1])
        return value if self.whole else self._unit(units).shown(value, self.digits)

    def props(self, robot: Robot, units: Units) -> dict[str, Any]:
        unit, own = self.unit(units), self.of(robot)
        low, high = self._ends(own.slider or own.limits, units)
        step = self.step
        if step is None:
            digits = self.digits if self.coarse is None else self.coarse
            step = 1 if self.whole else self._unit(units).step(digits)
        return {"min": low, "max": high, "step": step, **({"unit": unit.name} if unit and self.named else {})}

    def fixed(self, robot: Robot, units: Units) -> dict[str, Any]:
        return {"marks": limit_marks(*self._ends(self.slider, units))} if self.marks and self.slider else {}

    def read(self, name: str, posted: object, robot: Robot, units: Units) -> Any:
        own = self.of(robot)
        if self.whole:
            return own.unpack(name, posted, robot)
        unit, (low, high) = self._unit(units), own._ends(own.limits, units)
        valid = "a finite number" if self.clip else f"a number from {low:g} to {high:g}"
        if not _is_number(posted):
            raise InputError(name, posted, valid)
        if not self.clip and not low <= posted <= high:
            raise InputError(name, posted, valid)
        return min(max(unit.read(float(posted)), own.limits[0]), own.limits[1])

    def unpack(self, name: str, entry: object, robot: Robot) -> Any:
        low, high = self.of(robot).limits
        expected = f"a number from {low:g} to {high:g}"
        if self.whole:
            expected = f"a whole number from {low:.0f} to {high:.0f}"
        elif self.clip:
            expected = "a finite number"
        if not _is_number(entry):
            raise InputError(name, entry, expected)
        if (self.whole and entry != entry // 1) or (not self.clip and not low <= entry <= high):
            raise InputError(name, entry, expected)
        return int(entry) if self.whole else min(max(float(entry), low), high)

    def cell(self, name: str, value: float | None, units: Units, wrong: str | None = None) -> dict[str, object]:
        """The field of a form, for the macro *number* of the templates; `wrong`: a text that was refused."""
        unit = self._unit(units)
        shown = "" if value is None or (self.empty and value == self.nothing) else unit.short(value, _DECIMALS)
        return {
            "name": name,
            "spec": self,
            "value": shown if wrong is None else wrong,
            "unit": unit.name + "/s" * self.rate,
            "wrong": wrong is not None,
        }

    def typed(self, text: str, units: Units) -> float | None:
        """The value of a text in a form; raises `EntryError`, which says what would be valid."""
        unit, title, (low, high) = self._unit(units), "The field stays as it was", self.limits
        given = text.replace("/s", "") if self.rate else text
        if self.empty and not given.strip():
            return self.nothing
        small = 0.0 < low * unit.scale < unit.step(1)  # which would be written as 0
        valid = f"{unit.short(low, _DECIMALS if small else 1)} to {unit.short(high)}"
        valid += unit.suffix.rstrip() + "/s" * self.rate + f", or nothing: {self.empty}" * bool(self.empty)
        valid = "a whole number from " * self.whole + valid
        try:
            value = read(given, unit, self.limits)
        except ReadError as error:
            raise EntryError(title, f"{error.sentence} Valid: {valid}.", error.readings) from None
        if low <= value <= high and not (self.whole and value % 1.0):
            return int(value) if self.whole else value
        raise EntryError(title, f"“{cut(text)}” is not valid. Valid: {valid}.")

    def _unit(self, units: Units) -> Unit:
        return self.unit(units) or (_NONE if self.scale == 1.0 else Unit("", self.scale, 0))

    def _ends(self, ends: tuple[float, float], units: Units) -> tuple[Any, Any]:
        if self.whole:
            return int(ends[0]), int(ends[1])
        unit = self._unit(units)
        return unit.shown(ends[0], self.digits), unit.shown(ends[1], self.digits)


@dataclass(frozen=True, kw_only=True)
class Vector(Spec):
    """Numbers with a control each; `labels` are theirs, `each` is what is valid for all."""

    labels: tuple[str, ...] = ()
    each: Number = field(default_factory=Number)

    def pack(self, value: Any) -> object:
        return list(value)

    def unpack(self, name: str, entry: object, robot: Robot) -> Any:
        if not isinstance(entry, list) or len(entry) != len(self.labels):
            raise InputError(name, entry, f"{len(self.labels)} numbers")
        return tuple(self.each.unpack(name, item, robot) for item in entry)


@dataclass(frozen=True, kw_only=True)
class Index(Spec):
    """The index of one of the robot's joints, or None; without a control of its own. Links have 0 for None."""

    def pack(self, value: Any) -> object:
        return 0 if value is None else value + 1

    def unpack(self, name: str, entry: object, robot: Robot) -> Any:
        if type(entry) is not int or not 0 <= entry <= robot.n:
            raise InputError(name, entry, f"a whole number from 0 to {robot.n}")
        return entry - 1 if entry else None


@dataclass(frozen=True, kw_only=True)
class Kept(Spec):
    """What has no control: a value that the feature sets, and its form in links.

    Attributes:
        to_json: the entry of a link.
        from_json: the value of an entry for a robot; raises `InputError`.
    """

    to_json: Callable[[Any], object] = field(default=lambda value: value)
    from_json: Callable[[object, Robot], Any] = field(default=lambda entry, robot: entry)

    def pack(self, value: Any) -> object:
        return self.to_json(value)

    def unpack(self, name: str, entry: object, robot: Robot) -> Any:
        return self.from_json(entry, robot)


@dataclass(frozen=True, kw_only=True)
class Part(Spec):
    """Settings within settings."""

    of: type[Settings]

    def first(self, robot: Robot) -> Any:
        return self.of.fresh(robot)

    def pack(self, value: Any) -> object:
        return value.state()

    def unpack(self, name: str, entry: object, robot: Robot) -> Any:
        return self.of.fresh(robot).restored(entry, robot)


def _is_number(value: object) -> TypeGuard[float]:
    """Whether a value is a number that a float can hold."""
    return not isinstance(value, bool) and isinstance(value, int | float) and abs(value) <= sys.float_info.max


def numbers(name: str, entry: object, count: int, most: float = sys.float_info.max) -> tuple[float, ...]:
    """An entry of a link that is a list of so many finite numbers, none above `most`; raises `InputError`."""
    if not isinstance(entry, list) or len(entry) != count or not all(map(_is_number, entry)):
        raise InputError(name, entry, f"{count} finite numbers")
    if any(abs(item) > most for item in entry):
        raise InputError(name, entry, f"numbers up to {most:g}")
    return tuple(float(item) for item in entry)


def record(name: str, entry: object) -> Mapping[str, object]:
    """An entry of a link that has values by names; raises `InputError`."""
    if not isinstance(entry, dict):
        raise InputError(name, entry, "values by names")
    return entry


def numbers_by_name(name: str, entry: object) -> dict[str, float]:
    """An entry of a link that has numbers by names, without what is no number; raises `InputError`."""
    return {str(key): item for key, item in record(name, entry).items() if _is_number(item)}


def subset(name: str, entry: object, known: Iterable[str]) -> frozenset[str]:
    """A list of names in a link, without unknown ones; raises `InputError`."""
    if not isinstance(entry, list):
        raise InputError(name, entry, "a list of names")
    return frozenset(one for one in known if one in entry)


def rows(name: str, entry: object, most: int) -> list[object]:
    """An entry of a link that is a list with at most so many items; raises `InputError`."""
    if not isinstance(entry, list) or len(entry) > most:
        raise InputError(name, entry, f"a list of at most {most}")
    return entry


def ordinal(name: str, entry: object) -> int | None:
    """An entry of a link that is a whole number from 0, or nothing; raises `InputError`."""
    if entry is None or (type(entry) is int and entry >= 0):
        return entry
    raise InputError(name, entry, "a whole number from 0, or nothing")


def _field(spec: Spec) -> Any:
    default = None if callable(spec.default) else spec.default
    return field(default=default, metadata={"spec": spec})


def flag(label: str, default: bool = False, **options: Any) -> Any:
    """A field with a check box."""
    return _field(Flag(label=label, default=default, **options))


def text(label: str, **options: Any) -> Any:
    """A field with a line of text."""
    return _field(Text(label=label, default="", **options))


def choice(label: str, offered: Options | Callable[[Robot], Options], default: Any, **options: Any) -> Any:
    """A field with a drop-down list."""
    return _field(Choice(label=label, options=offered, default=default, **options))


def number(label: str, default: Any, limits: tuple[float, float], measure: Measure = "", **options: Any) -> Any:
    """A field with a number."""
    return _field(Number(label=label, default=default, limits=limits, measure=measure, **options))


def slider(label: str, default: Any, limits: tuple[float, float], measure: Measure = "", **options: Any) -> Any:
    """A field with a slider between the limits."""
    return number(label, default, limits, measure, slider=limits, **options)


def vector(labels: tuple[str, ...], default: tuple[float, ...], each: Number, **options: Any) -> Any:
    """A field with some numbers."""
    return _field(Vector(labels=labels, default=default, each=each, **options))


def joint(**options: Any) -> Any:
    """A field with a joint of the robot, none at first and for another robot."""
    return _field(Index(renew=True, **options))


def kept(default: Any, **options: Any) -> Any:
    """A field without a control."""
    return _field(Kept(default=default, **options))


def memory(default: Any = None, renew: bool = True) -> Any:
    """A field without a control that lives as long as the page, or the robot: neither links nor undo have it."""
    return kept(default, link=False, renew=renew)


def part(of: type[Settings]) -> Any:
    """A field with settings of a part."""
    return field(default_factory=of, metadata={"spec": Part(of=of)})


@dataclass(frozen=True)
class Settings:
    """The settings of a feature or of a part of one."""

    @classmethod
    @cache
    def specs(cls: type[Settings]) -> tuple[tuple[str, Spec], ...]:
        """What the fields declare, by their names."""
        return tuple((one.name, one.metadata["spec"]) for one in fields(cls) if "spec" in one.metadata)

    @classmethod
    def fresh(cls, robot: Robot) -> Self:
        """The defaults for a robot."""
        return cls(**{name: spec.first(robot) for name, spec in cls.specs()})

    @classmethod
    @cache
    def spec(cls: type[Settings], path: str) -> Spec:
        """What the field at a path declares."""
        name, _, rest = path.partition(".")
        spec: Spec = dict(cls.specs())[name]
        if isinstance(spec, Part) and rest:
            return spec.of.spec(rest)
        if isinstance(spec, Vector) and rest:
            label = spec.labels[int(rest)]
            return replace(spec.each, label=label, names=label.partition(",")[0], undo=spec.undo)
        return spec

    def value_at(self, path: str) -> Any:
        """The value at a path."""
        name, _, rest = path.partition(".")
        value = getattr(self, name)
        if not rest:
            return value
        return value.value_at(rest) if isinstance(value, Settings) else value[int(rest)]

    def with_value(self, path: str, value: object) -> Self:
        """These settings with another value at a path."""
        name, _, rest = path.partition(".")
        inner = getattr(self, name)
        if rest and isinstance(inner, Settings):
            value = inner.with_value(rest, value)
        elif rest:
            value = tuple(value if i == int(rest) else item for i, item in enumerate(inner))
        return replace(self, **{name: value})

    def state(self) -> dict[str, object]:
        """As JSON."""
        return {name: spec.pack(getattr(self, name)) for name, spec in self.specs() if spec.link}

    def restored(self, state: object, robot: Robot) -> Self:
        """These settings with the entries of a link; invalid and missing ones stay as they are."""
        settings = self
        for name, spec in self.specs():
            if spec.link and isinstance(state, dict) and name in state:
                try:
                    if isinstance(spec, Part):
                        value = getattr(self, name).restored(state[name], robot)
                    else:
                        value = spec.unpack(name, state[name], robot)
                except InputError:
                    continue  # the URL was edited
                settings = replace(settings, **{name: value})
        return settings

    def for_robot(self, robot: Robot) -> Self:
        """These settings as far as they do not depend on the robot; the others as they are at first."""
        renewed = {n: s.first(robot) for n, s in self.specs() if s.renew or callable(s.default)}
        return replace(self, **renewed)
