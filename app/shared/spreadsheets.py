"""Texts of visitors in CSV files, which spreadsheets may take for formulas."""

from __future__ import annotations

import re

_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")
_SEPARATED = re.compile(r"([;\t]\s*)(?=[=+\-@＝＋－＠])")


def cell(text: str) -> str:
    """A text that no spreadsheet takes for a formula: an apostrophe is put before what begins like one.

    Where a comma separates decimals, spreadsheets separate cells at semicolons, so what follows one counts too.
    """
    text = _SEPARATED.sub(r"\1'", text)
    return f"'{text}" if text.lstrip(" ").startswith(_FORMULA) else text
