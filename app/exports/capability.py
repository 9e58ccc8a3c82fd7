"""A capability map as a file: every voxel with its share of directions and its manipulability."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from kin.workspace import CapabilityMap


def _write_npz(found: CapabilityMap, path: Path) -> None:
    grid = found.grid
    with path.open("wb") as file:
        np.savez_compressed(
            file,
            robot=np.array(grid.robot.id),
            method=np.array(grid.method),
            origin=np.array(grid.origin),
            voxel=np.array(grid.voxel),
            shape=np.array(grid.shape),
            directions=grid.directions,
            index=found.index,
            centres=found.centres,
            approachable=found.approachable,
            share=found.share,
            manipulability=found.manipulability,
        )


def _write_csv(found: CapabilityMap, path: Path) -> None:
    columns = np.column_stack([found.centres, found.share, found.manipulability])
    with path.open("w", encoding="ascii", newline="") as file:
        file.write("x,y,z,share,manipulability\n")
        np.savetxt(file, columns, fmt=["%.9g"] * 3 + ["%.6g"] * 2, delimiter=",")


def _write_ply(found: CapabilityMap, path: Path) -> None:
    """The centres as a point cloud, coloured by share from red over yellow to green."""
    red, green = (np.clip(2.0 * part, 0.0, 1.0) * 255.0 for part in (1.0 - found.share, found.share))
    names = [("x", "f4"), ("y", "f4"), ("z", "f4"), ("share", "f4"), ("manipulability", "f4")]
    names += [("red", "u1"), ("green", "u1"), ("blue", "u1")]
    rows = np.zeros(len(found.index), dtype=[(name, f"<{kind}") for name, kind in names])
    columns = (*found.centres.T, found.share, found.manipulability, red.round(), green.round())
    for (name, _), column in zip(names, columns, strict=False):
        rows[name] = column
    words = {"f4": "float", "u1": "uchar"}
    head = ["ply", "format binary_little_endian 1.0", f"comment capability map of {found.grid.robot.id}"]
    head += [f"comment voxel {found.grid.voxel!r} m", f"element vertex {len(rows)}"]
    head += [f"property {words[kind]} {name}" for name, kind in names]
    path.write_bytes("\n".join([*head, "end_header", ""]).encode("ascii") + rows.tobytes())


WRITERS: dict[str, Callable[[CapabilityMap, Path], None]] = {
    ".npz": _write_npz,
    ".ply": _write_ply,
    ".csv": _write_csv,
}
