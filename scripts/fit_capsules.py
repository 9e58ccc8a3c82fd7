"""Fits capsules to the drawn bodies of built-in arms and writes them into their robot files.

    python scripts/fit_capsules.py [ROBOT ...]

Each link gets the fewest capsules, up to three, out of which no drawn surface stands by more than `OUT`; if three
are not enough, the three best. Lengths are rounded to millimetres.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import numpy as np
import scipy.optimize
import scipy.spatial

sys.path.insert(0, str(Path(__file__).parents[1]))

from app.viewer.scene.bodies.drawing import FOLDER, MM, _loft
from kin import link_frames
from kin.axes import inverse
from kin.files import classic_robots
from kin.parsing import to_toml

OUT = 0.008  # m
POINTS = 30  # per part
ROBOTS = Path(__file__).parents[1] / "kin" / "robots"


def surfaces(robot_id: str) -> dict[int, np.ndarray]:
    """Points of the drawn surface of each link, in the frame of its DH row, without those inside other parts."""
    robot = classic_robots()[robot_id]
    data = tomllib.loads((FOLDER / f"{robot_id}.toml").read_text("utf-8"))
    q = np.array(data["pose"], float) * np.where(robot.revolute, np.pi / 180.0, MM)
    frames = [robot.T_world_base, *(link_frames(robot, q)[row] for row in robot.joint_rows)]
    found = {}
    for link, T in enumerate(frames):
        meshes = [_loft(part).mesh for part in data["parts"] if part["joint"] == link]
        hulls = [scipy.spatial.ConvexHull(np.asarray(mesh.vertices)) for mesh in meshes]
        kept = []
        for i, hull in enumerate(hulls):
            points = sampled(hull, POINTS, i)
            for j, other in enumerate(hulls):
                if i != j:
                    depth = (other.equations[:, :3] @ points.T + other.equations[:, 3:]).max(axis=0)
                    points = points[depth > -1e-4]
            kept.append(points)
        if meshes and len(points := np.vstack(kept)):
            back = inverse(T)
            found[link] = points @ back[:3, :3].T + back[:3, 3]
    return found


def sampled(hull: scipy.spatial.ConvexHull, count: int, seed: int) -> np.ndarray:
    """Its corners, and points all over its faces."""
    rng = np.random.default_rng(seed)
    corners = hull.points[hull.simplices]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = corners[rng.choice(len(corners), 3 * count, p=areas / areas.sum())]
    inside = np.einsum("kc,kcx->kx", rng.dirichlet(np.ones(3), len(chosen)), chosen)
    return np.vstack([hull.points[hull.vertices][:: max(1, len(hull.vertices) // count)], inside])


def outside(x: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How far points are outside the capsules x ``(c, 7)``; negative inside."""
    least = np.full(len(points), np.inf)
    for row in x.reshape(-1, 7):
        start, way = row[:3], row[3:6] - row[:3]
        t = np.clip((points - start) @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
        least = np.minimum(least, np.linalg.norm(points - start - t[:, None] * way, axis=1) - abs(row[6]))
    return least


def misfit(x: np.ndarray, points: np.ndarray) -> np.ndarray:
    """What is minimised: what stands out counts four times as much; capsules hardly leave the box of the link."""
    apart = outside(x, points)
    rows = x.reshape(-1, 7)
    ends, radius = rows[:, :6].reshape(-1, 2, 3), np.abs(rows[:, 6:])
    over = np.maximum(ends.max(axis=1) + 0.4 * radius - points.max(axis=0), 0.0)
    under = np.maximum(points.min(axis=0) - ends.min(axis=1) + 0.4 * radius, 0.0)
    weight = 0.5 * np.sqrt(len(points))
    return np.concatenate(
        [np.where(apart > 0.0, 4.0 * apart, apart), weight * over.ravel(), weight * under.ravel()]
    )


def fitted(points: np.ndarray, count: int) -> np.ndarray:
    """`count` capsules ``(c, 7)`` near the points; what stands out counts four times as much."""
    best, least = None, np.inf
    for seed in range(3):
        rng = np.random.default_rng(seed)
        centres = points[rng.choice(len(points), count, replace=False)]
        for _ in range(12):
            owner = np.linalg.norm(points[:, None] - centres, axis=2).argmin(axis=1)
            centres = np.array(
                [points[owner == k].mean(0) if (owner == k).any() else c for k, c in enumerate(centres)]
            )
        first = []
        for k in range(count):
            own = points[owner == k] if (owner == k).sum() > 3 else points
            middle = 0.5 * (own.min(0) + own.max(0))
            _, size, axes = np.linalg.svd(own - own.mean(0), full_matrices=False)
            long = size[0] / np.sqrt(len(own))
            first.append(
                [*(middle - long * axes[0]), *(middle + long * axes[0]), 1.4 * size[1] / np.sqrt(len(own))]
            )
        result = scipy.optimize.least_squares(misfit, np.ravel(first), max_nfev=30, args=(points,))
        if result.cost < least:
            best, least = result.x.reshape(-1, 7), result.cost
    best[:, 6] = np.abs(best[:, 6])
    return best


def main() -> None:
    for robot_id in sys.argv[1:] or sorted(path.stem for path in FOLDER.glob("*.toml")):
        robot, capsules, worst, fat = classic_robots()[robot_id], [], 0.0, []
        for link, points in surfaces(robot_id).items():
            for count in (1, 2, 3):
                x = np.round(fitted(points, count), 3)
                gap = outside(x, points)
                if gap.max() <= OUT:
                    break
            worst = max(worst, float(gap.max()))
            fat.append(np.abs(gap))
            print(robot_id, link, count, f"out {1e3 * gap.max():.1f} mm, mean {1e3 * np.abs(gap).mean():.1f} mm")
            scale = {"m": 1.0, "cm": 100.0, "mm": 1000.0}[robot.units]
            for row in x * scale:
                start, end, radius = (
                    [float(f"{v:.6g}") + 0.0 for v in part] for part in (row[:3], row[3:6], row[6:])
                )
                name = {"row": robot.joints[link - 1].name} if link else {}
                capsules.append({**name, "start": start, "end": end, "radius": radius[0]})
        mean = 1e3 * np.concatenate(fat).mean()
        source = (
            "Capsules fitted to our drawing of this arm, which follows its maker's dimensions: its surface is "
            f"{mean:.0f} mm from theirs on average, and stands out by at most {1e3 * worst:.0f} mm."
        )
        path = ROBOTS / f"{robot_id}.toml"
        text = path.read_text("utf-8").split("\n[[capsules]]")[0]
        head = [line for line in text.rstrip("\n").split("\n") if not line.startswith("capsules_source")]
        at = next(i for i, line in enumerate(head) if line.startswith("units"))
        head.insert(at + 1, f'capsules_source = "{source}"')
        path.write_text("\n".join(head) + "\n\n" + to_toml({"capsules": capsules}), "utf-8")


main()
