"""The table of the tool's pose: filled with numbers, it is what its template writes."""

from __future__ import annotations

import re
from collections.abc import Collection

import numpy as np
import pytest

import kin
from app.viewer.panel.readout import html
from kin.poses import ANGLES, QUATERNIONS, Rotations
from kin.units import DEFAULT_UNITS, Units

PUMA = kin.get_robot("puma560")
TARGET = re.compile(r' data-target="[^"]*"')


@pytest.mark.parametrize(
    "withheld", [(), ("angles",), ("position", "quaternion"), ("position", "angles", "quaternion")]
)
@pytest.mark.parametrize("frame", ["world", "<number>", "{0} & <b>", "</table>"])
def test_the_filled_table_is_that_of_the_template(frame: str, withheld: Collection[str]) -> None:
    rng = np.random.default_rng(4)
    for units in (DEFAULT_UNITS, Units(degrees=False, length="m")):
        for angles in ANGLES:
            rotations = Rotations(angles, str(rng.choice(list(QUATERNIONS))))
            for q in PUMA.random_q(rng, 3):
                T = kin.fk(PUMA, q)
                filled = html(T, units, None, frame, withheld, rotations)
                written = html(
                    T, units, T, frame, withheld, rotations
                )  # by the template, with the target's numbers
                assert filled == TARGET.sub("", written)
                assert len(TARGET.findall(written)) == 3 - len(withheld)
