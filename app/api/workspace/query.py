"""Query parameters of workspace requests: limits, locks, and the description of a cloud."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Annotated, Any, TypeVar, get_origin

from pydantic import BeforeValidator, Field, ValidationError, WithJsonSchema
from starlette.datastructures import QueryParams

from app.api.problems import field_error, invalid
from app.api.schemas import LARGEST, Body
from app.shared.clouds import Cloud
from app.shared.options import declared
from app.shared.problems import FieldError, show
from app.shared.settings import Settings
from kin import InputError, JointConstraints, Robot
from kin.ik.options import WiderLimits
from kin.workspace import Measure, Strategy

_FIELD_OF_CORE = {"limits": "limit", "locked": "lock"}
_SEEDS = 1 << 64
_LONGEST = 200  # characters of an entry

# Numbers of an entry: a text with colons, or in JSON a list.
Entry = str | Sequence[float]

NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"


def _joint_values(values: int) -> Any:
    """Constraints of ``JOINT:VALUE…`` for the OpenAPI document; `_per_joint` validates and explains errors."""
    return Field(max_length=100, json_schema_extra={"pattern": _pattern(values)})


def _pattern(values: int) -> str:
    return rf"^[0-9]+(:{NUMBER}){{{values}}}$"


def listed(pattern: str, form: str, *, joint: bool = True) -> Any:
    """A text of numbers separated by colons that JSON may also hold as a list of numbers.

    Args:
        pattern: of the text.
        form: of the text, in words; that of a list has the same parts.
        joint: whether the first number counts joints.
    """
    count = form.count(":") + 1

    def checked(value: object) -> object:
        if isinstance(value, list) or (isinstance(value, str) and re.fullmatch(pattern, value[: _LONGEST + 1])):
            found = numbers_of(value)
            if len(found) == count and all(map(math.isfinite, found)) and not (joint and found[0] % 1.0):
                return value
        raise ValueError(f"{form} or {_as_list(form)}, numbers up to {LARGEST:g}")

    numbers = {"type": "array", "items": {"type": "number"}, "minItems": count, "maxItems": count}
    text = {"type": "string", "maxLength": _LONGEST, "pattern": pattern}
    return Annotated[Any, BeforeValidator(checked), WithJsonSchema({"anyOf": [text, numbers]})]


def numbers_of(entry: Sequence[object]) -> tuple[float, ...]:
    """The numbers of an entry; NaN for whatever is no number, or implausibly large."""
    if isinstance(entry, str):
        return tuple(map(_number, entry[: _LONGEST + 1].split(":")))
    plain = [type(item) in (int, float) and abs(item) <= LARGEST for item in entry]  # type: ignore[arg-type]
    return tuple(float(item) if ok else math.nan for item, ok in zip(entry, plain, strict=True))  # type: ignore[arg-type]


def _number(text: str) -> float:
    value = float(text) if re.fullmatch(NUMBER, text) else math.nan
    return value if abs(value) <= LARGEST else math.nan


def _as_list(form: str) -> str:
    """``"JOINT:VALUE"`` → ``"[joint, value]"``."""
    return f"[{form.lower().replace(':', ', ')}]"


def form_of(entry: Entry, form: str) -> str:
    """The form that a valid entry of this kind has."""
    return form if isinstance(entry, str) else _as_list(form)


_LIMIT, _LOCK = "JOINT:LOWER:UPPER", "JOINT:VALUE"
_MANY = Field(max_length=100)


class RegionQuery(Body):
    """Joint limits and locks."""

    @classmethod
    def in_json(cls) -> dict[str, Any]:
        """In JSON, each entry may be a list of numbers."""
        items = {"limit": listed(_pattern(2), _LIMIT), "lock": listed(_pattern(1), _LOCK)}
        return {name: Annotated[list[item], _MANY] for name, item in items.items()}  # type: ignore[valid-type]

    limit: Annotated[list[Annotated[str, _joint_values(2)]], _MANY] = Field(
        [],
        description="Narrower limits of a joint, `JOINT:LOWER:UPPER`, joints counted from 1, in radians (metres); "
        "may be repeated, once per joint.",
        examples=[["1:-0.5:0.5"]],
    )
    lock: Annotated[list[Annotated[str, _joint_values(1)]], _MANY] = Field(
        [],
        description="Lock a joint at a value, `JOINT:VALUE`, joints counted from 1, in radians (metres); may be "
        "repeated, once per joint.",
        examples=[["3:0.2"]],
    )

    wider_limits: WiderLimits = Field("refuse", description=declared()["wider_limits"].sentence)

    def constraints(self, robot: Robot) -> JointConstraints:
        """Limits and locks as the core takes them; raises 422 naming the invalid one."""
        pairs, limit_at = _per_joint(robot, "limit", self.limit, _LIMIT)
        values, lock_at = _per_joint(robot, "lock", self.lock, _LOCK)
        limits = tuple((p[0], p[1]) if p else None for p in pairs) if self.limit else None
        locked = tuple(v[0] if v else None for v in values) if self.lock else None
        try:
            constraints = JointConstraints(limits, locked, self.wider_limits)
            constraints.bounds(robot)
        except InputError as error:
            # The core counts joints from 0 and does not know the order of the parameters.
            found = re.fullmatch(r"(limits|locked)\[(\d+)\]", error.field)
            if found is None:
                raise
            name, joint = _FIELD_OF_CORE[found[1]], int(found[2])
            k = (limit_at if name == "limit" else lock_at)[joint]
            given = getattr(self, name)[k]
            wrong = FieldError(field=f"{name}[{k}]", value=show(given), expected=error.expected)
            raise invalid(wrong) from None
        return constraints


class CloudQuery(RegionQuery):
    """Description of a cloud."""

    n: int = Field(10_000, ge=1, description="Number of points.", examples=[1000])
    # The largest seed is more than JSON schemas in other languages can represent exactly.
    seed: Annotated[int, WithJsonSchema({"type": "integer", "minimum": 0})] = Field(
        0, ge=0, lt=_SEEDS, description="Seed from 0 to 2⁶⁴ − 1. Equal seeds give equal clouds."
    )
    strategy: Strategy = Field(
        "uniform",
        description="uniform: each joint uniformly between its limits. quasi: the same, more evenly (low "
        "discrepancy). volume: evenly over the workspace. boundary: on its envelope. The last two take ten to a "
        "few hundred microseconds per point, and seconds before the first.",
    )
    measure: list[Measure] = Field(
        [],
        max_length=8,
        description="A further column: manipulability (pose), as `all` in the answer of `jacobian`, or "
        "limit_margin (older name: limits), the relative distance to the nearest joint limit, 0 at a limit and 1 "
        "in the middle; may be repeated.",
    )
    q: bool = Field(False, description="Whether to include the configurations, in radians (metres).")

    def cloud(self, robot: Robot, settings: Settings) -> Cloud:
        """The cloud; raises 422 naming the invalid parameter."""
        if self.n > settings.max_points:
            most = settings.max_points
            wrong = FieldError(field="n", value=show(self.n), expected=f"a whole number from 1 to {most}")
            raise invalid(
                wrong,
                hint="Request several clouds with different seeds; the operator can raise KINBOARD_MAX_POINTS.",
            )
        constraints = self.constraints(robot)
        measures = tuple(dict.fromkeys(self.measure))
        return Cloud(robot, self.n, self.seed, self.strategy, measures, constraints)


def read_cloud_query(parameters: QueryParams) -> CloudQuery:
    """The query of a websocket URL, for which FastAPI would not explain errors; raises 422."""
    repeated = {name for name, field in CloudQuery.model_fields.items() if _is_list(field.annotation)}
    given: dict[str, Any] = {
        name: parameters.getlist(name) if name in repeated else parameters[name] for name in parameters
    }
    return validated(CloudQuery, given, "query")


_Model = TypeVar("_Model", bound=Body)


def validated(model: type[_Model], given: object, place: str) -> _Model:
    """A model of values that FastAPI has not read; raises 422. `place`: ``"query"`` or ``"body"``."""
    try:
        return model.model_validate(given)
    except ValidationError as error:
        items = [{**item, "loc": (place, *item["loc"])} for item in error.errors()]
        raise invalid(*map(field_error, items)) from None


def _is_list(annotation: Any) -> bool:
    return get_origin(annotation) is list


def _per_joint(
    robot: Robot, field: str, given: Sequence[Entry], form: str
) -> tuple[list[tuple[float, ...] | None], dict[int, int]]:
    """Entries such as ``3:0.2`` as values for each joint, and the position of each joint in the list."""
    entries: list[tuple[float, ...] | None] = [None] * robot.n
    places: dict[int, int] = {}
    for k, entry in enumerate(given):
        joint, *values = numbers_of(entry) or (math.nan,)
        counted = not isinstance(entry, str) or re.match("[0-9]+:", entry)
        known = counted and joint % 1.0 == 0.0 and 1.0 <= joint <= robot.n
        if not known or len(values) != form.count(":") or not all(map(math.isfinite, values)):
            expected = f"{form_of(entry, form)}, a joint from 1 to {robot.n} and values in radians (metres)"
            raise invalid(FieldError(field=f"{field}[{k}]", value=show(entry), expected=expected))
        i = int(joint) - 1
        if i in places:
            expected = f"each joint once; {field}[{places[i]}] is for the same joint"
            raise invalid(FieldError(field=f"{field}[{k}]", value=show(entry), expected=expected))
        entries[i], places[i] = tuple(values), k
    return entries, places
