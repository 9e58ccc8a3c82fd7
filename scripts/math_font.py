"""Write static/math.woff: a font without letters, whose MATH table tells browsers where to place scripts.

Browsers take the height of a subscript from the MATH table of a formula's first font. Many machines have no font
with such a table, and then Chromium leaves subscripts on the baseline. The letters come from the next font.

Needs fontTools: ``pip install fonttools``. The numbers are thousandths of the font's size; scales are in percent.
"""

from pathlib import Path

from fontTools.fontBuilder import FontBuilder
from fontTools.pens.ttGlyphPen import TTGlyphPen
from fontTools.ttLib import newTable
from fontTools.ttLib.tables import otTables

NUMBERS = {
    "ScriptPercentScaleDown": 73,
    "ScriptScriptPercentScaleDown": 60,
    "DelimitedSubFormulaMinHeight": 1300,
    "DisplayOperatorMinHeight": 1300,
    "RadicalDegreeBottomRaisePercent": 60,
}
# All other constants of the table are 0: the panel has no roots, fractions or stacks.
LENGTHS = {
    "AxisHeight": 258,
    "SubscriptShiftDown": 210,
    "SubscriptTopMax": 368,
    "SuperscriptShiftUp": 360,
    "SuperscriptShiftUpCramped": 252,
    "SuperscriptBottomMin": 120,
    "SuperscriptBaselineDropMax": 230,
    "SubSuperscriptGapMin": 150,
    "SuperscriptBottomMaxWithSubscript": 380,
    "SpaceAfterScript": 40,
}


def math_table():
    """The MATH table."""
    constants = otTables.MathConstants()
    for converter in constants.getConverters():
        name = converter.name
        if name in NUMBERS:
            setattr(constants, name, NUMBERS[name])
            continue
        record = otTables.MathValueRecord()
        record.Value = LENGTHS.get(name, 0)
        setattr(constants, name, record)
    table = newTable("MATH")
    table.table = otTables.MATH()
    table.table.Version = 0x00010000
    table.table.MathConstants = constants
    table.table.MathGlyphInfo = table.table.MathVariants = None
    return table


def main() -> None:
    """Write the font."""
    builder = FontBuilder(1000, isTTF=True)
    # A browser counts a font as the first one if it has a space.
    glyphs = {".notdef": 500, "space": 318}
    builder.setupGlyphOrder(list(glyphs))
    builder.setupCharacterMap({0x20: "space"})
    builder.setupGlyf({name: TTGlyphPen(None).glyph() for name in glyphs})
    builder.setupHorizontalMetrics({name: (width, 0) for name, width in glyphs.items()})
    builder.setupHorizontalHeader(ascent=928, descent=-236)
    builder.setupOS2(sTypoAscender=928, sTypoDescender=-236, usWinAscent=928, usWinDescent=236, sxHeight=480)
    builder.setupNameTable({"familyName": "Kinboard Math", "styleName": "Regular"})
    builder.setupPost()
    builder.font["MATH"] = math_table()
    builder.font["head"].created = builder.font["head"].modified = 0
    builder.font.flavor = "woff"
    builder.font.save(Path(__file__).parents[1] / "static" / "math.woff")


if __name__ == "__main__":
    main()
