"""Arrays as arguments of kernels: what is accepted and refused, also without compilation and in threads."""

from __future__ import annotations

import copy
import gc
import json
import os
import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import kin
from kin import InputError
from kin.kernels import fk as fk_kernels
from kin.kernels.ahead import levels
from kin.kernels.compile import PLAIN, direct

ROBOT = kin.get_robot("pioneer5")
Q = np.array([0.3, -0.4, 0.5, 0.6, -0.7])
ENTRY = direct(fk_kernels.fk_one)
COMPILED = pytest.mark.skipif(PLAIN, reason="kernels are not compiled")


class Array(np.ndarray):
    """A subclass, which may mean something else by its fields."""


def unaligned(values):
    found = np.ndarray(values.shape, np.float64, np.empty(values.nbytes + 1, dtype=np.uint8)[1:])
    found[...] = values
    return found


def read_only(values):
    found = values.copy()
    found.flags.writeable = False
    return found


# Arrays whose values can be borrowed, and what else holds the same values.
BORROWED = {
    "array": np.copy,
    "read-only": read_only,
    "view of bytes": lambda x: np.frombuffer(x.tobytes()).reshape(x.shape),
    "part of a longer one": lambda x: np.stack([x, x])[1],
    "data type with metadata": lambda x: x.astype(np.dtype("f8", metadata={"unit": "rad"})),
    "unpickled": lambda x: pickle.loads(pickle.dumps(x)),  # its data type is a copy
}
REFUSED = {
    "list": np.ndarray.tolist,
    "tuple": lambda x: tuple(x.tolist()),
    "every second value": lambda x: np.repeat(x, 2, axis=-1)[..., ::2],
    "negative strides": lambda x: np.flip(np.flip(x).copy()),
    "other byte order": lambda x: x.astype(">f8"),
    "extended precision": lambda x: x.astype(np.longdouble),
    "objects": lambda x: x.astype(object),
    "subclass": lambda x: x.copy().view(Array),
    "unaligned": unaligned,
}
WRONG = {
    "nothing": lambda x: None,
    "number": lambda x: 1.0,
    "type": lambda x: np.ndarray,
    "data type": lambda x: x.dtype,
    "no axis": lambda x: np.array(1.0),
    "more axes": lambda x: np.stack([x] * 3),
    "whole numbers": lambda x: x.astype(np.int64),
    "complex": lambda x: np.ones_like(x) + 0j,
    "empty of another type": lambda x: np.empty(0, dtype=np.int8),
}


def found(*functions):
    """Answers to every form of the arguments: nested lists, or what an error says."""
    T = kin.fk(ROBOT, Q)
    asked = {
        "fk": (lambda q: kin.fk(ROBOT, q), Q),
        "jacobian": (lambda q: kin.jacobian(ROBOT, q), Q),
        "branches": (lambda target: kin.ik_branches(ROBOT, target), T),
        "solutions": (lambda target: [s.q for s in kin.solve_ik(ROBOT, target).solutions], T),
        "seed": (lambda q: [s.q for s in kin.solve_ik(ROBOT, T, q_seed=q).solutions], Q),
        "targets": (lambda targets: kin.solve_ik_many(ROBOT, targets).q, np.stack([T, T])),
    }
    answers = {}
    for name in functions:
        function, value = asked[name]
        for form, change in (BORROWED | REFUSED | WRONG | {"short": lambda x: x[:3].copy()}).items():
            try:
                answers[f"{name}, {form}"] = np.array(function(change(value))).tolist()
            except InputError as error:
                answers[f"{name}, {form}"] = str(error)
    return answers


@pytest.mark.parametrize("form", BORROWED)
def test_arrays_that_can_be_borrowed_are(form):
    T = np.empty((4, 4))
    assert ENTRY(ROBOT.model, BORROWED[form](Q), T) is True
    assert np.array_equal(T, kin.fk(ROBOT, Q.tolist()))


@COMPILED
@pytest.mark.parametrize("form", REFUSED | WRONG)
def test_anything_else_is_a_type_error(form):
    value = (REFUSED | WRONG)[form](Q)
    with pytest.raises(TypeError, match="array"):
        ENTRY(ROBOT.model, value, np.empty((4, 4)))
    with pytest.raises(TypeError, match="array"):
        ENTRY(value, Q, np.empty((4, 4)))


