"""Make a release of this checkout: ``python scripts/release.py 1.0.0``.

It writes the version, and today's date, into every file that names them. It also writes the folder in
``tests/data/releases`` to which ``tests/test_releases.py`` holds every later version: the surface, the robot files
that are new, with poses, and links as a page gives them out. Nothing is committed.
"""

from __future__ import annotations

import argparse
import datetime
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import kin
from app.viewer.session.choices import ViewState
from app.viewer.session.state import PageState, encode
from kin.units import Units
from scripts import surface

ROOT = Path(__file__).parents[1]
VERSION = re.compile(r"(\d+)\.(\d+)\.(\d+)")
POSES = 3  # of each arm

# File, what stands there, and what a release makes of it.
PLACES = (
    ("kin/_version.py", r'^__version__ = ".*"$', '__version__ = "{version}"'),
    ("Dockerfile", r"^ARG VERSION=.*$", "ARG VERSION={version}"),
    ("CITATION.cff", r"^version: .*$", "version: {version}"),
    ("CITATION.cff", r"^date-released: .*$", "date-released: {date}"),
    ("CHANGELOG.md", r"^## \[Unreleased\]$", "## [Unreleased]\n\n## [{version}] – {date}"),
    ("pyproject.toml", r"Development Status :: [^\"]*", "Development Status :: {status}"),
)


def set_version(root: Path, version: str, date: datetime.date) -> None:
    """Write a version and its date into the files of a checkout.

    Raises:
        ValueError: it is no version, not newer than the one that is there, or a file lacks the place for it.
    """
    if not VERSION.fullmatch(version):
        raise ValueError(f"{version!r} is no version such as 1.0.0")
    (old,) = VERSION.findall((root / "kin/_version.py").read_text(encoding="utf-8"))
    new = VERSION.findall(version)[0]
    if tuple(map(int, new)) <= tuple(map(int, old)):
        raise ValueError(f"{version} is not newer than {'.'.join(old)}")
    status = "5 - Production/Stable" if int(new[0]) else "4 - Beta"
    texts: dict[str, str] = {}
    for name, pattern, line in PLACES:
        text = texts.get(name) or (root / name).read_text(encoding="utf-8")
        made = line.format(version=version, date=date.isoformat(), status=status)
        texts[name], count = re.subn(pattern, made, text, flags=re.MULTILINE)
        if count != 1:
            raise ValueError(f"{name} has {count} places like {pattern}, not one")
    for name, text in texts.items():
        (root / name).write_text(text, encoding="utf-8")


def write_evidence(releases: Path, version: str) -> Path:
    """Write the folder of a release below `releases`: surface, arms that no earlier one has, and links."""
    known = {path.name for path in releases.glob("*/robots/*.toml")}
    folder = releases / version
    (folder / "robots").mkdir(parents=True)
    _write(folder / "surface.json", surface.surface() | {"version": version})
    arms = [arm for arm in kin.builtin_robots().values() if f"{arm.id}.toml" not in known]
    for arm in arms:
        kin.save_robot(arm, folder / "robots" / f"{arm.id}.toml")
    rng = np.random.default_rng(0)
    _write(folder / "poses.json", {arm.id: _poses(arm, arm.random_q(rng, POSES)) for arm in arms})
    _write(folder / "links.json", {name: _link(page) for name, page in pages().items()})
    return folder


def _write(path: Path, found: dict[str, Any]) -> None:
    path.write_text(json.dumps(found, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def _poses(arm: kin.Robot, q: np.ndarray) -> dict[str, Any]:
    return {"q": q.tolist(), "T": kin.fk(arm, q).tolist()}


def pages() -> dict[str, PageState]:
    """Pages whose links are kept."""
    far = kin.pose_from_xyz_rpy([2.0, 0.5, 0.4])
    camera = np.array([[1.5, 1.0, 0.9], [0.0, 0.0, 0.4], [0.0, 0.0, 1.0]])
    irb120 = kin.get_robot("irb120")
    return {
        "configuration": PageState("ur5", np.array([0.3, -1.1, 0.7, 0.2, -0.4, 0.9])),
        "target out of reach": PageState("ur5", kin.get_robot("ur5").q_home, far, "position"),
        "branch and locks": PageState("irb120", irb120.q_home, branch=kin.branch_names(irb120)[0], locks=(1,)),
        "radians, metres, camera": PageState("panda", units=Units(False, "m"), camera=camera),
        "lesson": PageState("scara", lesson="dh"),
        "view": PageState("stanford", view=ViewState(frames=True)),
    }


def _link(page: PageState) -> dict[str, Any]:
    arrays = {name: getattr(page, name) for name in ("q", "target", "camera")}
    return {
        "link": encode(page),
        **{name: getattr(page, name) for name in ("robot", "task", "branch", "lesson")},
        **{name: None if value is None else value.tolist() for name, value in arrays.items()},
        "units": [page.units.degrees, page.units.length],
        "locks": list(page.locks),
        "frames": page.view.frames,
    }


def main() -> None:
    parser = argparse.ArgumentParser(prog="python scripts/release.py", description=__doc__)
    parser.add_argument("version", help="such as 1.0.0")
    version = parser.parse_args().version
    try:
        set_version(ROOT, version, datetime.date.today())
    except ValueError as error:
        raise SystemExit(f"release: {error}") from None
    folder = write_evidence(ROOT / "tests/data/releases", version)
    print(f"{folder.relative_to(ROOT)} is written; CONTRIBUTING.md says what follows.")


if __name__ == "__main__":
    main()
