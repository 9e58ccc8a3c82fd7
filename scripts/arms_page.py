"""Writes what follows from the robot files: ``python scripts/arms_page.py``.

The page *Arms* of the docs, ``docs/arms.md``, and the names of solvers in ``kin/robots/solvers.json``.
"""

from __future__ import annotations

import json
from pathlib import Path

from app.shared.solver_names import FILE, computed_names
from kin import Robot, builtin_robots
from kin.files import classic_robots
from kin.solvers import family_of

PAGE = Path(__file__).parents[1] / "docs" / "arms.md"
HEAD = """# Arms

{count} arms are built in: {classics} classics, for which lessons and exercises are written, and {library}
of a library. A maker's arm is in it only if its forward kinematics agrees with a published description to 0.1 mm;
`tests/data/library` holds these descriptions. What no source states is left out: a payload, a weight, a speed.

The field *Find an arm* in the tab *Robot*, `kinboard robots --find "kuka joints:7"` and `GET
/api/v1/robots?find=…` search by id, name, maker, number of joints (`joints:6`, `joints:4..6`), reach in metres
(`reach:0.5..1.2`) and solver (`solver:wrist6`). The reach is an upper bound, from the base to the tool point.
The solvers have [pages of their own](background/inverse-kinematics.md). On the site of this documentation, each
picture leads to the arm: a [page that solves by itself](embedding.md#as-a-file).

This page is written by `scripts/arms_page.py`.
"""
LEAD = {
    "Classics": "The arms of textbooks and lessons.",
    "Library": "By maker; textbook layouts come last. Joint values are those of the maker's own description. "
    "A maker's arm ends in its flange, or between its fingers where that is said first; there z points out "
    "([picture](background/conventions.md#transforms)).",
}


def page() -> str:
    """The text of the page."""
    robots, classics = builtin_robots(), classic_robots()
    parts = {
        "Classics": list(classics.values()),
        "Library": [robot for robot in robots.values() if robot.id not in classics],
    }
    text = HEAD.format(count=len(robots), classics=len(classics), library=len(parts["Library"]))
    for title, arms in parts.items():
        text += f"\n## {title}\n\n{LEAD[title]}\n\n"
        text += "| | arm | `id` | joints | reach | carries | weighs | solver |\n" + 8 * "|---" + "|\n"
        text += "".join(map(_row, arms))
    text += "\n## Sources\n\n"
    return text + "".join(f"- **{robot.name}** (`{robot.id}`): {robot.source}.\n" for robot in robots.values())


def _row(robot: Robot) -> str:
    picture = f"![{robot.name}](images/arms/{robot.id}.webp)"
    maker = f"<br>{robot.maker}" if robot.maker and not robot.name.startswith(robot.maker) else ""
    cells = (
        picture,
        f"**{robot.name}**{maker}<br>{robot.description}",
        f"`{robot.id}`",
        str(robot.n),
        f"{robot.reach:.2f} m",
        _kilograms(robot.payload),
        _kilograms(robot.mass),
        f"`{family_of(robot)}`",
    )
    return "| " + " | ".join(cells) + " |\n"


def _kilograms(weight: float | None) -> str:
    return "" if weight is None else f"{weight:g} kg"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    names = {key: computed_names(robot)._asdict() for key, robot in sorted(builtin_robots().items())}
    FILE.write_text(json.dumps(names, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
