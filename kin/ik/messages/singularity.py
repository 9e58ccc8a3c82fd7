"""What a singularity means, in a short clause and a long one."""

from __future__ import annotations

from kin.solvers.singular import Condition, JointValue, Lost, Singularity
from kin.units import DEFAULT_UNITS, Units

CONDITIONS: dict[Condition, str] = {
    "elbow straight": "elbow straight",
    "elbow folded": "elbow folded",
    "wrist centre level with axis 2": "wrist centre level with axis 2",
    "wrist centre on axis 1": "wrist centre on axis 1",
    "wrist centre nearest to axis 1": "wrist centre as near to axis 1 as it can get",
    "forearm in one plane with axis 1": "forearm in one plane with axis 1",
    "upper arm on axis 1": "upper arm on axis 1, axes 2 and 4 perpendicular",
    "upper arm on axis 1, hand along the forearm": "upper arm on axis 1 and hand in line with the forearm",
    "hand along the forearm": "hand in line with the forearm",
    "hand along the forearm, axes 4 and 6 perpendicular": (
        "hand in line with the forearm, axes 4 and 6 perpendicular"
    ),
    "tool along the forearm": "tool in line with the forearm",
    "axes 4 and 6 in line": "axes 4 and 6 in line",
    "axis 6 parallel to axes 2, 3 and 4": "axis 6 parallel to axes 2, 3 and 4",
    "tool on axis 1": "tool on axis 1",
    "tool nearest to axis 1": "tool as near to axis 1 as it can get",
    "smallest singular value": "smallest singular value of the {rows} × {columns} Jacobian",
}
LOSSES: dict[Lost, str] = {
    "wrist centre along the arm": "the wrist centre cannot move along the arm",
    "wrist centre sideways": "the wrist centre cannot move sideways",
    "wrist centre along axis 2": "the wrist centre cannot move along axis 2",
    "wrist centre off the slide": "only the slide can move the wrist centre in the arm's plane",
    "axis 4 along the arm": "axis 4 cannot move along the arm",
    "last axis along the arm": "the last axis cannot move along the arm",
    "hand along the arm": "the hand cannot move along the arm",
    "hand along the forearm": "the hand cannot move along the forearm",
    "hand along the upper arm": "the hand cannot move along the upper arm",
    "tilt sideways": "the tool cannot tilt sideways",
    "tilt about the third axis": "the tool cannot tilt about the third axis",
    "joints 5 and 7 coincide": "joints 5 and 7 turn about one line",
    "joints 1 and 3, 5 and 7 coincide": "joints 1 and 3 turn about one line, joints 5 and 7 about another",
    "tool sideways": "the tool cannot move sideways",
    "reference of the arm angle": "the arm angle ψ loses its reference; the arm loses no motion",
    "azimuth of the forearm": "the closed form takes θ1 + θ2 from the seed; the arm loses no motion",
    "slowest direction": "the tool's slowest direction",
}


DECIMALS = 3  # of a degree, at most


def short(found: Singularity, units: Units = DEFAULT_UNITS) -> str:
    """What aligns, with the joint values at which it does: ``"elbow straight (θ4 = 0°)"``."""
    rows, columns = found.shape or (0, 0)
    clause = CONDITIONS[found.condition].format(rows=rows, columns=columns)
    values = ", ".join(_joint_value(at, units) for at in found.met_at)
    return f"{clause} ({values})" if values else clause


def long(found: Singularity, units: Units = DEFAULT_UNITS) -> str:
    """`short`, and what is lost: ``"elbow straight (θ4 = 0°): the hand cannot move along the arm"``."""
    return f"{short(found, units)}: {LOSSES[found.lost]}"


def there(found: Singularity) -> str:
    """What would be lost at a singularity that the arm is not at: ``"there the hand could not move along …"``."""
    return f"there {LOSSES[found.lost].replace('cannot', 'could not')}"


def _joint_value(at: JointValue, units: Units) -> str:
    unit = units.angles
    value = round(at.value * unit.scale, unit.decimals(DECIMALS)) + 0.0  # no minus before a zero
    return f"θ{at.joint + 1} = {value:g}{unit.suffix}"
