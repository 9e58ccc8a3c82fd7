"""Compares what features show here with what they show in another checkout: panels, scenes, links, legends.

    python tests/app/viewer/declared/compare_shown.py /path/to/other/checkout [feature …]

Each feature gets a page, on which all arms follow each other. Each of them is shown at home, with some settings,
at random configurations, in other units, and in each step of a lesson that follows them. Numbers may differ by
`TOLERANCE`.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[3]))
from arms import CLASSICS
from bare_page import bare_page

from kin.units import DEFAULT_UNITS, Units

TOLERANCE = 2e-5
# Fewer arms, by their ids, for a quick look: ARMS=ur5,scara
ARMS = [robot for robot in CLASSICS if robot.id in os.environ.get("ARMS", robot.id).split(",")]
STATES: dict[str, list[dict[str, object]]] = {
    "velocity": [
        {"frame": "tool", "ellipsoid": "moment", "joint": 2, "statics": {"on": True, "force": [1, -2, 3.5]}},
        {"frame": "base", "ellipsoid": "none", "joint": 1, "step": 0.02, "turn": 0.1, "statics": {"on": False}},
        {"frame": ["tool"], "ellipsoid": "soul", "joint": 99, "step": 1e9, "turn": "1", "statics": 5},
        {"ellipsoid": "force", "joint": 0},
    ],
    "redundancy": [{"free": "theta2", "swing": False}, {"free": 5, "swing": "yes"}],
    "rotations": [
        {"convention": "zxz-moving", "angles": [0.1, 0.0, 0.2], "chained": False, "turn": 1.0, "shift": 0.1},
        {"chained": True, "chain": [[True, 0, 0.5, True], [False, 2, 0.1, False]], "motion": "Shift along x"},
        {
            "convention": 5,
            "angles": [1, 2],
            "chain": "x",
            "motion": [],
            "own": 3,
            "turn": 99.0,
            "shift": "far",
            "chained": False,
        },
        {"chained": True, "own": False, "motion": "Turn about y"},
    ],
    # All entries, as in every link: those that are missing or invalid stay as they are now.
    "numeric": [
        {
            "method": "transpose",
            "damping": 0.2,
            "gain": 0.5,
            "longest": 0.3,
            "limits": True,
            "match": "point",
            "start": None,
            "at": None,
            "compare": False,
            "picture": False,
        },
        {"method": "damped", "compare": True, "at": 2, "picture": True, "start": None},
        {
            "method": "guess",
            "damping": 99,
            "gain": "1",
            "longest": -1,
            "match": 3,
            "target": [1],
            "start": None,
            "at": None,
            "compare": False,
            "picture": False,
        },
        {
            "method": "newton",
            "limits": False,
            "longest": math.pi,
            "match": "pose",
            "start": None,
            "at": None,
            "compare": True,
            "picture": False,
        },
    ],
    "postures": [
        {"ghosts": False, "cone": True, "hidden": []},
        {"ghosts": True, "cone": False, "hidden": ["shoulder_right/elbow_up/wrist_flip", "nonsense", 5]},
        {"ghosts": 1, "cone": 0, "hidden": 3},
        {"ghosts": True, "cone": True},
    ],
    "screws": [
        {"form": "body", "axes": "now", "joint": 1, "factors": 1},
        {"form": "space", "axes": "zero", "joint": 2, "factors": 0},
        {"form": 1, "axes": "then", "joint": 77, "factors": -1},
    ],
    "equations": [{"equation": "3.14"}, {"equation": 7}],
    "dh": [
        {"at": 6.5, "symbols": True, "compare": False, "speed": "Double", "lines": False, "assign": None},
        {"at": 9, "symbols": False, "compare": True, "speed": "Half", "lines": True, "assign": None},
        {"at": True, "symbols": 1, "compare": False, "speed": ["x"], "lines": "yes"},
        {"at": 1e9, "compare": False, "assign": {"base": [], "rows": [], "made": {}}},
        {
            "assign": {
                "base": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
                "rows": [[0.1, 0.2, 0.3, 0.4], [0, 1e9, 0, 0]],
                "made": {"axis": 1, "x": True},
            }
        },
        {"assign": {"base": [1, 2], "rows": 3, "made": {"axis": 99}}},
        {"at": 4, "assign": None, "lines": True},
    ],
    "trajectories": [{"paths": True}, {"paths": 5}],
    "inverse": [
        {"all": True},
        {"q": [0.3] * 7, "signs": [-1, 1, -1], "taken": {"2": 0.5}},
        {"q": [0.3] * 6, "signs": [1, -1, -1], "all": False, "taken": {}},
        {"q": "far", "signs": [1, 2], "all": 3, "taken": []},
        {"q": [0.3, 0.8], "signs": [-1], "all": True},
        {"q": [0.2] * 5, "signs": [-1, 1, 1], "all": True},
    ],
}


def record(key: str) -> dict[str, Any]:
    """What a feature shows, by arm and moment."""
    from app.equations import book
    from app.viewer.lessons import LESSONS
    from app.viewer.lessons.guide.lesson import Lesson
    from app.viewer.lessons.guide.progress import Progress

    feature = next(lesson for lesson in LESSONS if lesson.key == key)
    found: dict[str, Any] = {}
    rng = np.random.default_rng(12)
    for robot in ARMS if key == "equations" else ():
        book(robot)  # derived before, so that nothing waits
    follows = feature.on_steps is not Lesson.on_steps
    with bare_page(ARMS[0]) as page:
        shown = page.open(feature)

        def follow(at: int = 0) -> None:
            """Tell a lesson that follows them that the steps are shown."""
            progress = Progress(feature.outline(page.now.robot, page.units))
            progress.at, progress.revealed = at, {"1", "3"} if at else set()
            shown.on_steps(progress)

        page.activity.changed = follow
        for robot in ARMS:
            if robot is not page.now.robot:
                page.change(robot)

            def note(moment: str, robot: Any = robot) -> None:
                found[f"{robot.id}: {moment}"] = {
                    "panel": page.panel(),
                    "scene": page.scene(),
                    "link": shown.state(),
                    "legend": page.legend,
                    "view": [str(page.views[-1:]), page.translucent],
                }

            note("at home")
            for k, state in enumerate(STATES[key]):
                if isinstance(q := state.get("q"), list) and len(q) != robot.n:
                    continue  # a link of another arm
                page.restore(state)
                note(f"state {k}")
                page.pose(robot.random_q(rng))
                note(f"state {k}, elsewhere")
            page.style(Units(False, "cm"))
            note("radians")
            page.style(DEFAULT_UNITS)
            for at in range(len(feature.outline(robot, DEFAULT_UNITS).steps) + 1) if follows else ():
                follow(at)
                page.rest()
                note(f"step {at + 1}")
    return found


def differences(old: Any, new: Any, path: str = "") -> list[str]:
    """Where two records differ."""
    if isinstance(old, int | float) and isinstance(new, int | float):
        return [] if abs(old - new) <= TOLERANCE * max(1.0, abs(old)) else [f"{path}: {old} → {new}"]
    if isinstance(old, dict) and isinstance(new, dict) and old.keys() == new.keys():
        return [line for name in old for line in differences(old[name], new[name], f"{path} / {name}")]
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        return [line for k, item in enumerate(old) for line in differences(item, new[k], f"{path} / {k}")]
    return [] if old == new else [f"{path}: {str(old)[:400]}\n    → {str(new)[:400]}"]


def close(old: Any, new: Any) -> bool:
    """Whether two nodes are the same, as `differences` but without the places; what is not is found at once."""
    if isinstance(old, int | float) and isinstance(new, int | float):
        return abs(old - new) <= TOLERANCE * max(1.0, abs(old))
    if isinstance(old, dict) and isinstance(new, dict) and old.keys() == new.keys():
        return all(close(old[name], new[name]) for name in old)
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        return old == new or all(close(item, other) for item, other in zip(old, new, strict=True))
    return bool(old == new)


def scenes_differ(old: list[Any], new: list[Any]) -> list[str]:
    """Nodes of one scene that the other does not have."""
    left, missing = list(new), []
    for node in old:
        same = next((other for other in left if close(node, other)), None)
        if same is None:
            missing.append(f"only before: {str(node[:2])[:300]} {str(node[2])[:600]}")
        else:
            left.remove(same)
    return missing + [f"only now: {str(node[:2])[:300]} {str(node[2])[:600]}" for node in left]


def main() -> int:
    other, *keys = sys.argv[1:]
    if other == "--record":
        Path(keys[0]).write_text(json.dumps({key: record(key) for key in keys[1:]}), encoding="utf-8")
        return 0
    root, failed = Path(__file__).resolve().parents[4], 0
    with tempfile.TemporaryDirectory() as folder:
        records = []
        for k, checkout in enumerate((Path(other), root)):
            out = Path(folder) / f"{k}.json"
            environment = {**os.environ, "PYTHONPATH": str(checkout)}
            command = [sys.executable, __file__, "--record", str(out), *(keys or STATES)]
            subprocess.run(command, check=True, env=environment, cwd=checkout, stdout=subprocess.DEVNULL)
            records.append(json.loads(out.read_text(encoding="utf-8")))
    for key, before in records[0].items():
        for moment, old in before.items():
            new = records[1][key][moment]
            lines = scenes_differ(old.pop("scene"), new.pop("scene")) + differences(old, new)
            failed += len(lines)
            for line in lines[:6]:
                print(f"{key}, {moment}: {line}")
        print(f"{key}: {len(before)} moments compared")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
