"""What ``kinboard capability`` does: compute a capability map, sum it up, write it to a file."""

from __future__ import annotations

import itertools
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from app.cli.terminal import Units, clean, per_joint, print_json, store_of, table
from app.shared.answers.capability import CapabilityAnswer, capability_answer
from app.shared.mapreduce import run_dask, run_local
from kin import CapabilityBlock, CapabilityMap, InputError, capability_grid, capability_join


def capability(arguments: Namespace) -> int:
    robot = store_of(arguments).get(arguments.robot)
    save = None if arguments.output is None else _saver(Path(arguments.output))
    voxel = arguments.voxel
    grid = capability_grid(
        robot,
        voxel=voxel if voxel is None or arguments.rad else voxel * 1e-3,
        resolution=arguments.resolution,
        limits=per_joint(robot, arguments.limit, "--limit", 2, arguments.rad),
        locked=per_joint(robot, arguments.lock, "--lock", 1, arguments.rad),
        directions=arguments.directions,
    )
    blocks = run_local(grid) if arguments.dask is None else run_dask(grid, arguments.dask)
    found = capability_join(grid, _shown(blocks, len(grid.blocks)))
    if save is not None:
        save(found)
    answer = capability_answer(found)
    if arguments.json:
        return print_json(answer)
    print(f"{robot.name} ({robot.id})\n")
    for line in _summary(answer, found, Units(robot, arguments.rad)):
        print(line)
    return 0


def _shown(blocks: Iterator[CapabilityBlock], total: int) -> Iterator[CapabilityBlock]:
    """The blocks as they come, their number told where somebody looks on."""
    shown = sys.stderr.isatty()
    for done, block in enumerate(blocks, 1):
        if shown:
            print(f"\r{done} of {total} blocks", end="", file=sys.stderr, flush=True)
        yield block
    if shown:
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def _summary(answer: CapabilityAnswer, found: CapabilityMap, units: Units) -> list[str]:
    """The same for people: a few lines, and how many voxels have which share of the directions."""
    length, a = units.of_length, "×".join(map(str, answer["shape"]))

    def at(place: list[float] | None) -> str:
        return "" if place is None else f" at {', '.join(units.length(x) for x in place)} {length}"

    lines = [
        f"grid            {a} voxels of {units.length(answer['voxel'])} {length}",
        f"directions      {answer['directions']}, {answer['method']}",
        f"reachable       {answer['reachable']} voxels, {clean(answer['volume'], 4)} m³",
        f"mean share      {100.0 * answer['mean_share']:.1f} %",
        f"best share      {100.0 * answer['best_share']:.1f} %{at(answer['best_share_at'])}",
        f"manipulability  {answer['best_manipulability']:.4g} at best{at(answer['best_manipulability_at'])}",
    ]
    steps = np.linspace(0.0, 1.0, 6)
    rows = [["none of the set", str(int((found.share == 0.0).sum()))]]
    for low, high in itertools.pairwise(steps.tolist()):
        inside = (found.share > low) & (found.share <= high + 1e-6)
        rows.append([f"up to {100.0 * high:.0f} %", str(int(inside.sum()))])
    return [*lines, "", table(["share of the directions", "voxels"], rows)]


def _saver(path: Path) -> Callable[[CapabilityMap], None]:
    """What writes a map to this file; `InputError` at once for an ending that is not known or no such folder."""
    if path.suffix.lower() not in WRITERS or not path.parent.is_dir():
        raise InputError("--output", str(path), "in an existing folder, a name ending in " + ", ".join(WRITERS))

    def save(found: CapabilityMap) -> None:
        try:
            WRITERS[path.suffix.lower()](found, path)
        except OSError as error:
            raise InputError("--output", str(path), f"a file that can be written: {error.strerror}") from None

    return save


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
