"""Sizes and sections of workspaces: computed once for REST and the viewer."""

from __future__ import annotations

from concurrent.futures import CancelledError
from dataclasses import replace

import numpy as np
import pytest

import kin
from app.shared.computations import TooManyPendingError
from app.shared.summaries import Summaries

ARM = kin.get_robot("pioneer5")
LOCKED = (None, None, None, None, 0.5)


@pytest.fixture
def summaries():
    made = Summaries(kept=4, threads=1)
    yield made
    made.close()


def test_sizes_and_sections_are_those_of_the_core(summaries):
    facts = summaries.facts(ARM, kin.JointConstraints(locked=LOCKED), effort=None).future.result(60)
    expected = kin.workspace.workspace_facts(ARM, locked=LOCKED, volume=False)
    assert facts.volume is None
    assert facts.reach.largest.value == expected.reach.largest.value
    cut = summaries.section(ARM, constraints=kin.JointConstraints(locked=LOCKED), resolution=16).future.result(60)
    assert np.array_equal(
        cut.curves[0], kin.workspace.workspace_section(ARM, locked=LOCKED, resolution=16).curves[0]
    )


def test_equal_requests_share_one_result_and_others_do_not(summaries):
    facts = summaries.facts(ARM, effort=None).future.result(60)
    assert summaries.facts(kin.get_robot("pioneer5"), effort=None).future.result(0) is facts
    assert summaries.facts(ARM, kin.JointConstraints(locked=LOCKED), effort=None).future.result(60) is not facts
    cut = summaries.section(ARM, resolution=16).future.result(60)
    assert summaries.section(ARM, resolution=16).future.result(0) is cut
    assert summaries.section(ARM, resolution=17).future.result(60) is not cut


def test_a_comparison_ends_when_nobody_waits_for_it(summaries):
    two = kin.get_robot("ur5"), kin.get_robot("panda")
    with summaries.comparison(*two, "fixed") as reader:
        assert reader.future.result(60).verdict == "different"
        assert summaries.comparison(*two, "fixed").future.result(0) is reader.future.result()
    rows = [replace(row, alpha=row.alpha + 0.3, a=row.a + 0.2) for row in two[1].rows]
    left = summaries.comparison(two[1], replace(two[1], rows=tuple(rows)), "fixed")
    left.leave()
    with pytest.raises(CancelledError):
        left.future.result(60)
    assert summaries.pending == 0


def test_only_callers_who_ask_for_the_limit_are_refused():
    full = Summaries(threads=1, max_pending=0)
    with pytest.raises(TooManyPendingError):
        full.facts(ARM, effort=None, limited=True)
    with pytest.raises(TooManyPendingError):
        full.section(ARM, limited=True)
    assert full.facts(ARM, effort=None).future.result(60).volume is None
    full.close()
