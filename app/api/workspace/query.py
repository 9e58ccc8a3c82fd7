"""What can be asked about a workspace in an address: limits and locks, and which cloud."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, get_origin

from pydantic import Field, ValidationError, WithJsonSchema
from starlette.datastructures import QueryParams

from app.api.problems import FieldError, field_error, from_input_error, invalid, show
from app.api.schemas import LARGEST, Body
from app.shared.clouds import Cloud
from app.shared.settings import Settings
from app.shared.summaries import Bounds, Locks
from kin import InputError, Robot
from kin.workspace import Measure, Strategy
from kin.workspace.region import Region

_OF_CORE = {"limits": "limit", "locked": "lock"}
_SEEDS = 1 << 64

NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"


def _told(values: int) -> Any:
    """What the document says of a joint and its values; it is refused in our own words."""
    return Field(max_length=100, json_schema_extra={"pattern": rf"^[0-9]+(:{NUMBER}){{{values}}}$"})


_MANY = Field(max_length=100)


class RegionQuery(Body):
    """How far the joints may move."""

    limit: Annotated[list[Annotated[str, _told(2)]], _MANY] = Field(
        [],
        description="Narrower limits of a joint, `JOINT:LOWER:UPPER`, joints counted from 1, radians (metres); "
        "may be repeated, once per joint.",
        examples=[["1:-0.5:0.5"]],
    )
    lock: Annotated[list[Annotated[str, _told(1)]], _MANY] = Field(
        [],
        description="A joint kept at a value, `JOINT:VALUE`, joints counted from 1, radians (metres); may be "
        "repeated, once per joint.",
        examples=[["3:0.2"]],
    )

    def bounds(self, robot: Robot) -> tuple[Bounds | None, Locks | None]:
        """Limits and locks as the core takes them; raises 422 naming the one that is wrong."""
        pairs, limit_at = _per_joint(robot, "limit", self.limit, 2)
        values, lock_at = _per_joint(robot, "lock", self.lock, 1)
        limits = tuple((p[0], p[1]) if p else None for p in pairs) if self.limit else None
        locked = tuple(v[0] if v else None for v in values) if self.lock else None
        try:
            Region.of(robot, limits, locked)
        except InputError as error:
            # The core counts from 0 and knows nothing of the order in which they were given.
            found = re.fullmatch(r"(limits|locked)\[(\d+)\]", error.field)
            if found is None:
                raise
            name, joint = _OF_CORE[found[1]], int(found[2])
            k = (limit_at if name == "limit" else lock_at)[joint]
            given = getattr(self, name)[k]
            wrong = FieldError(field=f"{name}[{k}]", value=show(given), expected=error.expected)
            raise invalid(wrong) from None
        return limits, locked


class CloudQuery(RegionQuery):
    """Which cloud."""

    n: int = Field(10_000, ge=1, description="How many points.", examples=[1000])
    # The largest seed is beyond what JSON schemas of programs in other languages hold exactly.
    seed: Annotated[int, WithJsonSchema({"type": "integer", "minimum": 0})] = Field(
        0, ge=0, lt=_SEEDS, description="Another seed, from 0 to 2⁶⁴ − 1, is another cloud; the same, the same."
    )
    strategy: Strategy = Field(
        "uniform",
        description="uniform: each joint evenly between its stops. quasi: the same, spread more evenly. volume: "
        "evenly over the workspace. boundary: on its envelope. The last two take some ten to a few hundred "
        "microseconds a point, and seconds before the first.",
    )
    measure: list[Measure] = Field(
        [],
        max_length=8,
        description="A further column: manipulability, as `all` of the Jacobian's answer, or limits, how far the "
        "joint nearest to a stop is from it, 0 there and 1 in the middle; may be repeated.",
    )
    q: bool = Field(False, description="Whether the configurations come along, radians (metres).")

    def cloud(self, robot: Robot, settings: Settings) -> Cloud:
        """The cloud asked for; raises 422 naming what is wrong."""
        if self.n > settings.max_points:
            most = settings.max_points
            wrong = FieldError(field="n", value=str(self.n), expected=f"a whole number from 1 to {most}")
            raise invalid(wrong, hint="Ask for several clouds with different seeds, or the operator for more.")
        limits, locked = self.bounds(robot)
        measures = tuple(dict.fromkeys(self.measure))
        return Cloud(robot, self.n, self.seed, self.strategy, measures, limits, locked)


def read_cloud_query(parameters: QueryParams) -> CloudQuery:
    """The query of a websocket's address, which FastAPI would refuse without a word; raises 422."""
    repeated = {name for name, field in CloudQuery.model_fields.items() if _is_list(field.annotation)}
    given: dict[str, Any] = {
        name: parameters.getlist(name) if name in repeated else parameters[name] for name in parameters
    }
    try:
        return CloudQuery.model_validate(given)
    except ValidationError as error:
        items = [{**item, "loc": ("query", *item["loc"])} for item in error.errors()]
        raise invalid(*map(field_error, items)) from None
    except InputError as error:
        raise invalid(from_input_error(error)) from None


def _is_list(annotation: Any) -> bool:
    return get_origin(annotation) is list


def _per_joint(
    robot: Robot, field: str, given: list[str], count: int
) -> tuple[list[list[float] | None], dict[int, int]]:
    """``3:0.2`` and the like as `count` values for each joint, and where in the list a joint was given."""
    entries: list[list[float] | None] = [None] * robot.n
    places: dict[int, int] = {}
    form = "JOINT:VALUE" if count == 1 else "JOINT:LOWER:UPPER"
    for k, text in enumerate(given):
        joint, *parts = text.split(":")
        values = [number(part) for part in parts]
        known = joint.isdecimal() and joint.isascii() and 1 <= int(joint) <= robot.n
        if not known or len(values) != count or not all(map(math.isfinite, values)):
            expected = f"{form}, a joint from 1 to {robot.n} and values in radians (metres)"
            raise invalid(FieldError(field=f"{field}[{k}]", value=show(text), expected=expected))
        i = int(joint) - 1
        if i in places:
            expected = f"each joint once; {field}[{places[i]}] has this one already"
            raise invalid(FieldError(field=f"{field}[{k}]", value=show(text), expected=expected))
        entries[i], places[i] = values, k
    return entries, places


def number(text: str) -> float:
    """A number, NaN for what is none or too large to be meant."""
    value = float(text) if re.fullmatch(NUMBER, text) else math.nan
    return value if abs(value) <= LARGEST else math.nan
