"""``python tests/bench/evidence``: what answers of inverse kinematics claim, and what is true of them.

Each row is a kind of arm. Configurations are drawn at random inside the limits, poses are made from them by NumPy
alone (``tests/numpy_arm.py``), and `kin.solve_ik` is asked for all postures. *Found* is the share of answers that
have the configuration the pose was made from; *false* counts answers that claim to be complete and lack it. Errors
are those of all solutions, by NumPy again.

The parameter of a redundancy is given, as it is in that configuration. Singular configurations, with a singular
value of the Jacobian below 0.001, are left out: there postures merge. So are random tables whose joints move the
tool in fewer directions than they are: they meet each pose in infinitely many ways.

``--record`` writes the counts to ``tests/data/evidence.json`` and the table into ``docs/background/evidence.md``;
with ``--only``, for a new arm of a known kind, the other rows stay, and the file says which were counted later.
``--times`` measures instead how long answers take (`evidence.times`), and records them from an idle machine only.
"""

from __future__ import annotations

import argparse
import datetime
import json
import platform
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "bench")]

from evidence import times  # noqa: E402
from evidence.counting import questions, tallies  # noqa: E402

import kin  # noqa: E402

PAGE, RECORD = ROOT / "docs" / "background" / "evidence.md", ROOT / "tests" / "data" / "evidence.json"
BEGIN, END = "<!-- table: python tests/bench/evidence --record -->\n", "<!-- end of the table -->\n"
HEAD = "| arms | number | targets | found | false | proved | agreed | searched | unknown | largest error |"


def table(rows: dict[str, dict[str, Any]]) -> str:
    """The counts as a table in Markdown."""
    lines = [HEAD, "|---|" + "---:|" * 9]
    for kind, row in rows.items():
        targets, known = row["targets"], row["completeness"]
        shares = [share(known.get(word, 0), targets) for word in ("proved", "agreed", "searched", "unknown")]
        error = f"{max(row['position_error'], row['rotation_error']):.0e}"
        cells = (kind, row["arms"], targets, share(row["found"], targets), row["false"], *shares, error)
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines) + "\n"


def share(part: int, whole: int) -> str:
    """A share in percent, with the digits that its size asks for; all and none are said as such."""
    if part in (0, whole):
        return "–" if part == 0 else "all"
    percent = 100.0 * part / whole
    return f"{percent:.2f} %" if min(percent, 100.0 - percent) < 1.0 else f"{percent:.1f} %"


def main() -> int:
    """Print the table; 1 if an answer claims to be complete and is not."""
    parser = argparse.ArgumentParser(
        prog="python tests/bench/evidence",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--targets", type=int, default=1000, help="configurations of each arm (1000)")
    parser.add_argument("--seed", type=int, default=1, help="of the configurations (1)")
    parser.add_argument("--processes", type=int, default=2, help="at a time (2)")
    parser.add_argument("--only", help="kinds whose name contains this text")
    parser.add_argument("--times", action="store_true", help="measure times, of one arm of each family")
    parser.add_argument("--record", action="store_true", help="write the file and the page")
    arguments = parser.parse_args()
    if arguments.times and arguments.record and arguments.only:
        parser.error("--times --record is for every kind of arm, without --only")
    if arguments.times:
        return measure(arguments)
    asked = [each for each in questions(arguments.targets, arguments.seed) if (arguments.only or "") in each.kind]
    rows = {kind: asdict(tally) for kind, tally in tallies(asked, arguments.processes).items()}
    print(table(rows))
    if arguments.record:
        record(rows, arguments)
    return int(any(row["false"] for row in rows.values()))


def measure(arguments: argparse.Namespace) -> int:
    """Print the times, and record them if the machine was idle; 1 if they should be recorded and are not."""
    found = times.run(arm for arm in times.arms() if (arguments.only or "") in arm.id)
    print(times.section(found))
    fault = times.why_not(found["run"])
    if fault:
        print(f"evidence: {'not recorded' if arguments.record else 'not to be quoted'}: {fault}.", file=sys.stderr)
    if fault or not arguments.record:
        return int(arguments.record)
    times.RECORD.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    write_between(times.BEGIN, times.END, times.section(found))
    return 0


def record(rows: dict[str, dict[str, Any]], arguments: argparse.Namespace) -> None:
    """Keep the run, or the part of one in that of all, and put its table into the page."""
    about = {
        "version": kin.__version__,
        "date": datetime.date.today().isoformat(),
        "commit": times.commit(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "targets": arguments.targets,
        "seed": arguments.seed,
    }
    found = {"run": about, "rows": rows}
    if arguments.only:
        found = json.loads(RECORD.read_text(encoding="utf-8"))
        found["run"].setdefault("later", []).append({**about, "rows": list(rows)})
        found["rows"].update(rows)
    RECORD.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    write_between(BEGIN, END, table(found["rows"]))


def write_between(begin: str, end: str, text: str) -> None:
    """Replace a part of the page."""
    before, rest = PAGE.read_text(encoding="utf-8").split(begin)
    PAGE.write_text(before + begin + text + end + rest.split(end)[1], encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
