"""All kernels in C: reached from entries, and the same bits as in Python."""

from __future__ import annotations

import ast
import inspect
import os
import pickle
import pkgutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from recorded import copied, kernel_of, same

import kin
from kin.codegen.extension import build
from kin.codegen.source import PRIMITIVES, plain
from kin.codegen.typing import Program
from kin.codegen.units import entry_of, units
from kin.kernels.ahead import entries, levels, loaded
from kin.kernels.compile import PLAIN
from kin.kernels.plain import written
from kin.workspace.region import Region
from kin.workspace.sampling.streams import joint_streams

LINES = [line for lines in units().values() for line in lines]
ROOT = Path(kin.__file__).parents[1]
pytestmark = pytest.mark.skipif(PLAIN, reason="kernels are not compiled")
FUSED = pytest.mark.skipif(next(levels()) == "x86_64_v2", reason="the extension does not fuse operations")
MAKERS = {"kernels_in_lanes", "one_after_another", "each_solved"}  # of kernels from others, which they call


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
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in MAKERS:
            return
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
        makes = isinstance(node, ast.FunctionDef) and node.name in MAKERS
        if getattr(own, "__module__", "") != module.__name__ and not makes:  # not a kernel
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


def recorded(arguments, kernels):
    program = Path(__file__).with_name("recorded.py")
    path = os.pathsep.join(map(str, (ROOT, ROOT / "tests")))
    environment = os.environ | {"PYTHONPATH": path, "KINBOARD_KERNELS": kernels}
    subprocess.run([sys.executable, program, *arguments], check=True, env=environment)
    return pickle.loads(arguments[-1].read_bytes())


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    """Recorded calls of the extension by the names of their entries, and what Python does with them."""
    folder = tmp_path_factory.mktemp("recorded")
    files = folder / "calls", folder / "answers"
    return recorded(files[:1], "c"), recorded(files, "python")


@pytest.mark.full
def test_all_entries_are_recorded_but_those_that_few_arms_need(calls):
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
    assert {line.split()[0] for line in LINES} - set(calls[0]) == rare


@FUSED
@pytest.mark.full
def test_python_computes_the_bits_of_the_extension(calls):
    compiled, written = calls
    wrong = [name for name, (_, *found) in compiled.items() if not same(tuple(found), written[name])]
    assert wrong == []


@FUSED
def test_python_computes_the_bits_of_some_kernels():
    robot, rng = kin.get_robot("ur5"), np.random.default_rng(60)
    q, arm = rng.uniform(-3.0, 3.0, (70, 6)), Region.of(robot).arm
    streams = joint_streams(0, np.ones(6, dtype=np.bool_), quasi=False)
    calls = {
        "kin.kernels.fk.fk_one": (robot.model, q[0], np.empty((4, 4))),
        "kin.kernels.fk.fk_many": (robot.model, q, np.empty((70, 4, 4))),
        "kin.ik.candidates.select": (q, np.abs(q[:, 0])),
        "kin.workspace.sampling.kernels.sample_points": (arm, streams, 7, np.empty((70, 3), dtype=np.float32)),
    }
    for name, arguments in calls.items():
        given = copied(arguments)
        assert same(entries()[name](*given), written(kernel_of(name))(*arguments))
        assert same(given, arguments)


def resized(value):
    """An argument with one of its arrays one shorter, or longer, in one axis."""
    if isinstance(value, tuple):
        for k, each in enumerate(value):
            yield from ((*value[:k], other, *value[k + 1 :]) for other in resized(each))
    for axis in range(value.ndim if isinstance(value, np.ndarray) else 0):
        before = (slice(None),) * axis
        yield np.ascontiguousarray(value[(*before, slice(-1))])
        yield np.concatenate([value, value[(*before, slice(1))]], axis=axis)


@pytest.mark.full
def test_no_recorded_call_reads_or_writes_beside_an_array(calls, tmp_path):
    texts = build.texts(tmp_path / "texts", lambda what: None, checked=True)
    file = build.build(texts, tmp_path, next(levels()), build.own_system(), lambda what: None)
    module, refused = loaded(file), 0
    for index, (name, *_) in enumerate(module.entries()):
        if name not in calls[0]:
            continue
        function, (before, *found) = module.entry(index), calls[0][name]
        given = copied(before)
        result = function(*given)
        assert same((given, result), tuple(found)), name
        for other in resized(before):
            try:
                function(*copied(other))  # an index outside its axis is an IndexError
            except TypeError as error:
                refused += "does not fit" in str(error)
    assert refused > 2000
