"""`IKOptions` is the only description of the options: the keywords of every call follow from it."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest

import kin
from kin import IKOptions, InputError, JointConstraints
from kin.ik.options import DEFAULTS, Range

ARM = kin.get_robot("redundant7-craig")
T = kin.fk(ARM, ARM.q_home)
OF_A_PATH = {
    "task",
    "mask",
    "mask_frame",
    "limits",
    "locked",
    "wider_limits",
    "branch",
    "position_tolerance",
    "rotation_tolerance",
}
OF_A_MOTION = {"avoid_self_collision", "obstacles"}
OTHERS = {
    "robot",
    "target",
    "targets",
    "program",
    "options",
    "q_seed",
    "q_start",
    "qd_start",
    "qdd_start",
    "max_step",
    "motion_limits",
    "cancel",
}
PROGRAM = [kin.Ptp(kin.JointTarget(ARM.home))]
CALLS = {
    "solve_ik": (kin.solve_ik, set(DEFAULTS), lambda **given: kin.solve_ik(ARM, T, **given)),
    "solve_ik_many": (kin.solve_ik_many, set(DEFAULTS), lambda **given: kin.solve_ik_many(ARM, [T], **given)),
    "solve_path": (kin.solve_path, OF_A_PATH | OF_A_MOTION, lambda **given: kin.solve_path(ARM, [T], **given)),
    "plan_motion": (kin.plan_motion, OF_A_MOTION, lambda **given: kin.plan_motion(ARM, PROGRAM, **given)),
}
# For each keyword a value that is valid and has an effect, and one that is not.
VALUES: dict[str, tuple[Any, Any]] = {
    "task": ("position", "pos"),
    "mask": ([True, True, False, False, False, False], [1, 1, 1, 0, 0, 0]),
    "mask_frame": ("base", "world"),
    "limits": ([(-1.0, 1.0), *[None] * 6], [(1.0, -1.0), *[None] * 6]),
    "locked": ([*[None] * 6, 0.25], ["0.25"]),
    "wider_limits": ("intersect", "clip"),
    "respect_limits": (False, None),
    "branch": ("elbow positive", [3]),
    "images": ("all", True),
    "prefer": ("limits", "best"),
    "redundancy": ({"psi": 0.25}, {"psi": "0.25"}),
    "max_solutions": (1, True),
    "solver": ("numeric", "opw"),
    "position_tolerance": (1e-3, 1.0),
    "rotation_tolerance": (1e-3, 0.0),
    "avoid_self_collision": (True, None),
    "obstacles": ([kin.Obstacle("sphere", (5.0, 0.0, 0.0), radius=0.1)], [7]),
}


def as_options(**keywords: Any) -> IKOptions:
    names = [each.name for each in fields(JointConstraints) if each.name in keywords]
    constraints = JointConstraints(**{name: keywords.pop(name) for name in names})
    return IKOptions(constraints=constraints, **keywords)


def hints_of_the_class() -> dict[str, Any]:
    """The type of each keyword, without ranges."""
    hints = get_type_hints(JointConstraints) | get_type_hints(IKOptions)
    return {name: hints[name] for name in DEFAULTS}


@pytest.mark.parametrize("name", CALLS)
def test_keywords_have_the_types_and_defaults_of_the_class(name):
    function, names, _ = CALLS[name]
    signature, hints = inspect.signature(function).parameters, get_type_hints(function)
    assert set(signature) - OTHERS == names
    for each in names:
        assert signature[each].default == DEFAULTS[each], each
        assert hints[each] == hints_of_the_class()[each], each
    assert hints["options"] == IKOptions | None


@pytest.mark.parametrize("name", CALLS)
def test_the_documentation_of_a_call_names_its_keywords_in_the_order_of_the_class(name):
    function, names, _ = CALLS[name]
    text = " ".join((inspect.getdoc(function) or "").split())
    listed = [each for each in re.findall(r"[a-z_]+(?=, |: )", text.partition("Args:")[2]) if each in DEFAULTS]
    assert list(dict.fromkeys(each for each in listed if each in names)) == [n for n in DEFAULTS if n in names]


def test_every_field_is_described_with_its_choices_and_unit():
    for kind in (IKOptions, JointConstraints):
        section = (inspect.getdoc(kind) or "").partition("Attributes:")[2].partition("Raises:")[0]
        described = re.findall(r"^ {4}(\w+): ", section, re.M)
        assert described == [field.name for field in fields(kind)]
    text = " ".join((IKOptions.__doc__ or "").split())
    hints = get_type_hints(IKOptions, include_extras=True)
    for name, hint in hints.items():
        about = text.partition(f" {name}: ")[2]
        if hasattr(hint, "__metadata__"):
            (allowed,) = hint.__metadata__
            assert isinstance(allowed, Range)
            assert {"m": "in metres", "rad": "in radians"}[allowed.unit] in about.partition(". ")[0], name
        elif get_origin(hint) is not None and all(isinstance(each, str) for each in get_args(hint)):
            for choice in get_args(hint):
                assert choice == getattr(IKOptions(), name) or choice in about.partition("_")[0], name


@pytest.mark.parametrize("keyword", DEFAULTS)
@pytest.mark.parametrize("name", CALLS)
def test_every_keyword_reaches_the_call_and_options_hold_the_same(name, keyword):
    _, names, call = CALLS[name]
    good, bad = VALUES[keyword]
    if keyword not in names:
        if name == "plan_motion":
            with pytest.raises(InputError) as caught:
                call(options=as_options(**{keyword: good}))
            field = "constraints" if keyword in ("limits", "locked", "wider_limits") else keyword
            assert caught.value.field == f"options.{field}"
        return
    if bad is not None:
        with pytest.raises(InputError) as caught:
            call(**{keyword: bad})
        assert re.split(r"[.\[]", caught.value.field)[0] in (keyword, "obstacles")
    with pytest.raises(InputError, match=f"no {keyword} besides options"):
        call(options=IKOptions(), **{keyword: good})
    once, whole = call(**{keyword: good}), call(options=as_options(**{keyword: good}))
    assert repr(once) == repr(whole)
    if name == "solve_ik":
        assert [s.q.tolist() for s in once.solutions] == [s.q.tolist() for s in whole.solutions]


def test_options_are_an_ik_options():
    for _, _, call in CALLS.values():
        with pytest.raises(InputError, match=r"options: got .* or none"):
            call(options={"task": "pose"})


def test_equal_values_of_other_types_are_refused():
    """Plain options are cached by value and type: True and 1.0 equal 1."""
    assert len(kin.solve_ik(ARM, T, max_solutions=1).solutions) == 1
    for wrong in (True, 1.0):
        with pytest.raises(InputError, match="max_solutions"):
            kin.solve_ik(ARM, T, max_solutions=wrong)
    with pytest.raises(InputError, match="no max_solutions besides options"):
        kin.solve_ik(ARM, T, options=IKOptions(), max_solutions=np.int64(1))
