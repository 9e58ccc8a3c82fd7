"""Numbers in ASCII digits."""

from __future__ import annotations

import pytest

from kin.files.numbers import index_of


@pytest.mark.parametrize(("text", "index"), [("0", 0), ("4", 4), ("004", 4)])
def test_an_index_is_read(text, index):
    assert index_of(text, 5) == index


@pytest.mark.parametrize(
    "text", ["５", "٣", "²", "5", "-1", "+1", " 1", "1.0", "1_0", "", "9" * 5000, 1, None, b"1"]
)
def test_what_is_no_index_is_none(text):
    assert index_of(text, 5) is None