@COMPILED
@pytest.mark.parametrize("shape", [(3, 4), (4, 3), (4, 5), (5, 4), (16,), (1, 4, 4), (0, 0)])
def test_a_shape_that_is_demanded_is_checked(shape):
    with pytest.raises(TypeError, match=r"4, ?4"):
        ENTRY(ROBOT.model, Q, np.empty(shape))


@pytest.mark.parametrize("form", BORROWED | REFUSED)
@pytest.mark.parametrize("function", ["fk", "jacobian", "branches", "solutions", "seed", "targets"])
def test_every_form_of_the_same_values_gives_the_same_answer(function, form, answers):
    given, wanted = (np.array(answers[f"{function}, {kind}"]) for kind in (form, "list"))
    if function == "solutions":  # targets are made orthonormal in one of two ways, compiled or not
        assert given == pytest.approx(wanted, abs=1e-12)
    else:
        assert np.array_equal(given, wanted, equal_nan=True)


@pytest.fixture(scope="module")
def answers():
    return found("fk", "jacobian", "branches", "solutions", "seed", "targets")


@pytest.mark.full
def test_functions_that_are_not_compiled_answer_the_same(answers):
    names = ("fk", "jacobian", "solutions", "seed")
    program = f"import json, test_arguments; print(json.dumps(test_arguments.found{names}))"
    path = os.pathsep.join([str(Path(kin.__file__).parents[1]), str(Path(__file__).parent)])
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        env={**os.environ, "KINBOARD_KERNELS": "python", "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    plain, off = json.loads(done.stdout), 1e-12 if next(levels()) == "x86_64_v2" else 0.0  # that has no fma
    assert plain.keys() == {name for name in answers if name.startswith(names)}
    for name, answer in plain.items():
        if isinstance(answer, str):
            assert answer == answers[name], name
        else:
            assert np.allclose(answer, answers[name], rtol=0.0, atol=off, equal_nan=True), name


@pytest.mark.full
def test_no_call_keeps_a_reference_or_memory():
    q, text, T = Q.copy(), Q.tolist(), np.empty((4, 4))
    everything = (q, text, T, ROBOT.model, np.ndarray, q.dtype)

    def calls(count):
        for _ in range(count):
            ENTRY(ROBOT.model, q, T)
            with pytest.raises(TypeError):
                ENTRY(ROBOT.model, text, T)

    calls(10)
    gc.collect()
    before = [sys.getrefcount(each) for each in everything]
    calls(1000)
    gc.collect()
    # Others may refer to the type and the data type meanwhile, but not thousands.
    assert all(abs(sys.getrefcount(each) - count) < 100 for each, count in zip(everything, before, strict=True))


def test_arms_that_come_and_go_in_many_threads_give_the_answers_of_one():
    """Each thread makes, copies and drops arms and arrays of its own; the numbers live only as long as a call."""

    def work(seed):
        rng = np.random.default_rng(seed)
        found = []
        for k in range(40):
            robot = kin.Robot.from_dh(rng.uniform(-1.0, 1.0, (2 + k % 6, 4)).tolist())
            robot = (copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x)))[k % 3](robot)
            q = rng.uniform(-3.0, 3.0, robot.n)
            found += [kin.fk(robot, q.copy()), kin.fk(robot, q.tolist()), kin.jacobian(robot, q.copy())]
            found += [kin.jacobian(robot, q[None])[0]]
        return found

    serial = [work(seed) for seed in range(16)]
    with ThreadPoolExecutor(8) as pool:
        for one, other in zip(serial, pool.map(work, range(16)), strict=True):
            assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))
            assert all(np.array_equal(a, b) for a, b in zip(one[::4], one[1::4], strict=True))
            assert all(np.array_equal(a, b) for a, b in zip(one[2::4], one[3::4], strict=True))


