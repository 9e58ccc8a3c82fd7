"""Write static/vendor/stix/math.woff2: the letters, signs and MATH table of STIX Math that our formulas need.

Browsers take the height of a subscript from the MATH table of a formula's first font, and its letters from the
mathematical alphabets. Many machines have no font with either; with this one, formulas look the same everywhere.

Needs fontTools with brotli (``pip install fonttools brotli``) and the font, of Debian's package fonts-stix::

    python scripts/math_font.py STIXMath-Regular.otf

The licence reserves the name of the original, so the subset has another one.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fontTools import subset
from fontTools.ttLib import TTFont

NAME = "Kinboard Math"
OUT = Path(__file__).parents[1] / "static" / "vendor" / "stix" / "math.woff2"
PLANCK = 0x210E  # the italic h, which is not among the other italic letters

CHARACTERS = {
    *range(0x20, 0x7F),
    *map(ord, "°±·×÷′″‴−⋅√∞≈≠≤≥∈→↦∂∑∏∫∠⊥∥ᵀ⁺⁻¹²³₀₁₂₃₄₅₆₇₈₉₊₋…–"),
    *range(0x391, 0x3AA),
    *range(0x3B1, 0x3CA),
    0x3D1,
    0x3D5,
    0x2062,  # invisible times
    0x307,  # the dot of a velocity
    0x308,
    *range(0x1D434, 0x1D468),  # italic letters
    PLANCK,
    *range(0x1D6FC, 0x1D71C),  # italic Greek letters
}


def main(source: str) -> None:
    """Write the subset of a font file."""
    options = subset.Options(
        flavor="woff2", layout_features=["*"], name_IDs=[0, 1, 2, 4, 6, 13, 14], hinting=False
    )
    font = TTFont(source)
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=CHARACTERS)
    subsetter.subset(font)
    for record in font["name"].names:
        if record.nameID in (1, 4, 6):
            record.string = NAME.replace(" ", "") if record.nameID == 6 else NAME
    if "CFF " in font:
        cff = font["CFF "].cff
        cff.fontNames = [NAME.replace(" ", "")]
        top = cff.topDictIndex[0]
        top.FullName = top.FamilyName = NAME
    font["head"].modified = font["head"].created
    OUT.parent.mkdir(parents=True, exist_ok=True)
    subset.save_font(font, str(OUT), options)


if __name__ == "__main__":
    main(sys.argv[1])
