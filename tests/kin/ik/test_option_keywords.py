"""`IKOptions` is the only description of the options: the keywords of every call follow from it."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields
from typing import Any, Unpack, get_args, get_origin, get_type_hints

import numpy as np
import pytest

import kin
from kin import IKOptions, InputError, JointConstraints
from kin.ik.options import DEFAULTS, IKKeywords, MotionKeywords, PathKeywords, Range

ARM = kin.get_robot("redundant7-craig")
T = kin.fk(ARM, ARM.q_home)
PROGRAM = [kin.motion.Ptp(kin.motion.JointTarget(ARM.home))]
CALLS = {
    "solve_ik": (kin.solve_ik, IKKeywords, lambda **given: kin.solve_ik(ARM, T, **given)),
    "solve_ik_many": (kin.solve_ik_many, IKKeywords, lambda **given: kin.solve_ik_many(ARM, [T], **given)),
    "solve_path": (kin.solve_path, PathKeywords, lambda **given: kin.solve_path(ARM, [T], **given)),
    "plan_motion": (kin.plan_motion, MotionKeywords, lambda **given: kin.plan_motion(ARM, PROGRAM, **given)),
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


def test_keywords_have_the_types_of_the_class():
    assert get_type_hints(IKKeywords) == hints_of_the_class()
    for function, keywords, _ in CALLS.values():
        assert get_type_hints(function)["keywords"] == Unpack[keywords]
        assert get_type_hints(function)["options"] == IKOptions | None


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
    _, keywords, call = CALLS[name]
    good, bad = VALUES[keyword]
    if keyword not in keywords.__optional_keys__:
        with pytest.raises(TypeError, match=f"unexpected keyword argument '{keyword}'"):
            call(**{keyword: good})
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
        assert once.q.tolist() == whole.q.tolist()


@pytest.mark.parametrize("name", CALLS)
def test_a_keyword_that_is_none_is_an_error_of_python(name):
    with pytest.raises(TypeError, match="unexpected keyword argument 'tasks'"):
        CALLS[name][2](tasks="pose")


@pytest.mark.parametrize("name", ["solve_ik", "solve_ik_many", "solve_path"])
def test_limits_and_locks_may_be_by_the_names_of_joints(name):
    call = CALLS[name][2]
    third, last = ARM.joints[2].name, ARM.joints[6].name
    listed = call(limits=[None, None, (-1.0, 1.0), *[None] * 4], locked=[*[None] * 6, 0.25])
    named = call(limits={third: (-1.0, 1.0)}, locked={last: 0.25})
    assert repr(named) == repr(listed)
    assert repr(call(limits={}, locked={})) == repr(call())


@pytest.mark.parametrize(
    ("given", "field", "expected"),
    [
        ({"limits": {"elbw": (0.0, 1.0)}}, "limits.elbw", "one of the joints shoulder, elbow"),
        ({"limits": {"elbow": (1.0, 0.0)}}, "limits.elbow", "a lower limit and an upper one"),
        ({"limits": {"elbow": (0.0, 9.0)}}, "limits.elbow", "limits inside the joint's own"),
        ({"locked": {"elbow": 9.0}}, "locked.elbow", "a value inside the limits"),
        ({"locked": {"elbow": "9"}}, "locked.elbow", "a finite number"),
        ({"locked": {1: 0.5}}, "locked.1", "one of the joints shoulder, elbow"),
    ],
)
def test_a_constraint_by_name_that_is_wrong_is_named(given, field, expected):
    with pytest.raises(InputError) as caught:
        kin.solve_ik("planar2r", [0.5, 0.5, 0.0], task="position", **given)
    assert caught.value.field == field
    assert expected in caught.value.expected


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