def test_the_fields_of_arrays_are_where_machine_code_reads_them():
    """One array of each length and address; a wrong offset would give another answer, or end the process."""
    for n in range(1, 9):
        robot = kin.Robot.from_dh([(0.1 * i, 0.2, 0.3, 0.4) for i in range(n)])
        block = np.linspace(-1.0, 1.0, 9 * n).reshape(9, n)
        wanted = kin.fk(robot, block)
        assert all(np.array_equal(kin.fk(robot, row), pose) for row, pose in zip(block, wanted, strict=True))
        for other in (n - 1, n + 1):
            with pytest.raises(InputError, match=f"{n} joint values"):
                kin.fk(robot, np.zeros(other))


# A finder that loads the module with something in its text replaced, before the core is imported.
CHANGED = """
import importlib.machinery, json, sys, sysconfig, warnings

class Loader(importlib.machinery.SourceFileLoader):
    def get_data(self, path):
        data = super().get_data(path)
        if not path.endswith("layout.py"):
            return b"" if path.endswith(".pyc") else data  # bytecode would be that of the true text
        assert {old!r}.encode() in data
        return data.replace({old!r}.encode(), {new!r}.encode())

class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == "kin.kernels.layout":
            return importlib.util.spec_from_loader(name, Loader(name, path[0] + "/layout.py"))

import importlib.util
sys.dont_write_bytecode = True
sys.meta_path.insert(0, Finder)
with warnings.catch_warnings(record=True) as warned:
    warnings.simplefilter("always")
    import numpy as np
    import kin
    from kin.kernels import layout
robot = kin.get_robot("pioneer5")
q = np.array({q})
fixed, refused = q.copy(), []
fixed.flags.writeable = False
for wrong in (q.tolist(), q[:4], q.astype("f4"), q.astype(">f8"), np.repeat(q, 2)[::2], None, fixed):
    try:
        refused.append(kin.fk(robot, wrong).tolist())
    except kin.InputError as error:
        refused.append(str(error))
print(json.dumps([layout.READABLE, [str(w.message) for w in warned], kin.fk(robot, q).tolist(), refused]))
"""

WRONG_PLACES = {
    "true": ("(-1, 1, 2, 3, 5, 6)", "(-1, 1, 2, 3, 5, 6)", ""),
    "type": ("(-1, 1, 2, 3, 5, 6)", "(-2, 1, 2, 3, 5, 6)", "another type"),
    "data": ("DATA = object.__basicsize__", "DATA = object.__basicsize__ + 8", "another"),
    "axes": ("(-1, 1, 2, 3, 5, 6)", "(-1, 2, 2, 3, 5, 6)", "another number of axes"),
    "shape and strides swapped": ("(-1, 1, 2, 3, 5, 6)", "(-1, 1, 3, 2, 5, 6)", "another shape"),
    "strides": ("(-1, 1, 2, 3, 5, 6)", "(-1, 1, 2, 4, 5, 6)", "another shape"),
    "data type": ("(-1, 1, 2, 3, 5, 6)", "(-1, 1, 2, 3, 4, 6)", "another data type"),
    "flags": ("(-1, 1, 2, 3, 5, 6)", "(-1, 1, 2, 3, 5, 7)", "another flags"),
    "beyond the end": ("(-1, 1, 2, 3, 5, 6)", "(-1, 1, 2, 3, 5, 600)", "shorter"),
    "no GIL": ('sysconfig.get_config_var("Py_GIL_DISABLED")', "1", "no GIL"),
}


@pytest.mark.full
@pytest.mark.parametrize("place", WRONG_PLACES)
def test_arrays_that_are_laid_out_otherwise_are_asked_for_their_buffers(place):
    old, new, why = WRONG_PLACES[place]
    code = CHANGED.replace("{old!r}", repr(old)).replace("{new!r}", repr(new)).replace("{q}", str(Q.tolist()))
    environment = os.environ | {"PYTHONPATH": str(Path(kin.__file__).parents[1])}
    run = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stderr
    readable, warned, pose, answers = json.loads(run.stdout)
    assert readable is (not why)
    assert np.array_equal(pose, kin.fk(ROBOT, Q))
    assert [np.array_equal(one, pose) for one in (*answers[:1], *answers[3:5], answers[6])] == [True] * 4
    assert "5 joint values" in answers[1]
    assert "joint values" in answers[5]
    if why:
        (line,) = warned
        assert why in line
        assert np.__version__ in line
    else:
        assert warned == []
