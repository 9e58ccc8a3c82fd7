"""``kinboard capability``: computes a capability map, prints its figures, writes it to a file."""

from __future__ import annotations

import itertools
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from app.cli.terminal import Notation, clean, joint_constraints, print_json, quantity, robot_of, table, units_of
from app.exports.capability import WRITERS
from app.exports.progress import progress_bar
from app.shared.answers.capability import CapabilityAnswer, capability_answer
from app.shared.mapreduce import run_dask, run_local
from kin import InputError
from kin.workspace import CapabilityBlock, CapabilityMap, capability_grid, capability_join


def run(arguments: Namespace) -> int:
    """Print the figures of the map, and write it to a file if one is named."""
    robot = robot_of(arguments)
    save = None if arguments.output is None else _saver(Path(arguments.output))
    constraints = joint_constraints(robot, arguments)
    grid = capability_grid(
        robot,
        voxel=None
        if arguments.voxel is None
        else quantity(arguments.voxel, units_of(arguments).lengths, "--voxel"),
        resolution=arguments.resolution,
        constraints=constraints,
        directions=arguments.directions,
    )
    blocks = run_local(grid) if arguments.dask is None else run_dask(grid, arguments.dask)
    with progress_bar(len(grid.blocks), "blocks", sys.stderr.isatty()) as advance:
        found = capability_join(grid, _counted(blocks, advance))
    if save is not None:
        save(found)
    answer = capability_answer(found)
    if arguments.json:
        return print_json(answer)
    print(f"{robot.name} ({robot.id})\n")
    for line in _summary(answer, found, Notation(robot, arguments.rad)):
        print(line)
    return 0


def _counted(blocks: Iterator[CapabilityBlock], advance: Callable[[int], object]) -> Iterator[CapabilityBlock]:
    for block in blocks:
        yield block
        advance(1)


def _summary(answer: CapabilityAnswer, found: CapabilityMap, units: Notation) -> list[str]:
    """The figures as lines of text, and a table of voxels by share of directions."""
    length, a = units.of_length, "×".join(map(str, answer.shape))

    def at(place: list[float] | None) -> str:
        return "" if place is None else f" at {', '.join(units.length(x) for x in place)} {length}"

    lines = [
        f"grid            {a} voxels of {units.length(answer.voxel)} {length}",
        f"directions      {answer.directions}, {answer.method}",
        f"reachable       {answer.reachable} voxels, {clean(answer.volume, 4)} m³",
        f"mean share      {100.0 * answer.mean_share:.1f} %",
        f"best share      {100.0 * answer.best_share:.1f} %{at(answer.best_share_at)}",
        f"manipulability  {answer.best_manipulability:.4g} at best{at(answer.best_manipulability_at)}",
    ]
    steps = np.linspace(0.0, 1.0, 6)
    rows = [["none of the set", str(int((found.share == 0.0).sum()))]]
    for low, high in itertools.pairwise(steps.tolist()):
        inside = (found.share > low) & (found.share <= high + 1e-6)
        rows.append([f"up to {100.0 * high:.0f} %", str(int(inside.sum()))])
    return [*lines, "", table(["share of the directions", "voxels"], rows)]


def _saver(path: Path) -> Callable[[CapabilityMap], None]:
    """A function that writes a map to this file; raises `InputError` for an unknown ending or a missing folder."""
    if path.suffix.lower() not in WRITERS or not path.parent.is_dir():
        raise InputError(
            "--output", str(path), "a file in an existing folder, with a name that ends in " + ", ".join(WRITERS)
        )

    def save(found: CapabilityMap) -> None:
        try:
            WRITERS[path.suffix.lower()](found, path)
        except OSError as error:
            raise InputError("--output", str(path), f"a file that can be written: {error.strerror}") from None

    return save
