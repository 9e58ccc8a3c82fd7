"""Whether what is said of the error of a tip holds, in 200 simulated calibrations of each arm and fixture."""

import numpy as np
import pytest

from kin.calibration import expected_error
from kin.calibration.fit import fit
from tests.kin.calibration.cells import CELLS

RUNS, KEPT = 200, 0.93


@pytest.mark.slow
@pytest.mark.parametrize("cell", CELLS, ids=lambda cell: f"{cell.name}, {cell.what}")
def test_the_bound_is_kept(cell):
    kept, covered = [], []
    for run in range(RUNS):
        model, errors, touches = cell.touches(run)
        found = fit(model, touches)
        kept.append(cell.off(model, errors, found.delta) <= expected_error(model, found, cell.test[:200]).bound)
        covered += (np.abs(found.delta - errors)[found.seen] <= 1.96 * found.sd[found.seen]).tolist()
    assert np.mean(kept) >= KEPT
    assert np.mean(covered) >= KEPT
