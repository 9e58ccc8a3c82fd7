"""All kernels in C: reached from entries, without warnings, and the same bits as compiled by numba."""

from __future__ import annotations

import ast
import inspect
import pickle
import pkgutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from native import built, same
from recorded import copied

import kin
from kin.codegen.source import PRIMITIVES, plain
from kin.codegen.typing import Program
from kin.codegen.units import entry_of, units
from kin.kernels.compile import PLAIN
from kin.workspace.region import Region
from kin.workspace.sampling.streams import joint_streams

LINES = [line for lines in units().values() for line in lines]
ROOT = Path(kin.__file__).parents[1]
pytestmark = [
    pytest.mark.skipif(PLAIN, reason="kernels are not compiled"),
    pytest.mark.timeout(1200),  # where they have to be compiled first
]


def modules(package: str) -> list[ModuleType]:
    root = import_module(package)
    names = [each.name for each in pkgutil.walk_packages(root.__path__, f"{package}.")]
    return [root, *(import_module(name) for name in names if ".codegen" not in name)]


def kernels_of(module: ModuleType) -> dict[str, object]:
    """The kernels that a module defines or imports, by their names there."""
    return {name: plain(value) for name, value in vars(module).items() if hasattr(value, "py_func")}


def named_in_python(module: ModuleType) -> set[object]:
    """The kernels that a module names outside of kernels."""
    known, found = kernels_of(module), set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in known:
            found.add(known[node.id])
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            base = vars(module).get(node.value.id)
            value = getattr(base, node.attr, None) if isinstance(base, ModuleType) else None
            found.update([plain(value)] if hasattr(value, "py_func") else [])
        for child in ast.iter_child_nodes(node):
            visit(child)

    for node in ast.parse(inspect.getsource(module)).body:
        own = known.get(node.name) if isinstance(node, ast.FunctionDef) else None
        if getattr(own, "__module__", "") != module.__name__:  # not a kernel
            visit(node)
    return found


def test_every_kernel_that_python_names_is_an_entry():
    there = {plain(entry_of(line).kernel) for line in LINES}
    missing = {
        f"{kernel.__module__}.{kernel.__name__}"
        for module in modules("kin")
        for kernel in named_in_python(module)
        if kernel not in there
    }
    assert missing == set()


def test_every_entry_has_a_type_for_each_argument():
    found = map(entry_of, LINES)
    wrong = [each for each in found if len(each.kinds) != plain(each.kernel).__code__.co_argcount]
    assert wrong == []


@pytest.mark.full
def test_every_kernel_is_reached_from_an_entry():
    program = Program()
    for entry in map(entry_of, LINES):
        program.add(entry.kernel, *entry.kinds)
    reached = {made.function for made in program.instances} | set(PRIMITIVES)
    known = {kernel for module in modules("kin") for kernel in kernels_of(module).values()}
    assert {f"{kernel.__module__}.{kernel.__name__}" for kernel in known - reached} == set()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Calls by the lines of their entries, and lines of calls that fit none."""
    file = tmp_path_factory.mktemp("recorded") / "calls"
    subprocess.run([sys.executable, Path(__file__).with_name("recorded.py"), file], check=True, cwd=ROOT)
    return pickle.loads(file.read_bytes())


@pytest.mark.full
def test_all_entries_are_recorded_but_those_that_few_arms_need(recorded):
    calls, others = recorded
    assert others == []
    rare = {
        "kin.angles.nearest_image",
        "kin.solvers.general5.point.configurations",
        "kin.solvers.general6.batch.loop_of",
        "kin.solvers.general6.recovery.polish",
        "kin.solvers.numeric.error.look",
        "kin.solvers.numeric.error.quadratic_model",
        "kin.solvers.numeric.step.inside",
        "kin.workspace.capability.kernels.search_each",
    }
    assert {line.split()[0] for line in LINES if line not in calls} == rare


@pytest.mark.full
@pytest.mark.parametrize("unit", sorted(units()))
def test_c_computes_the_bits_of_the_compiled_kernels(unit, recorded, tmp_path):
    lines = units()[unit]
    functions = built(map(entry_of, lines), tmp_path, unit, "-O1")
    compared, wrong = 0, []
    for line, function in zip(lines, functions, strict=True):
        if line not in recorded[0]:
            continue
        before, after, result = recorded[0][line]
        arguments = copied(before)
        if not (same(function(*arguments), result) and same(arguments, after)):
            wrong.append(line)
        compared += 1
    assert wrong == []
    assert compared > 0


def test_c_computes_the_bits_of_some_kernels(tmp_path):
    robot, rng = kin.get_robot("ur5"), np.random.default_rng(60)
    q, arm = rng.uniform(-3.0, 3.0, (70, 6)), Region.of(robot).arm
    streams = joint_streams(0, np.ones(6, dtype=np.bool_), quasi=False)
    calls = {
        "kin.kernels.fk.fk_one": (robot.model, q[0], np.empty((4, 4))),
        "kin.kernels.fk.fk_many": (robot.model, q, np.empty((70, 4, 4))),
        "kin.ik.candidates.select": (q, np.abs(q[:, 0])),
        "kin.workspace.sampling.kernels.sample_points": (arm, streams, 7, np.empty((70, 3), dtype=np.float32)),
    }
    lines = [next(line for line in LINES if line.startswith(f"{name} ")) for name in calls]
    functions = built(map(entry_of, lines), tmp_path, "some", "-O0")
    for arguments, function in zip(calls.values(), functions, strict=True):
        given = copied(arguments)
        assert same(function(*given), function.prototype.entry.kernel(*arguments))
        assert same(given, arguments)
