"""Writes what follows from the robot files: ``python scripts/arms_page.py``.

The page *Arms* of the docs, ``docs/arms.md``, and the names of solvers in ``kin/robots/solvers.json``.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path

from app.shared.answers.inspection import singular_at
from app.shared.solver_names import FILE, computed_names
from kin import InputError, Robot, builtin_robots, cuspidal
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

An arm that is [singular](background/singularities.md) at home or at zero says so: a motion of the tool is lost
there. `kin.leave_singularity` finds [the way out](background/singularities.md#the-way-out).

This page is written by `scripts/arms_page.py`.
"""
LEAD = {
    "Classics": "The arms of textbooks and lessons.",
    "Library": "By maker; textbook layouts come last. Joint values are those of the maker's own description. "
    "A maker's arm ends in its flange, or between its fingers where that is said first; there z points out "
    "([picture](background/conventions.md#transforms)).",
}
CUSPIDAL = """
## Cuspidal or not

A cuspidal arm can change its posture without meeting a singularity
([background](background/singularities.md#cuspidal-arms)). Arms with seven joints are judged with the last one
locked at its home value. *Yes* comes with a verified loop, *no* with a proof; *none found* is neither. The
verdicts are Kinboard's own. A. Elias and J. Wen (arXiv 2501.18505) report the GoFa as cuspidal, too; P. Wenger and
D. Chablat (arXiv 2210.05204) review such arms.

| verdict | how it is known | arms |
|---|---|---|
"""
KNOWN = {
    "loop": "a loop of the tool, inside the limits, verified between its samples",
    "factors": "postures are the signs of the factors of det J",
    "stages": "two neighbouring axes of the three joints that place a point are parallel or meet",
    "search": "{poses} random poses, {pairs} pairs of postures",
    "": "the arm has not as many joints as its task has dimensions",
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
    text += CUSPIDAL + "".join(_verdicts(robots.values()))
    text += "\n## Sources\n\n"
    return text + "".join(f"- **{robot.name}** (`{robot.id}`): {robot.source}.\n" for robot in robots.values())


def _row(robot: Robot) -> str:
    picture = f"![{robot.name}](images/arms/{robot.id}.webp)"
    maker = f"<br>{robot.maker}" if robot.maker and not robot.name.startswith(robot.maker) else ""
    cells = (
        picture,
        f"**{robot.name}**{maker}<br>{robot.description} {singular_at(robot)}".rstrip(),
        f"`{robot.id}`",
        str(robot.n),
        f"{robot.reach:.2f} m",
        _kilograms(robot.payload),
        _kilograms(robot.mass),
        f"`{family_of(robot)}`",
    )
    return "| " + " | ".join(cells) + " |\n"


def _verdicts(robots: Iterable[Robot]) -> Iterator[str]:
    """Rows of verdicts, each with the arms that have it."""
    found: dict[tuple[str, str], list[str]] = {}
    for robot in robots:
        try:
            answer = cuspidal(
                robot, locked=[None] * 6 + [float(robot.q_home[6])] if robot.n == 7 else None, poses=128
            )
            known = KNOWN[answer.evidence].format(poses=answer.poses, pairs=answer.pairs)
            key: tuple[str, str] = (answer.verdict, known)
            assert answer.evidence != "loop" or answer.in_limits
        except InputError:
            key = ("–", KNOWN[""])
        found.setdefault(key, []).append(f"`{robot.id}`")
    for (verdict, known), names in sorted(
        found.items(), key=lambda item: ("yes", "no", "none found", "–").index(item[0][0])
    ):
        yield f"| {verdict} | {known} | {', '.join(names)} |\n"


def _kilograms(weight: float | None) -> str:
    return "" if weight is None else f"{weight:g} kg"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    names = {key: computed_names(robot)._asdict() for key, robot in sorted(builtin_robots().items())}
    FILE.write_text(json.dumps(names, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
