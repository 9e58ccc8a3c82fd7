"""Typeset mathematics: well-formed, escaped, and numbers that do not flicker."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

from app.viewer.views import mathml as m


def tree(*parts: m.MathML) -> ET.Element:
    return ET.fromstring(m.math(*parts))


def words(element: ET.Element) -> str:
    return "".join(element.itertext())


def test_everything_put_together_is_well_formed() -> None:
    x = m.ident("x")
    formula = tree(
        m.subsup(m.ident("T"), m.text("i"), m.text("0")),
        m.op("="),
        m.neg(m.brackets(x, m.op("-"), m.gap(), m.func("cos", m.ident("θ")))),
        m.mark(m.matrix([[x, m.short(1.5)], [m.sub(x, m.number(1, 0)), x]], marks={(0, 1): "#0072b233"}), "red"),
    )
    assert words(formula) == "Ti0=−(x−cosθ)x1.5x1x"
    assert [len(line) for line in formula.iter("mtr")] == [2, 2]
    assert [i for i, cell in enumerate(formula.iter("mtd")) if "#0072b233" in cell.attrib["style"]] == [1]


@pytest.mark.parametrize("leaf", [m.ident, m.text, m.op])
def test_text_is_escaped(leaf) -> None:
    hostile = "<script>'\"&"
    element = tree(leaf(hostile))
    assert words(element) == hostile
    assert element.find(".//script") is None


def test_attributes_are_escaped() -> None:
    assert ET.fromstring(m.math(m.mark(m.ident("x"), '"><b>'), alt='"<')).attrib["aria-label"] == '"<'


@pytest.mark.parametrize(
    ("value", "decimals", "shown"),
    [(-1.25, 1, "−1.2"), (-0.0004, 3, "0.000"), (0.0, 0, "0"), (-0.6, 0, "−1"), (12.34567, 4, "12.3457")],
)
def test_numbers_have_a_true_minus_and_no_negative_zero(value: float, decimals: int, shown: str) -> None:
    assert m.fixed(value, decimals) == shown
    assert words(tree(m.number(value, decimals))) == shown


@pytest.mark.parametrize(("value", "shown"), [(130.0, "130"), (-0.5, "−0.5"), (0.08916, "0.089"), (-1e-9, "0")])
def test_constants_lose_idle_zeros(value: float, shown: str) -> None:
    assert words(tree(m.short(value))) == shown


def test_the_columns_of_numbers_keep_their_width() -> None:
    def widths(value: float) -> set[str]:
        element = tree(m.matrix([[m.number(v, 4) for v in row] for row in ((value, 0.0), (0.0, 1.0))], width=3.5))
        return {cell.attrib["style"] for cell in element.iter("mtd")}

    assert widths(0.1) == widths(-0.9999)
    assert len(widths(0.1)) == 1
