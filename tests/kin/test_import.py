"""What `import kin` loads: what few programs need comes when they ask for it."""

from __future__ import annotations

import subprocess
import sys

import pytest

import kin

PROGRAM = """
import sys
import kin

def there(*names):
    return [name for name in names if f"kin.{name}" in sys.modules]

assert kin.solve_ik("ur5", kin.fk("ur5", [0.1] * 6)).solutions
seldom = "calibration", "codegen", "comparison", "doctor", "escape", "motion", "motors", "notebook", "workspace"
assert there(*seldom) == [], there(*seldom)
assert set(kin.__all__) <= set(dir(kin))
assert kin.plan_motion is kin.plan_motion is kin.motion.plan_motion
assert "motion" in there(*seldom)
"""


@pytest.mark.full
def test_what_few_programs_need_is_loaded_when_they_ask_for_it():
    subprocess.run([sys.executable, "-c", PROGRAM], check=True)


def test_every_public_name_is_there_and_no_other():
    assert all(getattr(kin, name) is getattr(kin, name) for name in kin.__all__)
    assert set(kin._LATER) < set(kin.__all__)
    with pytest.raises(AttributeError, match="'kin' has no attribute 'warm_up'"):
        _ = kin.warm_up
