"""Example arms to start from: the fields of robot files, in millimetres and degrees, or those of built-in arms."""

from __future__ import annotations

from typing import Any

from kin import builtin_robots, robot_to_dict

UNITS = {"length": "mm", "angle": "deg"}


def _arm(name: str, description: str, rows: list[dict[str, Any]], q: list[float] | None = None) -> dict[str, Any]:
    data = {
        "name": name,
        "description": description,
        "source": "an example of the tab Robot",
        "convention": "standard",
        "units": UNITS,
        "rows": rows,
    }
    return data if q is None else {**data, "home": {"q": q}}


def _row(name: str, theta: float, d: float, a: float, alpha: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "theta": theta, "d": d, "a": a, "alpha": alpha, **more}


def _builtin(robot_id: str) -> dict[str, Any]:
    """The same arm as one of the service's."""
    return {**robot_to_dict(builtin_robots()[robot_id], angle="deg"), "source": "an example of the tab Robot"}


# By the key that a link carries.
PRESETS: dict[str, dict[str, Any]] = {
    "planar-2r": _builtin("planar2r"),
    "planar-3r": _builtin("planar3r"),
    "wrist-6r": _arm(
        "Spherical wrist arm",
        "Six joints; the last three axes meet in one point, so that position and orientation separate.",
        [
            _row("waist", 0, 400, 0, 90),
            _row("shoulder", 90, 0, 450, 0, limits=[-120, 120]),
            _row("elbow", 90, 0, 0, 90, limits=[-150, 150]),
            _row("forearm", 0, 420, 0, -90),
            _row("wrist", 0, 0, 0, 90, limits=[-120, 120]),
            _row("flange", 0, 100, 0, 0),
        ],
        [0, -10, -110, 0, -60, 0],
    ),
    "scara-4": _arm(
        "SCARA",
        "Two links turn in a horizontal plane, a slide goes down, and the tool turns.",
        [
            _row("shoulder", 0, 350, 325, 0, limits=[-130, 130]),
            _row("elbow", 0, 0, 275, 180, limits=[-145, 145]),
            _row("slide", 0, 40, 0, 0, kind="prismatic", limits=[0, 200]),
            _row("tool", 0, 0, 0, 0),
        ],
        [20, 60, 80, 0],
    ),
    # One length: an arm without any has no size to be drawn in, and `own_arm` refuses it.
    "one-joint": _arm("My arm", "", [_row("joint 1", 0, 0, 300, 0)]),
}
TITLES = {key: data["name"] for key, data in PRESETS.items()} | {"one-joint": "Empty (one joint)"}
